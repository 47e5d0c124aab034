"""Which accelerations, from where does a motion begin, and what is conserved?

    M(q) udot = f(q, u, t) + H^T lambda        H udot = gamma        qdot = N(q) u

    formalisms      each route from a moving mechanism to its equations, over any scalar
    programs        the equations as Programs: named, shaped inputs and outputs
    constraints     whether rows hold, depend on each other, or contradict each other
    contact         the problems of contact laws and impacts that a mechanism poses
    start           parameters, and the state at which a motion begins
    theorems        balances of momentum and energy, and what is conserved

In: a Mechanism. Out: accelerations, Programs, a Start. Neither prints, compiles nor runs Programs.
"""
