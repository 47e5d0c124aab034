"""Equilibrium of what holds one way only, found from the side on which it does not hold: against statics by hand."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Mapping
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.analysis import equilibrium_search
from multibody_sym.analysis.equilibrium import Equilibrium
from multibody_sym.analysis.equilibrium_search import SECONDS, EquilibriumSearch, FoundPositions
from multibody_sym.documents.analysis import equilibrium_text
from multibody_sym.errors import NoSolutionError

G = 9.81
HEAD = f"multibody_sym: 1\nname: rest\ngravity: [0, -{G}, 0]\n"


CONTACT = "contacts: {c: {between: [a, ground.floor], static: 0.4}}"


def rest(model: str) -> Equilibrium:
    return mbs.equilibrium(mbs.loads(HEAD + model))


def only(found: Equilibrium) -> tuple[Mapping[str, float], Mapping[str, str]]:
    assert len(found.positions) == 1
    return found.positions[0], found.closed[0]


def test_a_weight_on_a_slack_rope_hangs_from_it() -> None:
    found = rest("""
bodies: {b: {mass: 2}}
joints: {s: {type: prismatic, parent: ground, child: b, axis: -y, q: x, initial: {q: 0.5}}}
constraints: {rope: {type: rope, path: [ground, b], length: 1, slack: true}}
""")
    position, closed = only(found)
    assert position["x"] == pytest.approx(1.0, abs=1e-12)
    assert (dict(closed), found.stable) == ({"rope": "taut"}, (True,))
    assert "stable: x = 1 m; rope taut" in equilibrium_text(found)


@pytest.mark.parametrize("start", [2.0, 0.95])
def test_a_weight_above_a_plate_on_a_spring_rests_on_it(start: float) -> None:
    """By hand: the spring is shorter by (m + M) g/k, on whichever side the weight begins."""
    found = rest(f"""
bodies: {{b: {{mass: 2}}, plate: {{mass: 0.5, surfaces: {{top: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{s: {{type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {{q: {start}}}}},
  p: {{type: prismatic, parent: ground, child: plate, axis: y, q: z, initial: {{q: 0.9}}}}}}
forces: {{spring: {{type: spring_damper, joint: p, stiffness: 500, length: 1}}}}
contacts: {{c: {{between: [b, plate.top], open: true}}}}
""")
    position, closed = only(found)
    assert [position[x] for x in "yz"] == pytest.approx([1 - 2.5 * G / 500] * 2, abs=1e-11)
    assert dict(closed) == {"c": "closed"}


def test_a_load_between_two_slack_ropes_hangs_where_both_are_taut() -> None:
    """By hand: circles of 1.3 m about (-1, 0) and 1.2 m about (1, 0) meet at x = (1.3^2 - 1.2^2)/4."""
    found = rest("""
bodies: {ground: {points: {left: [-1, 0, 0], right: [1, 0, 0]}}, b: {mass: 2}}
joints: {s: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [0.2, -0.1]}}}
constraints: {l: {type: rope, path: [ground.left, b], length: 1.3, slack: true},
  r: {type: rope, path: [ground.right, b], length: 1.2, slack: true}}
""")
    position, closed = only(found)
    x = (1.3**2 - 1.2**2) / 4
    assert position["x"] == pytest.approx(x, abs=1e-11)
    assert position["y"] == pytest.approx(-math.sqrt(1.3**2 - (1 + x) ** 2), abs=1e-11)
    assert (dict(closed), found.stable) == ({"l": "taut", "r": "taut"}, (True,))


def test_a_pendulum_rests_on_its_stops_and_upright_not_beyond_them() -> None:
    found = rest("""
bodies: {b: {mass: 2, com: [1, 0, 0]}}
joints: {s: {type: revolute, parent: ground, child: b, axis: z, q: phi, initial: {q: 20 deg},
  limits: {lower: -30 deg, upper: 200 deg}}}
""")
    told = {round(math.degrees(p["phi"])): s for p, s in zip(found.positions, found.stable, strict=True)}
    assert told == {90: False, -30: True, 200: True}
    assert [dict(x) for x in found.closed if x] == [{"s.lower": "lower"}, {"s.upper": "upper"}]


def test_a_disc_in_a_notch_touches_both_sides_and_may_turn() -> None:
    """By hand: its centre is r away from both planes."""
    found = rest("""
parameters: {a: 30 deg, r: 0.1}
bodies: {ground: {surfaces: {l: {plane: [0, 0, 0], normal: [sin(a), cos(a), 0]},
  r: {plane: [0, 0, 0], normal: [-sin(2*a), cos(2*a), 0]}}}, b: {shape: {disc: r, mass: 2}}}
joints: {s: {type: planar, parent: ground, child: b, q: [x, y, th], initial: {q: [0.1, 0.6, 0]}}}
contacts: {cl: {between: [b, ground.l], open: true, static: 0.2}, cr: {between: [b, ground.r], open: true}}
""")
    position, closed = only(found)
    x, y = position["x"], position["y"]
    assert [x / 2 + y * math.sqrt(3) / 2, -x * math.sqrt(3) / 2 + y / 2] == pytest.approx([0.1, 0.1], abs=1e-12)
    assert (set(closed), found.free, found.stable) == ({"cl", "cr"}, (("th",),), (None,))
    assert found.friction_left_out == ("cl",)


def test_a_box_in_space_lies_on_its_four_corners() -> None:
    """Forces of four corners are not unique: that all press is decided by linear programming. It slides and turns."""
    system = mbs.loads(f"""
multibody_sym: 1
name: box
gravity: [0, 0, -{G}]
bodies: {{ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: z}}}}}},
  b: {{shape: {{box: [0.4, 0.2, 0.1], mass: 2}}}}}}
joints: {{s: {{type: free, parent: ground, child: b, initial: {{q: [0, 0, 0.05, 1, 0, 0, 0]}}}}}}
contacts: {{c: {{between: [b, ground.floor]}}}}
""")
    found = mbs.equilibrium(system)
    position, closed = only(found)
    assert position["s_z"] == pytest.approx(0.05, abs=1e-12)
    assert list(closed) == [f"c.corner{k}" for k in (1, 2, 3, 4)]
    assert re.search(r"\b\d{1,2} of 247 sets of contacts, ropes and stops", equilibrium_text(found))
    assert found.stable == (None,)
    assert {"s_x", "s_y", "s_qz"} <= set(found.free[0])


def test_what_falls_beside_everything_has_no_equilibrium() -> None:
    with pytest.raises(NoSolutionError, match=r"accelerates alike .*, and none with c closed either"):
        rest("""
bodies: {ground: {surfaces: {wall: {plane: [0, 0, 0], normal: x}}}, b: {mass: 1}}
joints: {s: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [1, 0]}}}
contacts: {c: {between: [b, ground.wall], open: true}}
""")


def notch(more: int) -> str:
    """Return a particle above a notch, below which there are more planes."""
    walls = {"left": "0, normal: [1, 1, 0]", "right": "0, normal: [-1, 1, 0]"}
    walls |= {f"deep{k}": f"{-1 - k}, normal: y" for k in range(more)}
    skins = ", ".join(f"{name}: {{plane: [0, {rest.replace(',', ', 0],', 1)}}}" for name, rest in walls.items())
    contacts = ", ".join(f"{name}: {{between: [b, ground.{name}], open: true}}" for name in walls)
    return f"""
bodies: {{ground: {{surfaces: {{{skins}}}}}, b: {{mass: 1}}}}
joints: {{s: {{type: point, parent: ground, child: b, q: [x, y], initial: {{q: [0.3, 5]}}}}}}
contacts: {{{contacts}}}
"""


LEANING = """\
multibody_sym: 1
name: leaning
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {shape: {rod: 0.8, mass: 8}, points: {e: [0.8, 0, 0], f: [0, 0, 0]}}
  ring: {mass: 0.3, inertia: {Izz: 0.01}}
joints:
  free: {type: planar, parent: ground, child: rod, q: [x, y, a], initial: {q: [0.8*cos(1), 0, pi - 1]}}
  on: {type: prismatic, parent: rod, child: ring, axis: x, q: s, initial: {q: 0.4}, limits: {lower: 0.1, upper: 0.7}}
contacts: {c1: {between: [rod.f, ground.floor]}, c2: {between: [rod.e, ground.wall]}}
"""


def test_each_set_is_searched_however_long_the_one_of_the_start_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    """A leaning rod slides, since the wall would have to pull; it rests upright or upside down, its ring at a stop.

    With its lower end on the floor V = (m L/2 + n s) g sin(a), and dV/da = 0 where cos(a) = 0.
    """
    spent, real = [0.0], equilibrium_search.search_positions

    def clock() -> float:
        spent[0] += 0.02  # a time that no other process disturbs
        return spent[0]

    def slow(search: EquilibriumSearch, *given: Any, **named: Any) -> FoundPositions:
        sides = search.mechanism.mode.sides if search.mechanism.mode else {}
        if {name for name, side in sides.items() if side} == {"c1", "c2"}:
            spent[0] += 2 * SECONDS
            return FoundPositions(guesses=1, cut_short=True)
        return real(search, *given, **named)

    monkeypatch.setattr(equilibrium_search, "search_positions", slow)
    monkeypatch.setattr(time, "process_time", clock)
    found = mbs.equilibrium(mbs.loads(LEANING))
    rests = {(round(math.sin(x["a"]), 9), round(x["s"], 9)) for x in found.positions}
    assert rests == {(1.0, 0.1), (-1.0, 0.7)}
    assert found.sets == (16, 16)
    assert not any(found.stable)


def test_sets_that_were_not_tried_are_not_called_without_rest() -> None:
    """By hand: the particle rests in the notch, on both of its sides; no other plane is reached."""
    found = rest(notch(0))
    assert dict(only(found)[0]) == pytest.approx({"x": 0.0, "y": 0.0}, abs=1e-9)
    assert found.sets == (4, 4)
    with pytest.raises(NoSolutionError) as caught:
        rest(notch(5))
    assert "none with" not in str(caught.value)
    assert "of 29 sets of left, right, deep0, deep1, .. that may be closed 8 were tried" in str(caught.value)


def test_a_hollow_that_was_not_tried_closed_is_not_called_without_rest() -> None:
    """By hand: the particle rests at the bottom of the hollow."""
    with pytest.raises(NoSolutionError) as caught:
        rest("""
bodies: {ground: {surfaces: {hollow: {curve: {y: x^2}}}}, b: {mass: 1}}
joints: {s: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [0.3, 5]}}}
contacts: {c: {between: [b, ground.hollow], open: true}}
""")
    assert "none with" not in str(caught.value)
    assert "of 2 sets of c that may be closed 1 was tried" in str(caught.value)


def test_modes_are_of_no_place_where_a_contact_would_pull_or_a_stop_is_passed() -> None:
    """A bead on a dome rests on its top, where it is unstable: omega^2 = -g/R; it was told to swing below it."""
    dome = """
parameters: {R: 1}
bodies: {ground: {surfaces: {dome: {disc: R, axis: z}}}, b: {mass: 1}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {q: [0.3, sqrt(R^2 - 0.09)]}}}
contacts: {c: {between: [b, ground.dome]}}
"""
    found = mbs.modes(mbs.loads(HEAD + dome))
    assert found.at["y"].value == pytest.approx(1.0, abs=1e-12)
    assert found.stable is False
    stop = """
bodies: {b: {mass: 2, com: [1, 0, 0]}}
joints: {s: {type: revolute, parent: ground, child: b, axis: z, q: phi, initial: {q: 1}, limits: {lower: -0.5}}}
"""
    hangs = mbs.modes(mbs.loads(HEAD + stop.replace("-0.5", "-1.6")))
    assert hangs.at["phi"].value == pytest.approx(-math.pi / 2, abs=1e-12)
    turned = mbs.modes(mbs.loads(HEAD + stop))  # the stop bars the way down, but not the one over the top
    assert turned.at["phi"].value == pytest.approx(3 * math.pi / 2, abs=1e-12)
    assert turned.stable is True
    with pytest.raises(NoSolutionError, match=r"s.lower, s.upper closed or open as at the start \(equilibrium tells"):
        mbs.modes(mbs.loads(HEAD + stop.replace("lower: -0.5", "lower: -0.5, upper: 1.2")))


def test_friction_that_might_hold_is_told_where_nothing_else_does() -> None:
    with pytest.raises(NoSolutionError, match=r"friction \(rub\) is left out: equilibrium --vary NAME"):
        rest("""
bodies: {ground: {frames: {slope: {rotate: [{axis: z, angle: 0.2}]}}}, b: {mass: 1}}
joints: {s: {type: prismatic, parent: ground.slope, child: b, axis: x, q: x}}
forces: {rub: {type: friction, joint: s, static: 0.5}}
""")


def test_friction_is_told_once_an_element_and_a_wheel_goes_on_rolling() -> None:
    """A spring at a wheel's axle rests at its length; the contact that rolls is closed and keeps its friction."""
    wheel = """
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}, points: {w: [1, 0.2, 0]}},
  a: {shape: {disc: 0.2, mass: 2}, surfaces: {rim: {disc: 0.2, axis: z}}}}
joints: {j: {type: planar, parent: ground, child: a, q: [x, y, th], initial: {q: [0.3, 0.2, 0]}}}
constraints: {roll: {type: rolling, body: a.rim, on: ground.floor, static: 0.4}}
forces: {s: {type: spring_damper, between: [a, ground.w], stiffness: 50, length: 0.5}}
"""
    found = rest(wheel)
    assert found.positions[0]["x"] == pytest.approx(0.5, abs=1e-9)
    assert (dict(found.closed[0]), found.friction_left_out) == ({"roll": "closed"}, ())
    box = wheel.replace("disc: 0.2, mass: 2", "box: [0.4, 0.4, 0.1], mass: 2")
    box = box.replace("constraints: {roll: {type: rolling, body: a.rim, on: ground.floor, static: 0.4}}", CONTACT)
    assert rest(box).friction_left_out == ("c",)


def test_what_stands_where_both_walls_of_a_corner_would_have_to_hold_it_does_not_accelerate_alike() -> None:
    """A pull draws a block off the wall, along a floor that is smooth here: the wall would have to pull."""
    with pytest.raises(NoSolutionError, match=r"no position of equilibrium was found near the start, and none with"):
        rest("""
bodies:
  ground: {surfaces: {wall: {plane: [0, 0, 0], normal: -x}, floor: {plane: [0, 0, 0], normal: y}}}
  a: {mass: 1}
joints: {j: {type: point, parent: ground, child: a, q: [x, y]}}
forces: {pull: {type: force, on: a, value: [-1.7, 4.6, 0]}}
contacts: {c1: {between: [a, ground.wall], static: 1.5}, c2: {between: [a, ground.floor], static: 0.1}}
""")
