"""What is true of a system at large?

    linearize             `linearize`: A, B, eigenvalues and their order; multipliers of a period; `bode`
    deviations            first-order deviations of a motion; whether A is constant along it
    modes                 `modes`: frequencies and shapes of small motions; periods of large ones
    phase_plane           one freedom: fixed points, separatrix, curves of constant energy
    equilibrium           `equilibrium`: positions of rest, their stability, whether they are all; `trim`
    equilibrium_search, positions    the search for them; whether two positions are one
    rest                  ranges of a parameter in which friction holds a system at rest
    robots                `inverse_kinematics`: coordinates that bring a frame to a place; `base_parameters`: the
                          combinations of masses and inertias that forces depend on
    check                 `check`: degrees of freedom, redundant constraints, conserved quantities; agreement of
                          formalisms, d'Alembert's principle, theorems along a short run
    hints                 hints on declarations that their author may not have meant
    state_asked_about     `at: start`, `equilibrium` or values: the state that a question is about; whether A has two
                          values there: kinks, contacts about to slip or to open

In: a System. Out: records of numbers and formulas. Does not know what was asked (`answers`).
"""
