"""Masses that vary (Meshchersky): how fast they change, and what leaves or joins exerts on the body.

In: a Motion. Out: wrenches on bodies, rates of momentum and energy. The body that is left at an instant moves as a
rigid body of the instantaneous mass, centre of mass and inertia (solidification) under its forces and these wrenches.
"""
