"""Inertia of bodies, alone and with what hangs on them.

In: masses, centres of mass and inertia tensors over any scalar. Out: the wrench M w that the acceleration w of a body
takes: of a rigid body, or several that move as one, from ten numbers about its origin (`rigid`); of an articulated
body, whose joints are left free, from a symmetric 6 x 6 matrix (`articulated`), of which one freedom eliminated leaves

    Ma = M - U U^T / d,  U = M a,  d = a^T U,  with a the motion that a unit speed of it makes.

`base_parameters` hands over to the parent what a joint cannot feel of its body's inertia, so that fewer numbers
enter the equations.

Imports kinematics, model and scalars; knows no formalism.
"""
