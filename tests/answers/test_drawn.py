"""`draw`: figures at the start and at a time, in all formats, with forces, reactions and marks."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.answers.free_bodies import CutFree, all_arrows, at_end, at_start, force_names, reaction_arrows
from multibody_sym.cli.main import main
from multibody_sym.derivation.free_bodies import component_label
from multibody_sym.pictures.page.picture import Arc, Arrow, Stroke
from multibody_sym.pictures.scene.items import ArrowItem, unit
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"
PENDULUM = EXAMPLES / "pendulum.yaml"


def rod(**more: object) -> mbs.System:
    """Return a uniform rod of 2 kg and 1 m that hangs on a hinge, at 0.5 rad from straight down."""
    return mbs.System(
        "rod",
        gravity=[0, -9.81, 0],
        bodies={"rod": mbs.Body(mass=2, com=[0, -0.5, 0], inertia={"Izz": 1 / 6}, points={"tip": [0, -1, 0]})},
        joints={"A": mbs.Revolute("ground", "rod", axis="z", q="theta", initial={"q": 0.5})},
        **more,
    )


def test_a_figure_shows_itself() -> None:
    figure = mbs.draw(rod())
    assert figure.svg == mbs.draw(rod()).svg
    root = ElementTree.fromstring(figure.svg)
    assert root.tag.endswith("svg")
    assert figure._repr_svg_().startswith("<svg")
    assert repr(figure).startswith("Figure('rod', ")
    assert figure.title == "rod"
    for word in ("rod", "A (pivot)", "theta", "t = 0 s"):
        assert word in figure.description


BEGINS = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF", "tex": b"\\documentclass"}


@pytest.mark.parametrize(("ending", "begins"), BEGINS.items())
def test_each_format_is_the_same_every_time(tmp_path: Path, ending: str, begins: bytes) -> None:
    for name in ("a", "b"):
        mbs.draw(rod(), tmp_path / f"{name}.{ending}")
    content = (tmp_path / f"a.{ending}").read_bytes()
    assert content.startswith(begins)
    assert content == (tmp_path / f"b.{ending}").read_bytes()


def test_a_later_time_is_where_the_motion_has_led() -> None:
    """Without gravity the rod turns evenly: 0.5 rad + 2 rad/s * 0.25 s = 1 rad."""
    joints = {"A": mbs.Revolute("ground", "rod", axis="z", q="theta", initial={"q": 0.5, "u": 2.0})}
    body = mbs.Body(mass=1, com=[0.5, 0, 0], inertia={"Izz": 1 / 12}, points={"tip": [1, 0, 0]})
    system = mbs.System("rod", bodies={"rod": body}, joints=joints)
    later, there = mbs.draw(system, at="0.25 s"), mbs.draw(system, initial={"theta": 1.0})
    assert "t = 0.25 s" in later.description
    boxes = later.picture.boxes()["body", "rod"], there.picture.boxes()["body", "rod"]
    first, second = (np.array([b[1:] for b in found]) for found in boxes)  # beside an arrow of its speed at the start
    assert first - first[:1, [0, 1, 0, 1]] == pytest.approx(second - second[:1, [0, 1, 0, 1]], abs=1e-3)


@pytest.mark.parametrize("at", [-1, "-1", "2 kg", math.nan, "x", None, []])
def test_odd_times_are_refused(at: object) -> None:
    with pytest.raises(mbs.InputError):
        mbs.draw(rod(), at=at)


def test_a_time_after_the_end_of_a_motion_is_refused() -> None:
    with pytest.raises(mbs.InputError, match="ends at t = "):
        mbs.draw(rod(stop={"low": "theta < 0.4"}), at=5)


@pytest.mark.parametrize("at", ["nan", "inf", "tomorrow"])
def test_a_time_that_is_none_is_blamed_where_it_was_asked_for(at: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["draw", str(PENDULUM), "--at", at]) == 2
    assert capsys.readouterr().err.startswith(f"error: --at: '{at}' is not declared")


def test_a_long_run_tells_how_far_it_is_and_ends_by_interruption() -> None:
    """A run to 1e9 s would take days: what it has done is told, and Ctrl-C draws nothing."""

    def stop(part: float) -> None:
        assert 0.0 <= part < 1e-3
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mbs.draw(rod(), at=1e9, on_progress=stop)


def test_other_formats_and_views_are_refused(tmp_path: Path) -> None:
    with pytest.raises(mbs.InputError, match=r"\.svg, \.png, \.pdf, \.tex"):
        mbs.draw(rod(), tmp_path / "a.gif")
    with pytest.raises(mbs.InputError, match="view"):
        mbs.draw(rod(), view="sideways")
    with pytest.raises(mbs.InputError, match="forces"):
        mbs.draw(rod(), forces="yes")


def cut_free(system: mbs.System) -> CutFree:
    scene = scene_of(system)
    return CutFree(system, scene, scene.motion(), *at_end(mbs.simulate(system, t_end=1e-9, samples=2)))


def test_reactions_are_those_of_the_hinge_turned_into_the_world() -> None:
    """A rod that is released at theta: m g cos(theta) along it towards the hinge, m g sin(theta) / 4 across it."""
    arrows = reaction_arrows(cut_free(rod()))
    weight, theta = 2 * 9.81, 0.5
    along = np.array([-math.sin(theta), math.cos(theta), 0])
    across = np.array([math.cos(theta), math.sin(theta), 0])
    expected = weight * math.cos(theta) * along + weight * math.sin(theta) / 4 * across
    assert [(arrow.role, arrow.name, arrow.label) for arrow in arrows] == [
        ("reaction", "A", "A_x"),
        ("reaction", "A", "A_y"),
    ]
    assert np.sum([arrow.vector for arrow in arrows], axis=0) == pytest.approx(expected, abs=1e-5)


def told(arrows: Iterable[ArrowItem]) -> set[tuple[str, str]]:
    return {(arrow.label, str(np.round(unit(arrow.vector), 6) + 0.0)) for arrow in arrows}


def test_a_block_on_an_incline_shows_what_presses_rubs_and_pulls() -> None:
    """It slides down at 45 degrees: N across, friction and the string up the plane; the load hangs on the string."""
    found = told(reaction_arrows(cut_free(mbs.load(EXAMPLES / "textbook/t5_incline.yaml"))))
    up, across = np.array([1, 1, 0]) / math.sqrt(2), np.array([-1, 1, 0]) / math.sqrt(2)
    ways = [("N", across), ("F", up), ("T", up), ("T", np.array([0.0, 1.0, 0.0]))]
    assert found == {(letter, str(np.round(way, 6) + 0.0)) for letter, way in ways}


def test_the_force_of_a_foot_that_sticks_is_in_its_cone_of_friction() -> None:
    """Sides at atan(mu) = atan(0.4) about the normal; the force leans by atan(F/N) = atan(1/(2*tan(60 deg))) within."""
    picture = mbs.draw(mbs.load(EXAMPLES / "textbook/ladder.yaml"), reactions=True).picture
    sides = [mark.points for mark in picture.marks if mark.role == "friction cone" and len(mark.points) == 2]
    leans = sorted(math.atan2(*(end - begin)) for begin, end in sides)
    assert leans == pytest.approx([-math.atan(0.4), math.atan(0.4)], abs=1e-12)
    assert 1 / (2 * math.tan(math.radians(60))) < 0.4


def test_a_ladder_later_on_shows_the_forces_of_both_contacts() -> None:
    """Rough foot and smooth wall: N1 and F at the foot, N2 at the wall, the last from it."""
    description = mbs.draw(mbs.load(EXAMPLES / "textbook/ladder.yaml"), at=0.01, reactions=True).description
    assert "Reactions: foot, top." in description


def test_friction_of_a_box_at_rest_is_what_pulls_at_it_backwards() -> None:
    """10 N pull: how the two corners share that is open, in a run and at the start, their sum is not."""
    system = mbs.load(EXAMPLES / "textbook/pulled_box.yaml")
    asked = replace(system, outputs={"f": "reaction(c, friction)"})
    assert mbs.simulate(asked, t_end=1e-9, samples=2)["f"] == pytest.approx([-10.0, -10.0])
    scene = scene_of(system)
    cut = CutFree(system, scene, scene.motion(), at_start(mbs.solve(system))[0])
    (friction,) = [pull for pull in cut.pulls() if pull.key == ("friction", "c")]
    assert friction.vector == pytest.approx([-10.0, 0.0, 0.0])
    for free in (cut, cut_free(system)):
        total = sum(pull.vector for pull in free.pulls() if pull.at.body == 0 and not pull.turns)
        assert total == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


def test_loads_are_drawn_always_and_weights_where_forces_are_asked_for() -> None:
    system = rod(forces={"F": mbs.Force(on="rod.tip", value=[5, 0, 0])})

    def arrows(**options: bool) -> set[str]:
        return {m.name for m in mbs.draw(system, **options).picture.marks if isinstance(m, Arrow) and m.role != "angle"}

    bare = arrows()
    assert bare & {"F", "rod"} == {"F"}
    assert arrows(forces=True) - bare == {"rod"}
    assert arrows(reactions=True) - bare == {"A"}


def test_the_weight_of_a_plank_acts_at_its_centre_of_mass_in_the_middle_of_it() -> None:
    """It lies on two wheels 0.1 m off their middle, and shows nothing of itself but its face."""
    system = mbs.load(EXAMPLES / "textbook/plank_on_rollers.yaml")
    picture = mbs.draw(system, forces=True).picture
    marks = [m for m in picture.marks if m.name == "plank"]
    (weight,) = [m for m in marks if isinstance(m, Arrow) and m.role == "force"]
    (centre,) = [m for m in marks if isinstance(m, Arc) and m.role == "mass centre"]
    (plank,) = [m for m in marks if isinstance(m, Stroke) and m.role == "body"]
    assert np.asarray(weight.points)[0] == pytest.approx(np.asarray(centre.centre))
    ends = np.asarray(plank.points)[:, 0]
    assert (ends.min() + ends.max()) / 2 == pytest.approx(float(centre.centre[0]))


def test_the_description_says_which_forces_are_not_unique() -> None:
    """A ladder on a rough floor and a rough wall: one equation is missing for its four forces."""
    ladder = mbs.load(EXAMPLES / "textbook" / "ladder.yaml")
    rough = replace(ladder.contacts["top"], static=ladder.contacts["foot"].static)
    system = replace(ladder, contacts={**ladder.contacts, "top": rough})
    told = mbs.draw(system, reactions=True, parameters={"mu": 0.6}).description
    names = mbs.solve(system, parameters={"mu": 0.6}).not_unique
    doubtful = [f"{name} (dashed)" for name in names]
    assert f"Not unique, because constraints depend on each other: {', '.join(doubtful)}." in told
    assert "Not unique" not in mbs.draw(ladder, reactions=True).description


def test_what_is_unique_of_a_joint_is_drawn_alone() -> None:
    """Three parallel cranks, 60 degrees below x: what they push along themselves is not unique, what is across is."""
    figure = mbs.draw(mbs.load(EXAMPLES / "three_cranks.yaml"), reactions=True)
    arrows = [m for m in figure.picture.marks if isinstance(m, Arrow) and m.role == "reaction"]
    assert {m.name for m in arrows} == {"B1", "B2", "B3"}
    for arrow in arrows:
        way = np.diff(np.asarray(arrow.points), axis=0)[0]
        assert way @ np.array([math.cos(math.pi / 3), -math.sin(math.pi / 3)]) == pytest.approx(0.0, abs=1e-6)
    assert "fx(A1), fy(A1) (not drawn), fx(B1) (not drawn)" in figure.description


SEVERAL = ["four_bar", "slider_crank", "cart_pole", "textbook/t5_incline", "textbook/capstan", "textbook/spool"]
SEVERAL += ["rolling_coin", "shaken_rotor", "chaplygin_sleigh"]  # zero just now; a ground that moves; a knife-edge


@pytest.mark.parametrize("name", SEVERAL)
def test_letters_of_bodies_cut_free_are_those_of_the_steps(name: str) -> None:
    """The steps tell below each body what acts on it, letter first."""
    verify_letters(mbs.load(EXAMPLES / f"{name}.yaml"))


@pytest.mark.long
@pytest.mark.parametrize("file", sorted(EXAMPLES.rglob("*.yaml")), ids=lambda path: path.stem)
def test_letters_of_all_examples_are_those_of_the_steps(file: Path) -> None:
    system = mbs.load(file)
    if system.impact is None:
        verify_letters(system)


def verify_letters(system: mbs.System) -> None:
    """All letters are those of the steps, but sums of friction and couples of joints that are no unknowns there."""
    solution = mbs.solve(system, steps=True)
    scene = scene_of(system)
    cut = CutFree(system, scene, scene.motion(), *at_start(solution)[:2])
    assert solution.steps is not None
    spelt = {label.text for label in solution.steps.notation.spelling.values()}
    alone = {
        component_label(*pull.key[1:]).text
        for pull in cut.pulls()
        if pull.key[0] == "joint" and pull.turns and "_".join(pull.key[1:]) in spelt
    }
    alone |= {f"F_{pull.key[1]}" for pull in cut.pulls() if pull.key[0] == "friction"}  # all corners together
    for arrow in all_arrows(cut):
        if arrow.role in ("reaction", "couple") and arrow.label not in alone:
            assert arrow.label in spelt, arrow


def test_a_ball_on_rails_has_the_numbers_of_the_steps() -> None:
    """Each of two rails has two parts of friction, of which one is zero; the open ends of the rails have no letters."""
    cut = cut_free(mbs.load(EXAMPLES / "textbook/ball_on_rails.yaml"))
    letters = force_names(cut.system, cut.scene.mechanism, list(cut.lasting()))
    sides = {f"{x}.side.{part}" for x in "AB" for part in ("normal", "friction1", "friction2")}
    assert {key[1]: letter for key, letter in letters.items()} == dict(
        zip(sorted(sides), ("F1", "F2", "N1", "F3", "F4", "N2"), strict=True)
    )


def test_a_constraint_on_a_joint_pulls_along_it_with_its_multiplier() -> None:
    """A knife-edge's force is across it, one arrow for both components; a prescribed slider's is its drive's."""
    text = (EXAMPLES / "chaplygin_sleigh.yaml").read_text(encoding="utf-8")
    turned = text.replace("initial: {u: [-1, 0, 0.1]}", "initial: {q: [0, 0, 0.4], u: [-cos(0.4), -sin(0.4), 0.1]}")
    (edge,) = reaction_arrows(cut_free(mbs.loads(turned)))
    assert edge.label == "lambda_edge"
    assert np.abs(unit(edge.vector)) == pytest.approx([math.sin(0.4), math.cos(0.4), 0.0], abs=1e-6)
    hopper = cut_free(mbs.load(EXAMPLES / "variable_mass/hopper.yaml"))
    pulls = [pull for pull in hopper.pulls() if pull.key == ("row", "drive")]
    assert [abs(pull.value) for pull in pulls] == pytest.approx([10.0, 10.0])


def test_redundant_rows_and_places_are_marked() -> None:
    plain, marked = (mbs.draw(mbs.load(EXAMPLES / "three_cranks.yaml"), redundant=r) for r in (False, True))
    assert "Marked" not in plain.description
    assert "(redundant)" in marked.description
    assert "#d05a00" in marked.svg
    assert "#d05a00" not in plain.svg
    assert "joints.A (here)" in mbs.draw(rod(), mark={"joints.A": "here"}).description
    with pytest.raises(mbs.InputError, match=r"nothing at 'joints.B'; did you mean joints.A\?"):
        mbs.draw(rod(), mark=["joints.B"])


def test_a_hundred_links_have_no_names() -> None:
    """No page has room for them; the words for screen readers tell the first."""
    count = 100
    body = mbs.Body(mass=1, com=[0.5, 0, 0], inertia={"Izz": 0.1}, points={"end": [1, 0, 0]})
    carriers = ["ground", *(f"link{k}.end" for k in range(count - 1))]
    joints = {f"J{k}": mbs.Revolute(carriers[k], f"link{k}", axis="z", q=f"q{k}") for k in range(count)}
    figure = mbs.draw(mbs.System("chain", bodies={f"link{k}": body for k in range(count)}, joints=joints))
    assert len(figure.picture.boxes()) > 2 * count
    assert max(figure.size) < 430
    assert "link7," in figure.description
    assert "and 70 more" in figure.description


def test_an_svg_takes_neither_sympy_nor_matplotlib(tmp_path: Path) -> None:
    code = (
        "import sys, multibody_sym as mbs\n"
        f"mbs.draw(mbs.load({str(PENDULUM)!r}), {str(tmp_path / 'a.svg')!r})\n"
        "print([name for name in ('sympy', 'matplotlib', 'scipy') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
