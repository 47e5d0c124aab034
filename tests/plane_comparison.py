"""Runs of the package against runs by brute force, as long as a disturbance has not grown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from plane_brute_force import Event, Run, Simulation
from plane_models import Model, text

import multibody_sym as mbs

DISTURBED = 1e-10
GROWN = 1e-7
ALIKE = 1e-6
FAINT, AROUND = 3e-3, 5e-4
"""Impulses (N s) of the last of endlessly many bounces, and the time (s) about them in which states alone count.

Bounces lower than 1e-9 m are none in the package where others touch, too, so that it ends them sooner.
"""
SAMPLES = 101

WORDS = {
    "lower": "on",
    "upper": "on",
    "taut": "on",
    "closed": "on",
    "free": "open",
    "slack": "open",
    "collapse": "impact",
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


def compare(model: Model, **options: Any) -> Compared:
    """Compare runs of a model up to where a disturbance shows, or the laws have several answers."""
    own = Simulation(model)
    run, disturbed = own.simulate(), Simulation(model, DISTURBED).simulate()
    until = min(run.end, disturbed.end)
    why = run.why if run.end < model.t_end else ""
    shaken = difference(course(own, run, until), course(own, disturbed, until), until, GROWN)
    if shaken is not None:
        until, why = shaken[0], "disturbed"
    until = min(until, model.t_end) if not why else 0.999 * until
    if until < 1e-3:
        return Compared(until, 0, "", why)
    system = mbs.loads(text(model))
    theirs = mbs.simulate(system, t_end=until, samples=SAMPLES, rtol=1e-11, atol=1e-12, **options)
    events = [_event(each) for each in theirs.events]
    first = course(own, run, until)
    found = difference(first, Course(events, np.hstack([theirs.q, theirs.u])), until, ALIKE)
    return Compared(until, len(first.events), "" if found is None else f"{found[0]:.9g} s: {found[1]}", why)


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
    found = []
    margin = max(allowed, 1e-9) * until
    for element in {x.element for x in (*first, *second)}:
        both = [[x for x in events if x.element == element] for events in (first, second)]
        faint = [x.t for x in (*both[0], *both[1]) if 0.0 < x.impulse < FAINT]
        own, other = (_reduced(events, faint) for events in both)
        for k in range(max(len(own), len(other))):
            one, two = (x[k] if k < len(x) else None for x in (own, other))
            t = min(x.t for x in (one, two) if x is not None)
            if t > until - (2 * AROUND if faint else margin):
                break
            if not _alike(one, two, margin, allowed, faint):
                found.append((t, f"{element}: {_told(one)} against {_told(two)}"))
                break
    return min(found, default=None)


def _reduced(events: Sequence[Event], faint: Sequence[float]) -> list[Event]:
    """Return the events of an element; about faint bounces the last of its states alone, if it is another one."""
    found, state = list[Event](), "open"
    for place, event in enumerate(events):
        following = events[place + 1] if place + 1 < len(events) else None
        if _is_about(event.t, faint):
            lasts = following is not None and _is_about(following.t, faint) and following.t - event.t < AROUND
            if event.kind != "impact":
                state = event.kind
            if not lasts and state != _state_of(found):
                found.append(replace(event, kind=state))
        else:
            found.append(event)
            state = state if event.kind == "impact" else event.kind
    return found


def _state_of(events: Sequence[Event]) -> str:
    return next((x.kind for x in reversed(events) if x.kind != "impact"), "open")


def _is_about(t: float, faint: Sequence[float]) -> bool:
    return any(abs(t - x) < AROUND for x in faint)


def _alike(one: Event | None, two: Event | None, margin: float, allowed: float, faint: Sequence[float]) -> bool:
    if one is None or two is None or one.kind != two.kind:
        return False
    if _is_about(one.t, faint):
        return abs(one.t - two.t) < 2 * AROUND
    # An impulse that is not unique is no number, and differs from none.
    return abs(one.t - two.t) <= margin and not abs(one.impulse - two.impulse) > allowed * (1.0 + one.impulse)


def _told(event: Event | None) -> str:
    return "nothing" if event is None else f"{event.kind} at {event.t:.12g} with {event.impulse:.9g}"


def _states_differ(first: Course, second: Course, until: float, allowed: float) -> tuple[float, str] | None:
    times = np.linspace(0.0, until, SAMPLES)
    jumps = np.array([x.t for x in (*first.events, *second.events)])
    faint = np.array([x.t for x in (*first.events, *second.events) if 0.0 < x.impulse < FAINT])
    apart = np.array([np.abs(jumps - t).min(initial=np.inf) > 2e-5 for t in times])
    apart &= np.array([np.abs(faint - t).min(initial=np.inf) > AROUND for t in times])
    apart[0] = True
    size = 1.0 + np.abs(first.states)
    wrong = np.abs(first.states - second.states) / size > allowed
    wrong[~apart, first.states.shape[1] // 2 :] = False
    places = np.argwhere(wrong)
    if not len(places):
        return None
    k, j = places[0]
    return float(times[k]), f"state {j}: {first.states[k, j]:.12g} against {second.states[k, j]:.12g}"
