"""The run of a mechanism of which some holds one way only: from leg to leg, each in a mode."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from multibody_sym.integrators.flow import Status
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.chain import NO_STEP, End, Switch, chain, shortly
from multibody_sym.runtime.course import Passage
from multibody_sym.runtime.problem import Loop, Reason, RunFailure
from multibody_sym.scalars.node import Node
from multibody_sym.simulation.along.jumps import Passed, added, passed
from multibody_sym.simulation.one_way import thin_bars
from multibody_sym.simulation.one_way.account import energy_account
from multibody_sym.simulation.one_way.at_switches import stop_jumped, stop_met, stopped, struck
from multibody_sym.simulation.one_way.decision import NextState
from multibody_sym.simulation.one_way.facts import Facts, rubs
from multibody_sym.simulation.one_way.jams import before_jam, jam_of, jams, slip_stopped
from multibody_sym.simulation.one_way.known_switches import followed
from multibody_sym.simulation.one_way.legs import Cause, Jump, Leg, Legs, between_jumps
from multibody_sym.simulation.one_way.modes import key_of, on_its_way
from multibody_sym.simulation.one_way.prepared import PreparedRuns
from multibody_sym.simulation.runs.modes import EnergyAccount
from multibody_sym.stages import stage

_RETURNS: Final = 2
_GIVEN_UP: Final = 20
_KEPT: Final = 1e4
"""How much further a mode that is kept may be beyond what ends it: 1e-8 of the forces."""


@dataclass(eq=False, kw_only=True)
class ModeRun(Legs):
    """A run under way, or done: its legs, by what its system has `prepared`, and what of them counts for what follows.

    That is what `switches` have met; the loop in C follows its `course`, if there is one.
    """

    prepared: PreparedRuns

    def __post_init__(self) -> None:
        """Begin the run. Raises NoSolutionError, and ModelError where a point moves across a thin bar it touches."""
        self.switches = self.prepared.switches()
        self.course = self.prepared.memory.course(partial(_turned, self))
        first, facts, self.switches.hidden = self.prepared.first
        self.switches.laws = facts.laws
        self.legs.append(_begun(first, facts, facts.t, self))

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in no mode."""
        return self.prepared.laws.mechanism

    @property
    def stabilised(self) -> tuple[float, float] | None:
        """Baumgarte's alpha, beta (1/s), None where rows are put back."""
        return self.prepared.stabilised

    @property
    def project(self) -> bool:
        """Whether rows are put back after each step."""
        return self.prepared.template.project

    @property
    def loop(self) -> Loop:
        """The loop that goes from leg to leg."""
        return chain(partial(next_leg, run=self), self.legs)

    @cached_property
    def account(self) -> EnergyAccount:
        """The work of friction at each part and of the loads (J), once the run is done."""
        return energy_account(self.along, self.mechanism, self.blows)

    @property
    def passed(self) -> Iterator[Passed]:
        """Both sides of the general theorems at each impact."""
        return (passed(self.mechanism, blow) for blow in self.blows)

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]:
        """Return the time of each impact, and what it adds to work and impulses (leaves)."""
        return [(blow.t, added(self.mechanism, blow, leaves)) for blow in self.blows]

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str:
        """Return which point got through a bar without thickness between samples, empty where none did."""
        bars = self.prepared.bars
        facts = (self.switches.at(float(t[k]), np.concatenate([q[k], u[k]])) for k in range(len(t)))
        return thin_bars.passed_through(bars, facts) if bars else ""


# --- from leg to leg --------------------------------------------------------------------------------------------------


def next_leg(leg: Leg, switch: Switch, run: ModeRun) -> Leg | End[Leg] | None:
    """Return the leg that follows one at a switch, or why none does, or the stop that the run meets."""
    with stage("decide"):
        return _across(leg, switch, run) if switch.index == NO_STEP else _behind(leg, switch, run)


def _behind(leg: Leg, switch: Switch, run: ModeRun) -> Leg | End[Leg] | None:
    """Return the leg that follows one at a switch between steps."""
    t, cause, switches = switch.begun.time, leg.switching(switch.index), run.switches
    reason = switches.hindered(t, switch.x, cause, lambda: run.changes)
    if reason is not None:
        return End(RunFailure(Status.NO_MODE, t, None, reason))
    if cause.ends == "moves on" and cause.part is not None:
        return _on_its_way(leg, switch, cause.part, run)
    if cause.ends == "stops in space" and cause.part is not None:
        switch = stopped(switch, leg, switches.at(t, switch.x), cause.part)
    found = _known(leg, switch, run)
    if found is not None:
        return _followed(leg, found, switch, run)
    found = switches.next_state(leg, switch.begun.time, switch.x, switch.index)
    switches.learn(leg, switch.index, found)
    run.prepared.memory.learn(found, leg, switch.index)
    following = _followed(leg, found, switch, run)
    run.prepared.memory.tell_c(leg, switch.index)
    return following


def _across(leg: Leg, switch: Switch, run: ModeRun) -> Leg | End[Leg] | None:
    """Return the leg behind an instant at which friction jams, or why there is none.

    Where friction has no part in it steps may lead across: None if they have tried.
    """
    t, switches, nq = switch.begun.time, run.switches, len(run.mechanism.coordinates)
    switches.grown(switch.x[nq:])
    facts = switches.seen(leg, t, switch.x)
    rough = rubs(facts, leg.program.entered)
    jam = jam_of(leg, facts) if rough else None
    if rough and jam is None and jams(leg, t, switch.x):
        found = switches.tipped(leg, facts) or _slip_stopped(leg, facts, run)
        return End(RunFailure(Status.SINGULAR, t, None)) if found is None else _later(leg, found, switch, run)
    if jam is None and leg.of.crosses:
        return None
    if jam is None:
        again = replace(leg.problem, crosses=True, course=None, jump=partial(_jump, run))
        again = replace(again, begun=switch.begun, q0=facts.q, u0=facts.u)
        return switches.enter(replace(leg, of=again, since=None, cause=None))
    found = switches.beyond(leg, jam.facts)
    if found.mode is None:
        why = found.why_none
        reason = Reason(
            f"friction jams: the force at {jam.row} grows without bound, for with its friction it hardly moves "
            f"what it presses (Painleve's paradox), and behind that {why.text}",
            why.ends,
        )
        return End(RunFailure(Status.NO_MODE, t, None, reason))
    return _later(leg, found, switch, run)


def _later(leg: Leg, found: NextState, switch: Switch, run: ModeRun) -> Leg | End[Leg]:
    """Return the leg in the mode that was found at an instant beyond a switch, but before the next sample."""
    at, following = found.facts.t, run.prepared.template.times()[switch.begun.written :][:1]
    at = at if found.blow is None else found.blow.t  # facts may be those of a later limit of impacts
    return _followed(leg, found, replace(switch, begun=replace(switch.begun, time=min(at, *following))), run)


def _slip_stopped(leg: Leg, facts: Facts, run: ModeRun) -> NextState | None:
    """Return what follows where slip stops at once, as its friction hardly moves what presses it."""
    time = before_jam(leg, facts)
    if time is None or run.switches.standstill.lasts(facts.t, len(facts.laws.unilateral)):
        return None
    *_, last = between_jumps(leg, (jump for jump in run.jumps if jump.leg == len(run.legs) - 1))
    facts = facts.laws.at(max(time, last.problem.start), *last.at(time), facts.scale)
    blow = slip_stopped(leg, facts)
    found = None if blow is None else run.switches.beyond(leg, facts, blow)
    return None if found is None or found.mode is None else found


def _on_its_way(leg: Leg, switch: Switch, part: FrictionPart, run: ModeRun) -> Leg:
    """Return the leg in which what has started to slide in space has come to move so fast."""
    q, u = np.split(switch.x, [len(run.mechanism.coordinates)])
    problem, mode = on_its_way(leg.program, leg.problem, leg.mode, part)
    problem = replace(problem, begun=switch.begun, q0=q, u0=u)
    return run.switches.enter(replace(leg, of=problem, since=None, mode=mode, cause=None))


def _known(leg: Leg, switch: Switch, run: ModeRun) -> NextState | None:
    """Return how the run goes on where a switch was decided before and leads on in the same way."""
    switches = run.prepared.memory.known(leg, switch.index)
    if not switches:
        return None
    facts, closed = run.switches.closed_at(leg, switch.begun.time, switch.x, leg.switching(switch.index))
    rates = None if switches[0].cause is None else leg.rates_at(facts)
    ways = (followed(one, facts, closed, rates) for one in switches)
    return next((found for found in ways if found is not None), None)


def _followed(leg: Leg, found: NextState, switch: Switch, run: ModeRun) -> Leg | End[Leg]:
    """Return the leg in the mode that was found at a switch, or the stop that the run meets."""
    following = _entered(leg, found, switch, run)
    if isinstance(following, End):
        return following
    end = stop_met(run.mechanism, (leg, following), switch, run.switches.scale.speed)
    run.ahead = following if end is not None and not end.behind else None
    return end or following


def _entered(leg: Leg, found: NextState, switch: Switch, run: ModeRun) -> Leg | End[Leg]:
    """Return the leg in the mode that was found at a switch, from what happened there on: slightly before it, perhaps.

    Where impacts have a limit, which is later, it is the motion that leads to this in the mode that follows.
    """
    t, switches = switch.begun.time, run.switches
    if found.mode is None:
        return End(RunFailure(Status.NO_MODE, t, None, found.why_none))
    problem, program = run.prepared.modes.problem(found, replace(switch.begun, time=found.facts.t))
    if found.facts.t > t:
        q, u = np.split(shortly(problem, t), [len(problem.q0)])
        problem = replace(problem, begun=switch.begun, q0=q, u0=u)
    returns = 0 if found.blow is not None else switches.returns.to(t, key_of(found.mode))
    if returns > _GIVEN_UP:
        beyond = switches.soon_beyond(leg, found.facts) or switches.slid_out(leg, found.facts)
        if beyond is not None:
            return _entered(leg, beyond, switch, run)
        changing = ", ".join(sorted({change.element for change in run.changes[-_GIVEN_UP:]}))
        reason = Reason(
            f"no state of {changing or 'what touches'} was found that lasts: {returns} times the same one followed "
            f"within {switches.returns.soon:.3g} s, the last ones kept up to 1e-8 of the forces beyond their limits,"
        )
        return End(RunFailure(Status.NO_MODE, t, None, reason))
    if returns >= _RETURNS:
        pairs = zip(program.switchings, problem.margins, strict=True)
        kept = (_KEPT * margin if x is not None and x.limits else margin for x, margin in pairs)
        problem = replace(problem, margins=tuple(kept))
    following = Leg(problem, program=program, mode=found.mode, cause=Cause.of(found, t))
    return _begun(following, found.facts, t, run)


# --- what a run remembers ---------------------------------------------------------------------------------------------


def _begun(leg: Leg, facts: Facts, t: float, run: ModeRun) -> Leg:
    """Return a leg in a mode that was found at some facts as it begins: what strikes has, and C may follow it."""
    switches = run.switches
    course = run.prepared.memory.entered(leg, run.course, t, switches.scale)
    following = switches.enter(replace(leg, of=replace(leg.of, jump=partial(_jump, run), course=course)))
    if leg.cause is not None and leg.cause.blow is not None:
        switches.hit(leg.cause.blow, facts)
    return following


def _jump(run: ModeRun, t: float, x: Floats, index: int) -> Floats | None:
    """Return the state after an impact from which the run goes on in its mode; None where that ends."""
    leg, switches = run.legs[-1], run.switches
    with stage("decide"):
        met = switches.within(leg, t, x, index)
    if met is None:
        return None
    if met.cause is not None and met.cause.blow is not None and met.facts is not None:
        blow = met.cause.blow
        if any(struck(each, blow) for each in run.mechanism.state_stops.values()):
            return None
        if stop_jumped((leg, leg), t, (x, met.after), switches.scale.speed) is not None:
            return None
        switches.hit(blow, met.facts)
    run.jumps.append(Jump(len(run.legs) - 1, t, index, met.after, met.moved, met.cause))
    return met.after.copy()


def _turned(run: ModeRun, passage: Passage) -> None:
    """Note a turn that the loop in C has taken."""
    switches = run.switches
    if passage.speed != switches.scale.speed:
        switches.scale = replace(switches.scale, speed=passage.speed)
    run.legs[-1] = run.legs[-1].come(passage.written, passage.time, passage.steps)
    leg = switches.enter(run.prepared.memory.legs[passage.to].passed_into(passage))
    switches.returns.to(passage.time, leg.program.key)
    run.legs.append(leg)
