"""What is a number here, and what is a matrix's rank?

    node, elementary          the Node; its functions, folded where exact; pickles of Nodes
    functions, vectors        functions and vectors over float, Node and sympy alike
    calculus, sign_changes    exact derivatives; where functions bend, jump and change sign
    tabulated                 functions given by rows
    limits                    what contacts and friction allow
    sympy_bridge              the door to sympy
    floats                    arithmetic as C performs it, values between the rows of tables; without NumPy
    arrays, numbers           arrays of floats and their rounding; numbers that a caller hands over
    rank, pivoted_qr          which rows are independent, also beside rounding: one rule, every tolerance
    elimination               rows with few entries
    least_norm                x of least norm with A x = r, to the same bits as in C
    linear_inequalities       whether E x = r, G x >= 0 can hold together, and where they stop

In: numbers and expressions. Out: the same. Imports errors alone: no text, no units, no mechanics.
"""

from multibody_sym.scalars import elementary

elementary.register()
