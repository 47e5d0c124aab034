"""The state at which a motion begins: values that take the place of declared ones, and what follows of them.

`start` evaluates parameters in the order of what refers to what (`parameters`), and finds coordinates and speeds with

    phi(q, t0) = 0,  H(q, t0) u = -phi_t

(`assembly`: what is known is held, the rest found from its guesses, and what was changed is told). `state` is that of
what holds one way only, `declared_impact` that behind an impact. What cannot be is refused by name (`number_checks`).
"""
