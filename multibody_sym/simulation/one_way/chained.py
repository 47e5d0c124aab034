"""The run of a mechanism of which some holds one way only: from switch to switch, with what happened at each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property, partial
from typing import Any, Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.errors import NoSolutionError
from multibody_sym.integrators.flow import Status
from multibody_sym.integrators.methods.library import LibraryMethod
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart, Mode
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.chain import Leg, Stopped, Switch, chain, shortly
from multibody_sym.runtime.course import Passage
from multibody_sym.runtime.problem import Begun, Event, Loop, Problem, Reason, RunFailure
from multibody_sym.scalars.node import Node
from multibody_sym.simulation.along.fine import Stretch as AlongStretch
from multibody_sym.simulation.along.jumps import Jump, Passed, added, passed
from multibody_sym.simulation.oddities import SEVERAL
from multibody_sym.simulation.one_way import thin_bars
from multibody_sym.simulation.one_way.account import energy_account
from multibody_sym.simulation.one_way.at_switches import stop_jumped, stop_met, stopped, stops_at_turns, struck
from multibody_sym.simulation.one_way.decision import Decided
from multibody_sym.simulation.one_way.facts import Facts, Laws, rubs
from multibody_sym.simulation.one_way.impact import Blow, Returns, Standstill
from multibody_sym.simulation.one_way.jams import before_jam, jam_of, jams, slip_stopped
from multibody_sym.simulation.one_way.modes import ModeProgram, Modes, key_of, on_its_way
from multibody_sym.simulation.one_way.remembered import Remembered
from multibody_sym.simulation.one_way.roads import Roads
from multibody_sym.simulation.one_way.stretches import Change, Stretch, between_jumps, parts_of, tell
from multibody_sym.simulation.one_way.switches import Switches
from multibody_sym.simulation.one_way.turns import followed
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.modes import Answer, EnergyAccount, noted

IMPACT: Final = "impact"
COLLAPSE: Final = "collapse"
_AT_ONCE: Final = 1e-3
"""The part of a mean step within which a return to a mode is no motion."""
_RETURNS: Final = 2
_GIVEN_UP: Final = 20
_KEPT: Final = 1e4
"""How much further a mode that is kept may be beyond what ends it: 1e-8 of the forces."""
_UNSEEN: Final = 100.0
"""The multiple of a run's absolute tolerance below which a speed is rounding of its steps."""
_UNSEEN_MOST: Final = 1e-8
"""The largest such speed (m/s): a tenth of that up to which slip keeps the direction in which it starts."""


@dataclass(eq=False)
class PreparedRuns:
    """What the runs of one prepared system share, by `laws`: their first decision, modes, and where switches led.

    `template` is the problem of all, `scale` tells how large and fast the model is where they begin; `bars` have no
    thickness. Rows are put back after each step if the template's are, or `stabilised` by Baumgarte's alpha, beta
    (1/s).
    """

    laws: Laws
    modes: Modes
    template: Problem
    scale: Scale
    stabilised: tuple[float, float] | None
    bars: tuple[thin_bars.ThinBar, ...] = ()
    remembered: Remembered = field(default_factory=Remembered)

    def switches(self) -> Switches:
        """Return the decisions of a run that has not begun."""
        unseen = min(_UNSEEN * self.template.atol, _UNSEEN_MOST)
        scale = replace(self.scale, unseen=unseen, steps=0.0 if self.template.step else self.template.rtol)
        if isinstance(self.template.method, LibraryMethod):
            scale = replace(scale, rtol=self.template.rtol, atol=self.template.atol)
        standstill = Standstill(self.template.t_end - self.template.t0)
        return Switches(self.laws, scale, self.bars, standstill)

    @cached_property
    def first(self) -> tuple[Decided, tuple[str, ...]]:
        """What is decided at the start, and the sides of bars on which no points are.

        Raises ModelError where a point moves across a thin bar that it touches.
        """
        switches = self.switches()
        return switches.first(self.template.start, self.template.x0), switches.hidden

    @cached_property
    def first_problem(self) -> tuple[Problem, ModeProgram]:
        """The run in the mode in which it begins, with its Programs."""
        return self.modes.problem(self.first[0], None)

    def run(self) -> OneWayRun:
        """Return a run that has not begun."""
        return OneWayRun(self)


@dataclass(eq=False)
class OneWayRun:
    """A run under way, and what it has done so far.

    `stretches` are its modes, one a leg, `changes` what switches did in the order of time, `blows` all impacts, `lost`
    what these took (J), by element, `lost_at_start` (J) what they took in all before the first sample, `jumps` those
    after which a stretch went on: its number, the time, and the state after it; `answers` what `jump` said.
    """

    prepared: PreparedRuns
    changes: list[Change] = field(default_factory=list)
    stretches: list[Stretch] = field(default_factory=list)
    lost: dict[str, float] = field(default_factory=dict)
    lost_at_start: float = 0.0
    legs: list[Leg] = field(default_factory=list)
    jumps: list[tuple[int, float, Floats]] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    blows: list[Jump] = field(default_factory=list)
    _passed: dict[int, Stretch] = field(default_factory=dict)

    def __post_init__(self) -> None:
        template = self.prepared.template
        soon = _AT_ONCE * template.t_end / 200.0
        self.switches = self.prepared.switches()
        self._returns = Returns(soon)
        self._roads = Roads(self.prepared.laws, template, soon, self.turned)

    def begin(self) -> Problem:
        """Return the run in the mode in which it begins.

        Raises NoSolutionError where there is none, ModelError where a point moves across a thin bar that it touches.
        """
        found, self.switches.hidden = self.prepared.first
        self.switches.laws = found.facts.laws
        self._go_the_same_ways()
        entered = self._entered(found, None)
        if isinstance(entered, RunFailure):
            assert entered.reason is not None
            raise NoSolutionError(f"{entered.reason.text} at the start")
        self.lost_at_start = sum(self.lost.values())
        return entered

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in no mode."""
        return self.prepared.laws.mechanism

    @property
    def stabilised(self) -> tuple[float, float] | None:
        """Baumgarte's alpha, beta (1/s), None where rows are put back."""
        return self.prepared.stabilised

    @property
    def loop(self) -> Loop:
        """The loop that goes from mode to mode."""
        return chain(self.onward, self.legs, self.across)

    @cached_property
    def account(self) -> EnergyAccount:
        """The work of friction at each part and of the loads (J), once the run is done."""
        return energy_account(self.along, self.mechanism, self.blows)

    @property
    def along(self) -> list[AlongStretch]:
        """The stretches between jumps of speeds as they are run once more, for what adds up along them."""
        jumps = ([(t, x) for k, t, x in self.jumps if k == number] for number in range(len(self.legs)))
        return [x for each in zip(self.stretches, self.legs, jumps, strict=False) for x in between_jumps(*each)]

    @property
    def passed(self) -> Iterator[Passed]:
        """Both sides of the general theorems at each impact."""
        return (passed(self.mechanism, jump) for jump in self.blows)

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]:
        """Return the time of each impact, and what it adds to work and impulses (leaves)."""
        return [(jump.t, added(self.mechanism, jump, leaves)) for jump in self.blows]

    @property
    def project(self) -> bool:
        """Whether rows are put back after each step."""
        return self.prepared.template.project

    @property
    def events(self) -> list[dict[str, Any]]:
        """What switches changed, as `Trajectory.events` tells it."""
        return [each.told for each in self.changes]

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[Part, ...]:
        """Return samples, which begin with number `first` of the run, by the modes they are in."""
        return parts_of(zip(self.stretches, self.legs, strict=False), (t, q, u), first)

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str:
        """Return which point got through a bar without thickness between samples, empty where none did."""
        bars = self.prepared.bars
        facts = (self.switches.at(float(t[k]), np.concatenate([q[k], u[k]])) for k in range(len(t)))
        return thin_bars.passed_through(bars, facts) if bars else ""

    def onward(self, problem: Problem, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that follows at a switch, or why there is none."""
        cause = self.stretches[-1].cause(switch.index)
        reason = self.switches.hindered(switch.begun.time, switch.x, cause, reversed(self.changes))
        if reason is not None:
            return RunFailure(Status.NO_MODE, switch.begun.time, None, reason)
        if cause.ends == "moves on" and cause.part is not None:
            return self._on_its_way(switch, cause.part)
        if cause.ends == "stops in space" and cause.part is not None:
            switch = stopped(switch, self.stretches[-1], self.switches.at(switch.begun.time, switch.x), cause.part)
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
        self.switches.grown(switch.x[len(problem.q0) :])
        facts = self.switches.seen(now, t, switch.x)
        rough = rubs(facts, now.program.entered)
        jam = jam_of(now, facts) if rough else None
        if rough and jam is None and jams(now, t, switch.x):
            found = self.switches.tipped(now, facts) or self._stopped(facts)
            return RunFailure(Status.SINGULAR, t, None) if found is None else self._later(found, switch)
        if jam is None and problem.crosses:
            return None
        if jam is None:
            again = replace(now.problem, crosses=True, course=None, begun=switch.begun, q0=facts.q, u0=facts.u)
            self._begin(replace(now, problem=again))
            return again
        found = self.switches.beyond(now, jam.facts)
        if found.mode is None:
            why = found.why_none
            reason = Reason(
                f"friction jams: the force at {jam.row} grows without bound, for with its friction it hardly moves "
                f"what it presses (Painleve's paradox), and behind that {why.text}",
                why.ends,
            )
            return RunFailure(Status.NO_MODE, t, None, reason)
        return self._later(found, switch)

    def _later(self, found: Decided, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that was found at an instant beyond a switch, but before the next sample."""
        at, following = found.facts.t, self.prepared.template.times()[switch.begun.written :][:1]
        at = at if found.blow is None else found.blow.t  # facts may be those of a later limit of impacts
        return self._followed(found, replace(switch, begun=replace(switch.begun, time=min(at, *following))))

    def _stopped(self, facts: Facts) -> Decided | None:
        """Return what follows where slip stops at once, as its friction hardly moves what presses it."""
        now, switches = self.stretches[-1], self.switches
        time = before_jam(now, facts)
        if time is None or switches.standstill.lasts(facts.t, len(facts.laws.unilateral)):
            return None
        last = self.along[-1]
        facts = facts.laws.at(max(time, last.problem.start), *last.at(time), facts.scale)
        blow = slip_stopped(now, facts)
        found = None if blow is None else switches.beyond(now, facts, blow)
        return None if found is None or found.mode is None else found

    def _followed(self, found: Decided, switch: Switch) -> Problem | RunFailure | Event | Stopped:
        """Return the run in the mode that was found at a switch, or the stop that it meets."""
        lost, blows = dict(self.lost), len(self.blows)
        entered = self._entered(found, switch)
        if isinstance(entered, RunFailure):
            return entered
        went = entered, found.blow, max(found.late.values(), default=0.0)
        met = stop_met(self.mechanism, self.stretches[-2:], switch, went, self.switches.scale.speed)
        if isinstance(met, Event):  # the run ends before what has struck
            self.lost, self.blows[blows:] = lost, []
        return met or entered

    def jump(self, t: float, x: Floats, index: int) -> Floats | None:
        """Return the state after an impact from which the run goes on in its mode; None where that ends."""
        now, number, switches = self.stretches[-1], len(self.stretches) - 1, self.switches
        met = switches.within(now, number + 1, t, x, index)
        if met is None or met.blow is None or met.facts is None:
            self.jumps += [(number, t, met.after)] if met is not None and met.moved else []
            return None if met is None else met.after.copy()
        if any(struck(each, met.blow) for each in self.mechanism.state_stops.values()):
            return None
        if stop_jumped((now, now), t, (x, met.after), switches.scale.speed) is not None:
            return None
        tell(self.changes, met.blow.t, self._hit(met.blow, dict.fromkeys(met.collapsed, COLLAPSE), met.late))
        switches.tips.struck(met.facts)
        self.jumps.append((number, t, met.after))
        return met.after.copy()

    def _known(self, switch: Switch) -> Decided | None:
        """Return how the run goes on where a switch was decided before and leads on in the same way."""
        now = self.stretches[-1]
        turns = self.prepared.remembered.turns.get((now.key, switch.index))
        if not turns:
            return None
        facts, closed = self.switches.closed_at(now, switch.begun.time, switch.x, now.cause(switch.index))
        rates = None if turns[0].cause is None else now.rates_at(facts)
        ways = (followed(turn, facts, closed, rates) for turn in turns)
        return next((found for found in ways if found is not None), None)

    def _searched(self, switch: Switch) -> Decided:
        """Return how the run goes on, and remember it."""
        now = self.stretches[-1]
        found = self.switches.decided(now, len(self.stretches), switch.begun.time, switch.x, switch.index)
        self.switches.learn(now, switch.index, found)
        self.prepared.remembered.learn(found, now, now.key, switch.index)
        return found

    def _learn(self, mode: Mode, index: int) -> None:
        """Let the loop in C know where a switch of a mode leads, if the run does not stop there."""
        stops = stops_at_turns(self.mechanism)
        self._roads.learn(mode, index, () if stops else self.prepared.remembered.turns.get((key_of(mode), index), ()))

    def _go_the_same_ways(self) -> None:
        """Let the loop in C know what runs before this one have decided."""
        known = self.prepared.remembered.stretches.values()
        for met in known:
            self._met(met.program, met.problem, met.mode, self.prepared.template.start)
        for met in known:
            for index in range(len(met.program.switchings)):
                self._learn(met.mode, index)

    def turned(self, passage: Passage) -> None:
        """Note a turn that the loop in C has taken."""
        stretch = self._passed[passage.to]
        if passage.speed != self.switches.scale.speed:
            self.switches.scale = replace(self.switches.scale, speed=passage.speed)
        self.legs[-1] = self.legs[-1].passed(passage.written, passage.time, passage.steps)
        self.legs.append(Leg.entered(stretch.problem, passage))
        self._returns.to(passage.time, stretch.key)
        tell(self.changes, passage.time, (Change(passage.time, *each) for each in self._begin(stretch, passage.time)))

    def _entered(self, found: Decided, switch: Switch | None) -> Problem | RunFailure:
        """Return the run in the mode that was found, noting what has changed."""
        t = found.facts.t if switch is None else switch.begun.time
        if found.mode is None:
            return RunFailure(Status.NO_MODE, t, None, found.why_none)
        problem, program = self.prepared.first_problem if switch is None else self._behind(found, switch.begun)
        returns = 0 if switch is None or found.blow is not None else self._returns.to(t, key_of(found.mode))
        if switch is not None and returns > _GIVEN_UP:
            now = self.stretches[-1]
            beyond = self.switches.soon_beyond(now, found.facts) or self.switches.slid_out(now, found.facts)
            if beyond is not None:
                return self._entered(beyond, switch)
            changing = ", ".join(sorted({change.element for change in self.changes[-_GIVEN_UP:]}))
            reason = Reason(
                f"no state of {changing or 'what touches'} was found that lasts: {returns} times the same one followed "
                f"within {self._returns.soon:.3g} s, the last ones kept up to 1e-8 of the forces beyond their limits,"
            )
            return RunFailure(Status.NO_MODE, t, None, reason)
        if returns >= _RETURNS:
            pairs = zip(program.switchings, problem.margins, strict=True)
            kept = (_KEPT * margin if x is not None and x.limits else margin for x, margin in pairs)
            problem = replace(problem, margins=tuple(kept))
        stretch = self._met(program, problem, found.mode, t)
        if stretch.problem.course is not None:
            known = self.prepared.remembered.stretches
            known.setdefault(key_of(found.mode), Stretch(program, problem, found.mode))
        self._note(t, found, stretch)
        if found.blow is not None:
            self.switches.tips.struck(found.facts)
        return stretch.problem

    def _behind(self, found: Decided, begun: Begun) -> tuple[Problem, ModeProgram]:
        """Return the run from what a switch did on, which may have been slightly before it: the part before ends then.

        Where impacts have a limit it is the motion that leads to this in the mode that follows.
        """
        problem, program = self.prepared.modes.problem(found, replace(begun, time=found.facts.t))
        if found.facts.t > begun.time:
            q, u = np.split(shortly(problem, begun.time), [len(problem.q0)])
            problem = replace(problem, begun=begun, q0=q, u0=u)
        elif self.legs:
            self.legs[-1] = replace(self.legs[-1], until=found.facts.t)
        return problem, program

    def _met(self, program: ModeProgram, problem: Problem, mode: Mode, t: float) -> Stretch:
        """Return the run in a mode from a time on, which the loop in C knows if it can follow it."""
        jump = partial(noted, self.jump, self.legs, self.answers)
        problem = self._roads.entered(replace(problem, jump=jump), program, mode, t, self.switches.scale)
        stretch = Stretch(program, problem, mode)
        if self._roads.course is not None:
            self._passed[self._roads.number(mode)] = stretch
        return stretch

    def _on_its_way(self, switch: Switch, part: FrictionPart) -> Problem:
        """Return the run in which what has started to slide in space has come to move so fast."""
        now, (q, u) = self.stretches[-1], np.split(switch.x, [len(self.mechanism.coordinates)])
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
        bounces = self.switches.bounces
        bounces.rhythm.mode(stretch.problem.start if time is None else time, stretch.key)
        bounces.rested([name for name, side in stretch.mode.sides.items() if side])
        return [
            (name, word, before.get(name, "")) for name, word in words.items() if before and before.get(name) != word
        ]

    def _hit(
        self, blow: Blow, words: Mapping[str, str] | None = None, late: Mapping[str, float] | None = None
    ) -> list[Change]:
        """Note what an impact did, and return it; what rests does so when it would have ceased to bounce."""
        self.blows.append(Jump(blow.t, blow.q, blow.u, blow.jump, blow.rows, blow.lost, self.switches.laws.parameters))
        for name, each in blow.lost.items():
            self.lost[name] = self.lost.get(name, 0.0) + each
        self.switches.hit(blow)
        changes = []
        for name, impulse in blow.impulses.items():
            when, word = blow.t + (late or {}).get(name, 0.0), (words or {}).get(name, IMPACT)
            if impulse or blow.lost.get(name) or word != IMPACT:
                changes.append(Change(when, name, word, "", impulse, blow.lost.get(name, 0.0)))
        return changes
