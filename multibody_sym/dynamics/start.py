"""Start: parameter values, and the coordinates and speeds at t = 0 that satisfy all constraints, in floats."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from multibody_sym.dynamics.absolute_state import absolute_state
from multibody_sym.dynamics.assembly import assembled_position, assembled_speeds
from multibody_sym.dynamics.closing import Rows, normalize
from multibody_sym.dynamics.contradiction import contradictions_named, verify_consistent
from multibody_sym.dynamics.forward_dynamics import verify_inertia
from multibody_sym.dynamics.regularity import generic_rank, verify_regular
from multibody_sym.dynamics.row_values import verify_direction, verify_lengths, verify_values
from multibody_sym.errors import ModelError, Where, at, suggestion
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.model.bodies import GROUND
from multibody_sym.model.mechanism import TIME, Coordinate, Mechanism, RopeRow, Speed
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, leaves, slot


@dataclass(frozen=True)
class Start:
    """The state at t = 0: parameter vector (np), q (nq), u (nu).

    `held` names the coordinates and speeds that kept their declared values while constraints were closed, `assembled`
    those that were found; `shifts` tells by how much values that were given changed. `rank` of the rows: where it is
    less than the generic one, among the parameters, the start is a singular position.
    """

    parameters: tuple[float, ...]
    q: tuple[float, ...]
    u: tuple[float, ...]
    held: tuple[str, ...]
    assembled: tuple[str, ...]
    shifts: Mapping[str, float]
    rank: int

    @property
    def shift(self) -> float:
        """The largest change of a value that was given."""
        return max(map(abs, self.shifts.values()), default=0.0)


def start(mechanism: Mechanism, overrides: Mapping[str, float] | None = None, *, project: bool = False) -> Start:
    """Return the state at t = 0: declared values, with what the constraints need of the others.

    Joints marked `known` keep their values and the others are assembled; without marks those with an `initial` are
    held in their order as long as the rest can close. If all are given, none marked, and miss the constraints by less
    than 1e-6, and whenever `project` asks for it, all change as little as possible, in the norm of the mass matrix.
    Ropes without a length are measured in the assembled position.
    Raises NoSolutionError (constraints that contradict each other, by name, or do not close, with residuals by name; a
    speed that no inertia resists) and ModelError (values that are not finite or not positive).
    """
    if mechanism.relative is not None:
        return _in_absolute_coordinates(mechanism, start(mechanism.relative, overrides, project=project))
    declared = parameter_values(mechanism, overrides or {})
    _verify_motions(mechanism, declared)
    q, u = _declared_state(mechanism, declared)
    measured = _measured_ropes(mechanism)
    rows = Rows(mechanism, declared, [k for k in range(len(mechanism.rows)) if k not in measured])
    _verify_inertia(rows, q, u)
    verify_lengths(rows.motion(q, u))
    with contradictions_named(rows, q, u):
        position = assembled_position(rows, q, project=project)
    verify_values(rows.motion(position.values, u))
    parameters = _with_lengths(rows, position.values, measured)
    every = Rows(mechanism, parameters, range(len(mechanism.rows)))
    with contradictions_named(every, position.values, u):
        speeds = assembled_speeds(every, position.values, u, project=project)
    rank = 0
    if mechanism.rows:
        rank, generic = generic_rank(every, position.values)
        parameters[-3] = float(generic)
        verify_consistent(every, position.values, speeds.values, generic)
    _verify_loads(every.motion(position.values, speeds.values))
    return Start(
        tuple(parameters),
        tuple(position.values.tolist()),
        tuple(speeds.values.tolist()),
        (*position.held, *speeds.held),
        (*position.found, *speeds.found),
        {**position.shifts, **speeds.shifts},
        rank,
    )


def _in_absolute_coordinates(mechanism: Mechanism, joints: Start) -> Start:
    """Return the start that is known in the coordinates of the joints, in which it is declared."""
    assert mechanism.relative is not None
    entries = zip(mechanism.relative.parameters, joints.parameters, strict=True)
    values = {entry.name: value for entry, value in entries}
    parameters = [values.get(entry.name, 0.0) for entry in mechanism.parameters]
    relative = Rows(mechanism.relative, joints.parameters, [])
    motion = relative.motion(np.array(joints.q, dtype=float), np.array(joints.u, dtype=float))
    q, u = absolute_state(mechanism, motion, parameters)
    rank = 0
    if mechanism.rows:
        rank, generic = generic_rank(Rows(mechanism, parameters, range(len(mechanism.rows))), q)
        parameters[-3] = float(generic)
    return replace(joints, parameters=tuple(parameters), q=tuple(q.tolist()), u=tuple(u.tolist()), rank=rank)


def verify_regular_start(mechanism: Mechanism, begin: Start) -> None:
    """Raise NoSolutionError where rows depend on each other at the start that are independent beside it, by name."""
    if mechanism.rows:
        rows = Rows(mechanism, begin.parameters, range(len(mechanism.rows)))
        verify_regular(rows, np.array(begin.q, dtype=float), begin.rank, int(begin.parameters[-3]))


def _verify_motions(mechanism: Mechanism, parameters: Sequence[float]) -> None:
    """Raise ModelError where a prescribed motion, its rate or its acceleration has no value at the start."""
    values = {TIME: 0.0, **{slot("parameters", i): value for i, value in enumerate(parameters)}}
    for body in mechanism.bodies:
        place = ("bodies",) if body.joint_name == GROUND else ("joints",)
        for given in body.given:
            with at(*place, body.joint_name, "motion"), _valued():
                evaluate_float(given or (), values)


def _verify_inertia(rows: Rows, q: Floats, u: Floats) -> None:
    motion = rows.motion(q, u)
    try:
        with _valued():
            verify_inertia(motion)
    except ModelError:
        verify_values(motion)
        raise


def _verify_loads(motion: Motion) -> None:
    for load in motion.mechanism.loads:
        with at("forces", load.name):
            verify_direction(motion, load)
            with _valued():
                applied(motion, [load])


@contextmanager
def _valued() -> Iterator[None]:
    try:
        yield
    except UNDEFINED as error:
        raise ModelError(f"an expression has no finite value at the start ({error})") from None


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
        name, declared = entries[index].name, entries[index].value
        value = overrides[name] if name in overrides else _finite(declared, values)
        if not math.isfinite(value):
            raise _parameter_error(name, f"{name} has no finite value")
        if entries[index].positive and value <= 0:
            raise _parameter_error(name, f"{name} = {value:g}, but it is declared positive")
        values[slot("parameters", index)] = float(value)
    return [values[slot("parameters", i)] for i in range(len(entries))]


def _finite(expression: Node | None, values: Mapping[Node, float]) -> float:
    """Return the value of an expression, nan where it has none."""
    assert expression is not None
    try:
        return evaluate_float([expression], values)[0]
    except UNDEFINED:
        return math.nan


def _parameter_error(name: str, message: str) -> ModelError:
    return ModelError(message, where=Where(path=("parameters", name)))


def _verify_overrides(mechanism: Mechanism, overrides: Mapping[str, float]) -> None:
    declared = [entry.name for entry in mechanism.parameters if entry.value is not None]
    for name in overrides:
        if name not in declared:
            raise ModelError(f"no parameter is called {name!r}{suggestion(name, declared)}")


def _evaluation_order(mechanism: Mechanism, overrides: Mapping[str, float]) -> list[int]:
    """Return the declared parameters' positions, each after those that its expression names."""
    needed = [
        [] if entry.value is None or entry.name in overrides else [n.data[1] for n in leaves([entry.value], "slot")]
        for entry in mechanism.parameters
    ]
    done: set[int] = {i for i, entry in enumerate(mechanism.parameters) if entry.value is None}
    order: list[int] = []
    for root in range(len(needed)):
        path = {} if root in done else {root: None}
        while path:
            index = next(reversed(path))
            missing = next((i for i in needed[index] if i not in done), None)
            if missing is None:
                path.popitem()
                order.append(index)
                done.add(index)
            elif missing in path:
                names = [mechanism.parameters[i].name for i in path]
                raise _circle([*names[list(path).index(missing) :], mechanism.parameters[missing].name])
            else:
                path[missing] = None
    return order


def _circle(names: Sequence[str]) -> ModelError:
    return _parameter_error(names[0], f"parameters depend on each other in a circle: {' -> '.join(names)}")


def _measured_ropes(mechanism: Mechanism) -> dict[int, int]:
    """Return the rows whose rope is measured at the start, each with its length's position among the parameters."""
    places = {slot("parameters", i): i for i, entry in enumerate(mechanism.parameters) if entry.value is None}
    return {
        k: places[row.length]
        for k, row in enumerate(mechanism.rows)
        if isinstance(row, RopeRow) and row.length in places
    }


def _with_lengths(rows: Rows, q: Floats, measured: Mapping[int, int]) -> list[float]:
    """Return the parameters with the ropes' lengths at q: phi = length - path, where length is still zero."""
    parameters = list(rows.parameters)
    if measured:
        with _valued():
            motions = row_motions(rows.motion(q, np.zeros(len(rows.mechanism.speeds))))
        for row, place in measured.items():
            parameters[place] = -float(motions[row].phi)
    return parameters


# --- declared state ------------------------------------------------------------------------------------------------


def _declared_state(mechanism: Mechanism, parameters: Sequence[float]) -> tuple[Floats, Floats]:
    """Return q with unit quaternions, and u, as declared."""
    values = {slot("parameters", i): value for i, value in enumerate(parameters)}
    found = []
    declared: Sequence[Coordinate | Speed] = (*mechanism.coordinates, *mechanism.speeds)
    for named in declared:
        value = _finite(named.initial, values)
        if not math.isfinite(value):
            where = Where(path=("joints", named.joint, "initial"))
            raise ModelError(f"the initial value of {named.name} is not finite", where=where)
        found.append(value)
    q, u = np.split(np.array(found, dtype=float), [len(mechanism.coordinates)])
    normalize(mechanism, q)
    return q, u
