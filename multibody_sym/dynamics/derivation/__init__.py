"""Derivation: equations with sympy, as a person derives and reads them.

In: a Mechanism. Out: SymbolicEquations with their Derivation, a tuple of steps (title, equations as data, note).
`lagrange` and `multipliers` form

    d/dt dT/du - dT/dq + dV/dq = Q + H^T lambda

from energies over sympy, each shared part named once and differentiated once; `free_bodies` writes every body cut
free with its reactions. `symbols` maps Nodes to sympy's symbols, `notation` gives what books print for them, `record`
holds the steps. Numbers never enter: parameters stay symbols until Programs are made.

Imports algebra, formalisms and the start's values; prints nothing.
"""
