"""Start: where a motion begins.

In: a Mechanism, and values that take the place of declared ones. Out: a Start: the parameter vector, evaluated in the
order of what refers to what (`parameters`), coordinates and speeds that satisfy

    phi(q, t0) = 0,  H(q, t0) u = -phi_t

(`assembly`: known values are held, others found on the side of their guesses, with what was changed told by name),
and the same in absolute coordinates (`absolute_state`). `sampling` draws other states that satisfy the rows, for
checks.

A start that cannot be is refused by the names of the rows that miss. Imports constraints; runs nothing.
"""
