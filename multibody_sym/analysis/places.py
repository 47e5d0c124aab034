"""Positions told apart by where bodies are, not by coordinates: a quaternion and its negative are one attitude.

Coordinates may also run twice over what can be told apart at all: a slider on a massless arm is at the same place for
(r, theta) and (-r, theta + pi). Two such positions are one where masses, points at which forces and constraints act,
and springs are the same, and some length has the other sign.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import Flow
from multibody_sym.analysis.steadiness import displaced
from multibody_sym.dynamics.constraints.closing import Rows, normalize
from multibody_sym.kinematics.energy import stored_energy
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.points import position
from multibody_sym.model.mechanism.loads import JointPotential, JointSpring
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import Pose
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.records import dataclass

Mask = npt.NDArray[np.bool_]

_NOTHING: Final = 1e-15
"""The part of the model's size, or of 1 rad, that is rounding."""
_SAME: Final = 1e-6
_NEAR: Final = 1e-2
_LEVEL: Final = 1e-5
_HEIGHTS: Final = 8
_SAMPLES: Final = 2
_PERIODIC: Final = 1e-8
_SEED: Final = 11


@dataclass(frozen=True, eq=False)
class Places:
    """Comparison of positions of a mechanism; `start` is a closed one."""

    flow: Flow
    rows: Rows
    start: Floats

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism whose positions these are."""
        return self.rows.mechanism

    def motion(self, q: Floats) -> Motion:
        """Return the motion at rest."""
        return self.rows.motion(q, np.zeros(len(self.mechanism.speeds)))

    @cached_property
    def length(self) -> float:
        """How large the model is: how far a body or a named point is from the origin at the start; 1 m for a point."""
        motion = self.motion(self.start)
        points = [*(position(motion, x) for x in self.mechanism.markers.values()), *(p for _, p in motion.poses)]
        return float(np.linalg.norm(np.array(points, dtype=float), axis=1).max(initial=0.0)) or 1.0

    @cached_property
    def scale(self) -> Floats:
        """How far (nu) positions differ that are clearly others: by the size of the model, or by 1 rad."""
        return np.array([self.length if speed.unit == "m/s" else 1.0 for speed in self.mechanism.speeds])

    @cached_property
    def angles(self) -> Mask:
        """The coordinates (nq) that are angles."""
        return np.array([c.unit == "rad" for c in self.mechanism.coordinates], dtype=bool)

    @cached_property
    def lengths(self) -> Mask:
        """The coordinates (nq) that are lengths."""
        return np.array([c.unit == "m" for c in self.mechanism.coordinates], dtype=bool)

    @cached_property
    def periodic(self) -> Mask:
        """The angles (nq) whose whole turns make no difference: no torsion spring winds up, no gear counts them."""
        found = self.angles.copy()
        rng = np.random.default_rng(_SEED)
        for k in np.flatnonzero(self.angles):
            for _ in range(_SAMPLES):
                q = self.start + np.where(self.angles, rng.uniform(-1.0, 1.0, len(self.start)), 0.0)
                turned = q.copy()
                turned[k] += 2.0 * np.pi
                found[k] &= self._alike(q, turned)
        return found

    def _alike(self, a: Floats, b: Floats) -> bool:
        """Return whether a system at rest stands alike in two positions, accelerates alike, and misses its rows alike.

        Along a curve, or on a screw, a whole turn leads elsewhere.
        """
        u, rows = np.zeros(len(self.mechanism.speeds)), self.rows.holonomic()
        try:
            accelerations = [self.flow.accelerations(q, u) for q in (a, b)]
            here, there = (self.flow.poses(q)[0] / self._units for q in (a, b))
            if not _close(here, there):
                return False
        except UNDEFINED:
            return True
        missed = [here[0] for here in map(rows.at, (a, b)) if here is not None]
        pairs = [accelerations, missed] if len(missed) == 2 else [accelerations]
        return all(np.abs(y - x).max(initial=0.0) <= _PERIODIC * (1.0 + np.abs(x).max(initial=0.0)) for x, y in pairs)

    def principal(self, q: Floats) -> Floats:
        """Return coordinates with angles in (-pi, pi] where whole turns make no difference, and quaternions w >= 0."""
        turned = q - 2 * np.pi * np.ceil(q / (2 * np.pi) - 0.5 - _SAME)
        found = np.where(self.periodic, turned, q)
        for body in self.mechanism.bodies:
            for places in map(list, body.quaternions):
                found[places] *= -1.0 if found[places[0]] < 0.0 else 1.0
        return found

    def told(self, q: Floats) -> list[float]:
        """Return coordinates as they are told: principal ones, zero where they are no more than rounding."""
        found = self.principal(q)
        least = _NOTHING * np.where(self.lengths, self.length, 1.0)
        return [float(x) for x in np.where(np.abs(found) <= least, 0.0, found)]

    def same(self, a: Floats, b: Floats, free: Mask) -> bool:
        """Return whether two positions are the same up to what is free in the second."""
        near = np.where(free, b, a)
        if free.any():
            normalize(self.mechanism, near)
        return _close(self._poses(near), self._poses(b)) or self._overlaps(near, b)

    def apart(self, a: Floats, b: Floats) -> Floats:
        """Return what poses in b differ by from those in a."""
        return self._poses(b) - self._poses(a)

    def slopes(self, q: Floats) -> Floats:
        """Return how that which `apart` compares follows deviations (nu) from a position."""
        found = self.flow.pose_slopes(q) / self._units[:, None]
        turns = np.eye(len(q))[self.angles & ~self.periodic] @ self.flow.displacements(q)
        return np.vstack([found, turns])

    def energy(self, q: Floats) -> float:
        """Return the potential energy."""
        return self._placed(q)[1]

    def level(self, a: float, b: float) -> bool:
        """Return whether two potential energies are the same, as they are in positions that are one."""
        return abs(a - b) <= _LEVEL * self._height

    @cached_property
    def _height(self) -> float:
        """How much potential energies differ around the start."""
        rng, energies = np.random.default_rng(_SEED), []
        scale = np.array([self.length if speed.unit == "m/s" else 1.0 for speed in self.mechanism.speeds])
        for _ in range(_HEIGHTS):
            q = displaced(self.mechanism, self.start, scale * rng.uniform(-1.0, 1.0, len(scale)))
            try:
                energies.append(self.energy(q))
            except UNDEFINED:
                continue
        rounding = _PERIODIC * max(map(abs, energies), default=0.0)
        return float(np.ptp(energies)) + rounding if len(energies) > 1 else np.inf

    def between(self, a: Floats, b: Floats) -> Floats | None:
        """Return the position half way between two that are close together, None where they are not."""
        if not _close(self._poses(a), self._poses(b), _NEAR):
            return None
        nearest = b - 2 * np.pi * np.round((b - a) / (2 * np.pi)) * self.periodic
        for body in self.mechanism.bodies:
            for k in map(list, body.quaternions):
                nearest[k] *= np.sign(nearest[k] @ a[k])
        found: Floats = (a + nearest) / 2
        normalize(self.mechanism, found)
        return found

    def _poses(self, q: Floats) -> Floats:
        """Return all bodies' attitudes and places, and angles that count whole turns."""
        return np.concatenate([self._placed(q)[0] / self._units, self._turns(q)])

    def _placed(self, q: Floats) -> tuple[Floats, float]:
        """Return poses and the potential energy, which are asked anew for each other position."""
        key = q.tobytes()
        if key not in self._known:
            self._known[key] = self.flow.poses(q)
        return self._known[key]

    @cached_property
    def _known(self) -> dict[bytes, tuple[Floats, float]]:
        """Poses and potential energies that were asked for, by coordinates."""
        return {}

    @cached_property
    def _units(self) -> Floats:
        """What counts as one among poses."""
        return np.tile([1.0] * 9 + [self.length] * 3, len(self.mechanism.bodies))

    def _turns(self, q: Floats) -> Floats:
        return q[self.angles & ~self.periodic]

    def _overlaps(self, a: Floats, b: Floats) -> bool:
        """Return whether coordinates give the same place twice: with lengths of other signs, nothing else differs."""
        turned = self.lengths & (np.abs(a + b) <= _SAME * self.length) & (np.abs(b) > _SAME * self.length)
        return bool(turned.any()) and _close(self._matter(a), self._matter(b))

    def _matter(self, q: Floats) -> Floats:
        """Return where masses are, and points at which forces and rows act, and what springs hold."""
        motion = self.motion(q)
        parts = [self._turns(q)]
        for index, mass in enumerate(motion.masses):
            R = np.array(motion.rotation(index), dtype=float)
            if mass.mass != 0:
                com = Marker("", index, Pose(self.mechanism.bodies[index].mass.com))
                parts.append(np.array(position(motion, com), dtype=float) / self.length)
            inertia = np.array(mass.inertia, dtype=float)
            parts.append(np.ravel(R @ inertia @ R.T) / (np.abs(inertia).max() or 1.0))
        parts += [np.ravel(np.array(motion.rotation(body), dtype=float)) for body in self._pushing]
        parts += [np.array(position(motion, at), dtype=float) / self.length for at in acted(self.mechanism)]
        in_joints = [x for x in self.mechanism.loads if isinstance(x, (JointSpring, JointPotential))]
        energies = [stored_energy(x, motion) for x in in_joints]
        size = max(map(abs, energies), default=0.0) or 1.0
        return np.concatenate([*parts, np.array(energies, dtype=float) / size])

    @cached_property
    def _pushing(self) -> list[int]:
        """The bodies in whose axes forces and torques are given."""
        return [load.axes_of for load in self.mechanism.loads if load.axes_of is not None]

    def nearer(self, a: Floats, b: Floats) -> bool:
        """Return whether more lengths have their sign of the start in a than in b."""
        signs = np.sign(self.start) * self.lengths
        return bool((signs * np.sign(a)).sum() > (signs * np.sign(b)).sum())


def acted(mechanism: Mechanism) -> Iterator[Marker]:
    """Yield the points of bodies at which loads and rows act."""
    for load in mechanism.loads:
        yield from load.points
    for row in mechanism.rows:
        yield from row.points


def _close(a: Floats, b: Floats, part: float = _SAME) -> bool:
    return bool(np.abs(a - b).max(initial=0.0) <= part * (1.0 + np.abs(b).max(initial=0.0)))
