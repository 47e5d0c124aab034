"""Constraints in floats: do they hold, do they depend on each other, do they contradict?

    question                                          answered by
    do rows hold at q; what closes them               closing (damped Newton on phi = 0, least change of q)
    what are rows worth at a state, can they be told  row_values
    which rows say twice what is so anyway            redundancy (rank of H, forces nobody can tell)
    which rows cannot hold together                   contradiction (the fewest elements that have no position)
    is this position singular, where others are not   singular (rank here against rank nearby)

In: a Mechanism with values of its parameters and a position. Out: positions, ranks and names of elements. H is scaled
by the joint-space inertia, so verdicts do not depend on units. Imports formalisms and programs; starts and
derivations import it.
"""
