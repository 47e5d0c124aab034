"""Forces that are not unique are dashed in figures, or left out and told below them; sums that are unique are drawn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.answers.free_bodies import CutFree, at_end
from multibody_sym.documents.report_content import free_bodies
from multibody_sym.pictures.draw import Figure
from multibody_sym.pictures.page.picture import Arrow, TextMark
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"
BOX = (EXAMPLES / "textbook/pulled_box.yaml").read_text()
DASHED = "dashed: not unique, other values would do as well"


def rough_ladder() -> mbs.System:
    """Return a ladder on a rough floor at a rough wall: one equation is missing for its four forces."""
    text = (EXAMPLES / "textbook/ladder.yaml").read_text()
    ladder = mbs.loads(text)
    rough = replace(ladder.contacts["top"], static=ladder.contacts["foot"].static)
    return replace(ladder, contacts={**ladder.contacts, "top": rough})


def arrows(figure: Figure) -> list[Arrow]:
    return [m for m in figure.picture.marks if isinstance(m, Arrow) and m.role == "reaction"]


def legend(figure: Figure) -> str:
    lines = [m for m in figure.picture.marks if isinstance(m, TextMark) and m.role == "legend"]
    return " ".join("".join(run for run, _ in line.runs).strip() for line in lines)


def way(arrow: Arrow) -> list[float]:
    step = np.diff(np.asarray(arrow.points), axis=0)[0]
    return [round(float(x), 6) + 0.0 for x in step / np.linalg.norm(step)]


def test_the_four_forces_of_a_rough_ladder_are_dashed_and_hold_it() -> None:
    """They push away from floor and wall, friction inwards at the foot and upwards at the wall."""
    figure = mbs.draw(rough_ladder(), reactions=True, parameters={"mu": 0.6})
    assert all(arrow.pen.dash for arrow in arrows(figure))
    assert sorted(map(way, arrows(figure))) == [[-1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [1.0, 0.0]]
    assert legend(figure) == DASHED
    smooth = mbs.draw(mbs.load(EXAMPLES / "textbook/ladder.yaml"), reactions=True)
    assert not any(arrow.pen.dash for arrow in arrows(smooth))
    assert legend(smooth) == ""


def test_a_ladder_cut_free_has_its_forces_dashed_by_their_letters() -> None:
    ladder = rough_ladder()
    (figure,) = free_bodies(replace(ladder, parameters={**ladder.parameters, "mu": mbs.Parameter(0.6)})).values()
    assert sum(bool(arrow.pen.dash) for arrow in arrows(figure)) == 4
    assert legend(figure) == DASHED


def test_friction_of_a_box_is_drawn_once_where_its_sum_is_unique() -> None:
    """10 N pull it to the right: each corner's share is open, what both exert is not."""
    figure = mbs.draw(mbs.loads(BOX), reactions=True)
    assert sorted(map(way, arrows(figure))) == [[-1.0, 0.0], [0.0, 1.0], [0.0, 1.0]]
    assert not any(arrow.pen.dash for arrow in arrows(figure))
    assert "c.corner1 (their sum is drawn)" in figure.description


def test_friction_of_a_box_at_a_wall_is_dashed_since_its_sum_is_not_unique() -> None:
    """Wall and floor share the 10 N: what friction does not hold, the wall does."""
    wall = BOX.replace("normal: y}}}", "normal: y}, wall: {plane: [b/2, 0, 0], normal: -x}}}")
    wall = wall.replace("contacts: {", "contacts: {w: {between: [box, ground.wall]}, ")
    figure = mbs.draw(mbs.loads(wall), reactions=True)
    dashed = [arrow for arrow in arrows(figure) if arrow.pen.dash]
    assert {abs(way(arrow)[0]) for arrow in dashed} >= {1.0}
    assert legend(figure) == DASHED
    assert "their sum" not in figure.description


def test_what_is_left_out_is_told_below_the_figure() -> None:
    system = mbs.load(EXAMPLES / "three_cranks.yaml")
    told = "not unique, so not drawn: A1,x, A1,y, B1,x, A2,x, A2,y, A3,x, A3,y, B2,x, B3,x"
    assert legend(mbs.draw(system, reactions=True)) == told
    free = free_bodies(system)
    assert legend(free["table"]) == "not unique, so not drawn: B1,x, B2,x, B3,x"
    with pytest.raises(KeyError):
        free["ground"]


@pytest.mark.parametrize("name", ["bicycle", "rolling_coin"])
def test_normal_forces_of_what_rolls_act_where_it_touches(name: str) -> None:
    """On the ground, which is at z = 0, and without a couple: they stood at the middle of the wheel, as its weight."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    scene = scene_of(system)
    run = mbs.simulate(system, t_end=1e-9, samples=2)
    cut = CutFree(system, scene, scene.motion(), *at_end(run))
    rows = [pull for pull in cut.pulls() if pull.key[0] == "row" and pull.key[1].endswith(".n") and pull.at.body >= 0]
    assert rows
    for pull in rows:
        assert not pull.turns
        assert cut.placed.point(pull.at)[2] == pytest.approx(0.0, abs=1e-9)
