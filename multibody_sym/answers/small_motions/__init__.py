"""Small motions about an equilibrium or a steady motion, in symbols: M, C, K, frequencies, shapes, stability.

`place` finds the state and `formulas_of_place` its formulas; `matrices` linearises the equations there over exact
quotients and reduces them to independent deviations, `steady` by the momenta of cyclic coordinates (Routh); `spectrum`
solves the characteristic polynomial as far as it factors; `modes` joins them with the numbers of `linearize`.
"""
