"""Which formulas say the same, and which steps lead there?

    derive, routes        `derive`; the formalisms by name
    prepare               what every derivation begins with, and its steps
    lagrange              Lagrange's equations of the first and second kind
    canonical             Hamilton's and Routh's
    free_bodies           Newton's and Euler's for bodies cut free
    theorems              momentum, angular momentum and energy in symbols
    notation              sympy symbols, their text and LaTeX, formulas in notebooks (`_repr_latex_`)
    symbolic_equations    the records of equations, evaluated with NumPy; Hamilton-Jacobi
    symbolic_start        the state at the start in the names of the model; closed forms there

In: a System. Out: equations of sympy. Knows neither motion nor pictures.
"""
