"""Questions of robots: coordinates at which a frame has a given place and attitude; parameters that forces tell apart.

In: a System; a frame and where it should be. Out: BaseParameters; a Posture. The posture comes from scipy's least
squares with exact Jacobians, in deviations of the coordinates from those it begins with, which are others where it does
not get there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from multibody_sym.analysis.deviations import coordinate_bounds, displaced
from multibody_sym.dynamics.closing import ConstraintRows, closed_near
from multibody_sym.dynamics.start.number_checks import check_numbers, on_numbers
from multibody_sym.dynamics.start.start import start
from multibody_sym.errors import InputError, ModelError, NoSolutionError
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.argument_checks import flag
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.function import function
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import UNDEFINED, Floats
from multibody_sym.scalars.numbers import floats, vector, verify_finite
from multibody_sym.scalars.rank import first_columns

_NEAR: Final = 1e-10
"""How far (m, rad) a frame may be from where it should be."""
_CLOSING: Final = 1e3
"""How much more loops that are open count than what the frame misses; what is left of them is closed afterwards."""
_TRIES: Final = 20
_SEED: Final = 1
_SMALL: Final = 1e-6
"""An angle (rad) below which its powers stand for its sine."""


@dataclass(frozen=True, eq=False)
class Posture:
    """The coordinates `q` (nq) at which a frame is where it should be, or as near as it gets, and the `state` by name.

    `missed` by its place (m), `turned` by its attitude (rad), zero where none was asked for.
    """

    q: Floats
    state: Mapping[str, float]
    missed: float
    turned: float

    @property
    def reached(self) -> bool:
        """Whether the frame is where it should be, to 1e-10 m and rad."""
        return max(self.missed, self.turned) <= _NEAR

    def as_json(self) -> dict[str, Any]:
        """Return the same as a JSON object."""
        return {"state": dict(self.state), "missed": self.missed, "turned": self.turned, "reached": self.reached}


def inverse_kinematics(
    system: System,
    frame: str,
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    *,
    initial: Mapping[str, Any] | None = None,
    limits: bool = True,
) -> Posture:
    """Return coordinates at which a `frame` (a body, point or frame) has a `position` (3) in m, in world axes.

    `rotation` (3, 3): its attitude R_WF, too. The search begins at the start of the system, changed by `initial`, and
    begins again elsewhere where it does not get there; the posture found is one of perhaps many. Limits of joints are
    kept, unless `limits` is False, and so are closed loops; contacts and ropes that may let go are not. Where no
    posture is found the nearest is returned, of which `reached` is false. Raises InputError for unknown names and wrong
    shapes, NoSolutionError where there is no start.
    """
    verify_system(system)
    place = vector("position", position, 3)
    verify_finite("position", place)
    attitude = None if rotation is None else floats("rotation", rotation)
    if attitude is not None and attitude.shape != (3, 3):
        raise InputError(f"rotation has the shape {attitude.shape}, not (3, 3)")
    if attitude is not None and not np.allclose(attitude @ attitude.T, np.eye(3), atol=1e-9):
        raise InputError("rotation is no rotation: its rows are not orthonormal")
    if attitude is not None and np.linalg.det(attitude) < 0.0:
        raise InputError("rotation is a reflection: its determinant is -1")
    return _nearest(Overrides(initial=initial).of(system), frame, place, attitude, flag("limits", limits))


@on_numbers
def _nearest(system: System, frame: str, place: Floats, attitude: Floats | None, limits: bool) -> Posture:
    declared = check_numbers(system)
    resolved = declared.relative or declared
    begin = start(resolved, project=system.simulation.project)
    rows = ConstraintRows(resolved, begin.parameters, range(len(resolved.rows))).holonomic()
    goal = _Goal(system, rows, frame, place, attitude)
    bounds = coordinate_bounds(resolved, begin.parameters)
    bounds = bounds if limits else np.array([[-np.inf], [np.inf]]).repeat(goal.count, axis=1)
    best: tuple[float, Floats] | None = None
    for q in _beginnings(resolved, np.array(begin.q, dtype=float), bounds):
        try:
            found = goal.approached(q, bounds)
            missed = float(np.abs(goal.residual(found)).max())
        except UNDEFINED:
            continue
        if best is None or missed < best[0]:
            best = missed, found
        if missed <= _NEAR:
            break
    if best is None:
        raise NoSolutionError("the constraints have no value in any position that was tried", number="N109")
    closed = closed_near(rows, best[1]) if rows.active else None
    q = best[1] if closed is None else closed
    off = [float(np.linalg.norm(part)) for part in np.split(goal.residual(q)[: goal.size], [3])]
    names = (coordinate.name for coordinate in resolved.coordinates)
    return Posture(q, dict(zip(names, q.tolist(), strict=True)), *off)


def _beginnings(mechanism: Mechanism, q: Floats, bounds: Floats) -> Iterator[Floats]:
    """Yield the start, and other coordinates within the bounds, angles without any up to half a turn away."""
    yield q
    random = np.random.default_rng(_SEED)
    turns = np.array([speed.unit == "rad/s" for speed in mechanism.speeds])
    for _ in range(_TRIES):
        sigma = np.where(turns, random.uniform(-np.pi, np.pi, len(turns)), random.uniform(-1.0, 1.0, len(turns)))
        moved = displaced(mechanism, q, sigma)
        for body in mechanism.bodies:
            for place, k in body.rate_pairs:
                low, high = bounds[:, k]
                if np.isfinite(low) and np.isfinite(high):
                    moved[place] = random.uniform(low, high)
        yield moved


class _Goal:
    """Where a frame should be: what is missed (3, 6, and the rows of loops), and its derivative by deviations."""

    def __init__(
        self, system: System, rows: ConstraintRows, frame: str, place: Floats, attitude: Floats | None
    ) -> None:
        world: dict[str, Any] = {"frame": frame, "axes": "local_world_aligned", "backend": "python"}
        self.frame, self.slope = (function(system, what, **world) for what in ("frame", "jacobian"))
        self.mechanism, self.rows, self.place, self.attitude = rows.mechanism, rows, place, attitude
        self.count, self.size = len(self.mechanism.speeds), 3 if attitude is None else 6

    def residual(self, q: Floats) -> Floats:
        """Return what is missed at coordinates (nq)."""
        found = self.frame(0.0, q, self._still)
        parts = [found.position - self.place]
        if self.attitude is not None:
            parts.append(_rotation_vector(self.attitude.T @ found.rotation))
        if self.rows.active:
            parts.append(_CLOSING * self._open(q)[0])
        return np.concatenate(parts)

    def slopes(self, q: Floats) -> Floats:
        """Return its derivative by deviations (nu)."""
        J = self.slope(0.0, q, self._still).jacobian
        parts = [J[:3]]
        if self.attitude is not None:
            R = self.frame(0.0, q, self._still).rotation
            parts.append(np.linalg.solve(_rate_matrix(_rotation_vector(self.attitude.T @ R)), R.T @ J[3:]))
        if self.rows.active:
            parts.append(_CLOSING * self._open(q)[1])
        return np.vstack(parts)

    def _open(self, q: Floats) -> tuple[Floats, Floats]:
        """Return phi of the loops and its derivative by deviations; raises FloatingPointError where it has no value."""
        found = self.rows.at(q)
        if found is None:
            raise FloatingPointError("a constraint has no value")
        return found

    def approached(self, q: Floats, bounds: Floats) -> Floats:
        """Return coordinates within bounds, from q on, at which the frame is nearest to its goal."""
        from scipy.optimize import least_squares  # scipy takes longer to import than most answers take

        here = np.zeros(self.count)
        for body in self.mechanism.bodies:
            for place, k in body.rate_pairs:
                here[k] = q[place]
        q = displaced(self.mechanism, q, np.clip(here, *bounds) - here)
        low, high = bounds - np.clip(here, *bounds)
        found = least_squares(
            lambda sigma: self.residual(displaced(self.mechanism, q, sigma)),
            np.clip(np.zeros(self.count), low, np.maximum(high, np.nextafter(low, np.inf))),
            jac=lambda sigma: self.slopes(displaced(self.mechanism, q, sigma)) @ self._turning(sigma),
            bounds=(low, np.maximum(high, np.nextafter(low, np.inf))),
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            x_scale=1.0,
            max_nfev=200,
        )
        return displaced(self.mechanism, q, np.asarray(found.x, dtype=float))

    def _turning(self, sigma: Floats) -> Floats:
        """Return how fast speeds are while deviations change: of a quaternion as a rotation vector says."""
        found = np.eye(self.count)
        for body in self.mechanism.bodies:
            for free in body.free_steps:
                if free.step.unit_quaternion:
                    found[np.ix_(free.u, free.u)] = _rate_matrix(sigma[list(free.u)])
        return found

    @cached_property
    def _still(self) -> Floats:
        return np.zeros(self.count)


def _rotation_vector(R: Floats) -> Floats:
    """Return the rotation vector (3) of a rotation matrix."""
    from scipy.spatial.transform import Rotation  # as above

    return np.asarray(Rotation.from_matrix(R).as_rotvec(), dtype=float)


def _rate_matrix(r: Floats) -> Floats:
    """Return the matrix that makes of the rate of a rotation vector the angular velocity in the axes of the body."""
    angle = float(np.linalg.norm(r))
    x, y, z = r
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < _SMALL:
        return np.asarray(np.eye(3) - cross / 2 + cross @ cross / 6, dtype=float)
    of_sine, of_cosine = (angle - np.sin(angle)) / angle**3, (1 - np.cos(angle)) / angle**2
    found: Floats = np.eye(3) - of_cosine * cross + of_sine * cross @ cross
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Base parameters: the combinations of masses and inertias that the forces of joints depend on.
#
# In: a System. Out: BaseParameters, for identification by least squares on the regressor.


_OF_BODY: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""The parameters of a body in the order of `theta`: mass, m times the centre, inertia about the origin."""
_DEPENDENT: Final = 1e-8
"""The part of a column by which it differs from a combination of those before it where it is one, by rounding."""


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Combinations K theta of the parameters of bodies that forces depend on: Y theta = Y[:, columns] (K theta).

    `names` (nb) of the base parameters, such as `Izz(upper) + 0.25*m(lower)`; their `columns` (nb) of the regressor Y;
    `combination` K (nb, 10 bodies); `parameters`: the names of theta.
    """

    names: tuple[str, ...]
    columns: npt.NDArray[np.intp]
    combination: Floats
    parameters: tuple[str, ...]


def base_parameters(system: System) -> BaseParameters:
    """Return the base parameters of the tree of a system, whose geometry counts and not its masses.

    Of parameters that forces cannot tell apart the first one in tree order stands in front, so that a link has those
    of the links that it carries. Constraints count for nothing.
    Raises ModelError for a system without speeds.
    Source: Gautier (1991), Numerical calculation of the base inertial parameters of robots.
    """
    regressor = function(system, "regressor")
    nu, width = regressor.shapes["regressor"]
    if not nu:
        raise ModelError("there are no speeds, so that no force tells of masses", number="M110")
    # the regressor at so many states that its rows are twice its columns
    rng, count, nq = np.random.default_rng(_SEED), 2 * width // nu + 1, regressor.program.input("q").size
    q, (u, udot) = rng.uniform(-2.0, 2.0, (count, nq)), rng.uniform(-2.0, 2.0, (2, count, nu))
    Y = regressor(0.0, q, u, udot).regressor.reshape(count * nu, width)
    sizes = np.linalg.norm(Y, axis=0)
    seen = np.flatnonzero(sizes > _DEPENDENT * sizes.max(initial=0.0))
    first, of_seen = first_columns(Y[:, seen] / sizes[seen], _DEPENDENT)
    columns = seen[first]
    combination = np.zeros((len(columns), len(sizes)))
    of_seen *= sizes[seen] / sizes[columns][:, None]
    combination[:, seen] = np.where(np.abs(of_seen) > _DEPENDENT, of_seen, 0.0)
    declared = mechanism(system)
    bodies = (declared.relative or declared).bodies
    parameters = tuple(f"{word}({body.name})" for body in bodies for word in _OF_BODY)
    names = tuple(_in_words(row, column, parameters) for row, column in zip(combination, columns, strict=True))
    return BaseParameters(names, columns, combination, parameters)


def _in_words(row: Floats, first: int, parameters: Sequence[str]) -> str:
    """Return a combination as text, its own parameter in front."""
    terms = [parameters[first]]
    for k in np.flatnonzero(row).tolist():
        if k != first:
            factor = "" if abs(abs(row[k]) - 1.0) < _DEPENDENT else f"{abs(row[k]):.6g}*"
            terms.append(f"{'-' if row[k] < 0 else '+'} {factor}{parameters[k]}")
    return " ".join(terms)
