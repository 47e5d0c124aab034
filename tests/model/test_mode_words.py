"""The words for what holds one way only in a mode: contacts, ropes, stops, rolling."""

from multibody_sym.mechanics.law_elements import FrictionPart, LawElement, Mode
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.row_records import VelocityRow
from multibody_sym.scalars.node import ONE, ZERO, slot

ROW = VelocityRow("row", slot("u", 0))


def element(name, *parts, kind="contact", words=("closed", "open"), unilateral=True):
    return LawElement(name, kind, (kind + "s", name), (ROW,), unilateral, parts, words=words)


def part(name, static=ONE, *, enough=False):
    return FrictionPart(name, (ROW,), static, static, enough)


def test_each_element_has_its_word():
    elements = (
        element("c1", part("c1"), part("c1.rolling")),
        element("c2", part("c2", ZERO)),
        element("c3", part("c3", ZERO, enough=True)),
        element("c4", part("c4")),
        element("string", part("wheel"), kind="rope", words=("taut", "slack")),
        element("end", kind="stop", words=("lower", "free")),
        element("rub", part("rub"), kind="friction", unilateral=False),
    )
    sides = {"c1": 1, "c2": 1, "c3": 1, "c4": 0, "string": 1, "end": 0, "rub": -1}
    slips = {"c1": -1, "c1.rolling": 0, "wheel": 1, "rub": 1}
    assert mode_words(elements, Mode(sides, slips)) == {
        "c1": "slide-",
        "c1.rolling": "roll",
        "c2": "closed",
        "c3": "stick",
        "c4": "open",
        "string": "taut",
        "wheel": "slip+",
        "end": "free",
        "rub": "slide+",
    }
    assert mode_words(elements[:1], Mode({"c1": 1}, {"c1": 2, "c1.rolling": 0}))["c1"] == "slide"
