"""How is a formula kept exact, and written as in a book?

    quotients, quotient_functions          quotients of polynomials in letters, sines, cosines, roots; systems of them
    inequalities, roots, antiderivatives   where one vanishes; integrals
    book_form, sums, long_sums, trigonometry, simplify, writers     the forms of books, as text and LaTeX

In: Nodes or sympy expressions of any origin. Out: what books print. Identities are decided exactly, never by numbers
that agree. Knows no mechanics.
"""
