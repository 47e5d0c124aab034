"""Derivation: equations with sympy, as a person derives and reads them.

In: a Mechanism. Out: `symbolic_equations`, and the Derivation (`record`): steps with a title, equations as data and a
note, which `steps` words as a student writes them. `lagrange` and `multipliers` form

    N^T (d/dt dT/dqdot - dT/dq + dV/dq) = Q + H^T lambda

from the energies of the kinematics over sympy, each shared part named once and differentiated once; `free_bodies` cuts
every body free, with its joint's reactions unknown. `symbols` gives sympy's symbols to a mechanism's slots, `notation`
the letters and the order in which books print them. The first two are formalisms too: their result is lowered to Nodes.

Imports algebra, the form of equations from formalisms, the values of parameters from start; prints nothing.
"""
