"""Modes whose equations leave one combination of forces open: whether it has values at which their laws may hold."""

from __future__ import annotations

import numpy as np

from multibody_sym.dynamics.laws.problem import STICKS
from multibody_sym.dynamics.laws.scaled import Flags, Places, Scaled, beyond
from multibody_sym.numerics.arrays import Floats


def may_hold(
    problem: Scaled,
    mu: Floats,
    mode: tuple[Places, Places],
    here: tuple[Floats, Floats],
    way: tuple[Floats, Floats],
    loose: float,
) -> Flags:
    """Return (b) whether all inequalities on lines hold for some t, to a part `loose` of what is largest.

    `mode`: sides (b, m) and slips (b, p) of modes; `here`: z (b, m) and a (b, m), which change by t times the `way`.
    Only with friction on lines; of what sticks between two sides nothing is asked.
    """
    present, slope = (_limits(problem, mu, mode, *values) for values in (here, way))
    gap = float(np.abs(problem.r).max(initial=0.0))
    z, dz = (_largest(values[0]) for values in (here, way))
    a, da = _largest(here[1]) + gap, _largest(way[1])
    own = np.where(present[1], z[:, None], (a + z)[:, None]), np.where(present[1], dz[:, None], (da + dz)[:, None])
    allowed, grows = present[0] + loose * own[0], loose * own[1]
    forward = _from_zero(allowed, slope[0] + grows)
    return np.asarray(forward | _from_zero(allowed, -slope[0] + grows))


def _largest(values: Floats) -> Floats:
    return np.asarray(np.abs(values).max(axis=1, initial=0.0))


def _from_zero(present: Floats, slope: Floats) -> Flags:
    """Return (b) whether present + slope t >= 0 (b, i) for some t >= 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = -present / slope
    low = np.where((slope > 0.0) & (present < 0.0), ends, 0.0).max(axis=1, initial=0.0)
    high = np.where(slope < 0.0, ends, np.inf).min(axis=1, initial=np.inf)
    never = ((slope == 0.0) & (present < 0.0)).any(axis=1)
    return np.asarray((low <= high) & ~never)


def _limits(
    problem: Scaled, mu: Floats, mode: tuple[Places, Places], z: Floats, a: Floats
) -> tuple[Floats, Flags]:
    """Return what must not be negative (b, i), zero where nothing is asked, and which (i) are forces."""
    sides, slips = mode
    pressed = problem.pressed_parts(sides)
    found, forces = list[Floats](), list[bool]()

    def ask(values: Floats, where: Flags, *, force: bool) -> None:
        found.append(np.where(where, values, 0.0))
        forces.append(force)

    for row in problem.unilateral:
        ask(z[:, row], sides[:, row] > 0, force=True)
        ask(a[:, row], sides[:, row] <= 0, force=False)
    for part in problem.parts:
        if not mu[part.number]:
            continue
        slip, row, both = slips[:, part.number], int(part.rows[0]), problem.two_sided[part.normals]
        for k in part.normals[both]:
            ask(sides[:, k] * z[:, k], slip != STICKS, force=True)
        if not part.rests:
            continue
        ask(slip * a[:, row], slip != STICKS, force=False)
        sticks = (slip == STICKS) & pressed[:, part.number]
        if not (part.held or both.any()):
            for sense in (1.0, -1.0):
                over = beyond(sense * z[:, row], part.loads(z).sum(axis=1), mu[part.number])
                ask(-over, sticks, force=True)
    shape = (len(z), len(found))
    return np.array(found).T.reshape(shape), np.array(forces, dtype=bool)
