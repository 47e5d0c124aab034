"""Worked steps: balances of bodies, elimination, states that contradict themselves.

    worked          the steps of a solved instant, and the equations of motion, where questions use them
    bodies          bodies cut free as lines; how their equations are eliminated; two- and three-force members
    alternatives    "Other assumption": directions and sticking that lead to contradictions
    actions         what acts on each body that is cut free: weight, forces, unknown reactions
    equations       all equations, numbered, and eliminated by hand
    rest            ends of a range of rest: bodies in balance, limits that are reached, the parameter there
    questions       answers to `ask`, each by its law
"""
