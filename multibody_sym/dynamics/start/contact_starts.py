"""Contacts at the start: coefficients that nothing has, and bodies that begin inside each other."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Final

from multibody_sym.errors import ModelError, at, gathered
from multibody_sym.kinematics.contacts import allowed_past_end, reach, touch
from multibody_sym.kinematics.flat_rims import ON_POINTS, flat_rims
from multibody_sym.kinematics.motion import Motion, accelerations
from multibody_sym.model.declaration.contacts import verify_coefficients
from multibody_sym.model.mechanism.contact_rows import ContactRow, is_point
from multibody_sym.model.mechanism.one_way import FrictionPart, OneWay
from multibody_sym.scalars.node import Node

_ROLLING: Final = ".rolling"


Value = Callable[[Node], float | None]
"""Returns the value of an expression; None where it is not known."""


def value_at(motion: Motion, node: Node) -> float:
    """Return the value of an expression at an instant."""
    return float(motion.state.values([node])[0])


def verify_contact_values(elements: Iterable[OneWay], value: Value) -> None:
    """Raise ModelError for negative coefficients and radii, and for more friction in sliding than in sticking.

    Declared numbers were judged when they were read; here those are that parameters give.
    """
    for element in elements:
        with at(*element.path):
            _verify_range(value(element.restitution), "restitution", 1.0)
            _verify_range(value(element.tangential_restitution), "tangential_restitution", 1.0)
            for part in element.frictions:
                verify_friction(part, value)
            for row in element.rows if element.kind == "contact" else ():
                for radius in row.radii:
                    _verify_radius(value(radius))


def verify_friction(part: FrictionPart, value: Value) -> None:
    """Raise ModelError, under the coefficient's name, for a negative one, and for more in sliding than in sticking."""
    if part.name.endswith(_ROLLING):
        _verify_range(value(part.static), "rolling_resistance", None)
        return
    static = _verify_range(value(part.static), "static", None)
    kinetic = _verify_range(value(part.kinetic), "kinetic", None)
    if not part.enough:
        verify_coefficients(static, kinetic)


def _verify_range(value: float | None, name: str, most: float | None) -> float | None:
    with at(name):
        if value is not None and value < 0.0:
            raise ModelError(f"{value:g} is negative; nothing rubs or bounces less than not at all", number="M109")
        if most is not None and value is not None and value > most:
            raise ModelError(f"{value:g} is above {most:g}: nothing leaves faster than it came", number="M114")
    return value


def _verify_radius(value: float | None) -> None:
    if value is not None and not value > 0.0:
        raise ModelError(
            f"a radius there is {value:g} m, and what has one is round; give a positive number", number="M109"
        )


def verify_outside(motion: Motion, tolerance: float) -> None:
    """Raise ModelError for contacts whose bodies are inside each other by more than a tolerance (m).

    There is one error for each declared contact: that of its first part inside.
    """
    wrong, told = gathered(), set[tuple[str, str]]()
    for element, row, gap in contact_gaps(motion, tolerance):
        error = None if element.path in told else _start_inside(element, row, gap, motion, tolerance)
        if error is not None:
            told.add(element.path)
            with wrong, at(*element.path):
                raise error
    wrong.told()


def _start_inside(element: OneWay, row: ContactRow, gap: float, motion: Motion, tolerance: float) -> ModelError | None:
    """Return why a contact cannot begin with its gap (m), if it cannot."""
    first, second = (skin.place.name for skin in row.skins)
    if gap < -tolerance:
        part = "" if element.name == element.group else f" ({element.name})"
        return ModelError(
            f"{first} starts {-gap:.6g} m inside {second}{part}; move it out along the normal "
            "(initial: {q: ..}), or correct the surface: its normal points out of its body",
            number="M114",
        )
    if gap <= tolerance and all(is_point(skin) for skin in row.skins):
        return ModelError(
            f"{first} and {second} are points and start at one place, where nothing says which way they push "
            "each other: start them apart, give one of them a surface (surfaces: {face: {plane: [0, 0, 0], "
            "normal: y}}) and name it, or let them strike there (impact: {between: [..]})",
            number="M114",
        )
    flat = next(iter(flat_rims([row], motion)), None) if gap <= tolerance else None
    return None if flat is None else ModelError(f"{flat}: {ON_POINTS}, or tilt it", number="M114")


def contact_gaps(motion: Motion, tolerance: float) -> Iterator[tuple[OneWay, ContactRow, float]]:
    """Yield each contact with its normal row and the gap at a state in floats, negative inside.

    Without those whose face ends before, by more than a tolerance (m): they do not hold there, whatever the gap.
    """
    bias = accelerations(motion, [0.0] * len(motion.state.u))
    for element in motion.mechanism.one_way:
        for row in element.normals:
            if not isinstance(row, ContactRow):
                continue
            beyond = min((tolerance, *map(float, allowed_past_end(row, motion))))
            if all(way >= -beyond for way in reach(row, motion)):
                yield element, row, float(touch(row.skins, motion, bias).gap)
