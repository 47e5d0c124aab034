"""Problems of laws and of impacts, posed by a mechanism at an instant.

    contact_problem         the problem of contact laws in numbers; modes from its states; shares of forces that are
                            not unique
    impact_problem          the same of an impact, with restitution; the mechanism at rest that has its impulses
    impact_programs         the Program of an impact, for functions and exports
"""
