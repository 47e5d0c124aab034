"""Constraints in floats: do they hold, do they depend on each other, do they contradict each other?

    question                                          answered by
    do rows hold at q; what closes them               closing (Newton on phi = 0, the change of q as small as can be)
    has every row and force a value; why has it none  row_values
    which rows say what others say anyway             redundancy (rank of H, and the forces that nobody can tell then)
    which rows cannot hold together                   contradiction (the fewest found, and what they leave no room for)
    is this position singular                         singular (rank here against rank nearby)

In: a Mechanism with values of its parameters, a position or state. Out: positions, ranks and names of elements.
Rank is that of H G^-1 with M = G^T G, as where accelerations are solved for, so that units do not matter.

Imports formalisms, the reactions of programs and what lies below; the start is built on it.
"""
