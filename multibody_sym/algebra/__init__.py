"""Algebra: formulas that people read, and the exact arithmetic behind them.

In: Nodes or sympy expressions, of any origin. Out: what books print. There are two ways to it. Where equations are
solved, Nodes become quotients of polynomials in parameters, sines, cosines and roots, exact and in lowest terms
(`quotients`, `quotient_functions`), systems of these are eliminated (`exact_solve`), and the result is factored and
spelt as Nodes again (`factors`, `decimal_sums`, `book_form`); `solving` finds the values of a symbol at which one
vanishes. Where equations are derived, sympy's expressions share named parts that are differentiated once
(`subexpressions`), are shortened as a person would (`readable`, on sums of products: `terms`, `signs`, `grouping`) and
written as text or LaTeX (`script`), within a `budget` of time and size.

Identities are decided in exact arithmetic, never by numbers that agree; a sample of the parameters chooses signs of
roots, and pivots. Imports scalars, expressions and errors; nothing here knows of a body.
"""
