"""What figures of books show: kerbs, rails under wedges, edges of skates, hoops, wheels where they touch the ground."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.draw import FigureContent, draw
from multibody_sym.pictures.marks.labels import Names
from multibody_sym.pictures.page.layout import crossing_count
from multibody_sym.pictures.page.picture import Arc, Arrow, Hatch, Mark, Picture, Stroke, TextMark
from multibody_sym.pictures.scene.scene import scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def picture(name: str, names: Names = "letters") -> Picture:
    scene = scene_of(mbs.load(EXAMPLES / f"{name}.yaml"))
    return draw(scene, scene.at(), shown=FigureContent(names=names))


def points(marks: list[Mark]) -> np.ndarray:
    return np.vstack([np.asarray(mark.points) for mark in marks])  # type: ignore[attr-defined]


def of(shown: Picture, role: str, name: str) -> list[Mark]:
    return [mark for mark in shown.marks if mark.role == role and mark.name == name and not isinstance(mark, TextMark)]


def text_at(shown: Picture, words: str) -> np.ndarray:
    marks = (mark for mark in shown.marks if isinstance(mark, TextMark))
    (found,) = [mark for mark in marks if "".join(run for run, _ in mark.runs) == words]
    return np.asarray(found.at)


def test_a_kerb_is_a_step_up_from_the_road_to_the_edge_that_the_wheel_touches() -> None:
    shown = picture("textbook/kerb")
    (step,) = [mark for mark in shown.marks if isinstance(mark, Hatch) and mark.role == "point"]
    (road,) = [mark for mark in shown.marks if isinstance(mark, Hatch) and mark.name == "ground.road"]
    foot, edge, end = np.asarray(step.points)
    scale = (edge - foot)[1] / 0.06
    assert foot[1] == pytest.approx(np.asarray(road.points)[0][1])
    wheel = next(mark for mark in shown.marks if mark.role == "body" and hasattr(mark, "radius"))
    assert wheel.radius == pytest.approx(0.3 * scale)  # type: ignore[attr-defined]
    assert np.hypot(*(edge - wheel.centre)) == pytest.approx(wheel.radius)  # type: ignore[attr-defined]
    assert end[0] > edge[0]
    assert end[1] == pytest.approx(edge[1])


@pytest.mark.parametrize("name", ["oscillations/wedge_and_spring", "textbook/free_wedge", "textbook/pushed_wedge"])
def test_the_table_lies_under_the_whole_wedge_and_has_its_name(name: str) -> None:
    shown = picture(name, "all")
    rail = points(of(shown, "joint", "table"))
    wedge = points(of(shown, "body", "wedge"))
    assert rail[:, 0].min() < wedge[:, 0].min()
    assert rail[:, 0].max() > wedge[:, 0].max()
    assert text_at(shown, "table")[1] < rail[:, 1].min() + 1.0


def test_a_skate_stands_along_the_only_direction_in_which_it_moves() -> None:
    """Chaplygin's sleigh starts along x."""
    (edge,) = of(picture("chaplygin_sleigh"), "limit", "edge")
    wide, high = np.ptp(np.asarray(edge.points), axis=0)  # type: ignore[attr-defined]
    assert wide > 5 * high


def test_wheels_in_space_have_the_names_of_their_contacts_on_the_ground() -> None:
    shown = picture("bicycle", "all")
    hub, contact = text_at(shown, "rear wheel"), text_at(shown, "rear contact")
    assert contact[1] < hub[1] - 25.0


def test_names_of_wheels_stand_outside_of_them() -> None:
    shown = picture("bicycle")
    boxes = {(m.role, m.name): np.reshape(m.box[1:], (2, 2)) for m in shown.marks if isinstance(m, TextMark)}
    for wheel in ("rear", "front"):
        hub = points(of(shown, "joint", f"{wheel}_wheel")).mean(axis=0)
        rim = np.hypot(*(points([m for m in of(shown, "body", wheel) if getattr(m, "fill", None)]) - hub).T)
        assert np.hypot(*(np.clip(hub, *boxes["body", wheel]) - hub)) > rim.min()


def test_radii_of_drums_are_shown_in_the_drum() -> None:
    shown = picture("textbook/capstan")
    (radius,) = [m for m in shown.marks if isinstance(m, Arrow) and m.role == "dimension"]
    drum = points([m for m in shown.marks if (m.role == "pulley" and isinstance(m, Stroke)) or hasattr(m, "radius")])
    assert np.all(np.asarray(radius.points) >= drum.min(axis=0) - 1e-6)
    assert np.all(np.asarray(radius.points) <= drum.max(axis=0) + 1e-6)


@pytest.mark.parametrize("name", ["textbook/crate_on_a_truck", "textbook/growing_force"])
def test_a_body_under_a_mass_without_a_size_is_not_huge_beside_it(name: str) -> None:
    shown = picture(name)
    names = {mark.name for mark in shown.marks if mark.role == "body"}
    heights = [np.ptp(points(of(shown, "body", name)), axis=0)[1] for name in names]
    assert 1.0 < max(heights) / min(heights) < 4.0


def test_a_prescribed_motion_has_its_name_at_its_arrow() -> None:
    text = (EXAMPLES / "variable_mass/hopper.yaml").read_text().replace("value: v*t}", "value: v*t^2*k/m0}")
    scene = scene_of(mbs.loads(text))
    shown = draw(scene, scene.at(), shown=FigureContent(names="all"))
    arrow = points(of(shown, "limit", "drive"))
    (label,) = [m for m in shown.marks if isinstance(m, TextMark) and m.role == "limit"]
    assert "drive" in {run for run, _ in label.runs}
    assert np.abs(label.at - arrow.mean(axis=0)).max() < 30.0


def test_a_wire_that_turns_is_its_curve() -> None:
    shown = picture("guides/ring_on_a_moving_wire")
    (wire,) = of(shown, "body", "wire")
    assert len(np.asarray(wire.points)) > 50  # type: ignore[attr-defined]


def test_a_wheel_in_a_figure_has_no_line_from_its_middle() -> None:
    assert not [m for m in of(picture("textbook/drum_brake"), "body", "drum") if isinstance(m, Stroke)]


@pytest.mark.parametrize("name", ["oscillations/triatomic_molecule", "textbook/t1_two_blocks"])
def test_blocks_on_one_rail_have_the_names_of_their_sliders_near_themselves(name: str) -> None:
    system, shown = mbs.load(EXAMPLES / f"{name}.yaml"), picture(name, "all")
    for joint, declared in system.joints.items():
        block = points(of(shown, "body", declared.child)).mean(axis=0)
        (label,) = [m for m in shown.marks if isinstance(m, TextMark) and m.role == "joint" and m.name == joint]
        assert abs(float(label.at[0] - block[0])) < 50.0


def arrow_of(shown: Picture, name: str) -> np.ndarray:
    (arrow,) = [m for m in shown.marks if isinstance(m, Arrow) and m.role == "force" and m.name == name]
    return np.asarray(arrow.points)


def test_a_beam_lies_on_its_supports_and_its_load_presses_on_it() -> None:
    shown = picture("textbook/beam")
    (beam,) = of(shown, "body", "beam")
    outline = np.asarray(beam.points)  # type: ignore[attr-defined]
    middle = (outline[:, 1].min() + outline[:, 1].max()) / 2
    assert len([mark for mark in shown.marks if isinstance(mark, Hatch)]) == 2
    circles = [mark for mark in of(shown, "ground", "ground.supports") if isinstance(mark, Arc)]
    tips = [mark for mark in circles if float(mark.centre[1]) == pytest.approx(middle)]
    wheels = [mark for mark in circles if float(mark.centre[1]) < outline[:, 1].min()]
    assert [len(tips), len(wheels)] == [2, 2]  # a pin, and a roller on two wheels
    for tip, end in zip(tips, (outline[:, 0].min(), outline[:, 0].max()), strict=True):
        assert float(tip.centre[0]) == pytest.approx(end, abs=3.5)
    assert min(float(wheel.centre[0]) for wheel in wheels) > outline[:, 0].max() - 15.0
    tail, tip = arrow_of(shown, "load")
    assert tail[1] > outline[:, 1].max() > tip[1] > outline[:, 1].min()
    assert tip[0] == pytest.approx(outline[:, 0].min() + np.ptp(outline[:, 0]) / 4, abs=3.0)
    assert text_at(shown, "F")[1] > outline[:, 1].max()


def test_a_rod_in_a_bowl_touches_it_with_both_ends() -> None:
    shown = picture("textbook/rod_in_bowl")
    (bowl,) = [np.asarray(mark.points) for mark in shown.marks if isinstance(mark, Hatch)]
    (rod,) = of(shown, "body", "rod")
    middle, radius = (bowl.min(axis=0) + bowl.max(axis=0)) / 2, np.ptp(bowl[:, 0]) / 2
    reach = np.hypot(*(np.asarray(rod.points) - middle).T)  # type: ignore[attr-defined]
    assert reach.max() == pytest.approx(radius, abs=0.05)
    assert sorted(reach)[-2] > radius - 0.4


@pytest.mark.parametrize(
    ("name", "force", "letter", "way"),
    [
        ("textbook/growing_force", "pull", "k\u2009t", 1),  # zero at the start
        ("questions/driven_oscillator", "drive", "F\u2009sin(w\u2009t)", 1),
        ("textbook/t1_two_blocks", "pull1", "F1", -1),
        ("textbook/ring_on_a_rod", "pull", "F", 1),
    ],
)
def test_loads_have_their_letters_and_directions(name: str, force: str, letter: str, way: int) -> None:
    shown = picture(name)
    tail, tip = arrow_of(shown, force)
    assert way * (tip - tail)[0] > 10.0
    (label,) = [m for m in shown.marks if isinstance(m, TextMark) and m.role == "force" and m.name == force]
    assert "".join(run for run, _ in label.runs) == letter


def test_the_torque_of_a_winch_turns_about_its_drum() -> None:
    shown = picture("textbook/drum_hoist")
    (torque,) = [np.asarray(m.points) for m in shown.marks if isinstance(m, Arrow) and m.role == "torque"]
    wheels = [m for m in shown.marks if hasattr(m, "radius") and m.role in ("body", "pulley")]
    radius = np.ptp(torque[:, 0]) / 2
    assert all(abs(radius - wheel.radius) > 2.5 for wheel in wheels)  # type: ignore[attr-defined]


def test_a_person_stands_in_a_lift_that_moves() -> None:
    shown = picture("lift")
    (person,) = of(shown, "body", "person")
    cabin = points([m for m in shown.marks if isinstance(m, Stroke) and m.role == "surface"])
    block = np.asarray(person.points)  # type: ignore[attr-defined]
    assert len(block) == 4
    assert block[:, 1].min() == pytest.approx(cabin[:, 1].min())
    (arrow,) = [np.asarray(m.points) for m in shown.marks if isinstance(m, Arrow) and m.role == "motion"]
    assert arrow[1, 1] > arrow[0, 1]


def zigzag_of(shown: Picture, name: str) -> np.ndarray:
    return max((np.asarray(m.points) for m in shown.marks if isinstance(m, Stroke) and m.name == name), key=len)


def test_the_spring_of_a_rod_that_gives_is_a_part_of_the_rod() -> None:
    """From the rod's end to its pin on the slider, in one line with it; the rod ends where the spring begins."""
    shown = picture("elastic_rod")
    rod = max((np.asarray(m.points) for m in of(shown, "body", "rod")), key=len)  # type: ignore[attr-defined]
    (pin,) = [np.asarray(m.centre) for m in shown.marks if m.role == "joint" and m.name == "C" and hasattr(m, "centre")]
    spring = zigzag_of(shown, "elasticity")
    way = pin - rod.mean(axis=0)
    along = way / np.hypot(*way)
    assert ((rod - pin) @ along).max() < ((spring - pin) @ along).min() + 12.0
    assert ((spring - pin) @ along).max() == pytest.approx(0.0, abs=10.0)
    assert np.abs((spring - pin) @ np.array([-along[1], along[0]])).max() < 14.0


def test_a_spring_on_a_wedge_begins_at_a_plate_on_it() -> None:
    shown = picture("oscillations/wedge_and_spring")
    (plate,) = [np.asarray(m.points) for m in shown.marks if isinstance(m, Stroke) and m.name == "spring" and m.closed]
    (wedge,) = [np.asarray(m.points) for m in of(shown, "body", "wedge")]  # type: ignore[attr-defined]
    spring = zigzag_of(shown, "spring")
    assert np.hypot(*(plate.mean(axis=0) - spring[0])) < 6.0
    low, high = wedge[np.argmin(wedge[:, 0])], wedge[np.argmax(wedge[:, 1])]
    slope = (high - low) / np.hypot(*(high - low))
    heights = (plate - low) @ np.array([-slope[1], slope[0]])
    assert heights.min() == pytest.approx(0.0, abs=0.5)
    assert np.hypot(*(spring[-1] - spring[0])) < 125.0


def test_a_bob_on_a_rope_is_round_and_both_wheels_are_alike() -> None:
    shown = picture("swinging_atwood")
    (bob,) = of(shown, "body", "bob")
    assert hasattr(bob, "radius")
    assert not of(shown, "body", "line")
    wheels = [max(m.radius for m in of(shown, "pulley", name) if hasattr(m, "radius")) for name in ("P1", "P2")]
    assert wheels[0] == wheels[1]
    (turn,) = of(shown, "joint", "turn")
    hub = next(m for m in of(shown, "pulley", "P2") if hasattr(m, "radius"))
    assert np.asarray(turn.centre) == pytest.approx(np.asarray(hub.centre))  # type: ignore[attr-defined]


def test_gimbals_have_their_bearings_where_their_axes_meet_the_rings() -> None:
    """On both sides of the middle: the frame's above and below all, the inner ring's within the outer one."""
    shown = picture("gyroscope", "all")
    middle = points(of(shown, "body", "rotor")).mean(axis=0)
    for joint in ("frame", "gimbal", "axle"):
        marks = points([m for m in of(shown, "joint", joint) if isinstance(m, Stroke)])
        assert np.hypot(*(marks - middle).T).min() < np.hypot(*(marks - middle).T).max() - 10.0
        assert (marks - middle).min(axis=0) @ (marks - middle).max(axis=0) < 0.0
    outer = points([m for m in shown.marks if isinstance(m, Stroke) and m.name == "outer"])
    frame = points([m for m in of(shown, "joint", "frame") if isinstance(m, Stroke)])
    assert frame[:, 1].max() > outer[:, 1].max()
    assert frame[:, 1].min() < outer[:, 1].min()
    assert text_at(shown, "frame")[1] > middle[1] + 40.0


def test_a_long_vehicle_is_seen_from_its_side() -> None:
    shown = picture("bicycle")
    rear, front = (points(of(shown, "body", name)) for name in ("rear", "front"))
    assert front[:, 0].min() > rear[:, 0].max()


def test_the_springs_of_legs_are_seen_between_their_halves() -> None:
    shown = picture("stewart_platform", "none")
    for k in range(1, 7):
        spring = zigzag_of(shown, f"drive{k}")
        lower, upper = (points(of(shown, "body", f"{half}{k}")) for half in ("lower", "upper"))
        assert spring[:, 1].max() < upper[:, 1].min() + 12.0
        assert spring[:, 1].min() > lower[:, 1].max() - 12.0
        sleeve = points([m for m in of(shown, "joint", f"leg{k}") if isinstance(m, Stroke) and m.closed])
        (ball, *_) = [np.asarray(m.centre) for m in of(shown, "joint", f"ball{k}") if isinstance(m, Arc)]
        middle = (sleeve.min(axis=0) + sleeve.max(axis=0)) / 2
        assert 10.0 < np.hypot(*(middle - ball)) <= 16.0  # on its bar, where the ball is seen too


def test_a_cycloid_is_drawn_from_cusp_to_cusp_and_a_slope_beside_it_no_further() -> None:
    """The arch of a wheel of radius R is 2*pi*R long and 2*R deep; both ways meet again in their common end."""
    shown = picture("guides/brachistochrone")
    cycloid, slope = (points(of(shown, "guide", name)) for name in ("cycloid", "slope"))
    wide, high = np.ptp(cycloid, axis=0)
    assert wide / high == pytest.approx(np.pi, rel=0.01)
    assert slope[:, 0].min() > cycloid[:, 0].min() - 0.1 * wide
    assert slope[:, 0].max() < cycloid[:, 0].max() + 0.1 * wide


def test_two_hinges_at_one_place_of_ground_stand_on_one_support() -> None:
    shown = picture("andrews_squeezer")
    assert len([m for m in shown.marks if isinstance(m, Hatch) and m.name in ("A5", "A7")]) == 1


def test_a_spring_with_a_length_is_drawn_where_its_slider_is_at_zero() -> None:
    """Bars of a leg pushed together: nothing is left between them, and the spring has its ends at both frames."""
    system = mbs.loads(
        "{multibody_sym: 1, name: leg, bodies: {a: {mass: 1, com: [0.2, 0, 0], inertia: {Izz: 1}},"
        " b: {mass: 1, com: [-0.2, 0, 0], inertia: {Izz: 1}}}, joints: {A: {type: revolute, parent: ground, child: a,"
        " axis: z}, S: {type: prismatic, parent: a, child: b, axis: x}},"
        " forces: {s: {type: spring_damper, joint: S, stiffness: 9, length: 1}}}"
    )
    scene = scene_of(system)
    (spring,) = scene.at().strands
    assert np.ptp(spring.pieces, axis=(0, 1)) == pytest.approx(0.0)
    assert draw(scene, scene.at()).width > 0.0


def test_the_letter_of_a_rough_incline_stands_where_the_block_slides() -> None:
    shown = picture("textbook/t5_incline")
    block = points(of(shown, "body", "block")).mean(axis=0)
    assert np.hypot(*(text_at(shown, "\u03bc") - block)) < 40.0


def test_what_rolls_on_a_curve_or_has_one_has_its_dot_where_it_touches() -> None:
    """The ellipse at its lowest place, on the floor; the disc in a hollow a radius from its middle, on the curve."""
    shown = picture("guides/rolling_ellipse")
    (dot,) = of(shown, "contact", "rolls")
    (rim,) = of(shown, "body", "wheel")
    lowest = min(np.asarray(rim.points), key=lambda place: place[1])  # type: ignore[attr-defined]
    assert np.asarray(dot.centre) == pytest.approx(lowest, abs=2.0)  # type: ignore[attr-defined]
    shown = picture("guides/disc_in_a_parabolic_hollow")
    (dot,) = of(shown, "contact", "rolls")
    disc = next(mark for mark in of(shown, "body", "disc") if isinstance(mark, Arc))
    assert np.hypot(*(np.asarray(dot.centre) - disc.centre)) == pytest.approx(disc.radius, abs=0.5)  # type: ignore[attr-defined]
    assert dot.centre[0] > disc.centre[0]  # type: ignore[attr-defined]  # on the side of the slope that rises


@pytest.mark.parametrize(
    ("name", "length", "acting"),
    [("textbook/beam", "beam.length", "load"), ("oscillations/coupled_pendulums", "first.com", "spring")],
)
def test_no_dimension_line_crosses_a_load_or_a_spring(name: str, length: str, acting: str) -> None:
    shown = picture(name)
    lines = [np.asarray(m.points) for m in of(shown, "dimension", length) if isinstance(m, Arrow)]
    strokes = [np.asarray(m.points) for m in shown.marks if m.name == acting and isinstance(m, (Arrow, Stroke))]
    pieces = np.vstack([np.hstack((points[:-1], points[1:])) for points in strokes])
    assert lines
    assert all(crossing_count(line[0], line[-1], pieces) == 0 for line in lines)


def test_a_ball_that_flies_without_gravity_has_no_rail_and_a_racket_in_a_guide_has() -> None:
    shown = picture("impacts/moving_racket")
    assert {mark.name for mark in shown.marks if isinstance(mark, Hatch)} == {"hand"}


def test_a_centre_of_force_has_its_name_and_a_tie_of_no_length_has_none() -> None:
    shown = picture("kepler", "all")
    (sun,) = [mark for mark in of(shown, "attraction", "sun") if isinstance(mark, Arc)]
    assert np.hypot(*(text_at(shown, "sun") - sun.centre)) < 30.0
    governor = picture("oscillations/governor", "all")
    assert not [m for m in governor.marks if isinstance(m, TextMark) and m.name == "sleeve"]


def test_what_is_thrown_shows_its_speed_at_the_start_alone() -> None:
    """At 50 degrees; half a second later it is elsewhere and flies another way."""
    scene = scene_of(mbs.load(EXAMPLES / "questions/over_a_wall.yaml"))
    (speed,) = [mark for mark in draw(scene, scene.at()).marks if isinstance(mark, Arrow) and mark.role == "velocity"]
    rise, way = np.ptp(np.asarray(speed.points), axis=0)[::-1]
    assert np.degrees(np.arctan2(rise, way)) == pytest.approx(50.0)
    later = draw(scene, scene.at(t=0.5))
    assert not [mark for mark in later.marks if mark.role == "velocity"]


def test_what_is_free_in_the_plane_shows_the_coordinates_that_a_question_names() -> None:
    def arrows(name: str, joint: str) -> list[int]:
        return [len(m.points) for m in of(picture(name), "joint", joint) if isinstance(m, Arrow)]

    assert len(arrows("oscillations/disc_in_a_hollow", "free")) == 1  # the bow of phi
    assert arrows("questions/over_a_wall", "j") == [2, 2]
    assert not of(picture("textbook/pulled_box"), "joint", "free")
    assert not of(picture("scattering"), "joint", "flight")


def drawn(text: str) -> Picture:
    scene = scene_of(mbs.loads("multibody_sym: 1\nname: drawn\n" + text))
    return draw(scene, scene.at())


def written(shown: Picture) -> list[str]:
    return ["".join(run for run, _ in m.runs) for m in shown.marks if isinstance(m, TextMark) and m.role != "legend"]


def test_moments_and_speeds_stand_at_their_bodies_and_names_only_where_they_tell_apart() -> None:
    shown = drawn("""
gravity: [0, -9.81, 0]
parameters: {m: 1 kg, J: 1, R: 20 cm, W: 3 rad/s, v: 2 m/s, a: 1 m/s^2, u: 1 m/s, w: 2 m/s, mu: 0.3}
bodies:
  drum: {mass: m, inertia: {Izz: J}, surfaces: {rim: {disc: R}}}
  bob: {mass: 2 kg, com: [0, -R, 0]}
  cart: {mass: 3 kg}
  stone: {mass: 4 kg}
joints:
  axle: {type: revolute, parent: ground, child: drum, q: phi, initial: {u: W}}
  string: {type: revolute, parent: ground, child: bob, q: psi, initial: {u: v/R}}
  road: {type: prismatic, parent: ground, child: cart, axis: x, motion: -a*t^2/2}
  flight: {type: point, parent: ground, child: stone, q: [x, y], initial: {q: [1, 1], u: [u, -w]}}
ask: {T: fy(string), x: x}
""")
    assert {"m, J", "W", "v", "a", "u", "w", "string", "x"} <= {*written(shown)}
    assert not {"bob", "cart", "stone", "drum", "axle", "y", "v/R"} & {*written(shown)}
    (spin,) = [mark for mark in of(shown, "velocity", "axle") if isinstance(mark, Arrow)]
    one, two = np.diff(spin.points, axis=0)[:-1], np.diff(spin.points, axis=0)[1:]
    assert np.all(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0] > 0.0)  # as W turns
    speeds = {tuple(np.sign(np.round(m.points[1] - m.points[0], 6))) for m in of(shown, "velocity", "flight")}  # type: ignore[attr-defined]
    assert speeds == {(1.0, 0.0), (0.0, -1.0)}
    (brake,) = [mark for mark in of(shown, "velocity", "road") if isinstance(mark, Arrow)]
    assert brake.points[1][0] < brake.points[0][0]


def test_sliders_on_one_line_share_a_floor_and_have_short_coordinates() -> None:
    shown = picture("textbook/t8_blocks_in_a_row")
    arrows = [m for m in shown.marks if isinstance(m, Arrow) and m.role == "coordinate" and m.name.startswith("x")]
    assert sorted(m.name for m in arrows) == ["x1", "x2", "x3"]
    assert {round(float(np.ptp(m.points[:, 0])), 6) for m in arrows} == {24.0}
    floors = [m for m in drawn("""
gravity: [0, -9.81, 0]
bodies: {a: {mass: 1}, b: {mass: 1}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: x, q: p}
  B: {type: prismatic, parent: ground, child: b, axis: x, q: r, initial: {q: 2}}
""").marks if isinstance(m, Hatch)]
    assert len(floors) == 1


def test_chains_wires_and_bodies_that_spin_have_the_form_that_the_model_says() -> None:
    (chain,) = of(picture("variable_mass/chain_on_a_scale"), "body", "falling")
    assert len(np.asarray(chain.points)) == 2  # type: ignore[attr-defined]
    assert "y\u2009=\u2009x²/(2\u2009p)".replace("\u2009", "") in {
        each.replace(" ", "").replace("\u2009", "") for each in written(picture("guides/bead_on_a_parabola"))
    }
    turn = "{type: revolute, parent: arm.end, child: wheel, axis: x, q: phi, initial: {u: 9}}"
    scene = scene_of(mbs.loads(f"""
multibody_sym: 1
name: gyro
gravity: [0, 0, -9.81]
parameters: {{m: 4 kg, r: 0.25 m}}
bodies:
  arm: {{mass: 1, com: [0.1, 0, 0], inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}, points: {{end: [0.2, 0, 0]}}}}
  wheel: {{mass: m, inertia: {{Ixx: m*r^2/2, Iyy: m*r^2/4, Izz: m*r^2/4}}}}
joints: {{A: {{type: revolute, parent: ground, child: arm, axis: z, q: psi}}, B: {turn}}}
"""))
    (wheel,) = [item.form for item in scene.items if item.role == "body" and item.name == "wheel"]
    assert (wheel.radius, tuple(map(abs, wheel.axis))) == (pytest.approx(0.25), (1.0, 0.0, 0.0))  # type: ignore[attr-defined]


def test_letters_of_many_alike_stand_once_and_open_contacts_have_none() -> None:
    assert written(picture("chain")).count("m") == 1
    assert written(picture("feet/rimless_wheel")).count("μ") == 1
