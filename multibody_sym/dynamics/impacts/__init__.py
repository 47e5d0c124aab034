"""Impacts in numbers: which impulses act where things strike, and the jumps of speeds that they make.

    v+ = A x + D z - r,   x = C^T z     x = G (u+ - u-), z impulses, r = -v-: an impact is the mechanism at rest

question                                            answered by
what is asked, and what is told                     problem (records only)
what happens                                        strike
which rows take part, and what became of them       account
several contacts at once                            together (the laws at an instant, for speeds)

In: an ImpactProblem, made of a mechanism's rows at its speeds. Out: Struck. Knows no mechanism, only numbers; imports
`laws` and `numerics`.
"""
