"""Formalisms: each way from a moving mechanism to its equations, one a file, over any scalar.

In: a Mechanism at a State. Out: TreeDynamics (`equations`): the f, H and gamma of

    M(q) udot = f(q, u, t) + H^T lambda,  H udot = gamma

with M formed (`composite_body`, `newton_euler`, `dalembert`), or M^-1 applied without forming M, in time linear in the
number of bodies (`block_ldl`, along `body_axes` where bodies are free, and `sweep`; both on `recursion`).
`inverse_dynamics` finds the forces that given accelerations need, and the wrenches of inertia that all routes share;
`massless` goes round what has no inertia; `forward_dynamics` solves for accelerations and multipliers in floats, by the
law of each row.

Routes are held against each other: they share kinematics and inertia, not the way to M or its inverse. Imports inertia
and what lies below; no Programs, no starts.
"""
