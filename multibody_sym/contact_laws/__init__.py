"""Which states fulfil the laws of contacts and friction, as numbers: accelerations, or impulses?

    a = A x + D z - r,   x = C^T z,   and for each row a law: a = 0;  0 <= a, 0 <= z, a z = 0;  Coulomb's friction

    problem                what is asked, and what is found
    search, enumeration    which modes fulfil all laws: none, one or several; all modes, where they are few;
                           proposals by Lemke's method
    solve_mode             what a mode leads to (by QR, never by W = H M^-1 H^T), and whether it fulfils the laws
    uniqueness             which forces, and which motion, are unique; which of two modes follows at a limit
    impact_problem         the same for speeds: v+ = A x + D z - r, x = G (u+ - u-), z impulses, r = -v-
    impact_sequence        in which order several contacts strike, or together: Newton's and Poisson's law;
                           impulses of many contacts by sweeps (projected Gauss-Seidel)
    routh_method           one contact alone, as a ball on the floor: through compression and restitution, in the plane
                           and in space, by Newton's, Poisson's or Stronge's law

In: a LawProblem or an ImpactProblem. Out: every state that is possible. Imports scalars: there is no mechanism here.
"""
