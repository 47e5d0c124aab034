"""Motions of rigid bodies in closed form, by Jacobi's elliptic functions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ellipj, ellipk

Floats = NDArray[np.float64]


def free_rotation(A: float, B: float, C: float, spin: float, wobble: float, t: Floats) -> Floats:
    """Return the angular velocity (3, m) of a free body with A < B < C that starts with (0, spin, wobble).

    The wobble is such that B < L^2 / (2 T). Source: L. D. Landau, E. M. Lifshitz, Mechanics, section 37, started where
    the first component vanishes.
    """
    energy, square = B * spin**2 + C * wobble**2, (B * spin) ** 2 + (C * wobble) ** 2  # 2 T, L^2
    rate = np.sqrt((C - B) * (square - energy * A) / (A * B * C))
    m = (B - A) * (energy * C - square) / ((C - B) * (square - energy * A))
    sn, cn, dn, _ = ellipj(ellipk(m) + rate * t, m)
    return np.array(
        [
            np.sqrt((energy * C - square) / (A * (C - A))) * cn,
            np.sqrt((energy * C - square) / (B * (C - B))) * sn,
            np.sqrt((square - energy * A) / (C * (C - A))) * dn,
        ]
    )


def nutation(A: float, weight: float, spin: float, tilt: float, t: Floats) -> Floats:
    """Return cos(theta) (m,) of a heavy symmetric top let go at `tilt`, turning about its axis only.

    z = cos(theta) obeys z'^2 = (alpha - beta z) (1 - z^2) - (b - a z)^2, with roots z1 < z2 < 1 < z3 on its right side;
    z = z1 + (z2 - z1) sn^2. Arguments: A, the moment of inertia across the axis about the tip; `weight`, m g h; `spin`,
    the angular momentum about the axis, C w3. Source: any text on mechanics.
    """
    upper = np.cos(tilt)
    beta, a = 2 * weight / A, spin / A
    alpha, b = beta * upper, a * upper
    roots = np.roots([beta, -(alpha + a**2), 2 * a * b - beta, alpha - b**2])
    z1, z2, z3 = np.sort(roots.real)
    m = (z2 - z1) / (z3 - z1)
    sn, *_ = ellipj(ellipk(m) + np.sqrt(beta * (z3 - z1)) / 2 * t, m)
    return z1 + (z2 - z1) * sn**2


FREE_BODY = """
multibody_sym: 1
name: free_body
parameters: {A: 1, B: 2, C: 3, spin: 1, wobble: 0.7}
bodies: {body: {mass: 1, inertia: {Ixx: A, Iyy: B, Izz: C}}}
joints: {ball: {type: spherical, parent: ground, child: body, initial: {u: [0, spin, wobble]}}}
"""
HEAVY_TOP = """
multibody_sym: 1
name: heavy_top
gravity: [0, 0, -g]
parameters: {g: 9.81, m: 0.3, h: 0.04, A: 3e-4, C: 2e-4, tilt: 60 deg, spin: 100}
bodies: {top: {mass: m, com: [0, 0, h], inertia: {Ixx: A, Iyy: A, Izz: C}}}
joints:
  tip: {type: spherical, parent: ground, child: top, initial: {q: [cos(tilt/2), sin(tilt/2), 0, 0], u: [0, 0, spin]}}
outputs: {z: "position(top, z)/h"}
"""
