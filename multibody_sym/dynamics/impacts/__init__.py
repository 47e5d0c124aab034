"""Impacts in numbers: which impulses act where things strike, and the jumps of speeds that they make.

    v+ = A x + D z - r,   x = C^T z     x = G (u+ - u-), z impulses, r = -v-: an impact is the mechanism at rest

    question                                            answered by
    what is asked, and what is told                     problem (records only)
    what happens                                        strike
    what became of the rows so far, which rows act      account
    in which order do several contacts strike           sequence, which lets those collapse that do not end
    several at once                                     together: the laws at an instant, for speeds
    one contact, through compression and restitution    one_contact: Routh's integration; restitution: where it ends
    at what rates; when slip turns in space             pace; in_space
    and what holds both ways?                           elimination: projected columns, apparent masses

In: an ImpactProblem, made of a mechanism's rows at its speeds. Out: Struck. Knows no mechanism, only numbers; imports
`laws` and `numerics`.
"""
