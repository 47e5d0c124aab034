"""Pictures as SVG: a document that parses, draws what the picture holds, and holds what users wrote as text alone."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from hostile_labels import LABELS

from multibody_sym.pictures.page.files import number, svg
from multibody_sym.pictures.page.picture import Arc, Pen, Picture, Stroke, TextMark, letters, words

SVG = "{http://www.w3.org/2000/svg}"
PEN = Pen(0.8, "#102030", (3.0, 2.0))


def drawn(*marks: object, title: str = "t") -> ElementTree.Element:
    return ElementTree.fromstring(svg(Picture(100, 50, marks, title, "d")))


def test_lines_have_y_downwards_and_their_pen() -> None:
    path = drawn(Stroke(np.array([[0.0, 0.0], [10.0, 50.0]]), PEN)).find(f".//{SVG}path")
    assert path.get("d") == "M0 50L10 0"
    assert (path.get("stroke"), path.get("stroke-width"), path.get("fill")) == ("#102030", "0.8", "none")
    assert path.get("stroke-dasharray") == "3 2"


def test_a_quarter_of_a_circle_turns_counterclockwise() -> None:
    path = drawn(Arc(np.array([50.0, 25.0]), 10.0, PEN, 0.0, np.pi / 2)).find(f".//{SVG}path")
    assert path.get("d") == "M60 25A10 10 0 0 0 50 15"


def test_letters_are_as_wide_as_the_layout_took_them_to_be() -> None:
    (span,) = drawn(TextMark(np.array([10.0, 20.0]), words("Mi"), 10.0)).findall(f".//{SVG}tspan")
    assert (span.get("x"), span.get("y"), span.text) == ("10", "30", "Mi")
    assert float(span.get("textLength")) == pytest.approx(11.67)


def test_what_users_wrote_is_text_alone() -> None:
    hostile = "</title><script>alert('1')</script>&\"\x00\x1b\ud800"
    root = drawn(TextMark(np.zeros(2), ((hostile, "roman"),), 10.0), title=hostile)
    tags = {element.tag.removeprefix(SVG) for element in root.iter()}
    assert tags <= {"svg", "title", "desc", "rect", "g", "text", "tspan"}
    shown = "</title><script>alert('1')</script>&\"\ufffd\ufffd\ufffd"
    assert root.find(f"{SVG}title").text == root.find(f".//{SVG}tspan").text == shown


def test_numbers_are_short() -> None:
    assert [number(x) for x in (-0.001, 1.0, 2.506, 1e-9)] == ["0", "1", "2.51", "0"]


@pytest.mark.parametrize("label", LABELS)
def test_no_label_is_markup(label: str) -> None:
    """Whatever a label is, the document has the elements that it has with a harmless one, and no attribute with it."""

    def shape(text: str) -> list[tuple[str, list[str]]]:
        for runs in (words(text), letters(text), ((text, "roman"),)):
            root = drawn(TextMark(np.zeros(2), runs, 10.0), title=text)
        return [(element.tag, sorted(element.attrib)) for element in root.iter()]

    assert shape(label) == shape("harmless")
    svg(Picture(100, 50, [], label, label)).encode("utf-8")


def test_products_have_their_thin_space() -> None:
    written = svg(Picture(100, 50, [TextMark(np.zeros(2), letters("2*m*g"), 10.0)], "t"))
    assert "\ufffd" not in written
    assert written.count("\u2009") == 2
