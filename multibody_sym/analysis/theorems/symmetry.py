"""The symmetry behind a conserved quantity, in words: which motion of the whole, or change of time, changes nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.theorems.candidates import Candidate, freedom_name
from multibody_sym.model.declaration.values import AXES
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats

_NEARLY: Final = 1e-9
Part = tuple[Candidate, float]


def symmetry(mechanism: Mechanism, parts: Sequence[Part]) -> str:
    """Return what gives a combination of candidates its constant value."""
    kinds = {part.kind for part, _ in parts}
    if "energy" in kinds:
        found = _of_energy(parts)
    elif "jacobi" in kinds:
        found = "time, as seen from what moves as prescribed: there no energy or force depends on it"
    elif "speed" in kinds:
        found = _of_freedoms(mechanism, [part for part, _ in parts])
    elif kinds == {"centre"}:
        axes = ", ".join(AXES[part.place] for part, _ in parts)
        found = f"turning all about the centre of mass: no moment from outside about it along {axes}"
    else:
        found = _of_space(mechanism, parts)
    return f"{found}, while the states of the start last" if mechanism.one_way else found


def _of_energy(parts: Sequence[Part]) -> str:
    if len(parts) == 1 and parts[0][0].place:
        return "time: no energy, force or constraint that does work depends on it, and these forces have a potential"
    if len(parts) == 1:
        return "time: no energy, force or constraint that does work depends on it"
    return "time, as seen from what is driven steadily (Jacobi's integral): there nothing depends on it"


def _of_freedoms(mechanism: Mechanism, parts: Sequence[Candidate]) -> str:
    """Return that coordinates are cyclic, or that turning a body about an axis of its own changes nothing."""
    rates = {u for body in mechanism.bodies for _, u in body.rate_pairs}
    places = [part.place for part in parts if part.kind == "speed"]
    names = " and ".join(freedom_name(mechanism, k) for k in places)
    if all(k in rates for k in places) and len(parts) == 1:
        return f"{names} is cyclic: no energy or constraint depends on it, and no force acts along it"
    if len(parts) == 1:
        body = next(body.name for body in mechanism.bodies if places[0] in body.u)
        return f"{body} is moved along {names} in its own axes: no energy depends on that, and no force acts along it"
    return f"{names} change together: no energy or constraint depends on that, and no force acts along it"


def _of_space(mechanism: Mechanism, parts: Sequence[Part]) -> str:
    along, about = (_vector(parts, kind) for kind in ("momentum", "axis"))
    if not about.any():
        return f"moving all along {_direction(along)}: no force from outside acts along it"
    axis = about / np.linalg.norm(about)
    pitch = float(along @ axis)
    if abs(pitch) > _NEARLY * float(np.linalg.norm(along)):
        return f"a screw of all about {_direction(about)}: forces from outside do no work in it"
    through = np.cross(about, along) / float(about @ about)
    place = "" if np.abs(through).max() <= _NEARLY else f" through ({', '.join(f'{x:.6g}' for x in through)})"
    return f"turning all about the axis {_direction(about)}{place}: no moment from outside about it"


def _vector(parts: Sequence[Part], kind: str) -> Floats:
    found = np.zeros(3)
    for part, c in parts:
        if part.kind == kind:
            found[part.place] += c
    return found


def _direction(vector: Floats) -> str:
    unit = vector / np.linalg.norm(vector)
    for k, axis in enumerate(AXES):
        if abs(abs(unit[k]) - 1.0) <= _NEARLY:
            return axis
    return f"({', '.join(f'{x + 0.0:.6g}' for x in unit)})"
