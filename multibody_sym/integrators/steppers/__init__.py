"""Steppers: how each family of methods takes a step of x' = f(t, x), in plain Python.

In: a Flow and a method's record. Out: trials, each with the state at the end of a step, its error estimate and what a
continuous extension needs, or the reason why the step failed. `table` has the stepper of each family: `explicit`,
`multistep`, and `collocation`, whose stages y are found from

    W E (y - y0) = h start f(t, y0) + h f(t + c h, y)

by simplified Newton iteration with exact Jacobians, factorised by `stages`. `library` yields the steps of other
libraries, and finds events within them itself.

Imports methods, looks and the flow; no mechanics. `templates/c` has the same steppers in C, those of `library` apart.
"""
