"""Boxes and tables in space: by roots of their moments, by laws at open forces, and what is not proved by a search."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import multibody_sym as mbs
from multibody_sym.contact_laws import search
from multibody_sym.contact_laws.search import States
from multibody_sym.documents.notes import redundancy_lines
from multibody_sym.scalars.linear_inequalities import outline

SPACE = """\
multibody_sym: 1
name: box
gravity: [g*sin(alpha), 0, -g*cos(alpha)]
parameters:
  g: {value: 10 m/s^2, positive: true}
  m: {value: 5 kg, positive: true}
  b: {value: 0.2 m, positive: true}
  c: {value: 0.3 m, positive: true}
  h: {value: 0.1 m, positive: true}
  mu: {value: 0.2, positive: true}
  nu: {value: 0.2, positive: true}
  F: {value: 0 N}
  alpha: 25 deg
bodies:
  ground: {surfaces: {ramp: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [b, c, h], mass: m}, points: {hook: [b/2, 0, h/2]}}
joints: {J: {type: free, parent: ground, child: box, initial: {q: [0, 0, h/2, 1, 0, 0, 0]}}}
forces: {pull: {type: force, on: box, at: hook, value: [F, 0, 0]}}
contacts: {c1: {between: [box, ground.ramp], static: mu, kinetic: nu}}
"""


def solved(model: str = SPACE, **values: float) -> mbs.Solution:
    return mbs.solve(mbs.loads(model), values)


def test_the_outline_of_points() -> None:
    """Corners of a square with its middle and one on its side; of a line, and of a place."""
    square = np.array([[0, 0, 1], [2, 0, 1], [1, 1, 1], [2, 2, 1], [0, 2, 1], [1, 0, 1]], dtype=float)
    assert outline(square, np.array([0.0, 0.0, 1.0])) == [0, 1, 3, 4]
    assert outline(square, np.array([0.0, 0.0, -1.0])) == [0, 4, 3, 1]
    line = np.array([[0.0, 1, 0], [0, 3, 0], [0, 2, 0]])
    assert sorted(outline(line, np.array([0.0, 0.0, 1.0]))) == [0, 1]
    assert len(outline(line[[0, 0]], np.array([0.0, 0.0, 1.0]))) == 1


TABLE = """\
multibody_sym: 1
name: table
gravity: [0, 0, -g]
parameters:
  {g: 10 m/s^2, m: {value: 5 kg, positive: true}, a: {value: 0.6 m, positive: true}, b: {value: 0.4 m, positive: true},
  h: 0.7 m, mu: 0.4, P: {value: 30 N, positive: true}, x: 0.2 m, y: 0.1 m}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  table:
    mass: m
    com: [0, 0, h]
    inertia: {Ixx: 0.3, Iyy: 0.5, Izz: 0.6}
    points: {l1: [-a, -b, 0], l2: [a, -b, 0], l3: [a, b, 0], l4: [-a, b, 0], load: [x, y, h]}
joints: {J: {type: free, parent: ground, child: table}}
forces: {P: {type: force, on: table, at: load, value: [0, 0, -P]}}
contacts: {L: {between: ["table.l#", ground.floor], static: mu, repeat: 4}}
"""


PULLED = TABLE.replace("value: [0, 0, -P]", "value: [H, 0, -P]").replace("mu: 0.4,", "mu: 0.3, H: 0 N,")


def test_that_nothing_fulfils_the_laws_is_not_said_of_slip_in_any_direction(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's method finds directions of slip in space: where it found none, nothing is proved."""
    monkeypatch.setattr(States, "_locally", lambda *_: None)
    monkeypatch.setattr(search, "candidate_modes", lambda *_: iter(()))
    with pytest.raises(mbs.NoSolutionError, match=r"no state was found .* all \d+ modes.* not proved that"):
        solved(PULLED, H=50.0)


def pushed_aside(place: str, **values: float) -> mbs.RangeOfRest:
    """Return with which forces along y at a place of the box it rests on the ramp, or on the floor."""
    model = SPACE.replace("[b/2, 0, h/2]", place).replace("value: [F, 0, 0]", "value: [0, F, 0]")
    system = mbs.loads(model.replace(", kinetic: nu", "").replace("F: {value: 0 N}", "F: {value: 1 N, positive: true}"))
    return mbs.range_of_rest(system, "F", parameters={"mu": 0.6, **values})


def test_a_box_pushed_beside_its_middle_turns_as_it_slips() -> None:
    """On four equal forces of its corners; about the place where its moment and its force fit each other."""
    ((_, high),) = pushed_aside("[b/4, 0, -h/2]", alpha=0.0).ends
    load, (x, y) = 0.6 * 50 / 2, (0.1, 0.15)

    def force(centre: float) -> float:
        return load * sum((side - centre) / math.hypot(side - centre, y) for side in (x, -x))

    def moment(centre: float) -> float:
        return load * sum((side * (side - centre) + y * y) / math.hypot(side - centre, y) for side in (x, -x))

    centre = brentq(lambda at: moment(at) - x / 2 * force(at), -10.0, -0.01, xtol=1e-15, rtol=1e-15)
    assert high.value == pytest.approx(force(centre), rel=1e-12)
    assert (high.expression, high.gives_way) == (None, ("slips at c1, turning",))


PUSHED = """
multibody_sym: 1
name: box pushed at a corner
gravity: [0, 0, -9.81 m/s^2]
parameters: {m: 10 kg, F: 20 N, mu: 0.25}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  box: {shape: {box: [1, 0.6, 0.4], mass: m}, points: {hand: [0.5, 0.3, 0]}}
joints: {J: {type: free, parent: ground, child: box, initial: {q: [0, 0, 0.2, 1, 0, 0, 0], u: [%s]}}}
contacts: {c: {between: [box, ground.floor], static: mu}}
forces: {push: {type: force, on: box, at: box.hand, value: [0, F, 0]}}
"""


@pytest.mark.parametrize("speeds", ["0, 0, 0, 0, 0, 0", "1, 0.5, 0, 0, 0, 2"])
def test_a_motion_that_open_forces_change_fulfils_all_laws(speeds: str) -> None:
    """Four normal forces are open by one number, and with friction so is the motion: `solve` takes one."""
    found = mbs.solve(mbs.loads(PUSHED % speeds))
    assert found.verdict == "several"
    assert "forces that are not unique change how it slides" in found.searched
    u = np.array([float(x) for x in speeds.split(",")])
    a = np.array([found.accelerations[name].value for name in ("J_x", "J_y", "J_wz")])
    sums = np.zeros(3)
    for k, (x, y) in enumerate([(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)], 1):
        force = {name: value.value for name, value in found.reactions[f"c.corner{k}"].items()}
        rubs = np.array([force["friction_1"], force["friction_2"]])
        v = u[:2] + u[5] * np.array([-y, x])
        way = v if v.any() else a[:2] + a[2] * np.array([-y, x])
        assert force["normal"] >= 0.0
        assert np.linalg.norm(rubs) <= 0.25 * force["normal"] + 1e-9
        if np.linalg.norm(way) > 1e-9:
            np.testing.assert_allclose(rubs, -0.25 * force["normal"] * way / np.linalg.norm(way), atol=1e-8)
        sums += [*rubs, x * rubs[1] - y * rubs[0]]
    sums += [0.0, 20.0, 0.5 * 20.0]
    np.testing.assert_allclose(sums, [10 * a[0], 10 * a[1], 10 * (1 + 0.36) / 12 * a[2]], atol=1e-8)
    others = [tuple(other.accelerations.values()) for other in found.others]
    assert tuple(x.value for x in found.accelerations.values()) not in others


def test_what_redundant_rows_mean_is_told_of_a_box_that_starts_to_slide() -> None:
    """It starts in a direction that is known before it moves; a report ended with an internal error."""
    model = PUSHED % "0, 0, 0, 0, 0, 0"
    along = model.replace("at: box.hand, value: [0, F, 0]", "value: [2*F, 0, 0]")
    run = mbs.simulate(mbs.loads(along), t_end=0.1, samples=3)
    assert run.redundancy.rank == 3
    assert run.redundancy.ambiguous_forces == tuple(f"normal(c.corner{k})" for k in range(1, 5))
    turned = mbs.simulate(mbs.loads(model), t_end=0.1, samples=3)
    assert turned.redundancy.ambiguous_forces == ()
    assert "with friction what slides moves by them" in "\n".join(redundancy_lines(turned.redundancy))
