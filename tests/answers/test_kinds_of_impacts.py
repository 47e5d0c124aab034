"""What begins to hold, ropes, stops, motions that jump, hinges that are spared: each against a formula of a book."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.answers.records import ImpactFound
from multibody_sym.text.printer import text

HEAD = "multibody_sym: 1\nname: struck\n"
def found(model: str) -> ImpactFound:
    told = mbs.solve(mbs.loads(HEAD + model)).impact
    assert told is not None
    return told


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


def test_energies_and_centres_that_are_rounding_are_zero() -> None:
    """Elastic blocks one after the other lose nothing; a rod that is dropped on its end turns about a point beside."""
    examples = Path(__file__).parents[2] / "examples/impacts"
    lost = mbs.solve(mbs.load(examples / "eleven_rods.yaml")).impact.energy_lost
    assert lost.value == 0.0
    centres = mbs.solve(mbs.load(examples / "dropped_rod.yaml")).impact.instantaneous_centres
    assert centres["rod"]["centre"][1] == 0.0


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
