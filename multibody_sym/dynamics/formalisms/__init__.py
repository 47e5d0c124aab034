"""Each route from a moving mechanism to its equations, one a file, over any scalar.

In: a Mechanism at a State. Out: TreeDynamics (`equations`): f, H and gamma of M udot = f + H^T lambda, H udot = gamma,
with M formed (`composite_body`, `newton_euler`), or M^-1 applied without forming M, in time linear in the number of
bodies (`articulated_body`). `solve_constrained` solves for accelerations and multipliers. Routes share kinematics and
inertia, not the way to M or its inverse, so that they can be held against each other.
"""
