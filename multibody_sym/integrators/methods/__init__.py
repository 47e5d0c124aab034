"""Methods of integration as data: coefficients that prove themselves.

In: nothing but numbers. Out: records by name (`methods`): explicit Runge-Kutta tableaus, collocation methods (Gauss,
Radau, Lobatto's trapezoid) whose coefficients follow from their nodes in exact arithmetic (`surd`), methods of
constant step that look back, and the names under which other libraries' methods go. Each record checks its own order
conditions

    sum over stages b_i Phi_i(tree) = 1/gamma(tree)

for every rooted tree when it is made (`order_conditions`).

Imports numpy only: no stepper, no flow, no mechanics.
"""
