"""What is true of a system at large?

    linearize, deviations                 how small deviations go on: x' = A x + B w
    modes                                 their modes, in numbers and formulas
    equilibrium, equilibrium_search       where it can rest, and whether that are all places
    rest                                  at which values of a parameter friction holds it
    state_asked_about, independent_checks, check, hints     at which state; do all routes agree; what was perhaps meant

In: a System. Out: records of numbers and formulas. Does not know what was asked (`answers`).
"""
