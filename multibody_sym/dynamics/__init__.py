"""Dynamics: from a mechanism to its equations of motion, by several routes that give the same ones.

    M(q) udot = f(q, u, t) + H^T lambda        H udot = gamma        qdot = N(q) u

Each room stands on those below it:

    derive, routes   closed forms with their steps; the formalisms by name
    derivation       equations with sympy, as a person derives and reads them
    start            parameters, and the state at which a motion begins
    constraints      do rows hold, do they depend on each other, do they contradict each other
    impacts          what strikes: impulses and the jumps of speeds, in numbers, and the mechanism at rest that has them
    laws             what holds one way only: contacts, ropes, stops and friction at an instant, in numbers
    programs         the equations as Programs: named, shaped inputs and outputs
    formalisms       each route from a moving mechanism to its equations, over any scalar
    inertia          of bodies, alone and with what they carry

Makes Programs, and neither prints, compiles nor runs them.
"""
