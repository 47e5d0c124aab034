"""Dependent rows: the rank of the constraints at a state, which rows it leaves over, and what they make ambiguous."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.equations import TreeDynamics
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.wrenches import Wrench, carried
from multibody_sym.program.solve import scaled_rows, solve
from multibody_sym.scalars.vectors import add, scale

Floats = npt.NDArray[np.float64]

_NEGLIGIBLE: Final = 1e-8
_APPROXIMATE: Final = 1e-6


@dataclass(frozen=True)
class Redundancy:
    """The rank of H, the names of the rows it leaves over, and of the rows and joints whose forces are not unique."""

    rank: int
    redundant: tuple[str, ...]
    not_unique: tuple[str, ...]


def redundancy(motion: Motion, dynamics: TreeDynamics) -> Redundancy:
    """Return the rank of the rows at a state over floats, judged as the solver judges it (H G^-1 with M = G^T G).

    Multipliers are not unique where a combination of them exerts nothing on the system: rows with a share in one, and
    joints that it loads.
    """
    if not dynamics.rows:
        return Redundancy(0, (), ())
    matrix = np.array([dynamics.factors.weighted(row.jacobian) for row in dynamics.rows], dtype=float)
    kept = solve(matrix, matrix @ _generic(matrix.shape[1])).multipliers != 0.0
    rank = int(kept.sum())
    redundant = tuple(name for name, is_kept in zip(dynamics.row_names, kept, strict=True) if not is_kept)
    idle = _idle(matrix, rank)
    rows = [name for name, part in zip(dynamics.row_names, idle, strict=True) if _is_there(part)]
    joints = [_loaded(motion, dynamics, combination) for combination in idle.T]
    names = [body.joint_name for k, body in enumerate(motion.mechanism.bodies) if any(loads[k] for loads in joints)]
    return Redundancy(rank, redundant, (*rows, *names))


def approximate_rank(dynamics: TreeDynamics) -> int:
    """Return the rank of the rows at a state that satisfies them only nearly."""
    if not dynamics.rows:
        return 0
    matrix = np.array([dynamics.factors.weighted(row.jacobian) for row in dynamics.rows], dtype=float)
    values = np.linalg.svd(scaled_rows(matrix)[1], compute_uv=False)
    return int((values > _APPROXIMATE).sum())


def _generic(count: int) -> Floats:
    """Return numbers that no row is likely to be perpendicular to: drawn, as any pattern meets masses that fit it."""
    return np.random.default_rng(20).normal(size=count)


def _idle(matrix: Floats, rank: int) -> Floats:
    """Return the combinations of multipliers (s x (s - rank)) that exert nothing."""
    lengths, rows = scaled_rows(matrix)
    u, _, _ = np.linalg.svd(rows)
    found = u[:, rank:] / lengths[:, None]
    unit: Floats = found / np.linalg.norm(found, axis=0)
    return unit


def _is_there(part: Floats) -> bool:
    return bool(np.abs(part).max(initial=0.0) > _NEGLIGIBLE)


def _loaded(motion: Motion, dynamics: TreeDynamics, combination: Sequence[float]) -> list[bool]:
    """Return for each body whether its joint transmits something under a combination of multipliers."""
    total: list[Wrench] = [((0, 0, 0), (0, 0, 0))] * len(motion.bodies)
    for row, multiplier in zip(dynamics.rows, combination, strict=True):
        for index, (force, moment) in enumerate(row.of_body):
            known = total[index]
            total[index] = (add(known[0], scale(multiplier, force)), add(known[1], scale(multiplier, moment)))
    return [_is_there(np.array(wrench, dtype=float)) for wrench in carried(motion, total)]
