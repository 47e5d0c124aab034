"""What a run finds at a switch: that slip in space stops a little later, and which declared stop it meets.

A stop is met there by a state that begins, or by a comparison that an impact or the forces of another mode make true.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.model.declaration.states import StateCondition
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.chain import End, Switch
from multibody_sym.runtime.problem import Event
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.one_way.facts import Facts
from multibody_sym.simulation.one_way.impact import ImpactOutcome
from multibody_sym.simulation.one_way.legs import Leg

_MOST: Final = 1e-6
"""The part of a run's time within which slip that slows down must have stopped."""
_KNOWN: Final = 1e-9
"""The part of the largest speed up to which a jump of speeds is rounding."""
_NOTHING: Final = 1e-12
"""The value up to which a stop's function is zero, whatever it tells."""


def stopped(switch: Switch, now: Leg, facts: Facts, part: FrictionPart) -> Switch:
    """Return the switch at which a part stops that slides slowly at the `facts`, by its deceleration there.

    It is at the next sample at the latest, and as it is where slip does not slow down.
    """
    places, (rates, udot) = [facts.place(row) for row in part.rows], now.rates_at(facts)
    v, a = facts.known["phidot"][places], facts.accelerations(places, udot)
    slower, problem = -float(v @ a), now.of
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


def stop_met(declared: Mechanism, legs: tuple[Leg, Leg], switch: Switch, speed: float) -> End[Leg] | None:
    """Return the end of a run at a switch between two legs, if it meets a stop there.

    It is a state that begins or what strikes, whose number follows those of other stops, or what `stop_jumped` tells.
    It begins later than it struck if it is the limit of infinitely many impacts.
    """
    (before, now), time, cause = legs, switch.begun.time, legs[1].cause
    blow, late = (None, 0.0) if cause is None else (cause.blow, max(cause.late.values(), default=0.0))
    begins = time if blow is None or not late else blow.t + late
    for k, condition in enumerate(declared.state_stops.values()):
        met = Event(begins, len(declared.stops) + k, True)
        if struck(condition, blow):
            return End(stop=replace(met, time=time), leg=now)
        before_words, words = before.program.words, now.program.words
        if condition.holds(words) and not condition.holds(before_words) and begins <= now.of.t_end:
            return End(stop=met, leg=now, behind=begins != time)
    jumped = stop_jumped(legs, time, (switch.x, now.of.x0), speed)
    return None if jumped is None else End(stop=Event(time, jumped, True), leg=now, behind=True)


def struck(condition: StateCondition, blow: ImpactOutcome | None) -> bool:
    """Return whether a condition is that an element strikes, which takes an impulse in an impact."""
    return condition.strikes and blow is not None and bool(blow.impulses.get(condition.element))


def stop_jumped(legs: tuple[Leg, Leg], t: float, there: tuple[Floats, Floats], speed: float) -> int | None:
    """Return the number of the first stop whose condition a jump of speeds or forces makes true, None if none.

    `there` are the states (nq + nu,) before it and after it, `speed` the largest: what rounding of speeds brings about
    is no jump.
    """
    problem = legs[0].of
    if not any(problem.terminal[: problem.switches]):
        return None
    held, holds = (_clearly(leg, t, x, _KNOWN * speed) for leg, x in zip(legs, there, strict=True))
    return next(iter(np.flatnonzero(holds & ~held).tolist()), None)


def _clearly(leg: Leg, t: float, x: Floats, known: float) -> NDArray[np.bool_]:
    """Return which stops' conditions hold at a state, whatever rounding does to its speeds."""
    beside = np.where(np.arange(len(x)) < len(leg.of.q0), 0.0, known)
    here, *near = (leg.stops_at(t, each) for each in (x, x + beside, x - beside))
    rounding = np.max(np.abs(np.array(near) - here), axis=0)
    found: NDArray[np.bool_] = here > np.maximum(rounding, _NOTHING)
    return found
