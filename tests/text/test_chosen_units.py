"""Units that people choose: what follows from them, and what is refused."""

from __future__ import annotations

import math

import pytest

from multibody_sym.errors import ArgumentError, InputError
from multibody_sym.text.units import UNITS, parse_unit
from multibody_sym.text.values import SI, chosen_units


@pytest.mark.parametrize(
    ("asked", "unit", "told"),
    [
        ("mm,deg", "m", "mm"), ("mm,deg", "m/s", "mm/s"), ("mm,deg", "m/s^2", "mm/s^2"), ("mm,deg", "rad", "deg"),
        ("mm,deg", "rad/s", "deg/s"), ("mm,deg", "rad/s^2", "deg/s^2"), ("mm,deg", "N", "N"), ("mm,deg", "N*m", "N*mm"),
        ("mm,deg", "J", "J"), ("mm,deg", "1/s", "1/s"), ("mm,deg", "", ""), ("mm,deg", "kg*m^2", "kg*mm^2"),
        ("mm", "N/m", "N/mm"), ("mm", "1/m", "1/mm"), ("kN", "N*s/m", "kN*s/m"), ("kN,kJ", "N*m", "kN*m"),
        ("kJ", "J", "kJ"), ("kJ", "N*m", "N*m"), ("Nm", "J", "J"), ("Nm", "N*m", "Nm"), ("rpm", "rad/s", "rpm"),
        ("rpm", "rad", "rad"), ("rpm", "1/s", "1/s"), ("Hz", "1/s", "Hz"), ("Hz", "rad/s", "rad/s"),
        ("g", "kg*m/s", "g*m/s"),
        ("km/h", "m/s", "km/h"), ("km/h", "m", "m"), ("ms", "m/s^2", "m/ms^2"), ("mm", "m^(3/2)", "mm^(3/2)"),
        ("mm", "m^2/s", "mm^2/s"), ("mm", "kg*m^2/s^2", "kg*mm^2/s^2"), ("mm", "m^(3/2)/s^(1/2)", "mm^(3/2)/s^(1/2)"),
        ("turn", "rad/s", "turn/s"), ("deg/s", "rad/s", "deg/s"), ("deg/s", "rad", "rad"),
    ],
)
def test_units_follow_from_those_that_are_chosen(asked: str, unit: str, told: str) -> None:
    units = chosen_units(asked)
    assert units.of(unit) == told
    if unit:
        theirs, ours = (parse_unit(text)[0].shadow for text in (told, unit))
        assert units.value(2.5, unit) * theirs == pytest.approx(2.5 * ours, rel=1e-15)


def test_numbers_are_told_with_their_unit() -> None:
    units = chosen_units(["mm", " deg "])
    assert units.said(0.1, "m") == "100 mm"
    assert units.said(math.pi / 6, "rad") == "30 deg"
    assert units.said(0.25, "") == "0.25"
    assert SI.said(0.1, "m/s", digits=3) == "0.1 m/s"
    assert chosen_units(None) is SI


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        ("mmm", "'mmm' is not a unit; did you mean mm?; known: "), ("m,furlong", "'furlong' is not a unit"),
        ("mm,cm", "mm and cm are units of one quantity"), ("deg,rad", "deg and rad are units of one quantity"),
        ("m/m", "is a pure number"), ("1", "is a pure number"), ("mm,", "write units with commas between them"),
        ("N*m/deg", "an angle stands alone"), ("m/", "the unit is not complete"),
    ],
)
def test_what_is_no_unit_to_read_is_refused(asked: str, part: str) -> None:
    with pytest.raises(InputError) as caught:
        chosen_units(asked)
    assert part in caught.value.message


def test_known_units_are_listed() -> None:
    with pytest.raises(InputError) as caught:
        chosen_units("smoot")
    assert all(f" {name}" in caught.value.message for name in UNITS)


@pytest.mark.parametrize("wrong", [3, {"m": 1}, [1, 2], b"mm"])
def test_what_is_no_text_is_refused(wrong: object) -> None:
    with pytest.raises(ArgumentError, match="units: expected a text such as 'mm,deg'"):
        chosen_units(wrong)  # type: ignore[arg-type]
