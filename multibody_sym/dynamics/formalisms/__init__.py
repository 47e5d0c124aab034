"""Formalisms: each way from a moving mechanism to its equations, one a file, over any scalar.

In: a Motion (poses, velocities and partial velocities of all bodies) with its loads. Out: either

    M(q) udot = f(q, u, t) + H^T lambda,  H udot = gamma

formed (`equations`: composite body, Newton-Euler, d'Alembert), or M^-1 applied without forming M (`recursion`: the
sweep and block L^T D L along the tree, in linear time). `massless` goes round what has no inertia, `inverse_dynamics`
asks for the forces of given accelerations, and `forward_dynamics` solves for accelerations and multipliers in floats.

The routes share kinematics and inertia, and nothing of each other's algebra: they are held against each other.
Imports inertia and what lies below; no Programs, no starts.
"""
