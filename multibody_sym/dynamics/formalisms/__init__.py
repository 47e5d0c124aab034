"""Each route from a moving mechanism to its equations, over any scalar.

    equations                       f, H and gamma of M udot = f + H^T lambda, H udot = gamma; massless bodies
    composite_body                  M formed: by composite bodies, virtual work, or every body cut free
    articulated_body                M^-1 applied without forming M, in time linear in the number of bodies
    constrained                     accelerations and multipliers; least corrections of coordinates and speeds
    inertia                         inertias of rigid and articulated bodies; base inertial parameters

In: a Mechanism at a State. Out: TreeDynamics. Routes share kinematics and inertia, not the way to M or its inverse, so
that they can be held against each other.
"""
