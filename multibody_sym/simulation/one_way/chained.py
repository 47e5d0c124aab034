"""The run of a mechanism of which some holds one way only: from switch to switch, with what happened at each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial
from itertools import takewhile
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.errors import NoSolutionError
from multibody_sym.integrators.flow import Status
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, Mode, OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.chain import Leg, Stopped, Switch, chain, shortly, stepped
from multibody_sym.runtime.course import Passage
from multibody_sym.runtime.loading import Compiled
from multibody_sym.runtime.problem import Begun, Event, Loop, Problem, RunFailure
from multibody_sym.runtime.python_loop import put_back
from multibody_sym.scalars.node import Node
from multibody_sym.simulation.along.fine import Stretch as AlongStretch
from multibody_sym.simulation.along.jumps import Jump, Passed, added, passed
from multibody_sym.simulation.oddities import SEVERAL
from multibody_sym.simulation.one_way import thin_bars
from multibody_sym.simulation.one_way.account import energy_account
from multibody_sym.simulation.one_way.at_switches import stop_jumped, stop_met, stopped, stops_at_turns, struck
from multibody_sym.simulation.one_way.decision import SOON, Before, Decided, decided
from multibody_sym.simulation.one_way.facts import Facts, Laws, larger, rubs
from multibody_sym.simulation.one_way.impact import Blow, Bounces, Hit, Returns, Standstill, bounced, ceases
from multibody_sym.simulation.one_way.jams import before_jam, jam_of, jams, slip_stopped
from multibody_sym.simulation.one_way.modes import Key, ModeProgram, Modes, key_of, on_its_way
from multibody_sym.simulation.one_way.remembered import Remembered
from multibody_sym.simulation.one_way.roads import Roads
from multibody_sym.simulation.one_way.stretches import Change, Stretch, between_jumps, parts_of, tell
from multibody_sym.simulation.one_way.tips import Tips, is_tip
from multibody_sym.simulation.one_way.turns import followed
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.modes import Answer, EnergyAccount, noted

IMPACT: Final = "impact"
COLLAPSE: Final = "collapse"
_AT_ONCE: Final = 1e-3
"""The part of a mean step within which a return to a mode is no motion."""
_RETURNS: Final = 2
_GIVEN_UP: Final = 20
_PROMPT: Final = 1e-14
"""The part of the time up to which an impact is not too late."""
_KEPT: Final = 1e4
"""How much further a mode that is kept may be beyond what ends it: 1e-8 of the forces."""
_UNSEEN: Final = 100.0
"""The multiple of a run's absolute tolerance below which a speed is rounding of its steps."""
_UNSEEN_MOST: Final = 1e-8
"""The largest such speed (m/s): a tenth of that up to which slip keeps the direction in which it starts."""


@dataclass
class OneWayRun:
    """A run under way, by `laws`; `make` compiles a mechanism in a mode, `template` is the run's problem.

    `scale` tells how large and fast the model is where it begins.

    Rows are put back after each step if the template's are, or `stabilised` by Baumgarte's alpha, beta (1/s).
    `blows` are all impacts, `changes` what switches did in the order of time, `stretches` the modes, `lost` what
    impacts took (J), by element, `lost_at_start` (J) what they took in all before the first sample, `answers` what
    `jump` said. `trouble` says why a run could not go on. `jumps` are those after which a stretch went on: its number,
    the time, and the state after it.
    """

    laws: Laws
    make: Callable[[Mechanism], Compiled]
    template: Problem
    scale: Scale
    stabilised: tuple[float, float] | None = None
    changes: list[Change] = field(default_factory=list)
    stretches: list[Stretch] = field(default_factory=list)
    lost: dict[str, float] = field(default_factory=dict)
    lost_at_start: float = 0.0
    trouble: str = ""
    legs: list[Leg] = field(default_factory=list)
    jumps: list[tuple[int, float, Floats]] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    blows: list[Jump] = field(default_factory=list)
    bars: tuple[thin_bars.ThinBar, ...] = ()
    every: Mechanism | None = None
    remembered: Remembered = field(default_factory=Remembered)
    _hidden: list[str] = field(default_factory=list)
    _scale: Scale = Scale(1.0, 1.0)
    _usual: dict[tuple[Key, int], Mode] = field(default_factory=dict)
    _passed: dict[int, Stretch] = field(default_factory=dict)
    _bounces: Bounces = field(default_factory=Bounces)
    _last: tuple[tuple[int, float, int, bytes], Decided] | None = None

    def __post_init__(self) -> None:
        self.modes = Modes(self.laws.mechanism, self.make, self.template, self.stabilised or (0.0, 0.0), self._every)
        soon = _AT_ONCE * self.template.t_end / 200.0
        self._returns, self._standstill = Returns(soon), Standstill(self.template.t_end - self.template.t0)
        self._roads = Roads(self.laws, self.template, soon, self.turned)
        self._tips = Tips.of(self.laws.mechanism)

    def begin(self) -> Problem:
        """Return the run in the mode in which it begins.

        Raises NoSolutionError where there is none, ModelError where a point moves across a thin bar that it touches.
        """
        found, self._scale, hidden = self._first
        self.laws = found.facts.laws
        self._hidden = list(hidden)
        self._go_the_same_ways()
        entered = self._entered(found, None)
        if isinstance(entered, RunFailure):
            raise NoSolutionError(f"{self.trouble} at the start")
        self.lost_at_start = sum(self.lost.values())
        return entered

    def again(self) -> OneWayRun:
        """Return the run before it begins, which shares what follows from its start, and what is remembered."""
        given = self.laws, self.make, self.template, self.scale, self.stabilised
        run = OneWayRun(*given, bars=self.bars, every=self.every, remembered=self.remembered)
        run.modes = self.modes
        run.__dict__["_first"] = self._first
        run.__dict__ |= {name: x for name, x in vars(self).items() if name == "_first_problem"}
        return run

    @cached_property
    def _first(self) -> tuple[Decided, Scale, tuple[str, ...]]:
        """What is decided at the start, how large and fast the model is, and the sides of thin bars that are hidden."""
        t, q, u = self.template.start, self.template.q0, self.template.u0
        scale = replace(self.scale, unseen=min(_UNSEEN * self.template.atol, _UNSEEN_MOST))
        facts = self.laws.at(t, q, u, scale)
        for bar in self.bars:
            bar.verify_leaving(facts)
        facts = self._tips.meeting(facts, ()).at(t, q, u, scale)
        aside = self._tips.aside(facts, ())
        hidden = thin_bars.hidden_sides(self.bars, facts, lambda known: decided(facts, (), hidden=known, beyond=aside))
        return self._tips.resting(decided(facts, (), hidden=hidden, beyond=aside)), scale, hidden

    @cached_property
    def _first_problem(self) -> tuple[Problem, ModeProgram]:
        return self.modes.problem(self._first[0], None)

    @property
    def _every(self) -> tuple[Mechanism, Compiled] | None:
        return None if self.every is None else (self.every, self.laws.compiled)

    @property
    def loop(self) -> Loop:
        """The loop that goes from mode to mode."""
        return chain(self.onward, self.legs, self.across)

    @cached_property
    def account(self) -> EnergyAccount:
        """The work of friction at each part and of the loads (J), once the run is done."""
        return energy_account(self.along, self.laws.mechanism)

    @property
    def along(self) -> list[AlongStretch]:
        """The stretches between jumps of speeds as they are run once more, for what adds up along them."""
        jumps = ([(t, x) for k, t, x in self.jumps if k == number] for number in range(len(self.legs)))
        return [x for each in zip(self.stretches, self.legs, jumps, strict=False) for x in between_jumps(*each)]

    @property
    def passed(self) -> Iterator[Passed]:
        """Both sides of the general theorems at each impact."""
        return (passed(self.laws.mechanism, jump) for jump in self.blows)

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]:
        """Return the time of each impact, and what it adds to work and impulses (leaves)."""
        return [(jump.t, added(self.laws.mechanism, jump, leaves)) for jump in self.blows]

    @property
    def project(self) -> bool:
        """Whether rows are put back after each step."""
        return self.template.project

    @property
    def events(self) -> list[dict[str, Any]]:
        """What switches changed, as `Trajectory.events` tells it."""
        return [each.told for each in self.changes]

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str:
        """Return which point got through a bar without thickness between samples, empty where none did."""
        facts = (self.laws.at(float(t[k]), q[k], u[k], self._scale) for k in range(len(t)))
        return thin_bars.passed_through(self.bars, facts) if self.bars else ""

    def _hindered(self, t: float, x: Floats, cause: Switching) -> str:
        """Return why nothing follows what has ended a mode, empty where something does."""
        if endless := self._standstill.lasts(t, len(self.laws.unilateral)):
            lately = takewhile(lambda each: each.time >= self._standstill.since, reversed(self.changes))
            return f"{', '.join(sorted({cause.element.name, *(each.element for each in lately)}))}: {endless}"
        facts = self.laws.at(t, x[: len(self.template.q0)], x[len(self.template.q0) :], self._scale)
        if cause.ends != "closes" or not thin_bars.is_behind(facts, cause.element):
            return ""
        hidden = thin_bars.turned_round(self.bars, cause.element, self._hidden)
        self._hidden = self._hidden if hidden is None else hidden
        return f"{cause.element.name}: {thin_bars.FROM_BEHIND}" if hidden is None else ""

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[Part, ...]:
        """Return samples, which begin with number `first` of the run, by the modes they are in."""
        return parts_of(zip(self.stretches, self.legs, strict=False), (t, q, u), first)

    def onward(self, problem: Problem, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that follows at a switch, or why there is none."""
        cause = self.stretches[-1].cause(switch.index)
        self.trouble = self._hindered(switch.begun.time, switch.x, cause)
        if self.trouble:
            return RunFailure(Status.NO_MODE, switch.begun.time, None)
        if cause.ends == "moves on" and cause.part is not None:
            return self._on_its_way(switch, cause.part)
        if cause.ends == "stops in space" and cause.part is not None:
            q, u = np.split(switch.x, [len(self.template.q0)])
            facts = self.laws.at(switch.begun.time, q, u, self._scale)
            switch = stopped(switch, self.stretches[-1], facts, cause.part)
        found, now = self._known(switch) or self._searched(switch), self.stretches[-1]
        followed = self._followed(found, switch)
        if not isinstance(followed, RunFailure):
            self._learn(now.mode, switch.index)
        return followed

    def across(self, problem: Problem, switch: Switch) -> Problem | RunFailure | Event | Stopped | None:
        """Return the run behind an instant at which friction jams, or that none is.

        Where friction has no part in it steps may lead across: None if they have tried.
        """
        now, t = self.stretches[-1], switch.begun.time
        self._scale = larger(self._scale, switch.x[len(self.template.q0) :], self.laws.slides)
        facts = self._seen(t, switch.x)
        rough = rubs(facts, now.program.entered)
        jam = jam_of(now, facts) if rough else None
        if rough and jam is None and jams(now, t, switch.x):
            found = self._tipped(facts) or self._stopped(facts)
            return RunFailure(Status.SINGULAR, t, None) if found is None else self._later(found, switch)
        if jam is None and problem.crosses:
            return None
        if jam is None:
            again = replace(now.problem, crosses=True, course=None, begun=switch.begun, q0=facts.q, u0=facts.u)
            self._begin(replace(now, problem=again))
            return again
        found = self._decided_beyond(jam.facts)
        if found.mode is None:
            self.trouble = (
                f"friction jams: the force at {jam.row} grows without bound, for with its friction it hardly moves "
                f"what it presses (Painleve's paradox), and behind that {found.why_none}"
            )
            return RunFailure(Status.NO_MODE, t, None)
        return self._later(found, switch)

    def _later(self, found: Decided, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that was found at an instant beyond a switch, but before the next sample."""
        at, following = found.facts.t, self.template.times()[switch.begun.written :][:1]
        at = at if found.blow is None else found.blow.t  # facts may be those of a later limit of impacts
        return self._followed(found, replace(switch, begun=replace(switch.begun, time=min(at, *following))))

    def _tipped(self, facts: Facts) -> Decided | None:
        """Return what follows where forces that are not unique have no room left, so that something opens or slips."""
        now = self.stretches[-1]
        if now.mode.shares is None:
            return None
        x = np.concatenate([facts.q, facts.u])
        for soon in (part * facts.scale.time for part in SOON):
            q, u = np.split(stepped(now.problem.rates, facts.t, x, soon), [len(facts.q)])
            found = self._decided_beyond(self.laws.at(facts.t + soon, q, u, facts.scale))
            if found.mode is not None and not found.mode.alike(now.mode):
                return found if found.blow is not None else replace(found, facts=facts)
        return None

    def _stopped(self, facts: Facts) -> Decided | None:
        """Return what follows where slip stops at once, as its friction hardly moves what presses it."""
        time = before_jam(self.stretches[-1], facts)
        if time is None or self._standstill.lasts(facts.t, len(self.laws.unilateral)):
            return None
        last = self.along[-1]
        facts = self.laws.at(max(time, last.problem.start), *last.at(time), facts.scale)
        blow = slip_stopped(self.stretches[-1], facts)
        found = None if blow is None else self._decided_beyond(facts, blow)
        return None if found is None or found.mode is None else found

    def _followed(self, found: Decided, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that was found at a switch, or the stop that it meets."""
        lost, blows = dict(self.lost), len(self.blows)
        entered = self._entered(found, switch)
        if isinstance(entered, RunFailure):
            return entered
        went = entered, found.blow, max(found.late.values(), default=0.0)
        met = stop_met(self.laws.mechanism, self.stretches[-2:], switch, went, self._scale.speed)
        if isinstance(met, Event):  # the run ends before what has struck
            self.lost, self.blows[blows:] = lost, []
        return met or entered

    def jump(self, t: float, x: Floats, index: int) -> Floats | None:
        """Return the state after an impact from which the run goes on in its mode; None where that ends."""
        now = self.stretches[-1]
        cause = now.cause(index)
        if cause.ends != "closes" or self._standstill.lasts(t, len(self.laws.unilateral)):
            return None
        facts = self._seen(t, x)
        aside = self._tips.aside(facts, now.active)
        element = self._tips.striking(facts, cause.element, (*aside, *self._hidden))
        if element is None:
            return x.copy()
        if thin_bars.is_behind(facts, element):
            return None
        leaving = self._bounces.leaving(facts, element)
        if leaving is not None:
            after = np.concatenate([leaving, facts.u])
            self.jumps += [] if leaving is facts.q else [(len(self.stretches) - 1, t, after)]
            return after.copy()
        facts = self._touched(facts, element)
        blow = bounced(facts, element, (*aside, *self._hidden))
        udot = now.udot_at(facts) if ceases(facts, element) else facts.u  # nobody asks how what never rests falls
        before = Before(now.mode, udot, now.problem.rates, None, self._bounces)
        if blow is None or before.late(facts, [element]):
            found = self._decided(t, x, index)
            blow, facts, u = found.blow, found.facts, found.facts.u
            if blow is None or found.mode is None or not found.mode.alike(now.mode) or found.several:
                return None
            late, collapsed = found.late, found.collapsed
        else:
            u = facts.u + blow.jump
            late, collapsed = dict[str, float](), frozenset[str]()
        after = np.concatenate([facts.q, u])
        if facts.t != t:
            after = stepped(now.problem.rates, facts.t, after, t - facts.t)
        if any(struck(each, blow) for each in self.laws.mechanism.state_stops.values()):
            return None
        if stop_jumped((now, now), t, (x, after), self._scale.speed) is not None:
            return None
        tell(self.changes, blow.t, self._hit(blow, dict.fromkeys(collapsed, COLLAPSE), late))
        self._tips.struck(facts)
        self.jumps.append((len(self.stretches) - 1, t, after))
        return after.copy()

    def _known(self, switch: Switch) -> Decided | None:
        """Return how the run goes on where a switch was decided before and leads on in the same way."""
        now = self.stretches[-1]
        turns = self.remembered.turns.get((now.key, switch.index))
        if not turns:
            return None
        facts, closed = self._at(switch.begun.time, switch.x, now.cause(switch.index))
        rates = None if turns[0].cause is None else now.rates_at(facts)
        ways = (followed(turn, facts, closed, rates) for turn in turns)
        return next((found for found in ways if found is not None), None)

    def _searched(self, switch: Switch) -> Decided:
        """Return how the run goes on, and remember it."""
        now = self.stretches[-1]
        usual = now.key, switch.index
        found = self._decided(switch.begun.time, switch.x, switch.index)
        if found.mode is not None:
            self._usual[usual] = found.mode
        self.remembered.learn(found, now, *usual)
        return found

    def _learn(self, mode: Mode, index: int) -> None:
        """Let the loop in C know where a switch of a mode leads, if the run does not stop there."""
        stops = stops_at_turns(self.laws.mechanism)
        self._roads.learn(mode, index, () if stops else self.remembered.turns.get((key_of(mode), index), ()))

    def _go_the_same_ways(self) -> None:
        """Let the loop in C know what runs before this one have decided."""
        for met in self.remembered.stretches.values():
            self._met(met.program, met.problem, met.mode, self.template.start)
        for met in self.remembered.stretches.values():
            for index in range(len(met.program.switchings)):
                self._learn(met.mode, index)

    def turned(self, passage: Passage) -> None:
        """Note a turn that the loop in C has taken."""
        stretch = self._passed[passage.to]
        if passage.speed != self._scale.speed:
            self._scale = replace(self._scale, speed=passage.speed)
        self.legs[-1] = self.legs[-1].passed(passage.written, passage.time, passage.steps)
        self.legs.append(Leg.entered(stretch.problem, passage))
        self._returns.to(passage.time, stretch.key)
        tell(self.changes, passage.time, (Change(passage.time, *each) for each in self._begin(stretch, passage.time)))

    def _decided(self, t: float, x: Floats, index: int) -> Decided:
        """Return how the run goes on from a state at which a switching function of its mode has crossed.

        An impact that ends the mode is asked for twice: whether the mode goes on behind it, and what follows.
        """
        now = self.stretches[-1]
        asked = (len(self.stretches), t, index, x.tobytes())
        if self._last is not None and self._last[0] == asked:
            return self._last[1]
        cause = now.cause(index)
        guess = None if cause.limits else self._usual.get((now.key, index))
        facts, closed = self._at(t, x, cause)
        beyond = [cause.element.name] if cause.ends == "leaves" else []
        beyond += facts.taken_over(cause.element, now.active) if cause.ends == "closes" else []
        beyond += self._tips.aside(facts, now.active)
        before = Before(now.mode, now.udot_at(facts), now.problem.rates, guess, self._bounces)
        found = self._tips.resting(decided(facts, closed, before, beyond=beyond, hidden=tuple(self._hidden)))
        self._last = asked, found
        return found

    def _seen(self, t: float, x: Floats) -> Facts:
        """Return what laws ask at a state, with the normals of points that meet there."""
        nq = len(self.laws.mechanism.coordinates)
        facts = self.laws.at(t, x[:nq], x[nq:], self._scale)
        self.laws = self._tips.meeting(facts, self.stretches[-1].active)
        return facts if self.laws is facts.laws else self.laws.at(t, x[:nq], x[nq:], self._scale)

    def _at(self, t: float, x: Floats, cause: Switching) -> tuple[Facts, list[str]]:
        """Return what laws ask where a switching function of the mode has crossed, and the elements that are closed."""
        now, nq = self.stretches[-1], len(self.laws.mechanism.coordinates)
        x = x if now.problem.project else put_back(now.problem, t, x)
        self._scale = larger(self._scale, x[nq:], self.laws.slides)
        apart = {*now.mode.idle, *([cause.element.name] if cause.ends == "leaves" else [])}
        closed = [name for name in now.active if name not in apart]  # what is idle may have opened: its gap tells
        facts = self._seen(t, x)
        touches = cause.ends == "closes" and not is_tip(cause.element)
        touches = touches and not thin_bars.is_behind(facts, cause.element)
        closed += [cause.element.name] if touches else []
        return self._touched(facts, cause.element) if touches else facts, closed

    def _touched(self, facts: Facts, element: OneWay) -> Facts:
        """Return what held when an element touched that strikes: a step ends where it is in by what rounding may make.

        That is late by a large part of a short flight; its parabola tells when it touched, after the last impact.
        """
        gap, rate, now = facts.gap(element), facts.rate(element), self.stretches[-1]
        if not (-2.0 * facts.rounded_gap(element) < gap < 0.0 and rate < 0.0):
            return facts
        room = max(rate * rate + 2.0 * gap * facts.falling(element, now.udot_at(facts)), 0.0)  # a face it grazes: none
        ago = -2.0 * gap / (math.sqrt(room) - rate)
        since = max(self._bounces.rhythm.last, now.problem.start)
        if not _PROMPT * abs(facts.t) < ago < facts.t - since:
            return facts
        before = stepped(now.problem.rates, facts.t, np.concatenate([facts.q, facts.u]), -ago)
        q, u = np.split(before, [len(facts.q)])
        return facts.laws.at(facts.t - ago, q, u, facts.scale)

    def _entered(self, found: Decided, switch: Switch | None) -> Problem | RunFailure:
        """Return the run in the mode that was found, noting what has changed."""
        t = found.facts.t if switch is None else switch.begun.time
        if found.mode is None:
            self.trouble = found.why_none
            return RunFailure(Status.NO_MODE, t, None)
        problem, program = self._first_problem if switch is None else self._behind(found, switch.begun)
        returns = 0 if switch is None or found.blow is not None else self._returns.to(t, key_of(found.mode))
        beyond = None if switch is None or returns <= _GIVEN_UP else self._beyond(found.facts)
        if beyond is not None:
            return self._entered(beyond, switch)
        if returns > _GIVEN_UP:
            changing = ", ".join(sorted({change.element for change in self.changes[-_GIVEN_UP:]}))
            self.trouble = (
                f"no state of {changing or 'what touches'} was found that lasts: {returns} times the same one followed "
                f"within {self._returns.soon:.3g} s, the last ones kept up to 1e-8 of the forces beyond their limits,"
            )
            return RunFailure(Status.NO_MODE, t, None)
        if returns >= _RETURNS:
            pairs = zip(program.switchings, problem.margins, strict=True)
            kept = (_KEPT * margin if x is not None and x.limits else margin for x, margin in pairs)
            problem = replace(problem, margins=tuple(kept))
        stretch = self._met(program, problem, found.mode, t)
        if stretch.problem.course is not None:
            self.remembered.stretches.setdefault(key_of(found.mode), Stretch(program, problem, found.mode))
        self._note(t, found, stretch)
        if found.blow is not None:
            self._tips.struck(found.facts)
        return stretch.problem

    def _beyond(self, limit: Facts) -> Decided | None:
        """Return what follows just beyond the limit of a mode; None where that is a state like others, or not known.

        Friction with what presses either way may have two states on one side of where that turns, and none beyond.
        """
        now = self.stretches[-1]
        soon, x = SOON[0] * limit.scale.time, np.concatenate([limit.q, limit.u])
        q, u = np.split(stepped(now.problem.rates, limit.t, x, soon), [len(limit.q)])
        facts = self.laws.at(limit.t + soon, q, u, limit.scale)
        found = self._decided_beyond(facts)
        proved = found.mode is None and found.found is not None and found.found.proved
        return found if found.blow is not None or proved else None

    def _decided_beyond(self, facts: Facts, blow: Blow | None = None) -> Decided:
        """Return what follows at an instant to which the mode does not lead, behind an impact if one is known."""
        now = self.stretches[-1]
        before = Before(now.mode, now.udot_at(facts), None, None, self._bounces)
        aside = self._tips.aside(facts, now.active)
        hidden = tuple(self._hidden)
        return self._tips.resting(decided(facts, now.active, before, beyond=aside, hidden=hidden, blow=blow))

    def _behind(self, found: Decided, begun: Begun) -> tuple[Problem, ModeProgram]:
        """Return the run from what a switch did on, which may have been slightly before it: the part before ends then.

        Where impacts have a limit it is the motion that leads to this in the mode that follows.
        """
        problem, program = self.modes.problem(found, replace(begun, time=found.facts.t))
        if found.facts.t > begun.time:
            q, u = np.split(shortly(problem, begun.time), [len(problem.q0)])
            problem = replace(problem, begun=begun, q0=q, u0=u)
        elif self.legs:
            self.legs[-1] = replace(self.legs[-1], until=found.facts.t)
        return problem, program

    def _met(self, program: ModeProgram, problem: Problem, mode: Mode, t: float) -> Stretch:
        """Return the run in a mode from a time on, which the loop in C knows if it can follow it."""
        jump = partial(noted, self.jump, self.legs, self.answers)
        problem = self._roads.entered(replace(problem, jump=jump), program, mode, t, self._scale)
        stretch = Stretch(program, problem, mode)
        if self._roads.course is not None:
            self._passed[self._roads.number(mode)] = stretch
        return stretch

    def _on_its_way(self, switch: Switch, part: FrictionPart) -> Problem:
        """Return the run in which what has started to slide in space has come to move so fast."""
        now, (q, u) = self.stretches[-1], np.split(switch.x, [len(self.template.q0)])
        problem, mode = on_its_way(now.program, now.problem, now.mode, part)
        self._begin(Stretch(now.program, replace(problem, begun=switch.begun, q0=q, u0=u), mode))
        return self.stretches[-1].problem

    def _note(self, time: float, found: Decided, stretch: Stretch) -> None:
        time = time if found.blow is None else found.blow.t
        several = [Change(time, name, SEVERAL, "", taken=word) for name, word in found.undecided.items()]
        blow, changes = found.blow, self._begin(stretch)
        changed, hits = {name: word for name, word, _ in changes}, list[Change]()
        if blow is not None:
            words = {x: changed.pop(x, COLLAPSE if x in found.collapsed else IMPACT) for x in blow.impulses}
            hits = self._hit(blow, words, found.late)
        others = [Change(time, *each) for each in changes if each[0] in changed]
        tell(self.changes, time, [*several, *hits, *others])

    def _begin(self, stretch: Stretch, time: float | None = None) -> list[tuple[str, str, str]]:
        """Begin a stretch, and return which elements are in another state than before: name, state now and before.

        One to which the loop in C has come back began at another `time` (s) than its problem.
        """
        before, words = self.stretches[-1].words if self.stretches else {}, stretch.words
        self.stretches.append(stretch)
        self._bounces.rhythm.mode(stretch.problem.start if time is None else time, stretch.key)
        self._bounces.rested([name for name, side in stretch.mode.sides.items() if side])
        return [
            (name, word, before.get(name, "")) for name, word in words.items() if before and before.get(name) != word
        ]

    def _hit(
        self, blow: Blow, words: Mapping[str, str] | None = None, late: Mapping[str, float] | None = None
    ) -> list[Change]:
        """Note what an impact did, and return it; what rests does so when it would have ceased to bounce."""
        self.blows.append(Jump(blow.t, blow.q, blow.u, blow.jump, blow.rows, blow.lost, self.laws.parameters))
        for name, each in blow.lost.items():
            self.lost[name] = self.lost.get(name, 0.0) + each
        taking = frozenset(name for name, impulse in blow.impulses.items() if impulse)
        self._bounces.hit(Hit(blow.t, taking, np.concatenate([blow.q, blow.u])))
        changes = []
        for name, impulse in blow.impulses.items():
            when, word = blow.t + (late or {}).get(name, 0.0), (words or {}).get(name, IMPACT)
            if impulse or blow.lost.get(name) or word != IMPACT:
                changes.append(Change(when, name, word, "", impulse, blow.lost.get(name, 0.0)))
        return changes
