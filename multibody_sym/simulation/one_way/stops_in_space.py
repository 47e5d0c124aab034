"""Where slip in space has stopped: a little after the look that ended it, which is before friction has no direction."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.model.mechanism.one_way import FrictionPart
from multibody_sym.runtime.chain import Switch
from multibody_sym.simulation.one_way.facts import Facts
from multibody_sym.simulation.one_way.stretches import Stretch

_MOST: Final = 1e-6
"""The part of a run's time within which slip that slows down must have stopped."""


def stopped(switch: Switch, now: Stretch, facts: Facts, part: FrictionPart) -> Switch:
    """Return the switch at which a part stops that slides slowly at the `facts`, by its deceleration there.

    It is at the next sample at the latest, and as it is where slip does not slow down.
    """
    places, (rates, udot) = [facts.place(row) for row in part.rows], now.rates_at(facts)
    v, known = facts.known["phidot"][places], facts.known
    a = known["jacobian"][places] @ (udot - known["free"]) - known["right"][places]
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
