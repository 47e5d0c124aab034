"""What is a number here, and what is a matrix's rank?

    node, elementary, functions, vectors     the Node, and functions over float, Node and sympy alike
    calculus, sign_changes                   exact derivatives; where functions bend, jump and change sign
    tabulated, between, limits               functions given by rows; what contacts and friction allow
    sympy_bridge, pickling                   doors to sympy and to other processes
    arrays, numbers, sparse_rows             arrays of floats; what a caller hands over; rows with few entries
    rank, elimination, pivoted_qr            which rows are independent, also beside rounding
    least_norm                               x of least norm with A x = r, to the same bits as in C
    linear_inequalities                      whether E x = r, G x >= 0 can hold together, and where they stop

In: numbers and expressions. Out: the same. Imports errors alone: no text, no units, no mechanics.
"""

from multibody_sym.scalars import pickling

pickling.register()
