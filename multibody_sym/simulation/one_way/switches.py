"""What follows at the switches of a run: what is decided there, and what of the run before counts for it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import takewhile
from typing import Final

import numpy as np

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.dynamics.programs.switching import Switching
from multibody_sym.model.mechanism.one_way import Mode, OneWay
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.chain import stepped
from multibody_sym.runtime.problem import Reason
from multibody_sym.runtime.python_loop import put_back
from multibody_sym.simulation.one_way import settling, thin_bars
from multibody_sym.simulation.one_way.decision import SOON, Before, NextState, next_state
from multibody_sym.simulation.one_way.facts import Facts, Laws, larger
from multibody_sym.simulation.one_way.impact import Bounces, Hit, ImpactOutcome, Returns, Standstill, bounced, ceases
from multibody_sym.simulation.one_way.legs import Cause, Change, Leg
from multibody_sym.simulation.one_way.modes import Key
from multibody_sym.simulation.one_way.tips import Tips, is_tip, rounded_meeting

_PROMPT: Final = 1e-14
"""The part of the time up to which an impact is not too late."""

_FITS: Final = 4.0
"""The factor up to which the margin of a mode differs from that of points as fast as they are now."""


@dataclass(frozen=True, eq=False)
class Within:
    """Where a mode goes on at a switch: the state `after` (nq + nu,), and the impact, if there was one, at `facts`.

    `moved`: it was put onto its face.
    """

    after: Floats
    moved: bool = False
    facts: Facts | None = None
    cause: Cause | None = None


@dataclass
class Switches:
    """The decisions of a run by `laws`, which know the normals of points that have met, for a model of a `scale`.

    Of the run before count how fast it was, on which sides of `bars` no point is (`hidden`), what `bounces`, how often
    it stood still, and which mode mostly followed at a switching function.
    """

    laws: Laws
    scale: Scale
    bars: tuple[thin_bars.ThinBar, ...]
    standstill: Standstill
    returns: Returns
    hidden: tuple[str, ...] = ()
    bounces: Bounces = field(default_factory=Bounces)
    _usual: dict[tuple[Key, int], Mode] = field(default_factory=dict)
    _last: tuple[tuple[float, int, bytes], NextState] | None = None

    @cached_property
    def tips(self) -> Tips:
        """What is known of points that meet."""
        return Tips.of(self.laws.mechanism)

    def at(self, t: float, x: Floats) -> Facts:
        """Return what laws ask at a state (nq + nu,)."""
        nq = len(self.laws.mechanism.coordinates)
        return self.laws.at(t, x[:nq], x[nq:], self.scale)

    def first(self, t: float, x: Floats) -> NextState:
        """Return what is decided at the start. Raises ModelError where a point moves across a thin bar it touches."""
        facts = self.at(t, x)
        for bar in self.bars:
            bar.verify_leaving(facts)
        self.laws = self.tips.meeting(facts, ())
        facts = self.at(t, x)
        aside = self.tips.aside(facts, ())
        self.hidden = thin_bars.hidden_sides(
            self.bars, facts, lambda known: next_state(facts, (), hidden=known, beyond=aside)
        )
        return self.tips.resting(next_state(facts, (), hidden=self.hidden, beyond=aside))

    def hindered(
        self, t: float, x: Floats, cause: Switching, changes: Callable[[], Sequence[Change]]
    ) -> Reason | None:
        """Return why nothing follows what has ended a mode, after some `changes`; None where it does."""
        if endless := self.standstill.lasts(t, len(self.laws.unilateral)):
            lately = takewhile(lambda each: each.time >= self.standstill.since, reversed(changes()))
            return Reason(f"{', '.join(sorted({cause.element.name, *(each.element for each in lately)}))}: {endless}")
        if cause.ends != "closes" or is_tip(cause.element) or not thin_bars.is_behind(self.at(t, x), cause.element):
            return None
        hidden = thin_bars.turned_round(self.bars, cause.element, self.hidden)
        self.hidden = self.hidden if hidden is None else tuple(hidden)
        return Reason(f"{cause.element.name}: {thin_bars.why_behind(cause.element)}") if hidden is None else None

    # --- what follows -------------------------------------------------------------------------------------------------

    def next_state(self, now: Leg, t: float, x: Floats, index: int) -> NextState:
        """Return how a leg goes on from a state at which a switching function of it has crossed.

        An impact that ends the mode is asked for twice: whether the mode goes on behind it, and what follows.
        """
        asked = (t, index, x.tobytes())
        if self._last is not None and self._last[0] == asked:
            return self._last[1]
        cause = now.switching(index)
        guess = None if cause.limits else self._usual.get((now.program.key, index))
        facts, closed = self.closed_at(now, t, x, cause)
        beyond = [cause.element.name, *self._leaving(now, facts)] if cause.ends == "leaves" else []
        beyond += facts.taken_over(cause.element, now.active) if cause.ends == "closes" else []
        beyond += self.tips.aside(facts, now.active)
        before = Before(now.mode, now.udot_at(facts), now.of.rates, guess, self.bounces)
        found = self.tips.resting(next_state(facts, closed, before, beyond=beyond, hidden=self.hidden))
        self._last = asked, found
        return found

    def learn(self, now: Leg, index: int, found: NextState) -> None:
        """Remember which mode followed: the next search begins with it."""
        if found.mode is not None:
            self._usual[now.program.key, index] = found.mode

    def beyond(self, now: Leg, facts: Facts, blow: ImpactOutcome | None = None) -> NextState:
        """Return what follows at an instant to which the mode does not lead, behind an impact if one is known."""
        before = Before(now.mode, now.udot_at(facts), None, None, self.bounces)
        aside = self.tips.aside(facts, now.active)
        return self.tips.resting(next_state(facts, now.active, before, beyond=aside, hidden=self.hidden, blow=blow))

    def soon_beyond(self, now: Leg, limit: Facts) -> NextState | None:
        """Return what follows just beyond the limit of a mode; None where that is a state like others, or not known.

        Friction with what presses either way may have two states on one side of where that turns, and none beyond.
        """
        found = self.beyond(now, self._later(now, limit, SOON[0]))
        proved = found.mode is None and found.found is not None and found.found.proved
        return found if found.blow is not None or proved else None

    def slid_out(self, now: Leg, facts: Facts) -> NextState | None:
        """Return what follows where all that touches rests, as its slip ends at once; None where it does not."""
        u = settling.slid_out(facts, now.active, now.udot_at(facts))
        found = None if u is None else self.beyond(now, settling.moved(facts, u=u))
        return None if found is None or found.mode is None else found

    def tipped(self, now: Leg, facts: Facts) -> NextState | None:
        """Return what follows where forces that are not unique have no room left, so that something opens or slips."""
        if now.mode.shares is None:
            return None
        for part in SOON:
            found = self.beyond(now, self._later(now, facts, part))
            if found.mode is not None and not found.mode.alike(now.mode):
                return found if found.blow is not None else replace(found, facts=facts)
        return None

    def _leaving(self, now: Leg, facts: Facts) -> list[str]:
        """Return what gets past an edge at one instant: two corners of a box do side by side."""
        soon = self._later(now, facts, SOON[0])
        at_edge = (x for x in self.laws.unilateral if x.name in now.active and facts.reach(x) <= facts.allowed_gap(x))
        return [x.name for x in at_edge if soon.reach(x) < -soon.rounded_gap(x)]

    @staticmethod
    def _later(now: Leg, facts: Facts, part: float) -> Facts:
        """Return what holds a part of the model's time later, as the mode has it."""
        soon, x = part * facts.scale.time, np.concatenate([facts.q, facts.u])
        q, u = np.split(stepped(now.of.rates, facts.t, x, soon), [len(facts.q)])
        return facts.laws.at(facts.t + soon, q, u, facts.scale)

    def within(self, now: Leg, t: float, x: Floats, index: int) -> Within | None:
        """Return how the mode goes on where it might end; None where it does end."""
        cause = now.switching(index)
        if cause.ends == "lies flat":
            return None if self.at(t, x).lying([cause.element]) else Within(x)
        if cause.ends != "closes" or self.standstill.lasts(t, len(self.laws.unilateral)):
            return None
        facts = self.seen(now, t, x)
        aside = self.tips.aside(facts, now.active)
        element = self.tips.striking(facts, cause.element, (*aside, *self.hidden))
        if element is None:
            return Within(x)
        if is_tip(element) and not self._fits(now, facts, element):
            return None
        if thin_bars.is_behind(facts, element):
            return None
        leaving = self.bounces.leaving(facts, element)
        if leaving is not None:
            return Within(np.concatenate([leaving, facts.u]), moved=leaving is not facts.q)
        facts = self._touched(now, facts, element)
        blow, late, collapsed = bounced(facts, element, (*aside, *self.hidden)), dict[str, float](), frozenset[str]()
        udot = now.udot_at(facts) if ceases(facts, element) else facts.u  # nobody asks how what never rests falls
        before = Before(now.mode, udot, now.of.rates, None, self.bounces)
        if blow is not None and not before.late(facts, [element]):
            u = facts.u + blow.jump
        else:
            found = self.next_state(now, t, x, index)
            blow, facts, u, late, collapsed = found.blow, found.facts, found.facts.u, {**found.late}, found.collapsed
            if blow is None or found.mode is None or not found.mode.alike(now.mode) or found.several:
                return None
        after = np.concatenate([facts.q, u])
        if facts.t != t:
            after = stepped(now.of.rates, facts.t, after, t - facts.t)
        return Within(after, facts=facts, cause=Cause(blow.t, blow, late, collapsed))

    @staticmethod
    def _fits(now: Leg, facts: Facts, element: OneWay) -> bool:
        """Return whether the margin of a mode is that of two points as fast as they meet now."""
        pairs = zip(now.program.switchings, now.problem.margins, strict=True)
        margins = {one.element.name: -margin for one, margin in pairs if one is not None and one.ends == "closes"}
        own = rounded_meeting(facts, element)
        return own / _FITS < margins.get(element.name, 0.0) < _FITS * own

    # --- what counts for what follows ---------------------------------------------------------------------------------

    def enter(self, leg: Leg) -> Leg:
        """Note a leg that begins, and return it."""
        self._last = None
        self.bounces.rhythm.mode(leg.start, leg.program.key)
        self.bounces.rested([name for name, side in leg.mode.sides.items() if side])
        return leg

    def hit(self, blow: ImpactOutcome, facts: Facts) -> None:
        """Note an impact, and what holds after it."""
        taking = frozenset(name for name, impulse in blow.impulses.items() if impulse)
        self.bounces.hit(Hit(blow.t, taking, np.concatenate([blow.q, blow.u]), blow.gives_back))
        self.tips.struck(facts)

    # --- what holds at a switch ---------------------------------------------------------------------------------------

    def grown(self, u: Floats) -> None:
        """Note the speeds (nu,) that a run has come to."""
        self.scale = larger(self.scale, u, self.laws.slides)

    def seen(self, now: Leg, t: float, x: Floats) -> Facts:
        """Return what laws ask at a state, with the normals of points that meet there."""
        facts = self.at(t, x)
        self.laws = self.tips.meeting(facts, now.active)
        return facts if self.laws is facts.laws else self.at(t, x)

    def closed_at(self, now: Leg, t: float, x: Floats, cause: Switching) -> tuple[Facts, list[str]]:
        """Return what laws ask where a switching function of the mode has crossed, and the elements that are closed."""
        x = x if now.of.project else put_back(now.of, t, x)
        self.grown(x[len(now.of.q0) :])
        apart = {*now.mode.idle, *([cause.element.name] if cause.ends == "leaves" else [])}
        closed = [name for name in now.active if name not in apart]  # what is idle may have opened: its gap tells
        facts = self.seen(now, t, x)
        touches = cause.ends == "closes" and not is_tip(cause.element)
        touches = touches and not thin_bars.is_behind(facts, cause.element)
        touches = touches or (cause.ends == "closes" and self.tips.strikes(facts, cause.element, now.active))
        closed += [cause.element.name] if touches else []
        return self._touched(now, facts, cause.element) if touches else facts, closed

    def _touched(self, now: Leg, facts: Facts, element: OneWay) -> Facts:
        """Return what held when an element touched that strikes: a step ends where it is in by what rounding may make.

        That is late by a large part of a short flight; its parabola tells when it touched, after the last impact. Two
        points have not met yet by as much, and touch later.
        """
        gap, rate = facts.gap(element), facts.rate(element)
        most = facts.allowed_gap(element) if is_tip(element) else 0.0
        strikes = rate < -facts.allowed_speed(element.normals[0])  # a rope beside one that is taut has no flight
        if not (-2.0 * facts.rounded_gap(element) < gap < most and strikes):
            return facts
        room = max(rate * rate + 2.0 * gap * facts.falling(element, now.udot_at(facts)), 0.0)  # a face it grazes: none
        ago = -2.0 * gap / (math.sqrt(room) - rate)
        since = max(self.bounces.rhythm.last, now.start)
        if not (_PROMPT * abs(facts.t) < abs(ago) and ago < facts.t - since):
            return facts
        before = stepped(now.of.rates, facts.t, np.concatenate([facts.q, facts.u]), -ago)
        q, u = np.split(before, [len(facts.q)])
        return facts.laws.at(facts.t - ago, q, u, facts.scale)
