"""Methods of integration as data: coefficients that prove themselves.

In: nothing but numbers. Out: a record for every name in `methods`: explicit Runge-Kutta tableaus (`runge_kutta`,
`explicit_methods`, `dormand_prince_8`), collocation methods whose coefficients follow from their nodes in exact
arithmetic (`collocation`, over numbers a + b sqrt(d) of `surd`), methods of constant step that look back (`multistep`),
and the names under which other libraries' methods go (`library`). When a record of our own is made it checks its order;
an explicit Runge-Kutta method of order p by

    sum over stages b_i Phi_i(tree) = 1/gamma(tree)      for every rooted tree of at most p nodes (`order_conditions`)

Imports numpy, numerics and errors: no stepper, no flow, no mechanics.
"""
