"""Algebra: formulas that people read, and the exact arithmetic behind them.

In: sympy expressions, or Nodes, of any origin. Out: the same values as books write them: quotients of polynomials
over the field that a formula needs (`quotients`, `quotient_functions`), linear systems solved without a division that
could vanish (`exact_solve`), common factors drawn out (`factors`, `book_form`), shared parts named once
(`subexpressions`), symbols set as text, LaTeX or code (`script`, `readable`), all within a `budget` of time and size.

A formula counts as simplified only if it equals what it came from: identities are decided in exact arithmetic.

Knows no mechanics: imports scalars, expressions and errors, and nothing that knows of a body.
"""
