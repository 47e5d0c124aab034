"""When speeds, forces, inputs or an asked expression bend or jump along a run: it may have its extreme there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np
from numpy.polynomial import Polynomial

from multibody_sym.answers.questions.simulated_motion import ASKED
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.mechanism.mechanism import TIME
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import table
from multibody_sym.scalars.kinks import known_zeros, switching_functions
from multibody_sym.scalars.node import Node, slot
from multibody_sym.scalars.rows import Tabulated
from multibody_sym.scalars.traversal import leaves, postorder
from multibody_sym.simulation.trajectory import Trajectory

_BESIDE: Final = 1
"""So many samples on each side of two between which a function changes its sign tell when."""


@dataclass(frozen=True)
class Crossing:
    """Where a `function` of the state changes its sign: about at `t`, `between` two samples."""

    function: Node
    t: float
    between: tuple[float, float]


def bends(run: Trajectory) -> dict[float, Crossing | None]:
    """Return the times in a run at which speeds, forces, inputs or what is asked bend or jump, rising.

    Those of impacts and changes of state are known, those that follow from time and parameters alone are exact, others
    have a crossing: they are as good as a cubic through four samples.
    """
    mechanism = run.ready.mechanism
    asked = [mechanism.outputs[ASKED]] if ASKED in mechanism.outputs else []
    functions = dict.fromkeys([*mechanism.kinks, *switching_functions(asked), *_knots(mechanism.inputs.values())])
    known = {slot("parameters", k): float(x) for k, x in enumerate(run.parameters)}
    begin, end = float(run.t[0]), float(run.t[-1])
    found: dict[float, Crossing | None] = {}
    moving = []
    for g in functions:
        timed = all(leaf is TIME or leaf in known for leaf in leaves([g], "slot"))
        zeros = known_zeros(g, TIME, known) if timed and not leaves([g], "quantity") else None
        if zeros is not None:
            found.update((t, None) for t in zeros if begin < t < end)
        elif not leaves([g], "quantity"):
            moving.append(g)
    for g, values in zip(moving, _along(run, moving), strict=True):
        found = {**{t: Crossing(g, t, between) for t, between in _changes_of_sign(run.t, values)}, **found}
    found.update((float(change["t"]), None) for change in run.changes)
    return dict(sorted(found.items()))


def _knots(inputs: Iterable[Node]) -> Iterator[Node]:
    """Yield the functions that change their signs at knots of splines, at which accelerations that they drive bend."""
    for n in postorder(inputs):
        if n.op == "table" and n.data[0].kind == "cubic":
            yield table(Tabulated(n.data[0].name, n.data[0].rows, "knots"), 0, n.args[0])


def _along(run: Trajectory, functions: Sequence[Node]) -> Iterator[Floats]:
    """Yield functions of the state at the samples of a run."""
    if not functions:
        return
    mechanism, parameters = run.ready.mechanism, run.parameters.tolist()
    states = zip(run.t.tolist(), run.q.tolist(), run.u.tolist(), strict=True)
    rows = [state_of(mechanism, float, t, q, u, parameters).values(functions) for t, q, u in states]
    yield from np.array(rows, dtype=float).T


def _changes_of_sign(t: Floats, y: Floats) -> Iterator[tuple[float, tuple[float, float]]]:
    """Yield about when a function changes its sign, and the samples beside that."""
    for k in np.flatnonzero(y[:-1] * y[1:] < 0.0):
        near = slice(max(k - _BESIDE, 0), k + 2 + _BESIDE)
        roots = Polynomial.fit(t[near], y[near], len(t[near]) - 1).roots()
        inside = [float(x.real) for x in roots if x.imag == 0.0 and t[k] <= x.real <= t[k + 1]]
        about = inside[:1] or [float(t[k] - y[k] * (t[k + 1] - t[k]) / (y[k + 1] - y[k]))]
        yield about[0], (float(t[k]), float(t[k + 1]))
    for k in np.flatnonzero(y[1:-1] == 0.0) + 1:
        yield float(t[k]), (float(t[k - 1]), float(t[k + 1]))
