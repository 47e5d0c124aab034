"""What begins at zero where another library begins a run in a mode: on which side it is shows only later.

What opens as the force on it passes zero opens with the third power of time, and the libraries that begin at order one
make an error of the second power in their first steps: however short these are, they may end on the wrong side.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.integrators.flow import Events, Flow
from multibody_sym.numerics.arrays import Floats

_SOON: Final = 2.0**-20  # s


def with_tolerance(flow: Flow, events: Events, t: float, x: Floats, slope: Floats) -> Events:
    """Return events at the start (t, x) of a run in a mode: what is at zero there may be beyond it within tolerance.

    That is what a function (ng,) changes by if every component of the state changes by its tolerance. What leaves zero
    by more than that in a second, as after an impact, is on its side.
    """
    margins, own = np.array(events.margins), slice(len(events.terminal) - len(events.margins), None)
    here, scales = events.values(t, x)[own], flow.scales(x, x)
    at_zero = np.abs(here) <= margins
    if not at_zero.any():
        return events
    changes = [np.abs(events.values(t, x + scale)[own] - here) for scale in np.diag(scales)]
    wide = np.maximum(margins, np.sum(changes, axis=0))
    soon, later = (events.values(t + h, x + h * slope)[own] for h in (_SOON, 2.0 * _SOON))
    falls = (3.0 * here - 4.0 * soon + later) / (2.0 * _SOON)  # without the bend of the straight way
    stays = at_zero & ~(falls > wide)
    return replace(events, margins=tuple(np.where(stays, wide, margins).tolist()))


def once_left(events: Events, usual: Events, values: Floats) -> Events:
    """Return events of `with_tolerance` with the `usual` margins for what is as far below zero, by values (ng,)."""
    if events.margins == usual.margins:
        return events
    values = values[len(values) - len(events.margins) :]
    margins = [
        least if value < -2.0 * margin else margin  # the values are less the margins
        for value, margin, least in zip(values.tolist(), events.margins, usual.margins, strict=True)
    ]
    return replace(events, margins=tuple(margins))
