"""A system ready to run, with the names and units of its results.

Labels are text and numbers: a run that was recalled has them without its mechanism.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from multibody_sym.motion.integrator.flow import Pairing
from multibody_sym.motion.loop.problem import Begun, ModeNumbers, Problem, SampleTimes
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.dynamics.start.start import Start
    from multibody_sym.dynamics.start.state import StartState
    from multibody_sym.mechanics.mechanism import Mechanism
    from multibody_sym.mechanics.units import MechanismUnits
    from multibody_sym.model.system import System
    from multibody_sym.motion.loop.integrate import Leg
    from multibody_sym.motion.switching.law_mechanism import LawMechanism
    from multibody_sym.scalars.node import Node


# ----------------------------------------------------------------------------------------------------------------------
# Names and units of results, and the events to look for in a run.


class Resolved(Protocol):
    """Who has the mechanism, or makes it when it is asked for."""

    @property
    def mechanism(self) -> Mechanism: ...


class ResolvedAlone(NamedTuple):
    """A mechanism that is of no run by itself, as a mode is."""

    mechanism: Mechanism


Names = tuple[str, ...]


class RunLabels:
    """What results tell of a mechanism, each found when it is first asked for."""

    def __init__(self, resolved: Resolved) -> None:
        self._resolved = resolved

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism itself, for what is seldom told."""
        return self._resolved.mechanism

    @cached_property
    def name(self) -> str:
        """What the system is called."""
        return self.mechanism.name

    @cached_property
    def coordinates(self) -> Names:
        """The names of the coordinates."""
        return tuple(c.name for c in self.mechanism.coordinates)

    @cached_property
    def quaternions(self) -> Names:
        """The names of the coordinates that are parts of quaternions."""
        bodies = self.mechanism.bodies
        return tuple(self.coordinates[k] for body in bodies for places in body.quaternions for k in places)

    @cached_property
    def speeds(self) -> Names:
        """The names of the speeds."""
        return tuple(s.name for s in self.mechanism.speeds)

    @cached_property
    def inputs(self) -> Names:
        """The names of the inputs."""
        return tuple(self.mechanism.inputs)

    @cached_property
    def outputs(self) -> Names:
        """The outputs that a Program tells."""
        return tuple(self.mechanism.outputs)

    @cached_property
    def run_outputs(self) -> Names:
        """The outputs that add up along a run."""
        return tuple(self.mechanism.run_outputs)

    @cached_property
    def untold(self) -> Names:
        """The outputs that cannot be told."""
        return self.mechanism.untold

    @cached_property
    def rows(self) -> Names:
        """The names of the constraint rows."""
        return tuple(row.name for row in self.mechanism.rows)

    @cached_property
    def doubles(self) -> dict[str, int]:
        """The joints whose coordinates massless doubles keep, with their speeds."""
        return self.mechanism.doubles

    @cached_property
    def stops(self) -> Names:
        """What ends a run, in the order of its switching functions."""
        return (*self.mechanism.stops, *self.mechanism.state_stops)

    @cached_property
    def ropes(self) -> Names:
        """The rows of ropes that have one tension."""
        runs = (row.rope_run for row in self.mechanism.rows)
        return tuple(run.name for run in runs if run is not None and not run.rubs)

    @cached_property
    def drives(self) -> Names:
        """The joints (and ground) that move as prescribed."""
        return self.mechanism.drives

    @cached_property
    def working(self) -> Names:
        """The loads and rows that may change the total energy."""
        from multibody_sym.mechanics.energy import working_names

        return working_names(self.mechanism)

    @cached_property
    def driven(self) -> bool:
        """Whether loads or rows may raise the total energy."""
        from multibody_sym.mechanics.energy import driving_names

        return bool(driving_names(self.mechanism))

    @cached_property
    def moved_by_time(self) -> bool:
        """Whether time, or an input, moves what does work."""
        from multibody_sym.mechanics.energy import moved_by_time

        return moved_by_time(self.mechanism)

    @cached_property
    def state_units(self) -> dict[str, str]:
        """The SI unit of each coordinate and speed, measured ones too; empty where none is known."""
        return self._units.state

    @cached_property
    def input_units(self) -> dict[str, str]:
        """The SI unit of each input; empty where none is known."""
        return self._units.inputs

    @cached_property
    def output_units(self) -> dict[str, str]:
        """The SI unit of each output; empty where none is known."""
        return self._units.outputs

    @cached_property
    def _units(self) -> MechanismUnits:
        from multibody_sym.mechanics.units import MechanismUnits

        return MechanismUnits(self.mechanism)

    @cached_property
    def withheld(self) -> dict[str, Names]:
        """Components of joints' reactions that are not determined."""
        return {name: each.components for name, each in self.mechanism.withheld.items()}

    @cached_property
    def withheld_reasons(self) -> Names:
        """Why they are not, and what to declare instead."""
        if not self.mechanism.withheld:
            return ()
        from multibody_sym.mechanics.gears import reasons

        return tuple(reasons(self.mechanism.withheld))

    @cached_property
    def limited(self) -> bool:
        """Whether a joint has limits."""
        return bool(self.mechanism.limits)

    @cached_property
    def rolls(self) -> bool:
        """Whether a wheel rolls that nothing but its weight keeps down."""
        from multibody_sym.mechanics.mechanism import normal_forces

        return bool(normal_forces(self.mechanism))

    @cached_property
    def one_way(self) -> bool:
        """Whether something holds one way only."""
        return bool(self.mechanism.one_way)

    @cached_property
    def boxes(self) -> bool:
        """Whether two boxes in space touch, of which edges may pass into each other."""
        from multibody_sym.mechanics.law_elements import boxes_that_touch

        return bool(boxes_that_touch(self.mechanism.one_way))

    @cached_property
    def works_unseen(self) -> bool:
        """Whether something does work that no load tells."""
        from multibody_sym.mechanics.energy import works_unseen

        return works_unseen(self.mechanism)

    @cached_property
    def loses_mass(self) -> bool:
        """Whether the mass of a body varies."""
        from multibody_sym.mechanics.forces import varies

        return any(map(varies, self.mechanism.bodies))


ALL: Final = tuple(x for x, part in vars(RunLabels).items() if isinstance(part, cached_property) and x[0] != "_")
"""The names of all labels."""


def as_json(told: RunLabels) -> dict[str, Any]:
    """Return all of it as JSON values."""
    return {name: getattr(told, name) for name in ALL}


class _Recalled(RunLabels):
    """The labels of an earlier run; their mechanism is made on first use."""

    def __init__(self, resolved: Resolved, known: Mapping[str, Any]) -> None:
        super().__init__(resolved)
        vars(self).update(known)


def labels_from_json(values: Any, resolved: Resolved) -> RunLabels:
    """Return what `as_json` wrote; raises KeyError or TypeError for anything else."""
    if set(values) != set(ALL):
        raise KeyError("no labels of a mechanism")
    return _Recalled(resolved, {name: freeze(values[name]) for name in ALL})


def freeze(value: Any) -> Any:
    """Return a value as it was before it was JSON, which has no tuples."""
    if isinstance(value, list):
        return tuple(map(freeze, value))
    return {name: freeze(x) for name, x in value.items()} if isinstance(value, dict) else value


# ----------------------------------------------------------------------------------------------------------------------
# A system ready to run.


class Numbers(NamedTuple):
    """The numbers of a start: the parameter vector (np,), coordinates (nq,), speeds (nu,) at t = 0; of many, rows."""

    parameters: Floats
    q0: Floats
    u0: Floats

    def of(self, which: int | list[int]) -> Numbers:
        """Return the numbers of one start among many, or of some."""
        return Numbers(self.parameters[which], self.q0[which], self.u0[which])


@dataclass(frozen=True, eq=False)
class PreparedSystem:
    """A mechanism in its mode at the start, with compiled Programs and the numbers that it starts with.

    `begin` tells its system and how it starts. Runs that differ in numbers alone share one mechanism, whose own numbers
    are those of the first, as are names and units. With `laws` the Programs serve all modes. Of a run that is
    recalled `begin` makes all that anew; `known` is
    what results tell of it.
    """

    formalism: str
    compiled: Compiled
    numbers: Numbers
    begin: Callable[[], tuple[System, StartState]]
    shared: RunLabels | None = None
    known: Mapping[str, Any] | None = None
    laws: LawMechanism | None = None

    @cached_property
    def mechanism(self) -> Mechanism:
        """The mechanism in its mode at the start."""
        return self.state.mechanism if self.shared is None else self.shared.mechanism

    @property
    def told(self) -> RunLabels:
        """Names and units of results."""
        return self._told if self.shared is None else self.shared

    @cached_property
    def _told(self) -> RunLabels:
        return RunLabels(self) if self.known is None else labels_from_json(self.known["told"], self)

    @cached_property
    def begun_from(self) -> Mapping[str, Any]:
        """`held`, `assembled` and `shifts` of the `Start`."""
        if self.known is not None:
            return dict(self.known["start"])
        return {name: getattr(self.start, name) for name in ("held", "assembled", "shifts")}

    @cached_property
    def wheels(self) -> Mapping[str, float]:
        """The least radius (m) of each row by which a wheel rolls that nothing but weight keeps down, zero without."""
        if self.known is not None:
            return dict(self.known["wheels"])
        from multibody_sym.mechanics.mechanism import normal_forces  # which few runs need
        from multibody_sym.scalars.functions import evaluate_float
        from multibody_sym.scalars.node import slot

        values = {slot("parameters", k): x for k, x in enumerate(self.parameters.tolist())}
        rows = normal_forces(self.mechanism).items()
        return {name: min(evaluate_float(row.radii, values), default=0.0) for name, row in rows}

    @property
    def shifts(self) -> Mapping[str, float]:
        """The changes of given start values."""
        shifts: Mapping[str, float] = self.begun_from["shifts"]
        return shifts

    @cached_property
    def _begun(self) -> tuple[System, StartState]:
        return self.begin()

    @property
    def system(self) -> System:
        """The system as it was asked to run."""
        return self._begun[0]

    @property
    def state(self) -> StartState:
        """How it starts."""
        return self._begun[1]

    @property
    def start(self) -> Start:
        """The start of the mechanism in its mode."""
        return self.state.start

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.numbers.parameters

    @property
    def q0(self) -> Floats:
        """The coordinates (nq,) at t = 0."""
        return self.numbers.q0

    @property
    def u0(self) -> Floats:
        """The speeds (nu,) at t = 0."""
        return self.numbers.u0

    def stabilised_by(self, alpha: float, beta: float) -> Floats:
        """Return the parameter vector (np,) with Baumgarte's coefficients (1/s)."""
        from multibody_sym.mechanics.mechanism import ALPHA, BETA

        return np.array(self.mechanism.parameters.changed(self.start.parameters, {ALPHA: alpha, BETA: beta}))

    @property
    def parameter_values(self) -> dict[Node, float]:
        """The value of each parameter's symbol; numbers that the model writes have none."""
        from multibody_sym.mechanics.mechanism import Source
        from multibody_sym.scalars.node import symbol

        entries = zip(self.mechanism.parameters, self.parameters.tolist(), strict=True)
        return {symbol(entry.name): value for entry, value in entries if entry.source is not Source.LITERAL}


# ----------------------------------------------------------------------------------------------------------------------
# Problems as JSON values, but for what is compiled, and for what the run itself adds.


_PLAIN: Final = (
    *("t0", "t_end", "step", "rtol", "atol", "project", "max_steps", "contradiction", "closure"),
    *("independent", "whole", "crosses"),
)
_ARRAYS: Final = ("q0", "u0", "parameters")
_TUPLES: Final = ("terminal", "margins", "limiting", "moments")
TOLD: Final = frozenset({*_PLAIN, *_ARRAYS, *_TUPLES, "method", "mode", "samples", "pairs", "begun"})
"""The fields of a problem that are among its values."""


def values_of(problem: Problem) -> dict[str, Any]:
    """Return a problem as JSON values; `compiled`, `jump` and `course` are left out."""
    pairs, begun, samples = problem.pairs, problem.begun, problem.samples
    return {
        **{name: getattr(problem, name) for name in _PLAIN},
        **{name: getattr(problem, name).tolist() for name in _ARRAYS},
        **{name: list(getattr(problem, name)) for name in _TUPLES},
        "method": problem.method.name,
        "mode": problem.modes.tolist(),
        "samples": samples if isinstance(samples, int) else [samples.times, samples.start, samples.end],
        "pairs": None if pairs is None else [pairs.nq, pairs.plain, pairs.balls],
        "begun": None if begun is None else [begun.time, begun.written],
    }


def problem_of(values: Mapping[str, Any], compiled: Compiled) -> Problem:
    """Return the problem of `values_of`. Raises KeyError, TypeError or ValueError for anything else."""
    pairs, begun, samples = values["pairs"], values["begun"], values["samples"]
    given: dict[str, Any] = {name: values[name] for name in _PLAIN}
    given |= {name: np.array(values[name], dtype=float) for name in _ARRAYS}
    given |= {name: tuple(values[name]) for name in _TUPLES}
    given["mode"] = ModeNumbers.of(np.array(values["mode"], dtype=float), {})
    given["pairs"] = None
    if pairs is not None:
        given["pairs"] = Pairing(pairs[0], *(tuple((a, b) for a, b in part) for part in pairs[1:]))
    given["begun"] = None if begun is None else Begun(*begun)
    given["samples"] = samples if isinstance(samples, int) else SampleTimes(tuple(samples[0]), *samples[1:])
    return Problem(compiled=compiled, method=METHODS[values["method"]], **given)


# ----------------------------------------------------------------------------------------------------------------------
# Samples of one mechanism: what its Programs say at each. A run in modes has several such parts.


@dataclass(frozen=True, eq=False)
class LegSamples:
    """Samples at times t (m,), with q (m, nq) and u (m, nu), of the mechanism that is `told`, by its `parameters`.

    These are (np,), or (m, np) where inputs are held that change.

    `modes` (nm,) are the numbers of the mode that they are in.
    """

    told: RunLabels
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


def leg_samples(
    legs: Iterable[tuple[Leg, RunLabels]], samples: tuple[Floats, Floats, Floats], first: int
) -> tuple[LegSamples, ...]:
    """Return samples t, q, u, which begin with number `first` of a run, by the legs they are in.

    Those of legs that differ in what is held alone are together, with parameters (m, np).
    """
    found: list[list[LegSamples]] = []
    before: Leg | None = None
    for leg, told in legs:
        t, q, u = (each[max(leg.first - first, 0) : max(leg.end - first, 0)] for each in samples)
        if not len(t) and found:
            continue
        part = LegSamples(told, leg.of.compiled, leg.of.parameters, t, q, u, leg.of.modes)
        if before is not None and before.of.whole and before.of.is_like(leg.of):
            found[-1].append(part)
        else:
            found.append([part])
        before = leg
    for k, parts in enumerate(found):
        if len(parts) > 1:
            parameters = np.repeat([part.parameters for part in parts], [len(part.t) for part in parts], axis=0)
            t, q, u = (np.concatenate([getattr(part, name) for part in parts]) for name in "tqu")
            found[k] = [replace(parts[0], parameters=parameters, t=t, q=q, u=u)]
    return tuple(part for (part,) in found)


def asked_parts(parts: Sequence[LegSamples], asked: slice) -> Sequence[LegSamples]:
    """Return parts of a run with those samples that were asked for: all but the first or the last one, perhaps."""
    if not parts or asked == slice(0, sum(len(part.t) for part in parts)):
        return parts
    begun, found = 0, list[LegSamples]()
    for part in parts:
        own = slice(max(asked.start - begun, 0), max(asked.stop - begun, 0))
        begun += len(part.t)
        held = part.parameters if part.parameters.ndim == 1 else part.parameters[own]
        cut = replace(part, parameters=held, t=part.t[own], q=part.q[own], u=part.u[own])
        if len(cut.t) or (part is parts[-1] and not found):
            found.append(cut)
    return found


def reaction_program(mechanism: Mechanism, code: Native) -> Compiled:
    """Return `reactions`: (t, q, u, parameters, inputs, modes, udot (nu), multipliers (ns)) -> values (joints, 6).

    The joints are those of the tree, then the cut ones (`Mechanism.joint_names`).
    """
    from multibody_sym.dynamics.programs.reactions import reactions  # which few runs are asked for
    from multibody_sym.mechanics.motion import arrays, motion_of, slot_state
    from multibody_sym.mechanics.row_kinematics import row_motions
    from multibody_sym.program.statements import Array
    from multibody_sym.program.trace import Trace
    from multibody_sym.text.printer import COMPONENTS

    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    trace = Trace("reactions", (*arrays(mechanism), *unknown))
    motion = motion_of(mechanism, slot_state(mechanism))
    found = reactions(motion, trace["udot"], row_motions(motion), trace["multipliers"])
    names = mechanism.joint_names
    values = [found[name][component] for name in names for component in COMPONENTS]
    program = trace.finish({"values": ((len(names), len(COMPONENTS)), values)})
    return load({"reactions": program}, code)
