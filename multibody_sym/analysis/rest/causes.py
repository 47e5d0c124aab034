"""What gives way beyond an end of a range of rest, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from multibody_sym.analysis.rest.statics import RestLimit, Statics
from multibody_sym.analysis.rest.touching import stands
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.kinematics.points import position
from multibody_sym.kinematics.rows import row_motion, row_motions
from multibody_sym.model.mechanism.contact_rows import ContactRow, Flat
from multibody_sym.model.mechanism.markers import Marker
from multibody_sym.model.mechanism.mass import GROUND
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.model.mechanism.rows import Row
from multibody_sym.numerics.arrays import Floats
from multibody_sym.numerics.rank import least_squares
from multibody_sym.scalars.vectors import ZERO_VECTOR, Vec, add, apply_transposed, combination

_LEVEL: Final = 1e-6
_STANDS: Final = 3
_TURNING: Final = ", turning"

NOTHING: Final = "nothing holds it at other values"


def causes(statics: Statics, limits: Sequence[RestLimit], motion: Motion | None) -> tuple[str, ...]:
    """Return what gives way where these limits are passed; `motion` at the end of the range tells edges apart.

    Smooth contacts are named where nothing else gives way.
    """
    parts = (part for element in statics.mechanism.one_way for part in element.frictions)
    smooth = {part.name for part in parts if not part.rubs}
    rough = [limit for limit in limits if limit.kind != "cone" or limit.part not in smooth]
    found = dict.fromkeys(_causes(statics, rough, motion)) or dict.fromkeys(_causes(statics, limits, motion))
    return tuple(found) or (NOTHING,)


def _causes(statics: Statics, limits: Sequence[RestLimit], motion: Motion | None) -> Iterator[str]:
    for limit in limits:
        if limit.kind == "cone":
            yield f"slips at {_slipping(statics, limit)}{_TURNING if _turns(limit, limits) else ''}"
        elif limit.kind == "side":
            yield f"{limit.group} presses on its other side"
        elif limit.of == "rope":
            yield f"{limit.group} slackens"
        elif limit.of == "stop":
            yield f"{limit.group} leaves its stop"
        else:
            yield from _opening(statics, limit, limits, motion)


def _turns(slip: RestLimit, limits: Sequence[RestLimit]) -> bool:
    """Return whether what slips at a contact does so along several directions: it turns."""
    ways = [x.along for x in limits if x.group == slip.group and x.along is not None]
    return len(ways) > 1 and float(np.ptp(np.array(ways), axis=0).max()) > _LEVEL


def _slipping(statics: Statics, limit: RestLimit) -> str:
    """Return where something slips: what is declared, or its part where that has parts that are no corners."""
    elements = [element for element in statics.mechanism.one_way if (element.group or element.name) == limit.group]
    if len(elements) > 1:
        return limit.group
    return limit.part


def _opening(statics: Statics, limit: RestLimit, limits: Sequence[RestLimit], motion: Motion | None) -> Iterator[str]:
    """Yield what happens where a contact opens: its body lifts off, or tips about what stays of it.

    Nothing where that are three corners: on these it stands, and something else gives way.
    """
    corners = [] if motion is None else [x for x in _closed(statics, motion) if (x.group or x.name) == limit.group]
    opened = {other.part for other in limits if other.group == limit.group and other.kind == "force"}
    stay = [element for element in corners if element.name not in opened]
    if motion is None or not stay:
        yield f"lifts off at {limit.group}"
        return
    if len(stay) >= _STANDS:
        return
    away = [element for element in corners if element.name in opened]
    body = _tipping(statics, motion, (away, stay), limits)
    own = [element for element in stay if _touches(element).body == body]
    what = "corner" if len(stay) == 1 and len(corners) > 2 else "edge"
    word = f"{_side(motion, _middle(motion, own or stay) - _middle(motion, away))}{what}"
    about = f"its {word}" if own else f"the {word} of {_name(statics, _touches(stay[0]).body)}"
    yield f"{_name(statics, body)} tips about {about}"


def _name(statics: Statics, body: int) -> str:
    return statics.mechanism.bodies[body].name if body >= 0 else GROUND


def _tipping(
    statics: Statics, motion: Motion, parts: tuple[Sequence[OneWay], Sequence[OneWay]], limits: Sequence[RestLimit]
) -> int:
    """Return which of the two bodies of a contact turns most where its parts open, of `parts` the first.

    What touches is held as long as no limit is passed.
    """
    away, stay = parts
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    loose = {id(row) for row in _loose(statics, motion, limits)}
    rows = [row for row in statics.mechanism.rows if id(row) not in loose]
    held = [found.jacobian for found in (row_motion(row, motion, bias) for row in rows) if found.kinematic]
    opening = [row_motion(element.normals[0], motion, bias).jacobian for element in away]
    wanted = [1.0] * len(opening) + [0.0] * len(held)
    speeds = least_squares(np.array([*opening, *held], dtype=float), np.array(wanted))
    turning = _turning(motion, speeds.tolist())
    bodies = dict.fromkeys(point.body for element in (*away, *stay) for point in element.normals[0].points)
    most = max(turning[body] for body in bodies)
    return next(body for body in bodies if turning[body] >= (1.0 - _LEVEL) * most)


def _loose(statics: Statics, motion: Motion, limits: Sequence[RestLimit]) -> Iterator[Row]:
    """Yield the rows that do not hold where limits are passed, as what does not touch and what has no friction."""
    passed = {(limit.kind == "cone", limit.part) for limit in limits}
    closed = {element.name for element in _closed(statics, motion)}
    for element in statics.mechanism.one_way:
        if (False, element.name) in passed or (element.unilateral and element.name not in closed):
            yield from element.rows
        for part in element.frictions:
            if (True, part.name) in passed or not part.rubs:
                yield from part.rows


def _turning(motion: Motion, speeds: Sequence[float]) -> dict[int, float]:
    """Return how fast each body turns (rad/s), by its number, at given speeds (nu)."""
    found: dict[int, Vec] = {-1: ZERO_VECTOR}
    for k, (body, moved) in enumerate(zip(motion.mechanism.bodies, motion.bodies, strict=True)):
        carried = apply_transposed(moved.R_PB, found[body.parent])
        found[k] = add(carried, combination(moved.angular, [speeds[n] for n in body.u]))
    return {k: float(np.linalg.norm(np.array(w, dtype=float))) for k, w in found.items()}


def _closed(statics: Statics, motion: Motion) -> list[OneWay]:
    """Return what touches of what may open."""
    return [x for x, how in stands(statics, motion, row_motions(motion)) if how == "touching"]


def _touches(element: OneWay) -> Marker:
    """Return the place of what is not flat, which is where its body touches."""
    row = element.normals[0]
    if isinstance(row, ContactRow):
        return next((skin.place for skin in row.skins if not isinstance(skin, Flat)), row.skins[0].place)
    return row.points[0]


def _middle(motion: Motion, elements: Sequence[OneWay]) -> Floats:
    """Return the middle of the places where elements touch (world axes)."""
    found = []
    for element in elements:
        found.append(np.array(position(motion, _touches(element)), dtype=float))
    return np.asarray(np.mean(found, axis=0))


def _side(motion: Motion, towards: Floats) -> str:
    """Return on which side an edge lies: lower or upper where gravity tells, else right or left along ground's x."""
    gravity = np.array(motion.gravity, dtype=float)
    pulled = float(np.linalg.norm(gravity))
    length = float(np.linalg.norm(towards)) or 1.0
    if pulled > 0.0 and abs(towards @ gravity) > _LEVEL * length * pulled:
        return "lower " if towards @ gravity > 0.0 else "upper "
    if abs(towards[0]) > _LEVEL * length:
        return "right " if towards[0] > 0.0 else "left "
    return ""
