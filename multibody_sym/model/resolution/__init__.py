"""How a Mechanism follows from a System: names looked up, joints sorted into a tree, the others cut.

    resolve                     the order of it all
    spanning_tree, bodies       which joints carry bodies, and the bodies in that order
    cuts, rows, plane           the other joints and the constraints as rows; fewer where motion is planar
    loads                       forces with their places found
    changes, driving_inputs     a system as a call asks for it; inputs in the place of motions that they drive
    references, vocabulary      what names mean, and which expressions may use which
    absolute, measured          the same in coordinates of each body; joints' coordinates measured there
    gear_teeth, force_places, surface_tangents      where forces of gears and couplings act; directions of rolling

In: a System. Out: a Mechanism, or a ModelError with its place. No numbers are needed.
Imports declaration and mechanism.
"""
