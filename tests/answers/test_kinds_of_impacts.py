"""What begins to hold, ropes, stops, motions that jump, hinges that are spared: each against a formula of a book."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.answers.records import ImpactFound
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.text.printer import text

HEAD = "multibody_sym: 1\nname: struck\n"
ROD = """
parameters: {m: {value: 2 kg, positive: true}, l: {value: 1 m, positive: true}, v: {value: 3 m/s, positive: true}}
bodies:
  rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {end: [l/2, 0, 0], tip: [-l/2, 0, 0]}}
  ground: {points: {hook: [l/2, 0, 0]}, surfaces: {edge: {plane: [0, 0, 0], normal: y}}}
joints:
  P: {type: planar, parent: ground, child: rod, initial: {u: [0, -v, 0]}}
"""


def found(model: str) -> ImpactFound:
    told = mbs.solve(mbs.loads(HEAD + model)).impact
    assert told is not None
    return told


def test_a_rod_caught_by_a_hook() -> None:
    told = found(ROD + "  hook: {type: revolute, parent: ground.hook, child: rod.end, axis: z, cut: true}\n"
                       "impact: {begins: hook}\n")
    assert text(told.joint_impulses["hook"]["fy"].expression) == "m*v/4"
    assert text(told.after["u_P_theta"].expression) == "3*v/(2*l)"
    assert text(told.energy_lost.expression) == "m*v^2/8"
    assert told.instantaneous_centres["rod"]["centre"] == pytest.approx((0.5, 0))


def test_a_rope_that_goes_taut() -> None:
    told = found("""
parameters: {m: {value: 2 kg, positive: true}, M: {value: 5 kg, positive: true}, v: {value: 3 m/s, positive: true}}
bodies: {a: {mass: m}, b: {mass: M}, ground: {points: {left: [0, 2, 0], right: [1, 2, 0]}}}
pulleys: {P1: {at: ground.left}, P2: {at: ground.right}}
constraints: {string: {type: rope, path: [a, P1, P2, b], slack: true, length: 5 m}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: y1, initial: {q: 0, u: -v}}
  B: {type: prismatic, parent: ground.right, child: b, axis: y, q: y2, initial: {q: -2, u: 0}}
impact: {}
""")
    assert text(told.impulses["string"]["normal"].expression) == "M*m*v/(M + m)"
    assert text(told.energy_lost.expression) == "M*m*v^2/(2*(M + m))"
    assert told.states["string"] == "stays"


def test_a_stop_that_is_hit() -> None:
    told = found("""
parameters: {m: {value: 2 kg, positive: true}, v: {value: 3 m/s, positive: true}, e: {value: 0.4, positive: true}}
bodies: {slide: {mass: m}}
joints:
  A: {type: prismatic, parent: ground, child: slide, axis: x, q: x, initial: {q: 1, u: v},
      limits: {lower: 0, upper: 1, restitution: e}}
impact: {contacts: A}
""")
    assert told.impulses.keys() == {"A.upper"}  # `normal(A)` is the force across a guide
    assert text(told.impulses["A.upper"]["normal"].expression) == "m*v*(e + 1)"
    assert told.joint_impulses["A"]["fx"].value == pytest.approx(-2 * 3 * 1.4)
    assert text(told.after["u_x"].expression) == "-e*v"


def test_a_prescribed_motion_whose_speed_jumps_tells_its_impulse() -> None:
    told = found("""
parameters: {m: {value: 2 kg, positive: true}, l: {value: 1 m, positive: true}, w: {value: 3 rad/s, positive: true}}
bodies:
  crank: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}, points: {end: [l, 0, 0]}}
  rod: {mass: m, com: [l/2, 0, 0], inertia: {Izz: m*l^2/12}}
joints:
  A: {type: revolute, parent: ground, child: crank, axis: z, motion: 0}
  B: {type: revolute, parent: crank.end, child: rod, axis: z}
impact: {motion: A, speed: w}
""")
    assert text(told.joint_impulses["A"]["mz"].expression) == "7*m*w*l^2/12"
    assert told.kinetic_energy["after"].value == pytest.approx(2 * 9 / 6 + 2 / 4 * 9 / 2)
    assert told.instantaneous_centres["crank"]["centre"] == pytest.approx((0, 0))


@pytest.mark.parametrize(("where", "reaction"), [("2*b/3", 0.0), ("b/2", -3 / 4), ("b", 3 / 2)])
def test_a_door_struck_at_its_centre_of_percussion_spares_the_hinge(where: str, reaction: float) -> None:
    told = found(f"""
parameters: {{m: {{value: 20 kg, positive: true}}, b: {{value: 0.9 m, positive: true}}, I: 3 N*s}}
bodies: {{door: {{mass: m, com: [b/2, 0, 0], inertia: {{Izz: m*b^2/12}}, points: {{hit: [{where}, 0, 0]}}}}}}
joints: {{H: {{type: revolute, parent: ground, child: door, axis: z}}}}
impact: {{impulse: [0, I, 0], at: door.hit}}
""")
    assert text(told.centres_of_percussion["door"].expression) == "2*b/3"
    assert told.joint_impulses["H"]["fy"].value == pytest.approx(reaction, abs=1e-14)


def test_a_closed_loop_tells_its_cut_joint_and_its_dependent_rows() -> None:
    told = found("""
parameters: {m: 1, I: 2 N*s}
bodies:
  left: {mass: m, com: [0, 0.5, 0], inertia: {Izz: m/12}, points: {end: [0, 1, 0]}}
  right: {mass: m, com: [0, 0.5, 0], inertia: {Izz: m/12}, points: {end: [0, 1, 0]}}
  middle: {mass: m, com: [0, 0.5, 0], inertia: {Izz: m/12}, points: {end: [0, 1, 0]}}
  beam: {mass: m, com: [1, 0, 0], inertia: {Izz: m/3}, points: {end: [2, 0, 0], middle: [1, 0, 0]}}
  ground: {points: {b: [2, 0, 0], c: [1, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: left, axis: z}
  B: {type: revolute, parent: left.end, child: beam, axis: z}
  C: {type: revolute, parent: ground.b, child: right, axis: z}
  D: {type: revolute, parent: right.end, child: beam.end, axis: z, cut: true}
  E: {type: revolute, parent: ground.c, child: middle, axis: z}
  F: {type: revolute, parent: middle.end, child: beam.middle, axis: z, cut: true}
impact: {impulse: [I, 0, 0], at: beam.middle}
""")
    assert told.after["u_A"].value == pytest.approx(-1.0, rel=1e-12)  # 3 cranks m/3 and the beam m: I/(2 m)
    assert {"D", "F"} & set(told.not_unique)
    assert told.joint_impulses["A"]["fx"].unique


def test_a_box_that_lands_flat_tells_the_sum_of_its_corners() -> None:
    told = found("""
parameters: {m: {value: 2, positive: true}, v: {value: 2, positive: true}}
bodies: {box: {shape: {box: [1, 0.5, 1], mass: m}}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {P: {type: planar, parent: ground, child: box, initial: {q: [0, 0.25, 0], u: [3, -v, 0]}}}
contacts: {c: {between: [box, ground.floor], restitution: 0.5, kinetic: 0.1}}
impact: {sequence: simultaneous}
""")
    assert text(told.impulses["c"]["normal"].expression) == "3*m*v/2"
    assert told.impulses["c"]["friction"].value == pytest.approx(-0.6)
    assert told.after["u_P_theta"].value == pytest.approx(0, abs=1e-14)


NAMED = """
parameters: {m: {value: 2, positive: true}, v: {value: 2, positive: true}, l: {value: 1, positive: true}}
bodies:
  ball: {mass: m}
  rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {tip: [l/2, 0, 0], end: ["-l/2", 0, 0]},
    surfaces: {top: {segment: ENDS, normal: y}}}
joints:
  A: {type: point, parent: ground, child: ball, axes: xy, initial: {q: [l/4, 0], u: [0, -v]}}
  B: {type: planar, parent: ground, child: rod}
contacts: {c: {between: [ball, rod.top]}}
impact: closing
"""


def test_a_segment_leads_from_point_to_point_of_its_body_by_name() -> None:
    told, same = (found(NAMED.replace("ENDS", x)) for x in ("[end, tip]", '[["-l/2", 0, 0], [l/2, 0, 0]]'))
    assert text(told.impulses["c"]["normal"].expression) == text(same.impulses["c"]["normal"].expression) == "4*m*v/11"
    system = mbs.loads(HEAD + NAMED.replace("ENDS", "[end, tip]"))
    assert mbs.loads(mbs.dumps(system)) == system
    with pytest.raises(mbs.ModelError, match=r"surfaces\.top\.segment\.1: the body has no point 'tup'; did you mean"):
        found(NAMED.replace("ENDS", "[end, tup]"))


@pytest.mark.parametrize(
    ("values", "words", "under"),
    [
        ({"mu": -0.2}, "negative; nothing rubs", "static"),
        ({"mk": -0.1}, "negative; nothing rubs", "kinetic"),
        ({"mk": 0.5}, "static 0.3 is below kinetic 0.5", "static"),
    ],
)
def test_friction_that_a_parameter_makes_impossible_is_refused_as_in_contacts(
    values: dict[str, float], words: str, under: str
) -> None:
    system = mbs.loads("""
multibody_sym: 1
name: thrown
parameters: {mu: 0.3, mk: 0.2}
bodies: {ball: {mass: 1}}
joints: {P: {type: point, parent: ground, child: ball, axes: xy, initial: {u: [2, -1]}}}
impact: {between: [ball, ground], normal: y, static: mu, kinetic: mk, restitution: 0.5}
""")
    with pytest.raises(mbs.ModelError, match=words) as caught:
        mbs.solve(Overrides(values).of(system))
    assert caught.value.where.path == ("impact", under)


THROWN = """
multibody_sym: 1
name: thrown
parameters: {m: {value: 1, positive: true}, mu: 0, u: 2}
bodies: {ball: {mass: m}}
joints: {P: {type: point, parent: ground, child: ball, axes: xy, initial: {u: [u, -1]}}}
impact: {between: [ball, ground], normal: y, FRICTION restitution: 0.5}
"""


def test_what_is_rough_enough_says_how_rough() -> None:
    """It stops along: p_t = -m u, p_n = m (1 + e) v."""
    found = mbs.solve(mbs.loads(THROWN.replace("FRICTION", "static: enough,"))).impact
    assert found is not None
    assert found.needed["impact"].value == pytest.approx(2 / 1.5, rel=1e-14)
    assert text(found.needed["impact"].expression) == "2*u/3"


def test_no_condition_says_that_a_coefficient_is_not_negative() -> None:
    found = mbs.solve(mbs.loads(THROWN.replace("FRICTION", "static: mu, kinetic: mu,"))).impact
    assert found is not None
    assert not [each for each in found.conditions if each.startswith("mu")]


JERKED = """
multibody_sym: 1
name: jerked
parameters: {w: 3, l: {value: 1, positive: true}, m: {value: 2, positive: true}}
bodies: {crank: {mass: m, com: [l, 0, 0], inertia: {Izz: 0}}}
joints: {J: {type: revolute, parent: ground, child: crank, axis: z, motion: 0}}
impact: {motion: J, speed: w}
"""


def test_a_motion_that_jumps_tells_the_energy_that_it_gives() -> None:
    found = mbs.solve(mbs.loads(JERKED)).impact
    assert found is not None
    assert found.energy_given is not None
    assert text(found.energy_given.expression) == "m*l^2*w^2/2"
    assert found.energy_given.value == 9.0
    assert found.energy_lost.value == 0.0
    assert found.as_json()["energy_given"]["value"] == 9.0


def test_energies_and_centres_that_are_rounding_are_zero() -> None:
    """Elastic blocks one after the other lose nothing; a rod that is dropped on its end turns about a point beside."""
    examples = Path(__file__).parents[2] / "examples/impacts"
    lost = mbs.solve(mbs.load(examples / "eleven_rods.yaml")).impact.energy_lost
    assert lost.value == 0.0
    centres = mbs.solve(mbs.load(examples / "dropped_rod.yaml")).impact.instantaneous_centres
    assert centres["rod"]["centre"][1] == 0.0


def test_a_declared_contact_that_rests_is_told_as_such() -> None:
    system = mbs.loads("""
multibody_sym: 1
name: resting
gravity: [0, -9.81, 0]
bodies: {ball: {mass: 1}, ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}}
joints: {P: {type: point, parent: ground, child: ball, axes: xy, initial: {u: [2, 0]}}}
contacts: {c: {between: [ball, ground.floor], restitution: 0.5}}
impact: closing
""")
    with pytest.raises(mbs.NoSolutionError, match=r"c touches and rests\. Start with speeds at which it closes"):
        mbs.solve(system)


def test_what_moves_a_racket_puts_in_the_energy_that_its_ball_has_more() -> None:
    """The racket goes on with w: its drive gives the impulse (1 + e) m (v + w), and so much times w as work."""
    told = mbs.solve(mbs.loads(_RACKET)).impact
    assert told is not None
    assert told.energy_given is not None
    assert told.energy_given.value == pytest.approx(1.8 * 0.06 * 8 * 3, rel=1e-13)
    before, after = (told.kinetic_energy[when].value for when in ("before", "after"))
    assert after == pytest.approx(before + told.energy_given.value - told.energy_lost.value, rel=1e-13)
    stands = mbs.solve(mbs.loads(_RACKET), parameters={"w": 0.0}).impact
    assert stands is not None
    assert stands.energy_given is None


_RACKET = """
multibody_sym: 1
name: racket
parameters: {w: 3 m/s, v: {value: 5 m/s, positive: true}, e: 0.8}
bodies: {racket: {mass: 1 kg}, ball: {mass: 60 g}}
joints:
  R: {type: prismatic, parent: ground, child: racket, axis: x, motion: w*t}
  B: {type: prismatic, parent: ground, child: ball, axis: x, q: x, initial: {u: -v}}
impact: {between: [ball, racket], normal: x, restitution: e}
"""
