"""Trajectory: a run's samples with its end, its drift, its cost, and the unphysical states among them."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multibody_sym.dynamics.left_over import Redundancy
from multibody_sym.model.argument_checks import door, flag
from multibody_sym.motion.loop.integrate import Integration
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.prepare.records import freeze
from multibody_sym.motion.results.samples import (
    EDGES_CROSS,
    ENERGY,
    NO_VALUE,
    PULLING,
    PUSHING,
    TOO_FAR,
    NewSamples,
    RunRecord,
    Samples,
)
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.motion.loop.integrate import EndChanges
    from multibody_sym.motion.prepare.records import LegSamples
    from multibody_sym.motion.results.integrals import FineLeg, Miss
    from multibody_sym.motion.results.samples import FrictionWork, RunInModes
    from multibody_sym.text.values import Units

@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(Samples):
    """The motion of a system: its samples, `problem` as it was integrated, `integration` as it ended.

    `run["theta"]`, `run.energy`, `run.reactions["hinge"]["fx"]`; see `Samples`. `run(0.25)["theta"]` is between them.
    """

    _made: RunRecord

    @property
    def problem(self) -> Problem:
        """What was integrated."""
        return self._made.problem

    @property
    def integration(self) -> Integration:
        """How that ended."""
        return self._made.integration

    @property
    def modes(self) -> RunInModes | None:
        """The modes through which it went, if something holds one way only."""
        return self._made.modes

    @property
    def begun(self) -> tuple[Mapping[str, Any], ...]:
        """The events of the impact from which it goes on."""
        return self._made.begun

    def __repr__(self) -> str:
        return f"<Trajectory of {self._told.name}: {len(self)} samples to t = {self.t_final:g} s>"

    @property
    def _asked(self) -> slice:
        """Which samples of the run were asked for: of own times perhaps neither the start nor the end."""
        return self._made.asked

    @cached_property
    def whole(self) -> Trajectory:
        """The run with samples at both its ends, which are not among those at times of one's own unless asked for."""
        return self if self._asked == slice(0, len(self._made.t)) else _WholeTrajectory(self._made)

    @door
    def __call__(self, t: ArrayLike, *, before: bool = False) -> Samples:
        """Return the motion at a time or at times (m,) in s, increasing, as `Samples`: `run(0.25)["theta"]` is (1,).

        Between its steps the method's continuous extension tells the state, to the order that the table of methods
        lists, a cubic (order 3) where it lists none of its own. At an event it is the state after it, or the one
        `before` it. Each call integrates the legs of the run once more: ask for many times at once.
        Raises InputError for times outside of the run, or that do not increase.
        """
        from multibody_sym.motion.results.integrals import motion_at  # which few runs are asked for

        parts = motion_at(self.stretches, self.t_final, t, before=flag("before", before))
        t, q, u = (np.concatenate([getattr(part, name) for part in parts]) for name in "tqu")
        whole = self.modes is None and not self._made.legs
        return _Between(NewSamples(self.ready, self.parameters, t, q, u, () if whole else parts), self)

    @property
    def t_final(self) -> float:
        """The time that the run reached."""
        return self.integration.t_final

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C ended the run."""
        failure = self._made.failure
        return failure is not None and failure.status is Status.INTERRUPTED

    @property
    def stop(self) -> dict[str, Any] | None:
        """The condition that ended the run, by name, and when; None for a run that reached `t_end`, or failed."""
        met = [event for event in self.integration.events if event.terminal]
        return {"t": met[0].time, "kind": "stop", "element": self._told.stops[met[0].index]} if met else None

    @property
    def events(self) -> list[dict[str, Any]]:
        """What happened on the way, in the order of time.

        What struck in an impact before it; the stop that ended the run; singular positions, in which rows depend on
        each other, that it passed; and the first sample at which a joint is beyond one of its limits, a rope would push
        (a real one goes slack there), a plane would pull at a rolling wheel (a real one lifts off), edges of boxes pass
        into each other, an output has no value, energy came from nowhere, or a coordinate is so large that floats
        around it are further apart than a step leads.
        """
        whole = self.whole
        found: list[dict[str, Any]] = [dict(event) for event in self.begun]
        found += whole._limits_passed
        found += [] if self.stop is None else [self.stop]
        found += [{"t": t, "kind": "singular position", "element": "constraints"} for t in self.integration.singular]
        found += [*pushing_ropes(whole), *outputs_without_value(whole)]
        found += [event for event in pulling_wheels(whole) if event["element"] not in self.redundancy.not_unique]
        found += [*whole._crossed_boxes, *self.changes]
        problem = self.problem  # of which fixed steps are not asked how exact they are
        accuracy = math.sqrt(_ROUNDING) if problem.step else max(_ROUNDING, problem.rtol, problem.atol)
        found += growing_energy(whole, accuracy)
        pairs = problem.pairs.plain if problem.pairs else ()
        found += coordinates_too_far(whole, pairs, self.integration.statistics.mean_step, accuracy)
        return sorted(found, key=lambda event: float(event["t"]))

    @property
    def _limits_passed(self) -> list[dict[str, Any]]:
        if not self._told.limited:
            return []
        from multibody_sym.motion.results.integrals import limits_passed

        crossed = limits_passed(self.ready.mechanism, self.parameters, self.__getitem__)
        return [{"t": float(self.t[at.sample]), "kind": f"{at.limit} limit", "element": at.joint} for at in crossed]

    @cached_property
    def _crossed_boxes(self) -> list[dict[str, Any]]:
        if not self._told.boxes:
            return []
        from multibody_sym.motion.results.integrals import crossed_boxes

        found = crossed_boxes(self.ready.mechanism, self.parameters, self.t, self.q, self.u)
        return [{"t": t, "kind": EDGES_CROSS, "element": name} for name, t in found.items()]

    @property
    def changes(self) -> list[dict[str, Any]]:
        """What began to stick, slide, open or close, in the order of time: `t`, `kind` and `element` of each."""
        return [] if self.modes is None else self.modes.events

    @property
    def friction_work(self) -> Mapping[str, FrictionWork]:
        """The work of friction in J by contact or joint friction, on all bodies and on each."""
        return {} if self.modes is None else self.modes.account.friction

    @property
    def impact_losses(self) -> Mapping[str, float]:
        """The kinetic energy in J that impacts took, by what closed."""
        return {} if self.modes is None else self.modes.lost

    @property
    def stretches(self) -> list[FineLeg]:
        """The parts of the run between switches of its mode, and between changes of inputs that are held."""
        if self.modes is not None:
            return self.modes.along
        from multibody_sym.motion.results.integrals import FineLeg

        end, ready = self.integration, self.ready
        if legs := self._made.legs:
            return [FineLeg(ready.mechanism, ready.compiled, leg.of, leg.until, leg.steps) for leg in legs]
        return [FineLeg(ready.mechanism, ready.compiled, self.problem, end.t_final, end.statistics.steps)]

    def verified(self) -> dict[str, Miss]:
        """Return how well the general theorems hold along the run: the largest miss of each by name, with its time.

        `momentum`, `angular_momentum` (about the origin) and `power` at each instant; `impulse`, `angular_impulse` and
        `work` from the start on, through impacts, which tell the accuracy of the integration too. Relative to the sums
        of absolute values of the terms. Every stretch is run once more, in fine samples.
        """
        from multibody_sym.motion.results.integrals import theorem_misses  # which few runs need

        jumps = () if self.modes is None else self.modes.passed
        return theorem_misses(self.stretches, jumps)

    def _run_outputs(self) -> dict[str, Floats]:
        return self._added_up(self._parts)

    def _added_up(self, parts: Sequence[LegSamples]) -> dict[str, Floats]:
        """Return the outputs that add up from the start of the run, at the samples of parts."""
        if not self._told.run_outputs:
            return {}
        from multibody_sym.motion.results.integrals import Adding, integrated_outputs

        adding = Adding(self.ready.mechanism.run_outputs)
        jumps = () if self.modes is None else self.modes.added(adding.leaves)
        return integrated_outputs(adding, self.stretches, parts, jumps)

    @property
    def energy_at_start(self) -> float:
        """T + V in J as the run begins: before what strikes then, of which the first sample tells the speeds after."""
        return float(self.whole.energy[0]) + (0.0 if self.modes is None else self.modes.lost_at_start)

    @property
    def energy_residual(self) -> float:
        """The change of T + V in J that the work of friction and loads and what impacts took leave over.

        For systems of which some holds one way only; nan for others, for runs without a sample at their end, and where
        prescribed motion, or a spring or row that time moves, does work that is not accounted.
        """
        whole = self.whole
        if self.modes is None or len(whole) < 2 or whole.t[-1] != self.t_final:
            return math.nan
        if self._told.works_unseen:
            return math.nan
        account = self.modes.account
        given = account.loads + sum(work.total for work in account.friction.values()) - sum(self.impact_losses.values())
        return float(whole.energy[-1]) - self.energy_at_start - given

    @property
    def final(self) -> dict[str, Any]:
        """Time, coordinates and speeds that the run reached."""
        told, end = self._told, self.integration
        return {
            "t": end.t_final,
            "coordinates": dict(zip(told.coordinates, end.q_final.tolist(), strict=True)),
            "speeds": dict(zip(told.speeds, end.u_final.tolist(), strict=True)),
        }

    @cached_property
    def end_changes(self) -> EndChanges | None:
        """What a coarser run changes of `final`; none of long runs, those in modes, and those whose inputs are held."""
        if self.modes is not None or self._made.legs:
            return None
        from multibody_sym.motion.loop.integrate import end_changes

        return end_changes(self.problem, self.integration)

    @property
    def drift(self) -> Mapping[str, float]:
        """How far the integrated state went astray.

        `position`, `velocity`: largest |phi| and |phidot|; `quaternion`: largest deviation of a length from 1 before it
        was normalised; `energy`: largest change of T + V in J, an error only where forces outside V do no work; nan
        where prescribed motion does, as T + V then tells nothing about the integration.
        """
        statistics, energy = self.integration.statistics, math.nan
        if not self._told.drives:
            total = self.whole.energy
            energy = float(np.max(np.abs(total - total[0]))) if len(total) else 0.0
        return {
            "position": statistics.drift_position,
            "velocity": statistics.drift_velocity,
            "energy": energy,
            "quaternion": statistics.quaternion_deviation,
        }

    @cached_property
    def redundancy(self) -> Redundancy:
        """Which constraints were redundant at the start, and which forces that leaves undetermined."""
        told, rank = self._told, self.integration.statistics.greatest_rank
        if rank == len(told.rows):
            return Redundancy(rank - sum(told.doubles.values()), (), (), doubles=told.doubles)
        if self.ready.known is not None:
            return Redundancy(**freeze(self.ready.known["redundancy"]))
        from multibody_sym.dynamics.formalisms.composite_body import composite_body
        from multibody_sym.dynamics.redundancy import redundancy  # which few runs need
        from multibody_sym.mechanics.motion import motion_of, state_of

        mechanism = told.mechanism
        parameters = self.parameters if self.modes is None else self.ready.parameters  # those of the first mode
        start = self.ready.q0.tolist(), self.ready.u0.tolist(), parameters.tolist()
        state = state_of(mechanism, float, self.problem.t0, *start)
        return redundancy(motion_of(mechanism, state), composite_body(mechanism, state))

    @property
    def statistics(self) -> dict[str, Any]:
        """Steps, evaluations and the like, with the method and what kept the constraints."""
        problem = self.problem
        return {
            **asdict(self.integration.statistics),
            "method": problem.method.name,
            "formalism": self.ready.formalism,
            "backend": self.ready.compiled.backend,
            "projection": problem.project if self.modes is None else self.modes.project,
            "index_2": problem.index_2,
            "baumgarte": self.baumgarte,
        }

    @property
    def baumgarte(self) -> dict[str, float] | None:
        """Baumgarte's alpha and beta in 1/s where they stabilised the run."""
        if self.modes is not None:
            names = ("alpha", "beta")
            return None if self.modes.stabilised is None else dict(zip(names, self.modes.stabilised, strict=True))
        if not self._told.rows or self.problem.project or self.problem.index_2:
            return None
        from multibody_sym.mechanics.mechanism import ALPHA, BETA

        vector, values = self.ready.mechanism.parameters, self.parameters.tolist()
        return {"alpha": vector.value(values, ALPHA), "beta": vector.value(values, BETA)}

    def as_json(self) -> dict[str, Any]:
        """Return the object that `simulate --json` prints; nan and infinity become None."""
        known = {"coordinates": self.units, "speeds": self.units, "outputs": self.output_units}
        columns = {"coordinates": self.coordinates, "speeds": self.speeds, "outputs": self.outputs}
        found = self.redundancy
        rows = len(self._told.rows) - sum(found.doubles.values())
        return {
            "t": self.t.tolist(),
            **{kind: {name: _plain(x) for name, x in named.items()} for kind, named in columns.items()},
            "units": {"t": "s", **{kind: {x: known[kind][x] for x in named} for kind, named in columns.items()}},
            "events": self.events,
            "final": self.final,
            "drift": {name: _finite(x) for name, x in self.drift.items()},
            "friction_work": {name: asdict(work) for name, work in self.friction_work.items()},
            "impact_losses": dict(self.impact_losses),
            "energy_residual": _finite(self.energy_residual),
            "withheld": {name: list(components) for name, components in self.withheld.items()},
            "withheld_reasons": self.withheld_reasons,
            "redundancy": {**asdict(found), "rows": rows},
            "statistics": self.statistics,
            "start": self.ready.begun_from,
            "interrupted": self.interrupted,
        }

    @door
    def plot(
        self,
        path: str | os.PathLike[str] | None = None,
        units: str | Sequence[str] | Units | None = None,
        *,
        show: str | Sequence[str] | None = None,
        x: str = "t",
    ) -> Any:
        """Return a matplotlib figure of the run, written to `path` if one is given: `multibody_sym.plot` of it alone.

        It is in SI units, angles in degrees or turns, but for those chosen, such as `units="mm,rad"`.
        `show="theta,psi"` chooses what is shown and `x="theta"` over what.
        Raises InputError for what is no unit or name, OutputError where matplotlib is missing or the file cannot be
        written.
        """
        from multibody_sym.motion.results.plot import plot

        return plot(self, path, units, show=show, x=x)


@dataclass(frozen=True, eq=False, repr=False)
class _Between(Samples):
    """The motion of a `run` at times that were asked of it."""

    run: Trajectory

    def _run_outputs(self) -> dict[str, Floats]:
        return self.run._added_up(self._parts)


class _WholeTrajectory(Trajectory):
    """A run with all samples that were made."""

    @property
    def _asked(self) -> slice:
        return slice(0, len(self._made.t))


def _plain(values: Floats) -> list[float | None]:
    listed: list[float | None] = values.tolist()
    return listed if np.isfinite(values).all() else [_finite(x) for x in values.tolist()]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


# ----------------------------------------------------------------------------------------------------------------------
# States of samples that no real mechanism has, or that have no number: each an event with its first time.

_ROUNDING: Final = 1e-9
_PART: Final = 0.1
_GROWTH: Final = 1e5


def pushing_ropes(run: Samples) -> list[dict[str, Any]]:
    """Return each rope's first sample at which it would push: a real one goes slack there."""
    tensions = run.tensions.items()
    return _first(run, PUSHING, {name: x < -_ROUNDING * np.abs(x).max(initial=0.0) for name, x in tensions})


def pulling_wheels(run: Samples) -> list[dict[str, Any]]:
    """Return each rolling row's first sample at which its plane would hold the wheel back: a real one lifts off there.

    Beyond rounding of all constraints' forces, and of T + V over the wheel's radius.
    """
    if not run.ready.told.rolls or len(run) == 0:
        return []
    energy = np.abs(run.kinetic_energy) + np.abs(run.potential_energy)
    largest = np.max([np.abs(force) for force in run.multipliers.values()], axis=0)
    found: dict[str, NDArray[np.bool_]] = {}
    for name, radius in run.ready.wheels.items():
        felt = largest + (energy / radius if radius > 0.0 else 0.0)
        found[name] = run.multipliers[name] < -_ROUNDING * np.nanmax(felt, initial=0.0)
    return _first(run, PULLING, found)


def outputs_without_value(run: Samples) -> list[dict[str, Any]]:
    """Return each output's first sample at which it is no finite number, but for outputs of withheld reactions."""
    untold = run.ready.told.untold
    return _first(run, NO_VALUE, {name: ~np.isfinite(x) for name, x in run.outputs.items() if name not in untold})


def growing_energy(run: Samples, accuracy: float) -> list[dict[str, Any]]:
    """Return the first sample at which energy has come from nowhere, if it has; `accuracy` is that of the run.

    Where nothing drives the mechanism: T + V rises above the least that it was by a tenth of the greatest T, and by
    more than the accuracy of V. Else, where nothing is given in time: T grows 1e5 times past all energies of the first
    half; a force that lasts from the start gives at most a few dozen times there.
    """
    told, kinetic, total = run.ready.told, run.kinetic_energy, run.energy
    kept = np.isfinite(kinetic) & np.isfinite(total)
    driven = told.driven
    if told.drives or not kept.any() or (driven and told.moved_by_time):
        return []
    if not kept.all():
        kinetic, total = kinetic[kept], total[kept]
    felt = accuracy * np.maximum(1.0, _accumulate(np.maximum, np.abs(total - kinetic)))
    if driven:
        half = (len(kinetic) + 1) // 2
        first = (kinetic + np.abs(total - kinetic))[:half]
        grown = kinetic > _GROWTH * (float(first.max()) + felt[half - 1])
        grown[:half] = False
    else:
        rise = total.copy()
        rise -= _accumulate(np.minimum, total.copy())
        enough = bool(rise.max() > _PART * kinetic.max() + felt[-1])
        felt += _PART * _accumulate(np.maximum, kinetic.copy())
        grown = (rise > felt) & enough
    at = np.flatnonzero(kept)[grown]
    return [{"t": float(run.t[at[0]]), "kind": ENERGY, "element": "total energy"}] if len(at) else []


def coordinates_too_far(
    run: Samples, pairs: Sequence[tuple[int, int]], step: float, least: float
) -> list[dict[str, Any]]:
    """Return each coordinate's first sample at which the numbers beside it are further away than it moves in a step.

    `pairs`: indices of coordinates and of the speeds that are their rates; `step`: the mean step of the run in s. A
    speed that is never above the `least` moves nothing. Such a coordinate stands still, or moves by leaps.
    """
    names, found = run.ready.told.coordinates, {}
    for a, b in pairs:
        fastest = float(np.nanmax(np.abs(run.u[:, b]), initial=0.0))
        if fastest > least and step > 0.0:
            found[names[a]] = np.spacing(np.abs(run.q[:, a])) > fastest * step
    return _first(run, TOO_FAR, found)


def _first(run: Samples, kind: str, held: Mapping[str, NDArray[np.bool_]]) -> list[dict[str, Any]]:
    """Return for each element the first sample at which something holds (m,), as an event."""
    at = {name: np.flatnonzero(holds) for name, holds in held.items()}
    return [{"t": float(run.t[k[0]]), "kind": kind, "element": name} for name, k in at.items() if len(k)]


def _accumulate(extreme: np.ufunc, values: Floats) -> Floats:
    """Return the extreme of values up to each, in their place: a run may have a million."""
    extreme.accumulate(values, out=values)
    return values
