"""Integrators: methods as data that check themselves, and the stepping loop in plain Python for any x' = f(t, x).

    loop, events, singular   the loop with its step control; steps that end where something switches; singular positions
    steppers                 how each family of methods takes a step
    looks, flow              signs within a step made certain; what loop and steppers share: the flow, trials, steps
    stage_equations, pairing what implicit stages solve; how coordinates follow speeds, where a ball turns too
    methods                  coefficients of every method

In: a Flow (rates, Jacobians, constraints to return to, switching functions, a method and its tolerances). Out: steps,
each with its continuous extension. `templates/c` has the same algorithms in C, with the same operations in the same
order.

Imports numerics and errors: knows neither Programs nor mechanics.
"""
