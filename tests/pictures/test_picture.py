"""Marks on a page: what they cover, what hides what, and how wide letters are."""

from __future__ import annotations

import numpy as np
import pytest

from multibody_sym.pictures.page.picture import (
    Arc,
    Arrow,
    Hatch,
    Pen,
    Picture,
    Stroke,
    TextMark,
    box_of,
    in_order,
    letters,
    printable,
    simple,
    width_of,
    words,
)

PEN = Pen(1.0)


def test_boxes_hold_half_the_pen() -> None:
    line = Stroke(np.array([[10.0, 10.0], [30.0, 20.0]]), PEN, role="body", name="rod")
    assert Picture(50, 50, [line], "rod").boxes() == {("body", "rod"): [("line", 9.5, 9.5, 30.5, 20.5)]}


def test_a_circle_is_as_large_as_its_radius() -> None:
    box = box_of(Arc(np.array([5.0, 5.0]), 3.0, None, fill="#ffffff"))
    assert box.kind == "fill"
    assert box[1:] == pytest.approx((2, 2, 8, 8))


def test_text_is_as_wide_as_its_letters_in_times() -> None:
    # Times-Roman: M 889, i 278 thousandths of the size; Times-Italic: m 722
    assert width_of((("Mi", "roman"),), 10) == pytest.approx(8.89 + 2.78)
    text = TextMark(np.array([100.0, 50.0]), (("m", "italic"), ("1", "subscript")), 10)
    assert text.box.right == pytest.approx(100 + 7.22 + 0.8 * 5.0)
    assert text.box.bottom < 50 < text.box.top


def test_the_ticks_of_a_face_stay_on_their_side() -> None:
    for side in (1, -1):
        line, *ticks = simple(Hatch(np.array([[0.0, 0.0], [40.0, 0.0]]), PEN, side=side))
        assert len(ticks) == 10
        assert box_of(line).kind == "line"
        for tick in ticks:
            assert tick.points[0, 1] == 0
            assert side * tick.points[1, 1] > 3
            assert -3.6 < tick.points[:, 0].min() <= tick.points[:, 0].max() < 40.1


def test_ticks_go_on_evenly_round_a_corner() -> None:
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 30.0]])
    feet = [mark.points[0] for mark in simple(Hatch(corner, PEN, gap=4.0))[1:]]
    along = [x if x < 10 else 10 + y for x, y in feet]
    assert np.diff(along) == pytest.approx(4.0)


def test_an_arrow_ends_at_its_tip() -> None:
    shaft, head = simple(Arrow(np.array([[0.0, 0.0], [20.0, 0.0]]), PEN, head=6))
    assert head.points[0] == pytest.approx([20, 0])
    assert 14 < shaft.points[-1, 0] < 20
    assert len(simple(Arrow(np.array([[0.0, 0.0], [20.0, 0.0]]), PEN, both=True))) == 3


def test_a_curved_arrow_has_its_head_along_its_end() -> None:
    arc = Arc(np.zeros(2), 10.0, PEN, 0.0, np.pi / 2).points
    *_, head = simple(Arrow(arc, PEN, head=5))
    tip, one, _, other = head.points
    assert tip == pytest.approx([0, 10])
    assert (one + other)[1] / 2 > 8.5
    assert (one + other)[0] / 2 > 4


def test_nearer_marks_come_later() -> None:
    marks = [Stroke(np.eye(2), PEN, name=str(i), layer=layer, depth=depth) for i, (layer, depth) in
             enumerate([(2, 0), (1, 5), (1, 3), (1, 3)])]  # fmt: skip
    assert [mark.name for mark in in_order(marks)] == ["2", "3", "1", "0"]


@pytest.mark.parametrize(
    ("name", "runs"),
    [
        ("l", (("l", "italic"),)),
        ("theta", (("θ", "italic"),)),
        ("m1", (("m", "italic"), ("1", "subscript"))),
        ("m_1", (("m", "italic"), ("1", "subscript"))),
        ("theta_12", (("θ", "italic"), ("12", "subscript"))),
        ("omega_max", (("ω", "italic"), ("max", "subscript"))),
        ("x_rho_2", (("x", "italic"), ("ρ,2", "subscript"))),
        ("crank_angle", (("φ", "italic"), ("crank", "subscript"))),
        ("link_3", (("link", "roman"), ("3", "subscript"))),
        ("x_left_end", (("x", "italic"), ("left end", "subscript"))),
        ("l/2", (("l", "italic"), ("/2", "roman"))),
        ("R - r_1", (("R", "italic"), (" − ", "roman"), ("r", "italic"), ("1", "subscript"))),
        ("theta + pi", (("θ", "italic"), (" + ", "roman"), ("π", "italic"))),
        ("front-wheel", (("front-wheel", "roman"),)),
        ("no symbol!", (("no symbol!", "roman"),)),
    ],
)
def test_symbols_are_written_as_in_a_book(name: str, runs: tuple) -> None:
    assert letters(name) == runs


def test_labels_hold_no_controls_and_no_more_than_fits() -> None:
    assert printable("a\nb\tc\x00\u202ed\ud800") == "a b c\ufffd\ufffdd\ufffd"
    assert len(printable("x" * 1000)) == 41
    assert words("") == ((" ", "roman"),)
