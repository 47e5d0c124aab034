"""Samples of one mechanism: what its Programs say at each. A run in modes has several such parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.runs.told import Told

if TYPE_CHECKING:
    from multibody_sym.model.mechanism.mechanism import Mechanism
    from multibody_sym.runtime.chain import Leg


@dataclass(frozen=True, eq=False)
class Part:
    """Samples at times t (m,), with q (m, nq) and u (m, nu), of the mechanism that is `told`, by `parameters` (np,).

    `modes` (nm,) are the numbers of the mode that they are in.
    """

    told: Told
    compiled: Compiled
    parameters: Floats
    t: Floats
    q: Floats
    u: Floats
    modes: Floats = field(default_factory=lambda: np.zeros(0))

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism itself."""
        return self.told.mechanism

    @cached_property
    def arguments(self) -> tuple[Floats, ...]:
        """What every Program takes: t, q, u, parameters, inputs, modes."""
        given = (self.t, self.q, self.u, self.parameters)
        shape = len(self.t), len(self.told.inputs)
        if 0 in shape:
            return (*given, np.empty(shape), self.modes)
        (inputs,) = self.compiled.map("inputs", *given)
        return (*given, inputs, self.modes)

    def evaluated(self, program: str) -> tuple[Floats, ...]:
        """Return what a Program says at each sample."""
        return self.compiled.map(program, *self.arguments)

    @cached_property
    def derivative(self) -> tuple[Floats, ...]:
        """Rates of coordinates and speeds, multipliers and the solve's report."""
        return self.evaluated("state_derivative")

    @cached_property
    def multipliers(self) -> Mapping[str, Floats]:
        """The multiplier of each row by name (m,)."""
        return dict(zip(self.told.rows, self.derivative[2].T, strict=True))

    def multiplier(self, name: str) -> Floats:
        """Return the multiplier of a row (m,); zero where the mechanism has no such row."""
        known = self.multipliers
        return known[name] if name in known else np.zeros(len(self.t))

    @cached_property
    def reactions(self) -> Floats:
        """What each joint exerts on its child (m, joints, 6)."""
        program = reaction_program(self.mechanism, self.compiled.likewise)
        (values,) = program.map("reactions", *self.arguments, self.derivative[1], self.derivative[2])
        return values


def parts_of(
    legs: Iterable[tuple[Leg, Told]], samples: tuple[Floats, Floats, Floats], first: int
) -> tuple[Part, ...]:
    """Return samples t, q, u, which begin with number `first` of a run, by the legs they are in."""
    found: list[Part] = []
    for leg, told in legs:
        t, q, u = (each[max(leg.first - first, 0) : max(leg.end - first, 0)] for each in samples)
        if len(t) or not found:
            found.append(Part(told, leg.of.compiled, leg.of.parameters, t, q, u, leg.of.modes))
    return tuple(found)


def reaction_program(mechanism: Mechanism, backend: Backend | None) -> Compiled:
    """Return `reactions`: (t, q, u, parameters, inputs, modes, udot (nu), multipliers (ns)) -> values (joints, 6).

    The joints are those of the tree, then the cut ones (`Mechanism.joint_names`).
    """
    from multibody_sym.dynamics.programs.reactions import reactions  # which few runs are asked for
    from multibody_sym.expressions.components import COMPONENTS
    from multibody_sym.kinematics.motion import motion_of
    from multibody_sym.kinematics.rows import row_motions
    from multibody_sym.kinematics.state import arrays, slot_state
    from multibody_sym.program.statements import Array
    from multibody_sym.program.trace import Trace

    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    trace = Trace("reactions", (*arrays(mechanism), *unknown))
    motion = motion_of(mechanism, slot_state(mechanism))
    found = reactions(motion, trace["udot"], row_motions(motion), trace["multipliers"])
    names = mechanism.joint_names
    values = [found[name][component] for name in names for component in COMPONENTS]
    program = trace.finish({"values": ((len(names), len(COMPONENTS)), values)})
    return load({"reactions": program}, backend=backend)
