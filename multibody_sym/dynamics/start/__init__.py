"""The state at which a motion begins: values that take the place of declared ones, and what follows of them.

    start                coordinates and speeds with phi(q, t0) = 0, H(q, t0) u = -phi_t: values marked `known`
                         are held, the others found from guesses; "does not close"; random states beside them
    parameters           values of parameters in the order of their references; undefined values
    state                which contacts touch, stick or slide: asked of contact_laws/search; or the words of a call
    declared_impact      the state behind an impact at the start
    initial_geometry     refused parameters as friction coefficients and restitutions; gaps, sides and lengths of ropes
    number_checks        values that are not finite, impossible masses and inertias, by their paths
    time_functions       jumps and poles of prescribed motions and laws of masses
"""
