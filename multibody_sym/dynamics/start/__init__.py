"""Start: where a motion begins.

In: a Mechanism, and values that take the place of declared ones. Out: a Start (`start`): the parameter vector,
evaluated in the order of what refers to what (`parameters`), and coordinates and speeds that satisfy

    phi(q, t0) = 0,  H(q, t0) u = -phi_t

(`assembly`: what is known is held, the rest found from its guesses, and told is what was changed), in absolute
coordinates too (`absolute_state`). What cannot be is refused by name: masses that no body has (`body_masses`), numbers
without a finite value (`examined`, which also resolves a System, and `undefined`, which says what has none), rows that
contradict each other or have no value.
`sampling` draws other states around a start, at which routes and theorems are compared.

Imports constraints and what lies below; moves nothing in time.
"""
