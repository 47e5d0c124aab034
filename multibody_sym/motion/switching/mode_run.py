"""The run of a mechanism of which some holds one way only: from leg to leg, each in a mode."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import copy, deepcopy
from dataclasses import replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.programs.law_programs import friction_power_program
from multibody_sym.mechanics.energy import split
from multibody_sym.mechanics.law_elements import STICKS
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.modes import friction_parts
from multibody_sym.mechanics.row_records import VelocityRow
from multibody_sym.model.settings import Settings
from multibody_sym.motion.loop.integrate import END, NO_STEP, End, Switch, chain, from_part, shortly
from multibody_sym.motion.loop.problem import Begun, Hold, Holds, Loop, Passage, Problem, Reason, RunFailure
from multibody_sym.motion.prepare.problem import compile_mechanism, own_coefficient, recall_laws
from multibody_sym.motion.prepare.records import PreparedSystem
from multibody_sym.motion.prepare.settings import RunSettings, form_of
from multibody_sym.motion.results.integrals import (
    PIECES,
    FineLeg,
    ImpactBalance,
    impact_balance,
    impact_integrals,
    integral,
    with_program,
)
from multibody_sym.motion.results.samples import EnergyAccount, FrictionWork
from multibody_sym.motion.switching import law_mechanism
from multibody_sym.motion.switching.decision import NextState
from multibody_sym.motion.switching.impact import ImpactOutcome
from multibody_sym.motion.switching.jams import before_jam, jam_of, jams, slip_stopped
from multibody_sym.motion.switching.law_mechanism import LawMechanism
from multibody_sym.motion.switching.law_values import Laws, LawValues, has_sliding_friction
from multibody_sym.motion.switching.legs import (
    Cause,
    LegJump,
    Legs,
    ModeLeg,
    between_jumps,
    stop_jumped,
    stop_met,
    stop_of_slip,
    strikes_now,
    times_to_check,
)
from multibody_sym.motion.switching.modes import EveryMode, ModePrograms, key_of, settled_direction
from multibody_sym.motion.switching.prepared import PreparedRuns, follow_known_switch
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import Compiled
from multibody_sym.program.runtime_constants import Status
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import ONE, Node
from multibody_sym.stages import is_logged, log, stage

# ----------------------------------------------------------------------------------------------------------------------
# What friction took in a run, at each part and from each body, and what loads gave: power, integrated by stretches.


_SETTLED: Final = 1e-10
"""Part of the work in a run by which half as many places may change it: Boole's rule is 64 times nearer."""
_SHORT: Final = 1e-14
"""The part of a time of which nothing is left to divide."""
_FEW_STEPS: Final = 1000
"""Of a run that is looked at in steps as short as places are apart: several times as many."""
_FEWEST: Final = 16
"""Pieces of a stretch in which it is looked at first: most are as short as a bounce, and need no more."""
_FINER: Final = 4
"""How many times as near places are where they are too far apart."""
_MOST_ROUNDS: Final = 30
"""How often that may happen one inside the other."""
_MOST_PARTS: Final = 100_000
"""Parts that are looked at in nearer places, in all."""
_UNKNOWN: Final = 1e-3
"""Part of the work in a run by which half as many places change it where it is not told at all."""
_LAST: Final = 3e-3
"""Part of the work in a run at the very end of a stretch that energy tells: friction that jams grows without bound."""
_LITTLE: Final = 1e-7
"""Part of the kinetic energy that counts as work always: what sticks does work of rounding, and none else."""


Ends = Mapping[float, tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class _Work:
    """The work in parts (n) of a stretch: of friction (n, p), of it on each body (n, p, bodies), of loads (n, 1).

    `sizes` (n) are integrals of absolute powers, `unsure` (n) what half as many places change; `kinetic` is the largest
    energy. `begins` are the states (t, q, u) in which parts begin, with the `energies`, of as many as were `asked`;
    where no step leads near enough to the end, the last ones count as one, of which nothing is known but the powers
    `last` (friction, shares, loads) before it. `missed` is by how much another energy was reached when places were
    farther apart: a run may step over a blow.
    """

    stretch: FineLeg
    program: Compiled
    begins: tuple[Floats, Floats, Floats]
    energies: Floats
    asked: int
    friction: Floats
    shares: Floats
    loads: Floats
    sizes: Floats
    unsure: Floats
    kinetic: float
    missed: float
    last: tuple[Floats, Floats, Floats] | None

    @classmethod
    def of(cls, stretch: FineLeg, program: Compiled, asked: int, reaches: float | None = None) -> _Work:
        """Return the work in a stretch from at least that many parts of it."""
        fine = stretch.fine(2 * asked)
        powers, *others = program.map("friction_power", *fine.arguments, fine.derivative[2])[2:]
        mode = stretch.mechanism.mode
        assert mode is not None
        # What sticks has a power of rounding, which no places resolve.
        sticks = [mode.slips.get(part.name) == STICKS for _, part in friction_parts(stretch.mechanism)]
        values = np.where(sticks, 0.0, powers), *others
        powers = np.column_stack([values[0], values[2]])
        kinetic, potential = fine.evaluated("energy")
        places = (len(fine.t) - 1) // 8
        whole, begins = slice(8 * places + 1), slice(None, 8 * places + 1, 8)
        t = fine.t[whole]
        friction, shares, loads = (_parts(value[whole], t) for value in values)
        sizes = _parts(np.abs(powers[whole]), t).sum(axis=1)
        fewer = np.diff(integral(powers[whole][::2], t[::2]), axis=0)
        unsure = np.abs(fewer - np.column_stack([friction, loads])).sum(axis=1)
        if places:
            asked = round(stretch.duration / (t[8] - t[0]))
        last = None
        if places < asked:
            last = values[0][8 * places], values[1][8 * places], values[2][8 * places]
            rest = stretch.until - t[-1]
            left = max(float(sizes.sum()), rest * float(np.abs(powers[8 * places]).sum()))
            left = left if rest > _SHORT * abs(stretch.until) else 0.0
            friction, shares, loads, sizes = (_with(x, 0.0) for x in (friction, shares, loads, sizes))
            unsure = _with(unsure, left)
        energies = (kinetic + potential)[begins]
        missed = 0.0 if reaches is None else abs(float(energies[-1]) - reaches)
        most = float(kinetic.max())
        states = fine.t[begins], fine.q[begins], fine.u[begins]
        found = friction, shares, loads, sizes, unsure
        return cls(stretch, program, states, energies, asked, *found, most, missed, last)

    def finer(self, limit: float) -> Iterator[_Work]:
        """Yield the work in what is sure up to a limit, and in the rest from parts that are shorter."""
        rough = self.unsure > limit
        if not rough.any():
            yield self
            return
        of_all = self.friction, self.shares, self.loads, self.sizes, self.unsure
        sure = [values.copy() for values in of_all]
        for values in sure:
            values[rough] = 0.0
        friction, shares, loads, sizes, unsure = sure
        last = None if rough[-1] else self.last
        yield replace(self, friction=friction, shares=shares, loads=loads, sizes=sizes, unsure=unsure, last=last)
        t, q, u = self.begins
        for first, end in np.flatnonzero(np.diff(np.concatenate([[0], rough, [0]]))).reshape(-1, 2).tolist():
            known = end < len(t)
            until, count = (float(t[end]), end - first) if known else (self.stretch.until, self.asked - first)
            part = replace(self.stretch.part(float(t[first]), until, q[first], u[first]), near=True)
            reached = float(self.energies[end]) if known else None
            for smooth in part.smooth_parts(2 * _FINER * count):
                asked = math.ceil(_FINER * count * smooth.duration / part.duration)
                yield _Work.of(smooth, self.program, asked, reached if smooth.until == until else None)


    def ended(self, size: float, ends: Ends) -> _Work:
        """Return the work of which a little, at the end of its stretch, is known by the energy in the state there."""
        until, begin = self.stretch.until, float(self.begins[0][-1])
        if self.last is None or until not in ends or not 0.0 < self.unsure[-1] <= _LAST * size:
            return self
        friction, shares, loads = self.last
        state = np.array([until]), *(x[None] for x in ends[until])
        kinetic, potential = self.stretch.sampled(*state).evaluated("energy")
        given = (until - begin) * loads
        taken = float(kinetic[0] + potential[0] - self.energies[-1]) - float(given.sum())
        if abs(taken) > _LAST * size:  # more than friction takes there: something struck
            return self
        part = taken / (float(friction.sum()) or 1.0)
        added = (part * friction, part * shares, given, part * np.abs(friction).sum() + np.abs(given).sum(), 0.0)
        of_all = (self.friction, self.shares, self.loads, self.sizes, self.unsure)
        found = (np.concatenate([x[:-1], np.asarray(y)[None]]) for x, y in zip(of_all, added, strict=True))
        friction, shares, loads, sizes, unsure = found
        return replace(self, friction=friction, shares=shares, loads=loads, sizes=sizes, unsure=unsure, last=None)


def _parts(values: Floats, t: Floats) -> Floats:
    """Return the integrals (n, ...) of values (8 n + 1, ...) over each eight of the times."""
    return np.diff(integral(values, t)[::2], axis=0)


def _with(values: Floats, last: float) -> Floats:
    return np.concatenate([values, np.full((1, *values.shape[1:]), last)])


def energy_account(
    stretches: Sequence[FineLeg], mechanism: Mechanism, blows: Sequence[ImpactOutcome] = ()
) -> EnergyAccount:
    """Return the work of the friction and of the loads of a run with these blows.

    It is nan where powers change faster than places tell.
    """
    parts = friction_parts(mechanism)
    names = [body.name for body in mechanism.bodies]
    found = {part.name: FrictionWork() for _, part in parts}
    told = [any(not isinstance(row, VelocityRow) for row in part.rows) for _, part in parts]
    account = EnergyAccount(found)
    # The states in which stretches end, before what strikes then or, by rounding, sooner.
    ends = {stretch.until: (after.problem.q0, after.problem.u0) for stretch, after in pairwise(stretches)}
    untils = [stretch.until for stretch in stretches]
    for blow in reversed(blows):
        place = bisect_left(untils, blow.t)
        if place < len(stretches) and stretches[place].problem.start < blow.t:
            ends[untils[place]] = blow.q, blow.u
    works = _works(stretches, ends)
    if _unsure(works) + sum(one.missed for one in works) > _UNKNOWN * _size(works):
        return EnergyAccount({part.name: FrictionWork(math.nan) for _, part in parts}, math.nan)
    for one in works:
        account.loads += float(one.loads.sum())
        shares = one.shares.sum(axis=0)
        for k, (_, part) in enumerate(parts):
            work = found[part.name]
            work.total += float(one.friction[:, k].sum())
            for body, share in zip(names, shares[k].tolist(), strict=True):
                if told[k] and (share != 0.0 or body in work.bodies):
                    work.bodies[body] = work.bodies.get(body, 0.0) + share
    return account


def _size(works: Sequence[_Work]) -> float:
    """Return the size (J) beside which work that is unsure counts."""
    return float(sum(one.sizes.sum() for one in works)) + _LITTLE * max((one.kinetic for one in works), default=0.0)


def _unsure(works: Sequence[_Work]) -> float:
    return float(sum(one.unsure.sum() for one in works))


def _works(stretches: Sequence[FineLeg], ends: Ends) -> list[_Work]:
    """Return the work in stretches and parts of them.

    Where places are too far apart there are nearer ones: friction that jams grows without bound at the very end of a
    stretch, and a power jumps at kinks and where points meet. `ends` are the states at the ends of stretches.
    """
    working = list[FineLeg]()
    for stretch in stretches:  # neither friction nor loads work where nothing slides and nothing moves
        of = stretch.mechanism
        assert of.mode is not None
        moves = any(slip != STICKS for slip in of.mode.slips.values()) or len(of.held) < len(of.speeds)
        if moves and (friction_parts(of) or split(of.loads)[1]):
            working.append(stretch)
    few = sum(stretch.steps for stretch in working) <= _FEW_STEPS
    looked_at = [replace(stretch, near=few, per_step=PIECES if few else 2, fewest=_FEWEST) for stretch in working]
    with_power = with_program(looked_at, "friction_power", friction_power_program)
    works = [_Work.of(x, program, x.pieces // 2) for x, program in with_power]
    left = _MOST_PARTS
    for _ in range(_MOST_ROUNDS):
        size = _size(works)
        works = [one.ended(size, ends) for one in works]
        settled = _SETTLED * _size(works)
        if _unsure(works) <= settled:
            break
        changes = np.sort(np.concatenate([one.unsure for one in works]))
        known = int(np.searchsorted(np.cumsum(changes), settled / 2))
        left -= _FINER * (len(changes) - known)
        if left < 0:
            break
        limit = float(changes[known - 1]) if known else 0.0
        works = [part for work in works for part in work.finer(limit)]
    return works


_RETURNS: Final = 2
_GIVEN_UP: Final = 20
_KEPT: Final = 1e4
"""How much further a mode that is kept may be beyond what ends it: 1e-8 of the forces."""


@dataclass(eq=False, kw_only=True)
class ModeRun(Legs):
    """A run under way, or done: its legs, by what its system has `prepared`, and what of them counts for what follows.

    That is what `switches` have met; the loop in C follows its `course`, if there is one. `holds` tells the inputs that
    are held from time to time.
    """

    prepared: PreparedRuns
    holds: Holds | None = None

    def __post_init__(self) -> None:
        """Begin the run. Raises NoSolutionError, and ModelError where a point moves across a thin bar it touches."""
        self.switches = self.prepared.switches()
        self.course = self.prepared.memory.course(partial(_note_turn, self))
        first, facts, self.switches.hidden = self.prepared.first
        self.switches.laws = facts.laws
        self.legs.append(_begin_leg(first, facts, facts.t, self))

    def __getstate__(self) -> dict[str, Any]:
        """Return what a copy has: not the functions that told what was held, which another process may not know."""
        return {**vars(self), "holds": None}

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
        loop = chain(partial(next_leg, run=self), self.legs)
        return loop if self.holds is None else from_part(self.legs[0].of, loop)

    def begin(self, holds: Holds) -> ModeRun:
        """Return the run, in which inputs are held from time to time."""
        self.holds, first = holds, self.legs[0]
        self.legs[0] = replace(first, of=self.hold(holds(first.start, first.of.x0), None, first.of.x0))
        return self

    def resumed(self, t: float, hold: Hold, x: Floats) -> Problem:
        """Return the problem of a run of its own, two samples long, that goes on from a state with held inputs.

        The legs before are forgotten, but not what decisions to come ask for.
        """
        for shared in (self.prepared, self.prepared.modes):
            template = shared.template
            shared.template = replace(template, t0=t, t_end=hold.until, samples=2, whole=template.lasts)
        problem = self.hold(hold, None, x)
        self.legs[:] = [replace(self.legs[-1], of=problem, since=None, cause=None)]
        self.jumps.clear()
        for told in ("events", "blows", "account"):
            vars(self).pop(told, None)
        return problem

    def hold(self, hold: Hold, begun: Begun | None, x: Floats) -> Problem:
        """Return the problem of the mode it is in, from a state (nq + nu,) on, while inputs are held."""
        for shared in (self.prepared, self.prepared.modes):
            given = shared.template.in_parts
            t0 = given.t0 if begun is None else begun.time
            shared.template = replace(given, t0=t0, t_end=hold.until)
        leg, laws, template = self.legs[-1], self.switches.laws, self.prepared.template
        own = leg.of.parameters.copy()
        for parameters, of in ((laws.parameters, laws.mechanism), (own, leg.program.mechanism)):
            for name, value in hold.values.items():
                parameters[of.parameters.places[name]] = value
        self.switches.forget()
        self.course = None  # its modes have the parameters and the end of the run that they were met in
        q0, u0 = np.split(x, [len(self.mechanism.coordinates)])
        span = {name: getattr(template, name) for name in ("t0", "t_end", "samples", "whole")}
        jump = partial(_jump, self)
        return replace(leg.problem, **span, begun=begun, q0=q0, u0=u0, parameters=own, jump=jump, course=None)

    def copied(self) -> ModeRun:
        """Return a run that goes on by itself from where this one is."""
        other = copy(self)
        other.prepared = copy(self.prepared)
        other.prepared.modes = copy(self.prepared.modes)
        other.legs, other.jumps = list(self.legs), list(self.jumps)
        own = {name: deepcopy(getattr(self.switches, name)) for name in ("standstill", "returns", "bounces")}
        laws = replace(self.switches.laws, parameters=self.switches.laws.parameters.copy())
        other.switches = replace(self.switches, laws=laws, **own)
        return other

    @cached_property
    def account(self) -> EnergyAccount:
        """The work of friction at each part and of the loads (J), once the run is done."""
        return energy_account(self.along, self.mechanism, self.blows)

    @property
    def passed(self) -> Iterator[ImpactBalance]:
        """Both sides of the general theorems at each impact."""
        return (impact_balance(self.mechanism, blow) for blow in self.blows)

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]:
        """Return the time of each impact, and what it adds to work and impulses (leaves)."""
        return [(blow.t, impact_integrals(self.mechanism, blow, leaves)) for blow in self.blows]

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str:
        """Return which point got through a bar without thickness between samples, empty where none did."""
        bars = self.prepared.bars
        facts = (self.switches.at(float(t[k]), np.concatenate([q[k], u[k]])) for k in range(len(t)))
        return law_mechanism.passed_through(bars, facts) if bars else ""


# --- from leg to leg --------------------------------------------------------------------------------------------------


def next_leg(leg: ModeLeg, switch: Switch, run: ModeRun) -> ModeLeg | End[ModeLeg] | None:
    """Return the leg that follows one at a switch, or why none does, or the stop that the run meets."""
    with stage("decide"):
        if switch.index == NO_STEP:
            return _leg_across_jam(leg, switch, run)
        if switch.index == END and run.holds is not None:
            held = run.hold(run.holds(switch.begun.time, switch.x), switch.begun, switch.x)
            return replace(leg, of=held, since=None, cause=None)
        t, cause, switches = switch.begun.time, leg.switching(switch.index), run.switches
        reason = switches.hindered(t, switch.x, cause, lambda: run.changes)
        if reason is not None:
            return End(RunFailure(Status.NO_MODE, t, None, reason))
        if cause.ends == "moves on" and cause.part is not None:
            q, u = np.split(switch.x, [len(run.mechanism.coordinates)])
            problem, mode = settled_direction(leg.program, leg.problem, leg.mode, cause.part)
            problem = replace(problem, begun=switch.begun, q0=q, u0=u)
            return switches.enter(replace(leg, of=problem, since=None, mode=mode, cause=None))
        if cause.ends == "stops in space" and cause.part is not None:
            switch = stop_of_slip(switch, leg, switches.at(t, switch.x), cause.part)
        if known := run.prepared.memory.known(leg, switch.index):  # it was decided before: is it as then?
            facts, closed = switches.closed_at(leg, switch.begun.time, switch.x, cause)
            rates = None if known[0].cause is None else leg.rates_at(facts)
            for one in known:
                if (found := follow_known_switch(one, facts, closed, rates)) is not None:
                    return _leg_or_stop(leg, found, switch, run)
        found = switches.next_state(leg, switch.begun.time, switch.x, switch.index)
        switches.learn(leg, switch.index, found)
        run.prepared.memory.learn(found, leg, switch.index)
        following = _leg_or_stop(leg, found, switch, run)
        run.prepared.memory.tell_c(leg, switch.index)
        return following


def _leg_across_jam(leg: ModeLeg, switch: Switch, run: ModeRun) -> ModeLeg | End[ModeLeg] | None:
    """Return the leg behind an instant at which friction jams, or why there is none.

    Where friction has no part in it steps may lead across: None if they have tried.
    """
    t, switches, nq = switch.begun.time, run.switches, len(run.mechanism.coordinates)
    switches.grown(switch.x[nq:])
    facts = switches.seen(leg, t, switch.x)
    rough = has_sliding_friction(facts, leg.program.entered)
    jam = jam_of(leg, facts) if rough else None
    if rough and jam is None and jams(leg, t, switch.x):
        found = switches.tipped(leg, facts) or _slip_stopped(leg, facts, run)
        if found is None:
            return End(RunFailure(Status.SINGULAR, t, None))
        return _leg_before_sample(leg, found, switch, run)
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
    return _leg_before_sample(leg, found, switch, run)


def _leg_before_sample(leg: ModeLeg, found: NextState, switch: Switch, run: ModeRun) -> ModeLeg | End[ModeLeg]:
    """Return the leg in the mode that was found at an instant beyond a switch, but before the next sample."""
    at, following = found.facts.t, run.prepared.template.times()[switch.begun.written :][:1]
    at = at if found.blow is None else found.blow.t  # facts may be those of a later limit of impacts
    return _leg_or_stop(leg, found, replace(switch, begun=replace(switch.begun, time=min(at, *following))), run)


def _slip_stopped(leg: ModeLeg, facts: LawValues, run: ModeRun) -> NextState | None:
    """Return what follows where slip stops at once, as its friction hardly moves what presses it."""
    time = before_jam(leg, facts)
    if time is None or run.switches.standstill.lasts(facts.t, len(facts.laws.unilateral)):
        return None
    *_, last = between_jumps(leg, (jump for jump in run.jumps if jump.leg == len(run.legs) - 1))
    facts = facts.laws.at(max(time, last.problem.start), *last.at(time), facts.scale)
    blow = slip_stopped(leg, facts)
    found = None if blow is None else run.switches.beyond(leg, facts, blow)
    return None if found is None or found.mode is None else found


def _leg_or_stop(leg: ModeLeg, found: NextState, switch: Switch, run: ModeRun) -> ModeLeg | End[ModeLeg]:
    """Return the leg in the mode that was found at a switch, or the stop that the run meets."""
    following = _enter_mode(leg, found, switch, run)
    if isinstance(following, End):
        return following
    end = stop_met(run.mechanism, (leg, following), switch, run.switches.scale.speed)
    run.ahead = following if end is not None and not end.behind else None
    return end or following


def _enter_mode(leg: ModeLeg, found: NextState, switch: Switch, run: ModeRun) -> ModeLeg | End[ModeLeg]:
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
            return _enter_mode(leg, beyond, switch, run)
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
    following = ModeLeg(problem, program=program, mode=found.mode, cause=Cause.of(found, t))
    return _begin_leg(following, found.facts, t, run)


# --- what a run remembers ---------------------------------------------------------------------------------------------


def _begin_leg(leg: ModeLeg, facts: LawValues, t: float, run: ModeRun) -> ModeLeg:
    """Return a leg in a mode that was found at some facts as it begins: what strikes has, and C may follow it."""
    switches = run.switches
    course = run.prepared.memory.entered(leg, run.course, t, switches.scale)
    following = switches.enter(replace(leg, of=replace(leg.of, jump=partial(_jump, run), course=course)))
    if leg.cause is not None and leg.cause.blow is not None:
        switches.hit(leg.cause.blow, facts)
    _log_mode(following, t)
    return following


def _log_mode(leg: ModeLeg, t: float) -> None:
    """Log a mode that begins: the state of each of its elements, and what struck."""
    if is_logged():
        struck = leg.cause is not None and leg.cause.blow is not None
        states = ", ".join(f"{name} {word}" for name, word in leg.program.words.items())
        log("t = %g s: %s%s", t, "an impact; " if struck else "", states or "free")


def _jump(run: ModeRun, t: float, x: Floats, index: int) -> Floats | None:
    """Return the state after an impact from which the run goes on in its mode; None where that ends."""
    leg, switches = run.legs[-1], run.switches
    with stage("decide"):
        met = switches.within(leg, t, x, index)
    if met is None:
        return None
    if met.cause is not None and met.cause.blow is not None and met.facts is not None:
        blow = met.cause.blow
        if any(strikes_now(each, blow) for each in run.mechanism.state_stops.values()):
            return None
        if stop_jumped((leg, leg), t, (x, met.after), switches.scale.speed) is not None:
            return None
        switches.hit(blow, met.facts)
        log("t = %g s: an impact", t)
    run.jumps.append(LegJump(len(run.legs) - 1, t, index, met.after, met.moved, met.cause))
    return met.after.copy()


def _note_turn(run: ModeRun, passage: Passage) -> None:
    """Note a turn that the loop in C has taken."""
    switches = run.switches
    if passage.speed != switches.scale.speed:
        switches.scale = replace(switches.scale, speed=passage.speed)
    run.legs[-1] = run.legs[-1].come(passage.written, passage.time, passage.steps)
    leg = switches.enter(run.prepared.memory.legs[passage.to].passed_into(passage))
    switches.returns.to(passage.time, leg.program.key)
    run.legs.append(leg)
    _log_mode(leg, passage.time)


# ----------------------------------------------------------------------------------------------------------------------
# The run of a system of which some holds one way only, as it is asked for, and its modes compiled.


def one_way_runs(
    ready: PreparedSystem, template: Problem, settings: RunSettings, code: Native
) -> Callable[[], ModeRun]:
    """Return what begins a run of a system of which some holds one way only."""
    laws_of = ready.laws or LawMechanism.of(ready.state.declared, ready.system.simulation)
    declared, bars, every = laws_of.declared, laws_of.bars, laws_of.every
    begun = None if ready.laws else (ready.mechanism, ready.compiled)
    make = partial(_compile_mode, begun, ready.system.simulation, ready.formalism, code)
    laws = laws_of_runs(ready, laws_of, code)
    looks = tuple(times_to_check(ready.system, ready.parameter_values, settings.t_end).tolist())
    assert ready.state.posed is not None  # what holds one way only poses its laws at the start
    scale = ready.state.posed.rows.scale
    template = replace(template, project=settings.project, moments=looks)
    served = None if every is None else EveryMode(every, laws.compiled)

    def runs(of: Problem, stabilised: tuple[float, float] | None) -> PreparedRuns:
        modes = ModePrograms(declared, make, of, stabilised or (0.0, 0.0), served)
        return PreparedRuns(laws, modes, of, scale, stabilised, bars)

    def own() -> float:
        pilot = ModeRun(prepared=runs(replace(template, samples=2), None))
        return own_coefficient(pilot.legs[0].of, pilot.loop)

    stabilised = None if settings.baumgarte is None else settings.baumgarte.chosen(own)
    return partial(ModeRun, prepared=runs(template, stabilised))


def laws_of_runs(ready: PreparedSystem, laws_of: LawMechanism, code: Native) -> Laws:
    """Return the laws of runs of a system that is ready, compiled."""
    known = ready.mechanism.parameters.places
    values = [  # parameters that the system has not are components of normals, before anything has met
        ready.parameters[known[x.name]] if x.name in known else float(x.value is ONE)
        for x in laws_of.declared.parameters
    ]
    served = (ready.formalism, laws_of.served) if laws_of.served else None
    recalled = recall_laws(laws_of.declared, served, code)
    return Laws(laws_of.declared, recalled.compiled, recalled.metadata, np.array(values, dtype=float))


def _compile_mode(
    begun: tuple[Mechanism, Compiled] | None,
    settings: Settings,
    formalism: str,
    code: Native,
    entered: Mechanism,
) -> Compiled:
    """Return a mechanism in a mode, compiled; that with which a run has `begun` is so. No closure, to be pickled."""
    form = form_of(settings, constrained=bool(entered.rows), varies=True)
    if begun is not None and not entered.rows and entered == begun[0]:
        return begun[1]
    if form == "index_2" and len(entered.held) == len(entered.speeds):
        form = "implicit"  # nothing moves: no rows have to be kept
    return compile_mechanism(entered, formalism, form, code)
