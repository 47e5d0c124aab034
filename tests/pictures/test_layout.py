"""Labels, dimension lines and angles find places that touch nothing, the same ones every time."""

from __future__ import annotations

import numpy as np
import pytest
from geometry import faults, shown, texts

from multibody_sym.pictures.page.files import svg
from multibody_sym.pictures.page.layout import crossings, laid_out
from multibody_sym.pictures.page.picture import (
    AngleArc,
    Arc,
    Arrow,
    Hatch,
    Mark,
    Measure,
    Pen,
    Picture,
    Stroke,
    TextMark,
    Wish,
    letters,
    words,
)

PEN = Pen(0.9)


def point(x: float, y: float) -> np.ndarray:
    return np.array([[x, y]])


def line(*points: tuple[float, float], **named: object) -> Stroke:
    return Stroke(np.array(points, dtype=float), PEN, **named)


def text_of(picture: Picture, words: str) -> TextMark:
    return next(text for text in texts(picture) if shown(text) == words)


def test_what_is_known_to_be_wrong_is_found() -> None:
    """The referee of all pictures sees each kind of fault."""
    over = [TextMark(np.array([10.0, 10.0]), words("ab"), 10.0), TextMark(np.array([14.0, 12.0]), words("cd"), 10.0)]
    assert any("over 'ab'" in fault for fault in faults(Picture(50, 50, over, "")))
    crossed = [over[0], line((0, 5), (30, 20), name="rod")]
    assert any("line of" in fault for fault in faults(Picture(50, 50, crossed, "")))
    assert any("cut off" in fault for fault in faults(Picture(15, 50, over[:1], "")))
    small = TextMark(np.array([10.0, 10.0]), (("m", "italic"), ("1", "subscript")), 9.0)
    assert any("7.2 pt" in fault for fault in faults(Picture(50, 50, [small], "")))
    assert faults(Picture(50, 50, over[:1], "")) == []


def test_a_label_stands_in_the_direction_that_it_prefers() -> None:
    for way in [(1, 0), (-1, 0), (0, 1), (0, -1)]:
        picture = laid_out([Wish(point(0, 0), words("A"), prefer=way), Arc(np.zeros(2), 2.0, PEN)], "")
        circle = picture.boxes()["", ""]
        box = text_of(picture, "A").box
        centre = np.array([box.left + box.right, box.bottom + box.top]) / 2
        origin = next(np.array([b.left + b.right, b.bottom + b.top]) / 2 for b in circle if b.kind == "line")
        assert (centre - origin) @ np.array(way) > 5


def test_a_label_keeps_off_a_line_through_its_point() -> None:
    picture = laid_out([line((-50, -50), (50, 50)), Wish(point(0, 0), words("joint"))], "")
    assert faults(picture) == []


def test_a_label_of_a_line_stands_beside_its_middle() -> None:
    picture = laid_out([line((0, 0), (100, 0)), Wish(np.array([[0.0, 0], [100, 0]]), words("rod"))], "")
    box = text_of(picture, "rod").box
    stroke = next(mark for mark in picture.marks if isinstance(mark, Stroke))
    assert (box.left + box.right) / 2 == pytest.approx(stroke.points[:, 0].mean())
    assert 0 < box.bottom - stroke.points[0, 1] < 6


def test_a_label_with_no_room_near_gets_a_leader() -> None:
    grid = [line((x, -40), (x, 40)) for x in range(-40, 41, 4)]
    picture = laid_out([*grid, Wish(point(0, 0), words("inside"), name="it", role="point")], "")
    assert faults(picture) == []
    assert {box.kind for box in picture.boxes()["point", "it"]} == {"text", "line"}


@pytest.mark.parametrize(("count", "limit"), [(6, 120), (40, 800)])
def test_labels_of_one_place_do_not_meet(count: int, limit: float) -> None:
    """Bodies that all begin at one place, and springs of no length between them."""
    wishes = [Wish(np.zeros((2, 2)), words(f"spring {i}"), name=str(i)) for i in range(count)]
    picture = laid_out([line((-20, 0), (20, 0)), *wishes], "")
    assert faults(picture) == []
    legend = " ".join(shown(text) for text in texts(picture) if text.role == "legend")
    near = {shown(text) for text in texts(picture)}
    assert all(f"spring {i}" in near or f"spring {i} ({i})" in legend for i in range(count))
    assert max(picture.width, picture.height) < limit


def test_a_mass_stands_on_its_block() -> None:
    block = Stroke(np.array([[0.0, 0], [40, 0], [40, 30], [0, 30]]), PEN, closed=True, fill="#eeeeee")
    picture = laid_out([block, Wish(point(20, 15), letters("m"), inside=np.array([20.0, 15.0]))], "")
    box = text_of(picture, "m").box
    corner = next(mark for mark in picture.marks if isinstance(mark, Stroke)).points[0]
    assert (box.left + box.right) / 2 - corner[0] == pytest.approx(20)


def test_a_dimension_has_arrows_at_its_ends_and_letters_in_its_middle() -> None:
    a, b = np.array([0.0, 0.0]), np.array([80.0, 0.0])
    picture = laid_out([line((0, 0), (80, 0)), Measure(a, b, letters("l"), role="dimension", name="l")], "")
    tips = sorted(mark.points[-1, 0] for mark in picture.marks if isinstance(mark, Arrow))
    assert tips[1] - tips[0] == pytest.approx(80)
    box = text_of(picture, "l").box
    assert (box.left + box.right) / 2 == pytest.approx(sum(tips) / 2)
    assert faults(picture) == []


def test_a_short_dimension_has_its_arrows_outside() -> None:
    picture = laid_out([Measure(np.zeros(2), np.array([6.0, 0]), letters("r"), role="dimension", name="r")], "")
    arrows = [mark for mark in picture.marks if isinstance(mark, Arrow)]
    tips = sorted(float(mark.points[-1, 0]) for mark in arrows)
    tails = sorted(float(mark.points[0, 0]) for mark in arrows)
    assert tips[1] - tips[0] == pytest.approx(6)
    assert tails[0] < tips[0] < tips[1] < tails[1]
    assert faults(picture) == []


def test_a_length_seen_along_itself_is_told_in_letters() -> None:
    picture = laid_out([Measure(np.zeros(2), np.zeros(2), letters("h"), role="dimension", name="h")], "")
    assert [shown(text) for text in texts(picture)] == ["h"]


def test_an_angle_is_an_arc_between_its_sides() -> None:
    sides = [line((0, 0), (60, 0)), line((0, 0), (30, 52))]
    angle = AngleArc(np.zeros(2), 0.0, np.pi / 3, letters("phi"), role="angle", name="phi", tip=1)
    picture = laid_out([*sides, angle], "")
    arc = next(mark for mark in picture.marks if isinstance(mark, Arrow)).points
    centre = next(mark for mark in picture.marks if isinstance(mark, Stroke)).points[0]
    start, stop = (np.degrees(np.arctan2(*(p - centre)[::-1])) for p in (arc[0], arc[-1]))
    assert (start, stop) == pytest.approx((0, 60), abs=0.01)
    assert "φ" in [shown(text) for text in texts(picture)]
    assert faults(picture) == []


def test_an_angle_of_zero_is_told() -> None:
    picture = laid_out([AngleArc(np.zeros(2), 1.0, 1.0, letters("phi"), role="angle", name="phi")], "")
    assert [shown(text) for text in texts(picture)] == ["φ = 0"]


def crowd(seed: int) -> list[Mark]:
    """Return a page full of lines, circles, hatching, labels, dimensions and angles at random places."""
    rng = np.random.default_rng(seed)
    marks: list[Mark] = [line(*rng.uniform(0, 250, (2, 2))) for _ in range(int(rng.integers(3, 30)))]
    marks += [Arc(rng.uniform(0, 250, 2), rng.uniform(2, 40), PEN) for _ in range(8)]
    marks += [Hatch(rng.uniform(0, 250, (2, 2)), PEN) for _ in range(2)]
    marks += [Wish(point(*rng.uniform(0, 250, 2)), words(f"body {i}")) for i in range(int(rng.integers(1, 15)))]
    marks += [Wish(rng.uniform(0, 250, (2, 2)), letters(f"m{i}")) for i in range(6)]
    for i in range(5):
        a, b = rng.uniform(0, 250, (2, 2))
        marks.append(Measure(a, b, letters(f"l{i}"), role="dimension", name=f"l{i}"))
        start = rng.uniform(0, 6)
        at, stop = rng.uniform(0, 250, 2), start + rng.uniform(0.2, 5)
        marks.append(AngleArc(at, start, stop, letters(f"phi{i}"), (True, True)))
    return marks


@pytest.mark.parametrize("seed", range(12))
def test_crowded_pages_have_no_text_over_anything(seed: int) -> None:
    picture = laid_out(crowd(seed), "crowd")
    assert faults(picture) == []
    wanted = sum(isinstance(mark, (Wish, Measure, AngleArc)) for mark in crowd(seed))
    assert len(texts(picture)) == wanted


def test_the_same_picture_every_time() -> None:
    assert svg(laid_out(crowd(3), "crowd")) == svg(laid_out(crowd(3), "crowd"))


def test_boxes_meet_the_lines_through_them() -> None:
    boxes = np.array([[0.0, 0, 10, 10]])
    inside, through, beside, corner = [4, 4, 5, 5], [-5, 5, 15, 6], [-5, 12, 15, 12], [-6, 5, 5, 16.5]
    for one, hit in [(inside, 1), (through, 1), (beside, 0), (corner, 0)]:
        assert crossings(boxes, np.array([one], dtype=float)) == [hit]
