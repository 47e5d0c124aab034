"""Samples of a motion: times, coordinates and speeds, and everything that follows from them at those times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

import numpy as np

from multibody_sym.errors import InputError, ModelError
from multibody_sym.model.argument_checks import door
from multibody_sym.motion.loop.integrate import Integration
from multibody_sym.motion.loop.problem import Holds, Loop, Problem, RunFailure
from multibody_sym.motion.prepare.records import LegSamples, PreparedSystem, RunLabels, asked_parts
from multibody_sym.records import ByName, dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.values import Units, chosen_units

if TYPE_CHECKING:
    from multibody_sym.motion.loop.integrate import Leg, LegAnswer
    from multibody_sym.motion.results.integrals import FineLeg, ImpactBalance
    from multibody_sym.motion.switching.legs import ModeLeg
    from multibody_sym.scalars.node import Node
    from multibody_sym.text.tables import Table

NO_VALUE: Final = "no value"
PULLING: Final = "wheel would pull"
PUSHING: Final = "rope would push"
ENERGY: Final = "energy grows"
TOO_FAR: Final = "too far for its steps"
EDGES_CROSS: Final = "edges cross"
STAGE: Final = "stage"
"""Kinds of events: states that no real mechanism has, or that have no number."""

# ----------------------------------------------------------------------------------------------------------------------
# What a run begins with, and how one that goes from mode to mode is taken: under way, or recalled.


@dataclass
class FrictionWork:
    """The work of one friction part in J: on all bodies together, negative, and on each that it acts on, by name.

    Of friction in a joint only the first is known: its force is the joint's own.
    """

    total: float = 0.0
    bodies: dict[str, float] = field(default_factory=dict)


@dataclass
class EnergyAccount:
    """The work of each friction part by name, and that of the loads that the potential energy does not hold, in J."""

    friction: dict[str, FrictionWork]
    loads: float = 0.0


class RunInModes(Protocol):
    """A run from mode to mode: its `loop`, which adds to `legs`, and what there is to tell of it afterwards.

    See `ModeRun` of `motion.switching.mode_run`.
    """

    @property
    def legs(self) -> Sequence[ModeLeg]: ...

    @property
    def events(self) -> list[dict[str, Any]]: ...

    @property
    def account(self) -> EnergyAccount: ...

    @property
    def lost(self) -> Mapping[str, float]: ...

    @property
    def lost_at_start(self) -> float: ...

    @property
    def stabilised(self) -> tuple[float, float] | None: ...

    @property
    def project(self) -> bool: ...

    @property
    def jumps(self) -> Sequence[LegAnswer]: ...

    @property
    def loop(self) -> Loop: ...

    @property
    def along(self) -> list[FineLeg]: ...

    @property
    def passed(self) -> Iterable[ImpactBalance]: ...

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]: ...

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]: ...

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str: ...


class RunStart(NamedTuple):
    """The start of a run: the prepared system, the problem, its modes, the events of an impact before it.

    `holds`: the inputs of a run without modes that are held from time to time.
    """

    ready: PreparedSystem
    problem: Problem
    modes: RunInModes | None = None
    events: tuple[Mapping[str, Any], ...] = ()
    hints: tuple[str, ...] = ()
    holds: Holds | None = None


class Departed(Exception):  # noqa: N818
    """A replayed run has not come to the state that was cached; `begin` makes it from its model."""

    def __init__(self, begin: Callable[[], RunStart]) -> None:
        super().__init__()
        self.begin = begin


# ----------------------------------------------------------------------------------------------------------------------
# Records of runs, which samples and trajectories read.


class Sampled(Protocol):
    """Times t (m,), coordinates q (m, nq) and speeds u (m, nu) of a system that is `ready`, with `parameters` (np,).

    A run in modes has `parts`, each with Programs of its own.
    """

    @property
    def ready(self) -> PreparedSystem: ...
    @property
    def told(self) -> RunLabels: ...
    @property
    def parameters(self) -> Floats: ...
    @property
    def t(self) -> Floats: ...
    @property
    def q(self) -> Floats: ...
    @property
    def u(self) -> Floats: ...
    @property
    def parts(self) -> Sequence[LegSamples]: ...


class RunRecord(Sampled, Protocol):
    """A run: the `problem` and its `integration`, the `modes` it went through, events of the impact it goes on from.

    Of its samples those were `asked` for. Without modes it has `legs` where its inputs are held from time to time.
    """

    @property
    def problem(self) -> Problem: ...
    @property
    def integration(self) -> Integration: ...
    @property
    def failure(self) -> RunFailure | None: ...
    @property
    def modes(self) -> RunInModes | None: ...
    @property
    def begun(self) -> tuple[Mapping[str, Any], ...]: ...
    @property
    def asked(self) -> slice: ...
    @property
    def legs(self) -> Sequence[Leg]: ...


class NewSamples(NamedTuple):
    """Samples of a run that goes on."""

    ready: PreparedSystem
    parameters: Floats
    t: Floats
    q: Floats
    u: Floats
    parts: Sequence[LegSamples]

    @property
    def told(self) -> RunLabels:
        """Names and units."""
        return self.ready.told


class SingleRun(NamedTuple):
    """A run that was not made with others."""

    ready: PreparedSystem
    problem: Problem
    integration: Integration
    parts: Sequence[LegSamples] = ()
    modes: RunInModes | None = None
    begun: tuple[Mapping[str, Any], ...] = ()
    legs: Sequence[Leg] = ()

    @property
    def told(self) -> RunLabels:
        """Names and units."""
        return self.ready.told

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.problem.parameters

    @property
    def t(self) -> Floats:
        """The times of samples (m,)."""
        return self.integration.t

    @property
    def q(self) -> Floats:
        """Coordinates (m, nq)."""
        return self.integration.q

    @property
    def u(self) -> Floats:
        """Speeds (m, nu)."""
        return self.integration.u

    @property
    def failure(self) -> RunFailure | None:
        """Why it ended early, if it did."""
        return self.integration.failure

    @property
    def asked(self) -> slice:
        """Which of its samples were asked for."""
        return self.problem.asked(0, self.t)


# ----------------------------------------------------------------------------------------------------------------------
# Samples of a motion: times, coordinates and speeds, and everything that follows from them at those times.


@dataclass(frozen=True, eq=False, repr=False)
class Samples(ByName):
    """A motion at times t (m,): coordinates q (m, nq) and speeds u (m, nu) of a system, as they were `made`.

    `samples["theta"]` is a coordinate, a speed, an input or a declared output by name, (m,).
    """

    _made: Sampled

    def __repr__(self) -> str:
        times = f"t = {self.t[0]:g} to {self.t[-1]:g} s" if len(self) > 1 else "".join(f"t = {t:g} s" for t in self.t)
        return f"<Motion of {self._told.name}: {times}>"

    def __len__(self) -> int:
        return len(self.t)

    @property
    def ready(self) -> PreparedSystem:
        """The system, ready to run."""
        return self._made.ready

    @property
    def _told(self) -> RunLabels:
        return self._made.told

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self._made.parameters

    @property
    def _asked(self) -> slice:
        """Which of the samples that were made were asked for."""
        return slice(0, len(self._made.t))

    @property
    def t(self) -> Floats:
        """The times (m,) in s."""
        return self._made.t[self._asked]

    @property
    def q(self) -> Floats:
        """The coordinates (m, nq)."""
        return self._made.q[self._asked]

    @property
    def u(self) -> Floats:
        """The speeds (m, nu)."""
        return self._made.u[self._asked]

    @cached_property
    def units(self) -> Mapping[str, str]:
        """The SI unit of each coordinate, speed and input, measured coordinates too; empty where none is known."""
        return {**self._told.input_units, **self._told.state_units}

    @cached_property
    def output_units(self) -> Mapping[str, str]:
        """The SI unit of each output; empty where none is known, as of what hangs on parameters without units."""
        return self._told.output_units

    def __getitem__(self, name: str) -> Floats:
        """Return a coordinate, speed, output or input (m,) by name, in SI units. Raises InputError for another name."""
        if not isinstance(name, str):
            raise InputError(f"a run is asked by name, such as run['theta'] (its times are run.t), not by {name!r}")
        for kind in ("coordinates", "speeds", "outputs", "inputs"):  # one after the other: the first two take no code
            columns: Mapping[str, Floats] = getattr(self, kind)
            if name in columns:
                return columns[name]
        raise InputError(f"nothing in this run is called {name!r}", number="M106", word=name, known=self._names())

    def keys(self) -> tuple[str, ...]:
        """Return the names that `samples[name]` knows: coordinates, speeds, outputs and inputs."""
        return tuple(dict.fromkeys(self._names()))

    def _names(self) -> list[str]:
        told = self._told
        return [*told.coordinates, *told.speeds, *told.outputs, *told.run_outputs, *told.inputs]

    @property
    def changes(self) -> list[dict[str, Any]]:
        """What began to stick, slide, open or close in a run; samples alone tell of none."""
        return []

    @cached_property
    def coordinates(self) -> Mapping[str, Floats]:
        """Each coordinate (m,) by name."""
        return dict(zip(self._told.coordinates, self.q.T, strict=True))

    @cached_property
    def speeds(self) -> Mapping[str, Floats]:
        """Each speed (m,) by name."""
        return dict(zip(self._told.speeds, self.u.T, strict=True))

    @cached_property
    def inputs(self) -> Mapping[str, Floats]:
        """Each input (m,) by name."""
        return dict(zip(self._told.inputs, self._of_all(lambda part: part.arguments[4]).T, strict=True))

    @cached_property
    def outputs(self) -> Mapping[str, Floats]:
        """Each declared output (m,) by name; nan where it hangs on a reaction that is withheld.

        Work and impulses are those since the start of the run; samples that are reported meanwhile have nan.
        """
        told = self._told.outputs
        columns = dict(zip(told, self._evaluated("outputs")[0].T, strict=True)) if told else {}
        untold = {name: np.full(len(self.t), np.nan) for name in self._told.untold}
        return {**columns, **untold, **self._run_outputs()}

    def _run_outputs(self) -> dict[str, Floats]:
        """Return the outputs that add up along a run (m,): samples alone do not tell them."""
        return {name: np.full(len(self.t), np.nan) for name in self._told.run_outputs}

    @cached_property
    def _energies(self) -> tuple[Floats, ...]:
        return self._evaluated("energy")

    @cached_property
    def kinetic_energy(self) -> Floats:
        """T (m,) in J."""
        return self._energies[0]

    @cached_property
    def potential_energy(self) -> Floats:
        """V (m,) in J: of weights and springs."""
        return self._energies[1]

    @cached_property
    def energy(self) -> Floats:
        """T + V (m,) in J."""
        return self.kinetic_energy + self.potential_energy

    @cached_property
    def accelerations(self) -> Mapping[str, Floats]:
        """The rate of each speed (m,), by the speed's name."""
        return dict(zip(self._told.speeds, self._of_all(lambda part: part.derivative[1]).T, strict=True))

    @cached_property
    def multipliers(self) -> Mapping[str, Floats]:
        """The multiplier of each constraint (m,) by name: a rope's or rod's tension; zero where it does not hold."""
        names = dict.fromkeys(name for part in self._parts for name in part.told.rows)
        return {name: self._of_all(partial(LegSamples.multiplier, name=name)) for name in names}

    @cached_property
    def reactions(self) -> Mapping[str, Mapping[str, Floats]]:
        """What each joint exerts on its child: fx, fy, fz, mx, my, mz (m,), by the joint's name.

        About the joint's point on the child, in the axes of the joint's frame on the parent; components along free
        directions are those of motors and springs in the joint. What is `withheld` is nan.
        """
        from multibody_sym.text.printer import COMPONENTS

        values = self._of_all(lambda part: part.reactions)
        names = self.ready.mechanism.joint_names
        for joint, components in self.withheld.items():
            values[:, names.index(joint), [COMPONENTS.index(c) for c in components]] = np.nan
        return {name: dict(zip(COMPONENTS, values[:, k].T, strict=True)) for k, name in enumerate(names)}

    @property
    def withheld(self) -> Mapping[str, tuple[str, ...]]:
        """Components of joints' reactions that are not determined: constraints do not say where their forces act."""
        return self._told.withheld

    @property
    def withheld_reasons(self) -> list[str]:
        """Why reactions are withheld, and what to declare instead."""
        return list(self._told.withheld_reasons)

    @door
    def table(self, units: str | Sequence[str] | Units | None = None) -> Table:
        """Return time, coordinates, speeds and outputs as columns, with the units that are known.

        They are SI but for those chosen, such as `units="mm,deg"`. Raises InputError for what is no unit.
        """
        from multibody_sym.text.tables import Table, in_units

        columns = {"t": self.t, **self.coordinates, **self.speeds}
        known = {name: self.units[name] for name in columns if name != "t"}
        for name, values in self.outputs.items():
            column = f"output {name}" if name in columns else name
            columns[column], known[column] = values, self.output_units[name]
        known = {"t": "s", **{name: unit for name, unit in known.items() if unit}}
        try:
            return in_units(Table(columns, known, self._about), chosen_units(units))
        except ValueError as problem:
            raise ModelError(f"the outputs cannot be columns of a table: {problem}") from None

    @door
    def to_numpy(self, units: str | Sequence[str] | Units | None = None) -> Floats:
        """Return the columns of `table` (m, columns): t, coordinates, speeds, outputs. Raises InputError."""
        return self.table(units).to_numpy()

    @door
    def to_dataframe(self, units: str | Sequence[str] | Units | None = None) -> Any:
        """Return the columns of `table` as a pandas DataFrame over t, units in its `attrs`.

        Raises InputError for what is no unit, OutputError where pandas is missing.
        """
        return self.table(units).to_dataframe()

    @door
    def to_xarray(self, units: str | Sequence[str] | Units | None = None) -> Any:
        """Return the columns of `table` as an xarray Dataset over t, each with its unit.

        Raises InputError for what is no unit, OutputError where xarray is missing.
        """
        return self.table(units).to_xarray()

    @property
    def _about(self) -> dict[str, str]:
        return {"system": self._told.name, "formalism": self.ready.formalism}

    # --- evaluated over all samples -------------------------------------------------------------------------------

    @cached_property
    def _parts(self) -> Sequence[LegSamples]:
        own = self._told, self.ready.compiled, self.parameters
        return asked_parts(self._made.parts, self._asked) or (LegSamples(*own, self.t, self.q, self.u),)

    def _of_all(self, of_part: Callable[[LegSamples], Floats]) -> Floats:
        """Return what the parts have, one after the other."""
        return _concatenate([of_part(part) for part in self._parts])

    @cached_property
    def tensions(self) -> Mapping[str, Floats]:
        """The tension of each rope (m,) by name; negative where it would have to push.

        Of a rope that rubs on a wheel there are two, which are asked as outputs.
        """
        ropes = dict.fromkeys(name for part in self._parts for name in part.told.ropes)
        return {name: self.multipliers[name] for name in ropes}

    def _evaluated(self, name: str) -> tuple[Floats, ...]:
        return tuple(map(_concatenate, zip(*(part.evaluated(name) for part in self._parts), strict=True)))


def last_part(samples: Samples) -> LegSamples:
    """Return the last part of a motion: the mechanism in the mode in which it ends."""
    return samples._parts[-1]


def _concatenate(values: Sequence[Floats]) -> Floats:
    """Return arrays one after the other; one alone is not copied."""
    return values[0] if len(values) == 1 else np.concatenate(values)
