"""Steppers: how each family of methods takes a step of x' = f(t, x), in plain Python.

In: a Flow (rates, Jacobians, how coordinates follow speeds) and a method's record. Out: trials: the state at the end
of a step, its error estimate and what dense output needs, or why the step failed. `table` has the stepper of each
family, `stages` the equations that implicit stages solve,

    Z = h (A x I) F(x + Z),

by simplified Newton iteration with exact Jacobians. `templates/c` has the same steppers in C, bit for bit.

Imports methods and the flow; knows neither events nor mechanics.
"""
