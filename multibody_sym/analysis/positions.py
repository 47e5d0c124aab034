"""Positions of a mechanism, compared by where bodies are, not by coordinates.

In: a mechanism and a closed position. Out: whether positions are one, how far apart they are, and sizes of steps.
A quaternion and its negative are one attitude.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.analysis.deviations import DeviationFlow, displaced
from multibody_sym.dynamics.closing import ConstraintRows, normalize
from multibody_sym.mechanics.energy import stored_energy
from multibody_sym.mechanics.load_records import JointPotential, JointSpring
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import Motion
from multibody_sym.mechanics.points import position
from multibody_sym.mechanics.row_records import Marker
from multibody_sym.model.bodies import Pose
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats

Mask = npt.NDArray[np.bool_]

# Coordinates may also give one place twice: a slider on a massless arm is at the same place for (r, theta) and
# (-r, theta + pi). Two such positions are one where masses, points at which forces and constraints act, and springs are
# the same, and some length has the other sign.

_NOTHING: Final = 1e-15
"""The part of the model's size, or of 1 rad, that is rounding."""
SAME: Final = 1e-6
_NEAR: Final = 1e-2
_LEVEL: Final = 1e-5
_HEIGHTS: Final = 8
_SAMPLES: Final = 2
_PERIODIC: Final = 1e-8
_SEED: Final = 11


@dataclass(frozen=True, eq=False)
class Positions:
    """Comparison of positions of a mechanism; `start` is a closed one."""

    flow: DeviationFlow
    rows: ConstraintRows
    start: Floats

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism whose positions these are."""
        return self.rows.mechanism

    def motion(self, q: Floats) -> Motion:
        return self.rows.motion(q, np.zeros(len(self.mechanism.speeds)))

    @cached_property
    def length(self) -> float:
        """The size of the model: the largest distance of bodies and named points from the origin; 1 m for a point."""
        motion = self.motion(self.start)
        points = [*(position(motion, x) for x in self.mechanism.markers.values()), *(p for _, p in motion.poses)]
        return float(np.linalg.norm(np.array(points, dtype=float), axis=1).max(initial=0.0)) or 1.0

    @cached_property
    def scale(self) -> Floats:
        """The deviations (nu) between clearly different positions: the size of the model, or 1 rad."""
        return np.array([self.length if speed.unit == "m/s" else 1.0 for speed in self.mechanism.speeds])

    @property
    def sizes(self) -> Floats:
        """The same with changes of declared states behind them (nu + ns)."""
        return np.concatenate([self.scale, self.units[len(self.scale) :]])

    @cached_property
    def units(self) -> Floats:
        """The units (nu + ns) in which steps are measured: 1 m and 1 rad, of declared states their size at the start.

        The unit of a state that is zero there changes an acceleration by 1, or is 1 where it changes none.
        """
        size, states = len(self.scale), len(self.mechanism.rates)
        found = np.ones(size + states)
        if states:
            slopes = np.abs(self._slopes_at_start[size : 2 * size, 2 * size :]).max(axis=0, initial=0.0)
            usable = np.isfinite(slopes) & (slopes > 0.0)
            at_zero = np.where(usable, 1.0 / np.where(usable, slopes, 1.0), 1.0)
            begun = np.abs(self.start[-states:])
            found[size:] = np.where(begun > 0.0, begun, at_zero)
        return found

    @cached_property
    def _slopes_at_start(self) -> Floats:
        """The derivatives dz'/dz (nz x nz) at the start, zero where they have no value."""
        size = 2 * len(self.scale) + len(self.mechanism.rates)
        with suppress(*UNDEFINED):
            return self.flow.derivatives(self.flow.known(self.start, np.zeros(len(self.scale))))[0]
        return np.zeros((size, size))

    @cached_property
    def rate_units(self) -> Floats:
        """The units (nu + ns) of accelerations, 1, and of rates of states: their change for steps of one unit."""
        found, size = np.ones(len(self.units)), len(self.scale)
        if self.mechanism.rates:
            by_state = self._slopes_at_start[2 * size :]
            sizes = np.abs(np.hstack([by_state[:, :size], by_state[:, 2 * size :]])) @ self.units
            found[size:] = np.where(np.isfinite(sizes) & (sizes > 0.0), sizes, 1.0)
        return found

    @cached_property
    def angles(self) -> Mask:
        """The coordinates (nq) of joints that are angles."""
        return np.array([c.unit == "rad" and c.rate is None for c in self.mechanism.coordinates], dtype=bool)

    @cached_property
    def lengths(self) -> Mask:
        """The coordinates (nq) of joints that are lengths."""
        return np.array([c.unit == "m" and c.rate is None for c in self.mechanism.coordinates], dtype=bool)

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
        """Return whether a system at rest has the same poses, accelerations and residuals of rows in two positions.

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
        turned = q - 2 * np.pi * np.ceil(q / (2 * np.pi) - 0.5 - SAME)
        found = np.where(self.periodic, turned, q)
        for body in self.mechanism.bodies:
            for places in map(list, body.quaternions):
                found[places] *= -1.0 if found[places[0]] < 0.0 else 1.0
        return found

    def told(self, q: Floats) -> list[float]:
        """Return coordinates as they are reported: principal ones, zero where they are rounding."""
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
        """Return the difference of poses in b from those in a."""
        return self._poses(b) - self._poses(a)

    def slopes(self, q: Floats) -> Floats:
        """Return the derivative of the poses of `apart` by deviations (nu + ns) from a position."""
        found, states = self.flow.pose_slopes(q) / self._units[:, None], len(self.mechanism.rates)
        turns = np.eye(len(q))[self.angles & ~self.periodic] @ self.flow.displacements(q)
        of_bodies = np.vstack([found, turns])
        if not states:
            return of_bodies
        of_states = np.diag(1.0 / self.units[len(self.scale) :])
        aside = np.zeros((len(of_bodies), states)), np.zeros((states, of_bodies.shape[1]))
        return np.block([[of_bodies, aside[0]], [aside[1], of_states]])

    def energy(self, q: Floats) -> float:
        return self._placed(q)[1]

    def level(self, a: float, b: float) -> bool:
        """Return whether two potential energies are the same, as they are in positions that are one."""
        return abs(a - b) <= _LEVEL * self._height

    @cached_property
    def _height(self) -> float:
        """How much potential energies differ around the start."""
        rng, energies = np.random.default_rng(_SEED), []
        for _ in range(_HEIGHTS):
            q = displaced(self.mechanism, self.start, self.scale * rng.uniform(-1.0, 1.0, len(self.scale)))
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
        """Return all bodies' attitudes and places, angles that count whole turns, and declared states."""
        states = q[len(q) - len(self.mechanism.rates) :] / self.units[len(self.scale) :]
        return np.concatenate([self._placed(q)[0] / self._units, self._turns(q), states])

    def _placed(self, q: Floats) -> tuple[Floats, float]:
        """Return poses and the potential energy, computed once for each position."""
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
        """The unit of each component of poses."""
        return np.tile([1.0] * 9 + [self.length] * 3, len(self.mechanism.bodies))

    def _turns(self, q: Floats) -> Floats:
        return q[self.angles & ~self.periodic]

    def _overlaps(self, a: Floats, b: Floats) -> bool:
        """Return whether coordinates give the same place twice: with lengths of other signs, nothing else differs."""
        turned = self.lengths & (np.abs(a + b) <= SAME * self.length) & (np.abs(b) > SAME * self.length)
        return bool(turned.any()) and _close(self._matter(a), self._matter(b))

    def _matter(self, q: Floats) -> Floats:
        """Return where masses are, and points at which forces and rows act, and the energies of springs."""
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
        acting = [at for load in self.mechanism.loads for at in load.points]
        acting += [at for row in self.mechanism.rows for at in row.points]
        parts += [np.array(position(motion, at), dtype=float) / self.length for at in acting]
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


def _close(a: Floats, b: Floats, part: float = SAME) -> bool:
    return bool(np.abs(a - b).max(initial=0.0) <= part * (1.0 + np.abs(b).max(initial=0.0)))
