"""Numerics: linear algebra in floats that knows nothing of bodies.

In: arrays of floats. Out: solutions of smallest norm with the rank found, which rows depend on which others, and the
rounding that such verdicts allow. A system A x = b is factorised as A P = Q R with columns in order of what is left
of them, and rows count as dependent by one rule of rounding.

`arrays` has the types and constants of floating point that every part shares, `least_norm` the solve, `dependence`
the combinations of rows that vanish.

Imports nothing but numpy: neither scalars nor mechanics.
"""
