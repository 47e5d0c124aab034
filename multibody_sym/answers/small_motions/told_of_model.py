"""What small motions and periods leave out of a model: what depends on time, and friction that turns round."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from multibody_sym.analysis.deviations import Flow
from multibody_sym.dynamics.start.start import Start
from multibody_sym.errors import ExpressionError
from multibody_sym.model.declaration.system import System, expressions
from multibody_sym.model.mechanism.mode_words import mode_words
from multibody_sym.numerics.arrays import UNDEFINED
from multibody_sym.scalars.derivatives import derivative
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.scalars.traversal import leaves, postorder

_TIME: Final = symbol("t")
_MOVING: Final = ("joints", "forces", "constraints", "bodies", "inputs", "gravity", "pulleys", "contacts")
_LATER: Final = (0.137, 1.913, 31.07)
"""Times (s) at which a system is compared with what it is at t = 0."""
_SAME: Final = 1e-9


def named_with_time(system: System) -> dict[str, list[Node]]:
    """Return what in a model depends on t: the expressions by the place of what they belong to, `forces.drive`."""
    found: dict[str, list[Node]] = {}
    for section in _MOVING:
        for path, node, _ in expressions(getattr(system, section), (section,)):
            if _TIME in leaves([node], "symbol"):
                found.setdefault(".".join(path[:2]), []).append(node)
    return found


def period_of_drive(system: System, parameters: dict[Node, float]) -> float | None:
    """Return the period (s) of all sines and cosines of t in a model, None where they are not of one period."""
    drives = [node for nodes in named_with_time(system).values() for node in nodes]
    waves = [n for n in postorder(drives) if n.op in ("sin", "cos") and _TIME in leaves([n], "symbol")]
    rates = [derivative(wave.args[0], _TIME) for wave in waves]
    try:
        paces = [abs(x) for x in evaluate_float(rates, parameters)] if rates else []
    except (ExpressionError, *UNDEFINED):
        return None
    same = paces and max(paces) - min(paces) <= _SAME * max(paces)
    return 2 * math.pi / paces[0] if same and paces[0] else None


def frozen(system: System, flow: Flow, begin: Start) -> str | None:
    """Return what is to be said where a state would not stay as it is, because time moves something."""
    named = named_with_time(system)
    if not named:
        return None
    at_first = _moved(flow, begin, 0.0)
    later = [_moved(flow, begin, t) for t in _LATER]
    size = max(1.0, float(np.abs(at_first).max(initial=0.0)))
    if all(np.abs(x - at_first).max(initial=0.0) <= _SAME * size for x in later):
        return None
    names = " and ".join(named)
    return (
        f"{names} {'depends' if len(named) == 1 else 'depend'} on t, and small motions are those of the model as it is "
        "at t = 0; free oscillations are those of the model without it, and simulate follows time"
    )


def _moved(flow: Flow, begin: Start, time: float) -> np.ndarray:
    """Return accelerations and their slopes in the state of a start, at another time."""
    known = flow.known_at(begin.q, begin.u, time)
    return np.concatenate([flow.rates(known)[1], np.ravel(flow.derivatives(known)[0])])


def friction_held(flow: Flow) -> list[str]:
    """Return what is to be said of friction that acts in the mode of the start, by what slides or sticks."""
    mechanism = flow.mechanism
    if mechanism.mode is None:
        return []
    words = mode_words(mechanism.one_way, mechanism.mode)
    parts = dict.fromkeys(name for x in mechanism.one_way for name in (x.name, *(part.name for part in x.frictions)))
    sliding = [name for name in parts if words.get(name, "").startswith(("slide", "slip"))]
    sticking = [name for name in parts if words.get(name, "") in ("stick", "grip")]
    told = []
    if sliding:
        told.append(
            f"{', '.join(sliding)}: friction is taken as it pushes while this slides as it does at the start; where it "
            "turns back friction does too, about another place of rest, and the motion ends (simulate)"
        )
    if sticking:
        told.append(f"{', '.join(sticking)}: it sticks, and small motions are those while it does")
    return told
