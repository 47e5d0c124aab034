"""Numerics: linear algebra in floats that knows nothing of bodies.

In: arrays of floats. Out: of A x = r the x of least norm, with the rank of A and its independent rows, by

    A^T P = Q R,   the longest of what is left of the rows first, where they are not independent beyond doubt

(`least_norm`); which combinations y^T A = 0 of rows vanish, and whether b contradicts them (`dependence`); whether
equations and inequalities E x = r, G x >= 0 can hold together, at which values of a parameter, and which few of them
contradict each other beyond (`feasibility`, `feasible_sets`); eigenvalues without what rounding alone makes of them
(`rounding`). `arrays` has the type of all arrays, the spacing of doubles and what undefined arithmetic raises,
`numbers` reads what a caller hands over as numbers.

Imports numpy, scipy's linear algebra and linear programming, and errors: neither scalars nor mechanics.
"""
