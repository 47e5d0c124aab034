"""Start: parameter values, and the coordinates and speeds at t = 0 that satisfy all constraints, in floats."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from multibody_sym.dynamics.block_ldl import tree_factors
from multibody_sym.dynamics.forward_dynamics import UNDEFINED, verify_inertia
from multibody_sym.errors import ModelError, NoSolutionError, Where
from multibody_sym.kinematics.motion import Motion, coordinate_rates, motion_of
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism import Mechanism, RopeRow
from multibody_sym.model.slots import suggestion
from multibody_sym.program.solve import solve
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, leaves, slot

Floats = npt.NDArray[np.float64]

NEAR: Final = 1e-6
"""Start values that are all given are projected onto the constraints when they miss them by less than this."""
_CLOSED: Final = 1e-10
_STEPS: Final = 60
_RESTARTS: Final = 8
_LARGEST_TURN: Final = 1.0


@dataclass(frozen=True)
class Start:
    """The state at t = 0: parameter vector (np), q (nq), u (nu).

    `held` names the coordinates and speeds that kept their declared values while rows were closed, `assembled` those
    that were found; `shift` is the largest change of a value that was given.
    """

    parameters: tuple[float, ...]
    q: tuple[float, ...]
    u: tuple[float, ...]
    held: tuple[str, ...]
    assembled: tuple[str, ...]
    shift: float


def start(mechanism: Mechanism, overrides: Mapping[str, float] | None = None) -> Start:
    """Return the state at t = 0: declared values, with what the constraints need of the others.

    Joints marked `known` keep their values and the others are assembled; without marks those with an `initial` are
    held in their order as long as the rest can close; if all are given and miss the constraints by less than 1e-6, they
    are changed as little as possible. Ropes without a length are measured in the assembled position.
    Raises NoSolutionError (residuals by name; a speed without inertia) and ModelError (values that are not finite).
    """
    declared = parameter_values(mechanism, overrides or {})
    q, u = _declared_state(mechanism, declared)
    measured = _measured_ropes(mechanism)
    closed = _Rows(mechanism, declared, [k for k in range(len(mechanism.rows)) if k not in measured])
    verify_inertia(closed.motion(q, u))
    position = _assembled_position(closed, q)
    parameters = _with_lengths(closed, position.values, measured)
    every = _Rows(mechanism, parameters, range(len(mechanism.rows)))
    velocity = _assembled_velocity(every, position.values, u)
    parts = (position, velocity) if mechanism.rows else ()
    return Start(
        tuple(parameters),
        tuple(position.values),
        tuple(velocity.values),
        tuple(name for part in parts for name in part.held),
        tuple(name for part in parts for name in part.assembled),
        max(position.shift, velocity.shift),
    )


# --- parameters ----------------------------------------------------------------------------------------------------


def parameter_values(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[float]:
    """Return the parameter vector (np): declared values, expressions of others evaluated, `overrides` by name.

    What is not declared (lengths of ropes that are measured, Baumgarte's coefficients) is zero.
    Raises ModelError for unknown names, circles, values that are not finite, and `positive` ones that are not.
    """
    entries = mechanism.parameters
    _verify_overrides(mechanism, overrides)
    values = {slot("parameters", i): 0.0 for i, entry in enumerate(entries) if entry.value is None}
    for index in _evaluation_order(mechanism, overrides):
        name = entries[index].name
        try:
            value = overrides[name] if name in overrides else evaluate_float([_given(entries[index].value)], values)[0]
        except UNDEFINED:
            value = math.nan
        if not math.isfinite(value):
            raise _parameter_error(name, f"{name} has no finite value")
        if entries[index].positive and value <= 0:
            raise _parameter_error(name, f"{name} = {value:g}, but it is declared positive")
        values[slot("parameters", index)] = float(value)
    return [values[slot("parameters", i)] for i in range(len(entries))]


def _given(value: Node | None) -> Node:
    assert value is not None
    return value


def _parameter_error(name: str, message: str) -> ModelError:
    return ModelError(message, where=Where(path=("parameters", name)))


def _verify_overrides(mechanism: Mechanism, overrides: Mapping[str, float]) -> None:
    declared = [entry.name for entry in mechanism.parameters if entry.value is not None]
    for name in overrides:
        if name not in declared:
            raise ModelError(f"no parameter is called {name!r}{suggestion(name, declared)}")


def _evaluation_order(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[int]:
    """Return the declared parameters' positions, each after those that its expression names."""
    entries = mechanism.parameters
    order: dict[int, None] = {}
    path: dict[int, None] = {}
    stack = [i for i in reversed(range(len(entries))) if entries[i].value is not None]
    while stack:
        index = stack[-1]
        value = entries[index].value
        needed = [] if entries[index].name in overrides or value is None else leaves([value], "slot")
        missing = [leaf.data[1] for leaf in needed if leaf.data[1] not in order]
        if index in order or not missing:
            order[stack.pop()] = None
            path.pop(index, None)
            continue
        path[index] = None
        for other in missing:
            if other in path:
                raise _circle([entries[i].name for i in path], entries[other].name)
        stack.extend(missing)
    return list(order)


def _circle(names: list[str], again: str) -> ModelError:
    circle = [*names[names.index(again) :], again]
    return _parameter_error(again, f"parameters depend on each other in a circle: {' -> '.join(circle)}")


def _measured_ropes(mechanism: Mechanism) -> dict[int, int]:
    """Return the rows whose rope is measured at the start, each with its length's position among the parameters."""
    places = {slot("parameters", i): i for i, entry in enumerate(mechanism.parameters) if entry.value is None}
    return {
        k: places[row.length]
        for k, row in enumerate(mechanism.rows)
        if isinstance(row, RopeRow) and row.length in places
    }


def _with_lengths(rows: _Rows, q: Floats, measured: Mapping[int, int]) -> list[float]:
    """Return the parameters with the ropes' lengths as they are at q; phi = length - path, and length is still zero."""
    parameters = list(rows.parameters)
    if measured:
        motions = row_motions(rows.motion(q, np.zeros(len(rows.mechanism.speeds))))
        for row, place in measured.items():
            parameters[place] = -float(motions[row].phi)
    return parameters


# --- declared state ------------------------------------------------------------------------------------------------


def _declared_state(mechanism: Mechanism, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    """Return q with unit quaternions, and u, as declared."""
    values = {slot("parameters", i): value for i, value in enumerate(parameters)}
    q = np.array([_initial(c.initial, values, c.joint, c.name) for c in mechanism.coordinates], dtype=float)
    u = np.array([_initial(s.initial, values, s.joint, s.name) for s in mechanism.speeds], dtype=float)
    for body in mechanism.bodies:
        places = [k for k, unit in zip(body.q, body.joint.coordinate_units, strict=True) if unit == ""]
        if places:
            length = float(np.linalg.norm(q[places]))
            if length == 0.0:
                raise ModelError(
                    "the quaternion is zero; [1, 0, 0, 0] is no rotation",
                    where=Where(path=("joints", body.joint_name, "initial", "q")),
                )
            q[places] /= length
    return q, u


def _initial(value: Node, parameters: Mapping[Node, float], joint: str, name: str) -> float:
    try:
        found = evaluate_float([value], parameters)[0]
    except UNDEFINED:
        found = math.nan
    if not math.isfinite(found):
        raise ModelError(f"the initial value of {name} is not finite", where=Where(path=("joints", joint, "initial")))
    return found


# --- assembly ------------------------------------------------------------------------------------------------------


class _Assembled(NamedTuple):
    """Coordinates or speeds that satisfy the rows, with the names that were held and found."""

    values: Floats
    held: tuple[str, ...]
    assembled: tuple[str, ...]
    shift: float


@dataclass(frozen=True)
class _Rows:
    """Those rows of a mechanism that are to be closed, at t = 0."""

    mechanism: Mechanism
    parameters: Sequence[float]
    active: Sequence[int]

    def motion(self, q: Floats, u: Floats) -> Motion:
        """Return the motion; raises ModelError where something declared has no value."""
        try:
            return motion_of(
                self.mechanism,
                state_of(self.mechanism, float, 0.0, q.tolist(), u.tolist(), self.parameters),
            )
        except UNDEFINED as error:
            raise ModelError(f"an expression of the model has no finite value at the start ({error})") from None

    def at(self, q: Floats, u: Floats) -> list[RowMotion]:
        """Return the active rows."""
        if not self.active:
            return []
        rows = row_motions(self.motion(q, u))
        return [rows[k] for k in self.active]

    def phi(self, q: Floats) -> Floats:
        """Return phi, infinite where the rows have no value."""
        try:
            values = np.array([row.phi for row in self.at(q, np.zeros(len(self.mechanism.speeds)))], dtype=float)
        except UNDEFINED:
            return np.full(len(self.active), math.inf)
        return np.where(np.isfinite(values), values, math.inf)

    def named(self, residuals: Sequence[float]) -> str:
        """Return residuals by the names of their rows."""
        names = [self.mechanism.rows[k].name for k in self.active]
        return ", ".join(f"{name} by {abs(x):.3g}" for name, x in zip(names, residuals, strict=True) if abs(x) > _CLOSED)


def _jacobian(rows: Iterable[RowMotion], count: int) -> Floats:
    return np.array([row.jacobian for row in rows], dtype=float).reshape(-1, count)


def _sizes(jacobian: Floats, values: Floats) -> Floats:
    """Return what residuals are measured with: how far a row moves when all values change by their own size."""
    return np.maximum(1.0, np.abs(jacobian).sum(axis=1) * max(1.0, float(np.abs(values).max(initial=0.0))))


def _assembled_position(rows: _Rows, q: Floats) -> _Assembled:
    mechanism = rows.mechanism
    if not rows.active:
        return _Assembled(q, (), (), 0.0)
    groups = [group for body in mechanism.bodies for group in _groups(body.q, body.u)]
    given = [bool(mechanism.coordinates[places[0]].given) for places, _ in groups]
    known = [bool(mechanism.coordinates[places[0]].known) for places, _ in groups]
    resting = np.zeros(len(mechanism.speeds))
    jacobian = _jacobian(rows.at(q, resting), len(mechanism.speeds))
    concerned = [bool(np.abs(jacobian[:, list(speeds)]).max() > 0) for _, speeds in groups]
    free_to = [places for (_, places) in groups]

    def close(held: Sequence[int]) -> Floats | None:
        fixed = [k for i in held for k in free_to[i]]
        return _closed_position(rows, q, [k for k in range(len(mechanism.speeds)) if k not in set(fixed)])

    def miss() -> Floats:
        return rows.phi(q)

    names = [tuple(mechanism.coordinates[k].name for k in places) for places, _ in groups]
    return _assembled(rows, q, [list(places) for places, _ in groups], names, _Marks(given, known, concerned), close, miss())


def _groups(q: Sequence[int], u: Sequence[int]) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return what can be held on its own: each coordinate with its speed, a quaternion joint as a whole."""
    if len(q) == len(u):
        return [((i,), (k,)) for i, k in zip(q, u, strict=True)]
    return [(tuple(q), tuple(u))]
