"""What a run finds at a switch: that slip in space stops a little later, and which declared stop it meets.

A stop is met there by a state that begins, or by a comparison that an impact or the forces of another mode make true.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.model.declaration.states import StateCondition
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.chain import Stopped, Switch
from multibody_sym.runtime.problem import Event, Problem
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.one_way.facts import Facts
from multibody_sym.simulation.one_way.impact import Blow
from multibody_sym.simulation.one_way.stretches import Stretch

_MOST: Final = 1e-6
"""The part of a run's time within which slip that slows down must have stopped."""
_KNOWN: Final = 1e-9
"""The part of the largest speed up to which a jump of speeds is rounding."""
_NOTHING: Final = 1e-12
"""The value up to which a stop's function is zero, whatever it tells."""


def stopped(switch: Switch, now: Stretch, facts: Facts, part: FrictionPart) -> Switch:
    """Return the switch at which a part stops that slides slowly at the `facts`, by its deceleration there.

    It is at the next sample at the latest, and as it is where slip does not slow down.
    """
    places, (rates, udot) = [facts.place(row) for row in part.rows], now.rates_at(facts)
    v, a = facts.known["phidot"][places], facts.accelerations(places, udot)
    slower, problem = -float(v @ a), now.problem
    left = float(v @ v) / slower if slower > 0.0 else 0.0
    t, sample = switch.begun.time, switch.begun.written
    samples = problem.times()
    until = float(samples[sample]) if sample < len(samples) else problem.t_end
    left = min(left, until - t)
    if not 0.0 < left <= _MOST * (problem.t_end - problem.t0):
        return switch
    x = np.concatenate([facts.q + left * rates, facts.u + left * udot])
    return replace(switch, begun=replace(switch.begun, time=t + left), x=x)


def stops_at_turns(declared: Mechanism) -> bool:
    """Return whether a run may stop where a mode ends without impact: by its state, or by forces, which jump there."""
    return bool(declared.state_stops or leaves(declared.stops.values(), "quantity"))


def stop_met(
    declared: Mechanism,
    parts: Sequence[Stretch],
    switch: Switch,
    went: tuple[Problem, Blow | None, float],
    speed: float,
) -> Event | Stopped | None:
    """Return the stop that a run meets at a switch between two parts, where it `went` on, struck perhaps; None if none.

    It is a state that begins or what strikes, whose number follows those of other stops, or what `stop_jumped` tells.
    It begins so much later (s) than it struck if it is the limit of infinitely many impacts: the last of `went`.
    """
    (before, now), time, (entered, blow, late) = parts, switch.begun.time, went
    begins = time if blow is None or not late else blow.t + late
    for k, condition in enumerate(declared.state_stops.values()):
        met = Event(begins, len(declared.stops) + k, True)
        if struck(condition, blow):
            return replace(met, time=time)
        if condition.holds(now.words) and not condition.holds(before.words) and begins <= entered.t_end:
            return met if begins == time else Stopped(met, entered)
    jumped = stop_jumped((before, now), time, (switch.x, entered.x0), speed)
    return None if jumped is None else Stopped(Event(time, jumped, True), entered)


def struck(condition: StateCondition, blow: Blow | None) -> bool:
    """Return whether a condition is that an element strikes, which takes an impulse in an impact."""
    return condition.strikes and blow is not None and bool(blow.impulses.get(condition.element))


def stop_jumped(parts: tuple[Stretch, Stretch], t: float, there: tuple[Floats, Floats], speed: float) -> int | None:
    """Return the number of the first stop whose condition a jump of speeds or forces makes true, None if none.

    `there` are the states (nq + nu,) before it and after it, `speed` the largest: what rounding of speeds brings about
    is no jump.
    """
    problem = parts[0].problem
    if not any(problem.terminal[: problem.switches]):
        return None
    held, holds = (_clearly(part, t, x, _KNOWN * speed) for part, x in zip(parts, there, strict=True))
    return next(iter(np.flatnonzero(holds & ~held).tolist()), None)


def _clearly(stretch: Stretch, t: float, x: Floats, known: float) -> NDArray[np.bool_]:
    """Return which stops' conditions hold at a state, whatever rounding does to its speeds."""
    beside = np.where(np.arange(len(x)) < len(stretch.problem.q0), 0.0, known)
    here, *near = (stretch.stops_at(t, each) for each in (x, x + beside, x - beside))
    rounding = np.max(np.abs(np.array(near) - here), axis=0)
    found: NDArray[np.bool_] = here > np.maximum(rounding, _NOTHING)
    return found
