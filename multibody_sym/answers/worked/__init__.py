"""Worked steps: balances of bodies, elimination, states that contradict themselves.

    worked          the steps of a solved instant in order
    actions         what acts on each body that is cut free: weight, forces, unknown reactions
    equations       all equations, numbered, and eliminated by hand
    alternatives    "Other assumption": directions and sticking that lead to contradictions
"""
