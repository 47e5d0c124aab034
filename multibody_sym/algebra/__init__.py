"""How is a formula kept exact, and written as in a book?

    quotients                 quotients of polynomials in letters, sines, cosines and roots, with a sample; work budgets
    quotient_functions        signs, roots, sines and cosines of quotients; exact values of Nodes; systems of equations
    inequalities              conditions of validity: comparisons, reduced to few and short ones
    roots                     zeros in closed form; shorter roots, angles and absolute values in finished formulas
    antiderivatives           integrals in closed form
    book_form                 the shortest form of a quotient; order and grouping of terms
    simplify, trigonometry    terms merged, angles added; sin^2 + cos^2, tangents, multiples of angles
    writers                   sympy expressions as text and LaTeX, factors and terms in a given order

In: Nodes or sympy expressions of any origin. Out: what books print. Identities are decided exactly, never by numbers
that agree. Knows no mechanics.
"""
