"""Figures show the body that the model's facts describe: rings, balls, drums, steps, arms beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.pictures.page.picture import Arc, Arrow, Hatch, Mark, Stroke
from multibody_sym.pictures.scene.items import Symbol
from multibody_sym.pictures.scene.scene import Scene, scene_of

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> mbs.System:
    return mbs.load(EXAMPLES / f"{name}.yaml")


def marks_of(system: mbs.System, role: str, name: str = "") -> list[Mark]:
    marks = mbs.draw(system).picture.marks
    return [mark for mark in marks if mark.role == role and name in ("", mark.name)]


def kinds(scene: Scene) -> set[str]:
    return {item.form.kind for item in scene.items if isinstance(item.form, Symbol)}


def test_what_is_lifted_off_its_way_is_a_ring_on_a_bar_and_what_is_pressed_on_it_a_block() -> None:
    written = (EXAMPLES / "textbook/ring_on_a_rod.yaml").read_text(encoding="utf-8")
    assert "ring" in kinds(scene_of(mbs.loads(written)))  # F*sin(beta) = 9.2 N against a weight of 5 N
    pressed = scene_of(mbs.loads(written.replace("12 N", "6 N")))
    assert {"ring", "block"} & kinds(pressed) == {"block"}


def test_a_ring_is_half_behind_its_bar_and_half_before_it() -> None:
    marks = mbs.draw(example("textbook/ring_on_a_rod")).picture.marks
    drawn = [(mark.role, len(mark.points)) for mark in marks if isinstance(mark, Stroke) and mark.pen is not None]
    halves = [k for k, (role, _) in enumerate(drawn) if role == "body"]
    bar = next(k for k, (role, count) in enumerate(drawn) if role == "joint" and count > 4)
    assert halves[0] < bar < halves[1]


def test_balls_in_a_row_without_gravity_lie_on_no_table() -> None:
    assert not [mark for mark in mbs.draw(example("impacts/newtons_cradle")).picture.marks if isinstance(mark, Hatch)]


def test_a_slammed_door_comes_to_a_stop_on_the_side_to_which_it_turns() -> None:
    written = (EXAMPLES / "impacts/slammed_door.yaml").read_text(encoding="utf-8")
    for text, side in ((written, -1.0), (written.replace("u: -w", "u: w"), 1.0)):
        system = mbs.loads(text)
        (stop,) = [mark for mark in marks_of(system, "ground") if isinstance(mark, Hatch)]
        (door,) = [mark for mark in marks_of(system, "body", "door") if isinstance(mark, Stroke)]
        beside = float(np.asarray(stop.points)[:, 1].mean() - np.asarray(door.points)[:, 1].mean())
        assert side * beside == pytest.approx(3.7, abs=0.2)  # half a rod and half a line


def test_a_bead_on_a_hoop_is_held_by_the_hoop_alone() -> None:
    scene = scene_of(example("bead_on_hoop"))
    forms = [item.form for item in scene.items if item.name in ("bead", "slide")]
    centre = np.array([0.0, 0.0, -0.3])
    assert [form.kind for form in forms if isinstance(form, Symbol)] == ["bob", "bead"]
    assert all(np.allclose(form.bounds, centre) for form in forms)


def test_the_arms_of_a_folded_chain_hang_beside_each_other() -> None:
    system = example("variable_mass/folded_chain")
    arms = [points_of(marks_of(system, "body", name)) for name in ("hanging", "falling")]
    straight = [mark for mark in marks_of(system, "body", "falling") if isinstance(mark, Stroke)]
    (fold,) = [mark for mark in marks_of(system, "body", "falling") if isinstance(mark, Arc)]
    assert arms[0][:, 0].max() < points_of(straight)[:, 0].min()
    lower = [min(points_of(marks), key=lambda p: p[1]) for marks in (marks_of(system, "body", "hanging"), straight)]
    assert np.asarray(fold.points)[[0, -1]] == pytest.approx(np.array(lower))  # one end goes on into the other
    assert np.asarray(fold.points)[:, 1].min() < min(end[1] for end in lower)
    (weld,) = [mark for mark in marks_of(system, "joint", "hook") if isinstance(mark, Stroke) and mark.closed]
    assert np.asarray(weld.points)[:, 0].mean() == pytest.approx(arms[0][:, 0].mean(), abs=0.5)


def points_of(marks: Sequence[Mark]) -> np.ndarray:
    return np.vstack([np.asarray(mark.points) for mark in marks if isinstance(mark, (Stroke, Arc))])


STAIRS = """
multibody_sym: 1
name: stairs
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {s1: {segment: [[-1, 0, 0], [0, 0, 0]]}, s2: {segment: [[1, -0.4, 0], [0, -0.4, 0]]}}}
  ball: {mass: 1, surfaces: {skin: {sphere: 0.1}}}
joints: {free: {type: point, parent: ground, child: ball, q: [x, y], initial: {q: [-0.5, 0.1]}}}
contacts: {c1: {between: [ball.skin, ground.s1]}, c2: {between: [ball.skin, ground.s2]}}
"""


def test_stairs_have_risers_hatched_below_the_upper_tread() -> None:
    marks = [mark for mark in mbs.draw(mbs.loads(STAIRS)).picture.marks if isinstance(mark, Hatch)]
    (riser,) = [mark for mark in marks if np.ptp(np.asarray(mark.points)[:, 0]) < 1e-6]
    (upper,) = [mark for mark in marks if np.allclose(np.asarray(mark.points)[:, 1], riser.points[:, 1].max())]
    along = np.diff(np.asarray(riser.points), axis=0)[0]
    hatched = riser.side * np.array([-along[1], along[0]])
    assert float(hatched[0]) * (np.asarray(upper.points)[:, 0].mean() - riser.points[0, 0]) > 0.0


def test_a_force_with_its_couple_is_a_thread_that_leaves_its_drum() -> None:
    """F at the middle and F*r are F on a line at the distance r: tangent to the drum, turned by beta = 30 deg."""
    system = example("textbook/spool")
    marks = mbs.draw(system).picture.marks
    (drum,) = [mark for mark in marks if isinstance(mark, Arc) and mark.role == "drum"]
    (thread,) = [np.asarray(mark.points) for mark in marks if isinstance(mark, Stroke) and mark.role == "rope"]
    (force,) = [np.asarray(mark.points) for mark in marks if isinstance(mark, Arrow) and mark.role == "force"]
    assert not [mark for mark in marks if mark.role == "torque"]
    arm, way = thread[0] - np.asarray(drum.centre), np.diff(thread, axis=0)[0]
    assert float(np.hypot(*arm)) == pytest.approx(drum.radius)
    assert abs(float(arm @ way)) < 1e-9 * float(np.hypot(*arm) * np.hypot(*way))
    assert np.degrees(np.arctan2(*way[::-1])) == pytest.approx(30.0)
    assert arm[1] < 0.0  # it leaves below
    assert np.allclose(force[0], thread[1])


def test_the_drum_of_a_yo_yo_is_seen_and_its_cord_is_tangent_to_it() -> None:
    system = example("textbook/yo_yo")
    (cord,) = [np.asarray(mark.points) for mark in marks_of(system, "rope", "cord") if isinstance(mark, Stroke)]
    circles = [mark for mark in marks_of(system, "pulley", "drum") if isinstance(mark, Arc)]
    drum = max(circles, key=lambda circle: circle.radius)
    (wheel,) = [mark for mark in marks_of(system, "body", "yoyo") if isinstance(mark, Arc)]
    assert 5.0 < drum.radius < wheel.radius
    assert abs(float(cord[-1][0] - drum.centre[0])) == pytest.approx(drum.radius)
    assert cord[-1][1] == pytest.approx(float(drum.centre[1]))


def test_a_wedge_is_longer_than_what_slides_on_it() -> None:
    system = example("textbook/free_wedge")
    wedge, block = (np.ptp(points_of(marks_of(system, "body", name)), axis=0) for name in ("wedge", "block"))
    assert wedge[0] > 3.0 * block[0]
    assert wedge[1] > 2.0 * block[1]


PULLED = [("two_drums", "rope", "block"), ("t9_block_on_block", "string", "upper")]


@pytest.mark.parametrize(("name", "rope", "block"), PULLED)
def test_a_rope_along_a_plane_leads_from_the_middle_of_its_block(name: str, rope: str, block: str) -> None:
    system = example(f"textbook/{name}")
    (line,) = [np.asarray(mark.points) for mark in marks_of(system, "rope", rope) if isinstance(mark, Stroke)]
    outline = points_of(marks_of(system, "body", block))
    assert line[0] == pytest.approx((outline.min(axis=0) + outline.max(axis=0)) / 2)
    assert line[1][1] == pytest.approx(line[0][1])
    (dot,) = [m for m in mbs.draw(system).picture.marks if m.role == "contact" and isinstance(m, Arc)][:1]
    assert dot.centre[1] == pytest.approx(outline[:, 1].min())


def test_who_stands_in_a_lift_stands_on_its_floor_though_it_moves() -> None:
    system = example("lift")
    person = points_of(marks_of(system, "body", "person"))
    floor = next(mark for mark in marks_of(system, "surface", "ground.floor") if isinstance(mark, Stroke))
    assert person[:, 1].min() == pytest.approx(float(np.asarray(floor.points)[:, 1].mean()))
    assert not [mark for mark in marks_of(system, "joint", "scale") if isinstance(mark, Hatch)]


def test_the_edge_on_which_a_rod_falls_is_seen_below_it() -> None:
    system = example("impacts/dropped_rod")
    (edge,) = [mark for mark in marks_of(system, "ground") if isinstance(mark, Hatch)]
    rod = points_of(marks_of(system, "body", "rod"))
    assert float(np.asarray(edge.points)[:, 1].mean()) == pytest.approx(rod[:, 1].min(), abs=1.0)
    right = float(np.asarray(edge.points)[:, 0].mean()) - rod[:, 0].mean()
    assert right / np.ptp(rod[:, 0]) == pytest.approx(0.2 / 1.2, abs=0.01)


PLANE = """
multibody_sym: 1
name: plane
gravity: [0, -9.81, 0]
parameters: {m: 2 kg, l: 1.2 m, J: 0.3 kg*m^2}
bodies: {swing: {mass: m, com: [COM, 0, 0], inertia: {Izz: MOMENT}}}
joints: {A: {type: revolute, parent: ground, child: swing, axis: z, q: phi}}
"""


@pytest.mark.parametrize(
    ("com", "moment", "reach"),
    [("l/2", "m*l^2/12", 1.2), ("-l/2", "m*l^2/12", 1.2), ("l", "m*l^2/48", 1.5), ("l", "0.001*m*l^2", 1.2)],
)
def test_a_rod_that_swings_goes_through_its_centre_to_where_its_moment_puts_its_end(
    com: str, moment: str, reach: float
) -> None:
    """A uniform rod of half length h has m h^2/3 about its centre; a lump at the end of an arm ends there."""
    scene = scene_of(mbs.loads(PLANE.replace("COM", f'"{com}"').replace("MOMENT", moment)))
    (form,) = [item.form for item in scene.items if item.role == "body"]
    assert float(np.linalg.norm(form.bounds[-1])) == pytest.approx(reach)
    assert form.bounds[-1] @ np.array([1.0, 0.0, 0.0]) * (-1.0 if com.startswith("-") else 1.0) > 0.0


def test_a_rod_that_is_pinned_within_reaches_to_both_sides_of_its_pin() -> None:
    """Of the length l about its centre, which is at l/4 from the pin."""
    scene = scene_of(mbs.loads(PLANE.replace("COM", "l/4").replace("MOMENT", "m*l^2/12")))
    (form,) = [item.form for item in scene.items if item.role == "body"]
    assert form.bounds[:, 0] == pytest.approx([-0.3, 0.9])


def test_both_outer_rods_of_two_chains_and_a_door_are_whole() -> None:
    scene = scene_of(example("impacts/two_chains"))
    ends = [scene.at().world(i.body, i.form.bounds)[:, 0] for i in scene.items if i.role == "body"]
    assert sorted((round(min(x), 9), round(max(x), 9)) for x in ends) == [(-2, -1), (-1, 0), (0, 1), (1, 2)]
    door = next(i.form for i in scene_of(example("impacts/slammed_door")).items if i.role == "body")
    assert door.bounds[:, 0].max() == pytest.approx(0.9)  # it reaches beyond its stop at 0.6 m


POLAR = """
multibody_sym: 1
name: polar
gravity: [0, 0, 0]
bodies: {arm: {}, star: {mass: 1}}
joints:
  turn: {type: revolute, parent: ground, child: arm, axis: z, q: phi}
  away: {type: prismatic, parent: arm, child: star, axis: x, q: r, initial: {q: 2}}
forces: {pull: {type: force, on: star, value: [-1/r^2, 0, 0], frame: arm}}
"""


def test_an_arm_without_mass_that_turns_freely_is_a_line_and_one_that_is_driven_or_heavy_has_a_rail() -> None:
    """A massless body that turns freely bears no force across: what slides on it is a free particle."""
    free = scene_of(mbs.loads(POLAR))
    assert {"origin", "bob", "hanger"} <= kinds(free)
    (line,) = [m for m in mbs.draw(mbs.loads(POLAR)).picture.marks if m.name == "away" and isinstance(m, Stroke)][:1]
    assert np.ptp(np.asarray(line.points), axis=0)[1] == pytest.approx(0.0)
    (force,) = [m for m in mbs.draw(mbs.loads(POLAR)).picture.marks if m.role == "force" and isinstance(m, Arrow)]
    assert np.diff(np.asarray(force.points)[:, 0])[0] < 0.0  # it pulls to the centre
    for change in (("q: phi", "motion: 2*t"), ("arm: {}", "arm: {mass: 1, inertia: {Izz: 1}}")):
        held = scene_of(mbs.loads(POLAR.replace(*change)))
        assert {"pivot", "slider"} <= kinds(held)
    crank = """
  crank: {type: revolute, parent: ground.at, child: rod, axis: z}
  pin: {type: revolute, parent: rod.end, child: star, axis: z, cut: true}
forces"""
    ground, rod = "ground: {points: {at: [0, 1, 0]}}", "rod: {shape: {rod: 2, mass: 1}, points: {end: [2, -1, 0]}}"
    slotted = POLAR.replace("\nforces", crank).replace("arm: {}", f"arm: {{}}, {ground}, {rod}")
    assert "origin" not in kinds(scene_of(mbs.loads(slotted)))  # a crank turns the arm


FLOWS = {
    "variable_mass/rocket": {"rocket", "jet"},
    "variable_mass/loaded_wagon": {"wagon", "hopper"},
    "variable_mass/leaking_wagon": {"wagon", "leak"},
    "variable_mass/hopper": {"belt", "hopper"},
    "variable_mass/raindrop": {"mist"},
    "variable_mass/cayleys_chain": {"heap"},
    "variable_mass/chain_on_a_scale": {"pile"},
    "cart_pole": {"wagon"},
    "textbook/growing_force": set(),
}


@pytest.mark.parametrize("name", FLOWS)
def test_a_mass_that_varies_shows_what_it_loses_or_takes_in(name: str) -> None:
    every = set().union(*FLOWS.values())
    assert kinds(scene_of(example(name))) & every == FLOWS[name]


def test_gas_leaves_a_rocket_at_its_nozzle_against_its_nose() -> None:
    scene = scene_of(example("variable_mass/jet_damping"))
    (body,) = [item.form for item in scene.items if item.role == "body"]
    (jet,) = [item for item in scene.items if item.role == "flow"]
    assert jet.form.bounds[0] == pytest.approx([-1.5, 0.0, 0.0])
    assert body.bounds[:, 0].min() == pytest.approx(-1.5)
    assert body.bounds[np.argmax(body.bounds[:, 0])] == pytest.approx([1.5, 0.0, 0.0])
    assert (jet.letters, jet.symbol is not None and jet.symbol.along) == ("c", (-1.0, 0.0, 0.0))


def test_a_load_hangs_below_a_beam_on_which_its_trolley_runs() -> None:
    marks = marks_of(example("control/trolley"), "joint", "rail")
    (beam,) = [np.asarray(mark.points) for mark in marks if isinstance(mark, Stroke) and mark.closed]
    wheels = [mark for mark in marks_of(example("control/trolley"), "body", "trolley") if isinstance(mark, Arc)]
    assert len(wheels) == 2
    assert min(np.asarray(wheel.points)[:, 1].min() for wheel in wheels) == pytest.approx(beam[:, 1].max(), abs=0.2)
    assert not [mark for mark in marks if isinstance(mark, Hatch)]


def test_a_drawer_is_as_long_as_its_guides_and_rubs_on_both() -> None:
    system = example("textbook/jamming_drawer")
    (box,) = [item.form for item in scene_of(system).items if item.role == "body"]
    assert np.ptp(box.bounds, axis=0)[:2] == pytest.approx([0.4, 0.84])  # l, and on either side 1.4 times d
    assert len([mark for mark in marks_of(system, "joint", "guide") if isinstance(mark, Hatch)]) == 2


@pytest.mark.parametrize(("change", "block"), [(("", ""), False), (("between: [one, two]", "joint: a"), True)])
def test_particles_that_springs_join_to_each_other_alone_float(change: tuple[str, str], block: bool) -> None:
    text = """
name: molecule
bodies: {one: {mass: 1}, two: {mass: 2}}
joints:
  a: {type: prismatic, parent: ground, child: one, axis: x, q: x1}
  b: {type: prismatic, parent: ground, child: two, axis: x, q: x2, initial: {q: 1}}
forces: {k: {type: spring, between: [one, two], stiffness: 5, length: 1}}
"""
    marks = mbs.draw(mbs.loads("multibody_sym: 1" + text.replace(*change))).picture.marks
    assert any(isinstance(mark, Hatch) and mark.role == "joint" for mark in marks) == block
