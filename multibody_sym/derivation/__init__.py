"""Which formulas say the same, and which steps lead there?

    derive, routes, prepare                closed forms with their steps; the formalisms by name
    lagrange, legendre, canonical, free_bodies     each route, as a person derives and reads it
    symbolic_equations, notation, force_letters, steps, theorems     how it is written
    symbolic_start                         the state at the start in the names of the model

In: a System. Out: equations of sympy. Knows neither motion nor pictures.
"""
