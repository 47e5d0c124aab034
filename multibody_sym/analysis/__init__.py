"""Analysis: questions about a mechanism that are answered without moving it in time.

In: a Mechanism or System with its start. Out: records of numbers. `linearization` gives x' = A x + B v about a start,
`equilibrium` the positions where Q + H^T lambda = 0 and whether they are stable, `theorems` the balances of momentum
and energy, `reference` the equations once more from d'Alembert's principle body by body,

    sum over bodies of (J_C^T (F - m a_C) + J_w^T (M - dL/dt)) = 0,

and `agreement` how far any route misses them, in units of rounding. `limits` tells which limits of joints a motion
passes.

Imports dynamics and what lies below; neither runs nor reports.
"""
