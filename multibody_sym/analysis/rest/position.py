"""The declared position at values of a parameter, at rest, and the conditions of rest there in floats."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

import numpy as np

from multibody_sym.analysis.rest.statics import RestLimit, Statics, statics
from multibody_sym.analysis.rest.touching import crossed, height, out_of_touch, size_of, ways_of, with_planes
from multibody_sym.dynamics.constraints.closing import normalize
from multibody_sym.dynamics.laws.assemble import TOUCHING
from multibody_sym.dynamics.routes import FORMALISMS
from multibody_sym.dynamics.start.constants import measured_rows, with_constants
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start, start
from multibody_sym.errors import MultibodyError
from multibody_sym.kinematics.loads import applied, applied_generalized_forces
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.rows import RowMotion, row_motions
from multibody_sym.kinematics.state import slot_state, state_of
from multibody_sym.model.mechanism.contact_rows import Flat
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import UNDEFINED, Floats
from multibody_sym.numerics.feasibility import Conditions
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.kinks import switching_functions
from multibody_sym.scalars.node import Node, as_node, slot

_SAME: Final = 1e-12
_BEYOND: Final = 1e-14
"""The part of the model's size by which a centre of mass may seem to be beyond a plane."""


@dataclass(frozen=True)
class Position:
    """A mechanism at rest in its declared position, for any values of some parameters by name.

    `formalism`: by whose equations forces balance; None projects them directly.
    """

    mechanism: Mechanism
    begin: Start
    formalism: str | None = None

    @cached_property
    def statics(self) -> Statics:
        """What rest needs, whatever the values are."""
        return statics(self.mechanism)

    @cached_property
    def value(self) -> dict[str, float]:
        """The values of all parameters as they are declared."""
        return dict(zip((entry.name for entry in self.mechanism.parameters), self.begin.parameters, strict=True))

    @cached_property
    def kinks(self) -> list[Node]:
        """Functions, over slots, at whose zeros loads bend or jump: those of parameters alone, too."""
        motion = motion_of(self.mechanism, slot_state(self.mechanism))
        return switching_functions(map(as_node, applied_generalized_forces(motion, applied(motion))))

    @cached_property
    def _moving(self) -> dict[str, bool]:
        return {}

    def moves_with(self, name: str) -> bool:
        """Return whether the position is another one, or none, at another value of a parameter."""
        if name not in self._moving:
            self._moving[name] = self._moves_with(name)
        return self._moving[name]

    def _moves_with(self, name: str) -> bool:
        value = self.value[name]
        try:
            found = start(self.mechanism, {name: value * (1 + 2.0**-7) + 2.0**-9 * (value == 0.0)})
        except (*UNDEFINED, MultibodyError):
            return True
        return not np.allclose(found.q, self.begin.q, rtol=_SAME, atol=_SAME)

    def has_start(self, values: Mapping[str, float]) -> bool:
        """Return whether the model has a start at these values: no inertia is missing, constraints close."""
        try:
            start(self.mechanism, values)
        except (*UNDEFINED, MultibodyError):
            return False
        return True

    def motion(self, values: dict[str, float], moves: bool) -> Motion | None:
        """Return the motion at rest for values of parameters, None where they allow no such position."""
        try:
            whole = self.statics.mechanism
            if moves and not self.is_declared:
                begin = start(self.mechanism, values)
                q, parameters = begin.q, list(begin.parameters)
            else:
                declared = parameter_values(self.mechanism, values)
                q = self.declared(declared) if moves else self.begin.q
                parameters = with_constants(self.mechanism, declared, np.array(q, dtype=float))
            state = state_of(whole, float, 0.0, q, [0.0] * len(whole.speeds), parameters)
            return motion_of(whole, state)
        except (*UNDEFINED, MultibodyError):
            return None

    @cached_property
    def is_declared(self) -> bool:
        """Whether nothing but declarations says where bodies are: no constraint that a position could violate."""
        restricted = len(self.mechanism.rows) - len(measured_rows(self.mechanism))
        found = {c.name for c in self.mechanism.coordinates} & set(self.begin.assembled)
        return restricted == 0 and not found

    def declared(self, parameters: list[float]) -> tuple[float, ...]:
        """Return the coordinates as declared, with unit quaternions."""
        known = {slot("parameters", k): x for k, x in enumerate(parameters)}
        q = np.array(evaluate_float([c.initial for c in self.mechanism.coordinates], known), dtype=float)
        normalize(self.mechanism, q)
        return tuple(q.tolist())

    @cached_property
    def _known(self) -> dict[tuple[object, ...], tuple[Motion, list[RowMotion]] | None]:
        return {}

    def moved(self, values: dict[str, float], moves: bool) -> tuple[Motion, list[RowMotion]] | None:
        """Return the motion at rest for values of parameters and its rows, None where there is none; it is kept."""
        key = moves, *sorted(values.items())
        if key not in self._known:
            motion = self.motion(values, moves)
            try:
                self._known[key] = None if motion is None else (motion, row_motions(motion))
            except UNDEFINED:
                self._known[key] = None
        return self._known[key]

    def rows(self, motion: Motion, found: list[RowMotion]) -> list[RowMotion] | None:
        """Return all rows, those that are out of touch without force; None where bodies would cross each other."""
        apart = out_of_touch(self.statics, motion, found)
        if apart is None or self.inside_out(motion) is not None:
            return None
        return [_without_force(row) if k in apart else row for k, row in enumerate(found)]

    def ways(self, values: dict[str, float], moves: bool) -> tuple[Floats, Floats] | None:
        """Return the gaps (m) of all that may touch, and how far inside the ends of faces it is, for values."""
        moved = self.moved(values, moves)
        try:
            return None if moved is None else ways_of(self.statics, *moved)
        except UNDEFINED:
            return None

    @cached_property
    def sides(self) -> tuple[tuple[Marker, Flat], ...]:
        """What is on the outer side of planes as declared: each body's centre of mass whose contact is with one."""
        motion = self.motion({}, moves=False)
        pairs = with_planes(self.mechanism)
        return () if motion is None else tuple(p for p in pairs if height(motion, *p) > TOUCHING * size_of(motion))

    def inside_out(self, motion: Motion) -> str | None:
        """Return the contact where a body's centre of mass is inside of what it is declared outside of, if any."""
        inside = (com.name for com, flat in self.sides if height(motion, com, flat) < -_BEYOND * size_of(motion))
        return next(inside, None)

    def crossing(self, motion: Motion) -> str | None:
        """Return the declared contact, rope or stop at which bodies would cross each other, if any."""
        return crossed(self.statics, motion, row_motions(motion)) or self.inside_out(motion)

    def conditions(self, values: dict[str, float], limits: Sequence[RestLimit], moves: bool) -> Conditions | None:
        """Return the conditions of rest in floats for values of parameters; None where there is no such position."""
        moved = self.moved(values, moves)
        try:
            rows = None if moved is None else self.rows(*moved)
            if moved is None or rows is None:
                return None
            motion = moved[0]
            found = self.statics.balance(motion, limits, rows)
            right = found.right if self.formalism is None else self.routed(motion, found.right)
        except UNDEFINED:
            return None
        count = len(rows)
        equal, cone = (np.array(x, dtype=float).reshape(len(x), count) for x in (found.equal, found.limits))
        forces: Floats = np.array(right, dtype=float)
        finite = all(np.isfinite(x).all() for x in (equal, cone, forces))
        return Conditions(equal, forces, cone) if finite else None

    def routed(self, motion: Motion, right: list[float]) -> list[float]:
        """Return the right sides with the forces of the formalism in place of those found directly."""
        assert self.formalism is not None
        dynamics = FORMALISMS[self.formalism](self.statics.mechanism, motion.state)
        return [*(-f for f in dynamics.forcing), *right[len(dynamics.forcing) :]]


def _without_force(row: RowMotion) -> RowMotion:
    nothing = [0.0] * len(row.jacobian)
    return replace(row, jacobian=nothing, exerts=nothing)
