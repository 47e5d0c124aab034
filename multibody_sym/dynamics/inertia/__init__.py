"""Inertia of bodies, alone and with what hangs on them.

In: masses, centres of mass and inertia tensors over any scalar. Out: the wrench M w that a rigid body's acceleration
takes, the same of bodies that move as one (`rigid`), of an articulated body with its joints left free,

    Ma = M - U V^-1 U^T,  U = M A,  V = A^T U,

(`articulated`), and the few sums of parameters on which a tree's motion depends at all (`base_parameters`).

Only structure that is not zero is multiplied. Imports kinematics and scalars; knows no formalism.
"""
