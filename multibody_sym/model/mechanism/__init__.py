"""What follows from a System: a Mechanism, frozen records that later layers read and never change.

    mechanism    bodies in tree order (parents first), coordinates, speeds, parameters, outputs
    markers      poses fixed on bodies
    mass         poses, mass, inertia
    loads        forces with their places found
    rows         scalar constraint equations, and which of them stand for joints that were cut
    limits       what must hold of elements that hold one way only, so that a mode lasts
    units        in which units all of that, and what expressions are worth, is told

Every expression is written in slots: `t[0]`, `q[i]`, `u[i]`, `parameters[i]`, `inputs[i]`; names stay in tables.
Imports declarations, nothing of how a Mechanism is found.
"""
