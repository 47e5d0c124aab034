"""Which accelerations, from where does a motion begin, and what is conserved?

    M(q) udot = f(q, u, t) + H^T lambda        H udot = gamma        qdot = N(q) u

    formalisms    each route from a moving mechanism to its equations, over any scalar
    programs      the equations as Programs; switching functions (`reactions`), quantities of outputs
    closing       coordinates displaced until constraints hold
    redundancy    redundant and contradictory constraints, forces that are not unique
    left_over     the record of redundant rows, which results keep
    contact       the problems of contact laws and impacts that a mechanism poses
    start         parameters, and the state at which a motion begins
    balance       balances of power, momentum and angular momentum as checks
    conserved     conserved quantities, and the symmetry behind each

In: a Mechanism. Out: accelerations, Programs, a Start. Neither prints, compiles nor runs Programs.
"""
