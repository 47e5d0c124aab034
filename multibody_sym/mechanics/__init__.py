"""What moves and what acts, at an instant?

    mechanism, load_records, row_records, law_elements, impact_records     a Mechanism: records alone
    resolve, references, vocabulary, spanning_tree, absolute, declared_rows, changes, questions     how it follows
    modes, units                           a mechanism in a mode, with words for it; units of all results
    state, motion, points, energy, variable_mass, alignment     poses, velocities and accelerations over any scalar
    row_kinematics                         phi, phidot, H^T lambda and gamma of rows
    contacts, contact_solids, contact_geometry, ropes, gears, joint_friction, forces, impacts     one kind each
    model_files                            files read, with the place of every mistake, and written back

In: a System. Out: a Mechanism, and what is true of it at a state, in expressions or numbers. Solves nothing.
"""
