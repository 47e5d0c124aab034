"""Runs of the package against runs by brute force, as long as a disturbance has not grown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from typing import Any

import numpy as np
from plane_brute_force import Event, Run, Simulation
from plane_models import Model, text

import multibody_sym as mbs

DISTURBED = 1e-10
GROWN = 1e-7
ALIKE = 1e-6
TAIL = 2e-5
"""The time (s) before rest in which impacts are not told apart: each program ends infinitely many in its own way."""
SAMPLES = 101
SHORTEST = 1e-3
"""Shorter runs (s) are not compared."""

WORDS = {
    "lower": "on",
    "upper": "on",
    "taut": "on",
    "closed": "on",
    "free": "open",
    "slack": "open",
}


@dataclass(frozen=True)
class Course:
    """Events of a run and its states (k, n) at given times, speeds in the second half."""

    events: list[Event]
    states: np.ndarray


@dataclass(frozen=True)
class Compared:
    """Until when (s) two programs are compared, how many events they share, what differs, and why the run ended."""

    until: float
    events: int
    difference: str
    why: str


@dataclass(frozen=True)
class Reference:
    """A run by brute force, up to which time (s) it is one to compare with, and why it ended there."""

    model: Model
    until: float
    course: Course
    why: str


def reference(model: Model) -> Reference:
    """Return the run of a model up to where a disturbance shows, or the laws have several answers."""
    own = Simulation(model)
    run, disturbed = own.simulate(), Simulation(model, DISTURBED).simulate()
    until = min(run.end, disturbed.end)
    why = run.why if run.end < model.t_end else ""
    shaken = difference(course(own, run, until), course(own, disturbed, until), until, GROWN)
    if shaken is not None:
        until, why = shaken[0], "disturbed"
    until = min(until, model.t_end) if not why else 0.999 * until
    return Reference(model, until, course(own, run, until), why)


def compare(own: Reference, **options: Any) -> Compared:
    """Compare the package's run of a model with a reference."""
    if own.until < SHORTEST:
        return Compared(own.until, 0, "", own.why)
    system = mbs.loads(text(own.model))
    theirs = mbs.simulate(system, t_end=own.until, samples=SAMPLES, rtol=1e-11, atol=1e-12, **options)
    events = [_event(each) for each in theirs.events]
    found = difference(own.course, Course(events, np.hstack([theirs.q, theirs.u])), own.until, ALIKE)
    told = "" if found is None else f"{found[0]:.9g} s: {found[1]}"
    return Compared(own.until, len(own.course.events), told, own.why)


def course(own: Simulation, run: Run, until: float) -> Course:
    """Return a run up to a time, in the coordinates of joints."""
    L, place = own.geometry.of_joints
    states = np.array([run.at(float(t)) for t in np.linspace(0.0, until, SAMPLES)])
    q, u = np.split(states, 2, axis=1)
    return Course([x for x in run.events if x.t <= until], np.hstack([q @ L.T - place, u @ L.T]))


def _event(told: dict[str, Any]) -> Event:
    kind = WORDS.get(told["kind"], told["kind"])
    return Event(told["t"], told["element"], kind, told.get("impulse", 0.0))


def difference(first: Course, second: Course, until: float, allowed: float) -> tuple[float, str] | None:
    """Return when and how two runs differ first."""
    found = [_events_differ(first.events, second.events, until, allowed), _states_differ(first, second, until, allowed)]
    return min((x for x in found if x is not None), default=None)


def _events_differ(
    first: Sequence[Event], second: Sequence[Event], until: float, allowed: float
) -> tuple[float, str] | None:
    margin = max(allowed, 1e-9) * until
    ends = _joined([*_ends(first, second, margin), *_ends(second, first, margin)])
    found = []
    for end in ends:
        one, two = (max((x.t for x in events if end.has(x)), default=end.since) for events in (first, second))
        if abs(one - two) > margin and end.t <= until - TAIL - margin:
            found.append((end.t, f"{', '.join(sorted(end.names))}: end at {one:.12g} against {two:.12g}"))
    for element in {x.element for x in (*first, *second)}:
        own, other = (_reduced(events, element, ends) for events in (first, second))
        for one, two in zip_longest(own, other):
            t = min(x.t for x in (one, two) if x is not None)
            if t > until - TAIL - margin:
                break
            if not _alike(one, two, margin, allowed):
                found.append((t, f"{element}: {_told(one)} against {_told(two)}"))
                break
    return min(found, default=None)


@dataclass(frozen=True)
class End:
    """When infinitely many impacts end, since when (s) they are not told apart, and all that strikes with them."""

    since: float
    t: float
    names: frozenset[str]

    def has(self, event: Event) -> bool:
        """Return whether an event is one of those that are not told apart."""
        return event.element in self.names and self.since < event.t <= self.t


def _ends(events: Sequence[Event], others: Sequence[Event], margin: float) -> list[End]:
    """Return where elements that struck shortly before come to rest, or where a collapse ends their impacts.

    An end lasts until the same is told by `others`, which may be later by a margin (s).
    """
    found = []
    for end in (x for x in events if x.kind not in ("impact", "open")):
        late = [x for x in events if end.t - TAIL < x.t <= end.t and x != end]
        struck = {x.t for x in late if (x.element, x.kind) == (end.element, "impact")} | _closings(events, end)
        struck |= {end.t} if end.kind == "collapse" else set()
        if struck:
            names = frozenset({end.element, *(x.element for x in late if x.t in struck)})
            same = [x.t for x in others if (x.element, x.kind) == (end.element, end.kind)]
            found.append(End(end.t - TAIL, max([end.t, *(t for t in same if abs(t - end.t) <= margin)]), names))
    return found


def _closings(events: Sequence[Event], end: Event) -> set[float]:
    """Return when an element closed shortly before, each time to open again, sooner by less than half of the time."""
    times = [x.t for x in events if x.element == end.element and x.kind not in ("impact", "open") and x.t <= end.t]
    opened = [x.t for x in events if (x.element, x.kind) == (end.element, "open")]
    closings = [t for t, until in pairwise(times) if any(t <= x < until for x in opened)] + times[-1:]
    shrinks = len(closings) > 2 and 2.0 * (closings[-1] - closings[-2]) < closings[-2] - closings[-3]
    return {t for t in closings[:-1] if shrinks and t > end.t - TAIL}


def _joined(ends: Sequence[End]) -> list[End]:
    """Return the ends of both runs, as one where they are near each other and share elements: these strike in turn."""
    found = list[End]()
    for end in sorted(ends, key=lambda x: x.t):
        near = [x for x in found if x.t > end.since and x.names & end.names]
        found = [x for x in found if x not in near]
        since = min([end.since, *(x.since for x in near)])
        found.append(End(since, end.t, end.names.union(*(x.names for x in near))))
    return found


def _reduced(events: Sequence[Event], element: str, ends: Sequence[End]) -> list[Event]:
    """Return the events of an element; the last of infinitely many impacts and the state that they lead to are one."""
    found = sorted((x for x in events if x.element == element), key=lambda x: x.t)
    for end in (x for x in ends if element in x.names):
        before = [x for x in found if x.t <= end.since]
        late = [x for x in found if end.has(x)]
        words = [x for x in (*before, *late) if x.kind not in ("impact", "collapse")]
        state = words[-1] if words else Event(end.t, element, "open")
        found = [*before, Event(end.t, element, state.kind, math.nan), *found[len(before) + len(late) :]]
    return found


def _alike(one: Event | None, two: Event | None, margin: float, allowed: float) -> bool:
    if one is None or two is None or one.kind != two.kind:
        return False
    # An impulse that is not unique is no number, and differs from none.
    return abs(one.t - two.t) <= margin and not abs(one.impulse - two.impulse) > allowed * (1.0 + one.impulse)


def _told(event: Event | None) -> str:
    return "nothing" if event is None else f"{event.kind} at {event.t:.12g} with {event.impulse:.9g}"


def _states_differ(first: Course, second: Course, until: float, allowed: float) -> tuple[float, str] | None:
    times = np.linspace(0.0, until, SAMPLES)
    jumps = np.array([x.t for x in (*first.events, *second.events)])
    apart = np.array([np.abs(jumps - t).min(initial=np.inf) > 2e-5 for t in times])
    apart[0] = True
    size = 1.0 + np.abs(first.states)
    wrong = np.abs(first.states - second.states) / size > allowed
    wrong[~apart, first.states.shape[1] // 2 :] = False
    places = np.argwhere(wrong)
    if not len(places):
        return None
    k, j = places[0]
    return float(times[k]), f"state {j}: {first.states[k, j]:.12g} against {second.states[k, j]:.12g}"
