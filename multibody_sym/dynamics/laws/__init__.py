"""What holds one way only, at an instant: which contacts, ropes, stops and guides act, and what slides, in numbers.

    a = A x + D z - r,   x = C^T z,   and for each row a law: a = 0;  0 <= a, 0 <= z, a z = 0;  Coulomb's friction

    question                                           answered by
    what is asked, and what is found                   problem (records only)
    which modes fulfil all laws; none, one, several    search, with the modes that `states` finds at given coefficients
    which modes may                                    proposals (Lemke's method), enumeration (all of them)
    what does a mode lead to; does it fulfil them      mode_solve (by QR, never by W = H M^-1 H^T), judgement
    which of its forces, and is its motion, unique     uniqueness
    two modes fit at the limit: which one follows      ties (their rates)

In: a LawProblem, made of a mechanism's rows at a state, of its speeds or of impulses. Out: Found, with a LawState for
each motion that is possible. Knows no mechanism, only numbers; imports `numerics` alone.
"""
