"""Modes whose equations leave one combination of forces open: whether it has values at which their laws may hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from multibody_sym.dynamics.laws.scaled import Flags, Modes, Scaled, beyond, limits_of, over_parts
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.limits import OF_FORCES


def may_hold(
    problem: Scaled,
    mu: Floats,
    modes: Modes,
    here: tuple[Floats, Floats],
    way: tuple[Floats, Floats],
    loose: float,
) -> Flags:
    """Return (b) whether all inequalities on lines hold for some t, to a part `loose` of what is largest.

    `here`: z (b, m) and a (b, m) of modes, which change by t times the `way`. Only with friction on lines; of what
    sticks between two sides nothing is asked.
    """
    present, slope = (_limits(problem, mu, modes, *values) for values in (here, way))
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


def _limits(problem: Scaled, mu: Floats, modes: Modes, z: Floats, a: Floats) -> tuple[Floats, Flags]:
    """Return what must not be negative (b, i), zero where nothing is asked, and which (i) are forces."""
    table, (force, gap, cone, slip, side) = problem.table, limits_of(problem, modes, mu, z, a)
    N, rubs = over_parts(np.add, problem.loads(z), table.starts), z[:, table.rows[table.first]]
    one_sided = ~over_parts(np.logical_or, problem.two_sided[table.normals], table.starts)
    cones = [replace(cone, values=-beyond(x, N, mu), asked=cone.asked & one_sided) for x in (rubs, -rubs)]
    limits = [force, side, *cones, gap, slip]
    forces = np.repeat([x.kind in OF_FORCES for x in limits], [len(x.places) for x in limits])
    return np.hstack([np.where(x.asked, x.values, 0.0) for x in limits]), forces
