"""What moves and what acts, at an instant?

    mechanism                  a Mechanism: tables of bodies, coordinates, parameters and names
    load_records               its loads
    row_records                its rows: constraints, surfaces in contact
    law_elements               its contacts, slack ropes, stops and friction; limits of each in a mode
    model_files                files read, with the place of every mistake, and written back
    changes                    parameters, start values and inputs that a call overrides; the system of each stage
    resolve                    a Mechanism from a System
    references, vocabulary     names of bodies, points and joints; names and quantities in expressions
    spanning_tree, absolute    joints that carry bodies and joints that are cut; absolute coordinates
    declared_rows              rows of constraints and cut joints; stops of joints
    modes, units               a mechanism in a mode, and the words of its states; units of results
    motion, points             slots, poses, velocities and accelerations; points and directions
    row_kinematics             phi, phidot, H^T lambda and gamma of rows
    contacts                   contacts with their rows; rolling; corners, faces, rims, ends
    contact_geometry           gap, normal and place of two surfaces
    ropes, gears               free lengths, wheels and tensions of ropes; teeth of wheels, withheld reactions
    joint_friction             friction in joints
    forces, energy             loads exerted, varying masses; kinetic and potential energy, what changes it
    impacts                    `impact:` sections
    alignment                  axes of bodies in which motion takes few operations

In: a System. Out: a Mechanism, and what is true of it at a state, in expressions or numbers. Solves nothing.
"""
