"""Points that meet without a normal strike along the way in which they come together, which a run remembers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

PARTICLES = """\
multibody_sym: 1
name: particles
gravity: [0, 0, 0]
parameters: {e: 0.5, aside: 0}
bodies: {a: {mass: 2}, b: {mass: 3}}
joints:
  A: {type: point, parent: ground, child: a, q: [x1, y1], initial: {q: [-4, aside], u: [4, 0]}}
  B: {type: point, parent: ground, child: b, q: [x2, y2], initial: {q: [0, -3], u: [0, 3]}}
contacts: {c: {between: [a, b], restitution: e}}
simulation: {t_end: 2, samples: 5}
"""
PRESSED = """\
multibody_sym: 1
name: pressed particles
gravity: [0, 0, 0]
bodies: {a: {mass: 1}, b: {mass: 2}}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: x, q: xa, initial: {q: 0}}
  jb: {type: prismatic, parent: ground, child: b, axis: x, q: xb, initial: {q: 0.2}}
forces: {k: {type: force, on: a, value: [2, 0, 0]}, k2: {type: force, on: b, value: [-1, 0, 0]}}
contacts: {ab: {between: [a, b], restitution: 0.6}}
simulation: {samples: 5}
"""
LANDING = """\
multibody_sym: 1
name: on a resting particle
gravity: [0, -9.81, 0]
bodies: {a: {mass: 3}, b: {mass: 0.5}}
joints:
  ja: {type: prismatic, parent: ground, child: a, axis: y, q: ya, limits: {lower: 0}}
  jb: {type: prismatic, parent: ground, child: b, axis: y, q: yb, initial: {q: 1}}
contacts: {ab: {between: [b, a], restitution: 0.5}}
simulation: {samples: 5}
"""
TONGS = """\
multibody_sym: 1
name: tongs
gravity: [0, 0, 0]
parameters: {l: 0.7, e: 1, T: 0}
bodies:
  ground: {points: {left: [-0.5, 0, 0], right: [0.5, 0, 0]}}
  one: {shape: {rod: l, mass: 2}}
  two: {shape: {rod: l, mass: 2}}
joints:
  A: {type: revolute, parent: ground.left, child: one, axis: z, q: a, initial: {q: 1.5, u: -1}}
  B: {type: revolute, parent: ground.right, child: two, axis: z, q: b, initial: {q: pi - 1.5, u: 1}}
forces:
  down: {type: torque, joint: A, value: -T}
  up: {type: torque, joint: B, value: T}
contacts: {c: {between: [one, two], restitution: e}}
simulation: {t_end: 1.2, samples: 13, rtol: 1e-12, atol: 1e-13}
"""


@pytest.mark.parametrize("backend", ["c", "python"])
def test_particles_strike_along_their_relative_velocity(backend: str) -> None:
    """v1 = (4, 0), v2 = (0, 3) m/s: p = (1 + e) mu 5 with mu = 6/5 kg, along (4, -3)/5; they meet after 1 s."""
    run = mbs.simulate(mbs.loads(PARTICLES), backend=backend)
    (event,) = run.events
    assert (event["kind"], event["element"]) == ("impact", "c")
    assert event["t"] == pytest.approx(1.0, rel=1e-12)
    assert event["impulse"] == pytest.approx(9.0, rel=1e-12)
    assert event["lost"] == pytest.approx(0.75 * 6 / 5 * 25 / 2, rel=1e-12)
    way, after = np.array([4, -3]) / 5, [run[f"u_{x}"][-1] for x in ("x1", "y1", "x2", "y2")]
    np.testing.assert_allclose(after, [*([4, 0] - 4.5 * way), *([0, 3] + 3 * way)], rtol=1e-11)
    assert [run[x][-1] for x in ("x1", "y1", "x2", "y2")] == pytest.approx(after, abs=1e-11)


def test_particles_that_pass_each_other_do_not_strike() -> None:
    run = mbs.simulate(mbs.loads(PARTICLES), parameters={"aside": 1e-6}, backend="python")
    assert run.events == []
    assert run["x1"][-1] == pytest.approx(4.0, rel=1e-12)


def test_particles_without_restitution_go_on_together_where_they_stick() -> None:
    text = PARTICLES.replace("restitution: e", "restitution: 0, static: 5")
    run = mbs.simulate(mbs.loads(text), backend="python")
    assert [run[f"u_{x}"][-1] for x in ("x1", "y1", "x2", "y2")] == pytest.approx([1.6, 1.8] * 2, rel=1e-11)


def pressed_impacts(e: float) -> tuple[list[float], float]:
    """Return when PRESSED strikes, and the limit of that: 0.2 m close at 2.5 m/s^2, each flight lasts e as long."""
    first = math.sqrt(2 * 0.2 / 2.5)
    times = [first * (1 + 2 * sum(e**k for k in range(1, n + 1))) for n in range(10)]
    return times, first * (1 + e) / (1 - e)


@pytest.mark.parametrize("settings", [{}, {"backend": "python"}, {"step": 0.3}, {"method": "bogacki_shampine"}])
@pytest.mark.parametrize("t_end", [1.7, 40.0])
def test_particles_pressed_together_bounce_until_they_stay(settings: dict[str, Any], t_end: float) -> None:
    times, limit = pressed_impacts(0.6)
    run = mbs.simulate(mbs.loads(PRESSED), t_end=t_end, **settings)
    assert [x["t"] for x in run.events[:10]] == pytest.approx(times, rel=1e-9)
    assert [x["impulse"] for x in run.events[:10]] == pytest.approx([16 / 15 * 0.6**k for k in range(10)], rel=1e-7)
    assert run.events[-1]["kind"] == "closed"
    assert run.events[-1]["t"] == pytest.approx(limit, rel=1e-8)
    assert run["xa"][-1] == pytest.approx(run["xb"][-1], rel=1e-12)
    assert run["u_xa"][-1] == pytest.approx(t_end / 3, rel=1e-7)


@pytest.mark.parametrize(("axes", "place"), [("xy", [0.12, 0.16]), ("xyz", [0.08, 0.16, 0.2 / math.sqrt(5)])])
def test_free_particles_pressed_together_stay_on_their_line(axes: str, place: list[float]) -> None:
    """The last impacts are so slow that rounding turns their directions: without friction they would slip apart."""
    text, way = PRESSED, np.array(place) / 0.2
    for name, x in (("a", 0.0), ("b", 0.2)):
        q, at = [f"{name}{axis}" for axis in axes], (x * way).tolist()
        old = f"{{type: prismatic, parent: ground, child: {name}, axis: x, q: x{name}, initial: {{q: {x or 0}}}}}"
        assert old in text
        text = text.replace(
            old, f"{{type: point, axes: {axes}, parent: ground, child: {name}, q: {q}, initial: {{q: {at}}}}}"
        )
    x, y, z = (*way.tolist(), 0.0)[:3]
    text = text.replace("[2, 0, 0]", f"[{2 * x}, {2 * y}, {2 * z}]").replace("[-1, 0, 0]", f"[{-x}, {-y}, {-z}]")
    run = mbs.simulate(mbs.loads(text), t_end=20)
    assert run.events[-1]["kind"] == "closed"
    assert run.events[-1]["t"] == pytest.approx(pressed_impacts(0.6)[1], rel=1e-8)
    assert [run[f"u_a{axis}"][-1] for axis in axes] == pytest.approx((20 / 3 * way).tolist(), rel=1e-7)


def test_another_library_sees_short_flights_within_its_steps() -> None:
    """Its errors are as large as the last flights are high: it knows the limit to 1e-6."""
    run = mbs.simulate(mbs.loads(PRESSED), t_end=10, method="Radau")
    assert run.events[-1]["kind"] == "closed"
    assert run.events[-1]["t"] == pytest.approx(pressed_impacts(0.6)[1], rel=1e-6)


def test_particles_pushed_apart_do_not_meet() -> None:
    text = PRESSED.replace("[2, 0, 0]", "[-2, 0, 0]").replace("[-1, 0, 0]", "[1, 0, 0]")
    run = mbs.simulate(mbs.loads(text), t_end=3)
    assert run.events == []
    assert run["xa"][-1] == pytest.approx(-9, rel=1e-12)


@pytest.mark.parametrize("t_end", [1.345, 1.5, 30.0])
def test_a_particle_that_lands_on_another_one_bounces_until_it_rests_there(t_end: float) -> None:
    """Flights of 2 sqrt(2 h/g) e^k end at 3 sqrt(2 h/g), within steps of t_end/200, which they get shorter than."""
    fall = math.sqrt(2 / 9.81)
    run = mbs.simulate(mbs.loads(LANDING), t_end=t_end)
    struck = [x for x in run.events if x["element"] == "ab"]
    times = [fall * (3 - 2 * 0.5**k) for k in range(len(struck))]
    assert [x["t"] for x in struck[:-1]] == pytest.approx(times[:-1], rel=1e-9)
    if t_end < 3 * fall:
        assert len(struck) == sum(fall * (3 - 2 * 0.5**k) < t_end for k in range(30))
    else:
        assert struck[-1]["kind"] == "closed"
        assert struck[-1]["t"] == pytest.approx(3 * fall, rel=1e-9)
        assert [run["ya"][-1], run["yb"][-1]] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_particle_that_loses_nothing_bounces_as_long_as_a_run_lasts() -> None:
    """All flights are shorter than the longest steps, t_end/200."""
    text = LANDING.replace("restitution: 0.5", "restitution: 1").replace("between: [b, a]", "between: [b, ground.o]")
    text = text.replace("bodies: {", "bodies: {ground: {points: {o: [0, 0, 0]}}, ")
    run, fall = mbs.simulate(mbs.loads(text), t_end=200), math.sqrt(2 / 9.81)
    assert [x["t"] for x in run.events] == pytest.approx([fall * (2 * k + 1) for k in range(221)], rel=1e-8)


def test_points_in_one_place_at_the_start_have_no_normal() -> None:
    text = PARTICLES.replace("[-4, aside]", "[0, 0]").replace("[0, -3]", "[0, 0]")
    with pytest.raises(ModelError, match=r"contacts\.c: a and b are points and start at one place, .*impact: "):
        mbs.solve(mbs.loads(text))


@pytest.fixture(scope="module")
def tongs() -> mbs.System:
    return mbs.loads(TONGS)


@pytest.mark.parametrize("e", [1.0, 0.3])
def test_two_rods_meet_end_on_end(tongs: mbs.System, e: float) -> None:
    """Their tips are in one place where cos a = 0.5/l; mirrored, they strike along x, and each turns back by e."""
    run = mbs.simulate(tongs, parameters={"e": e})
    (event,) = run.events
    meet = 1.5 - math.acos(0.5 / 0.7)
    assert event["element"] == "c.end2.end2"
    assert event["t"] == pytest.approx(meet, rel=1e-11)
    inertia, arm = 2 * 0.7**2 / 3, 0.7 * math.sin(math.acos(0.5 / 0.7))
    assert event["impulse"] == pytest.approx((1 + e) * inertia / arm, rel=1e-9)
    assert event["lost"] == pytest.approx((1 - e * e) * inertia, rel=1e-9, abs=1e-12)
    assert [run["u_a"][-1], run["u_b"][-1]] == pytest.approx([e, -e], rel=1e-9)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_rods_that_are_pressed_end_on_end_come_to_rest_there(tongs: mbs.System, e: float) -> None:
    run = mbs.simulate(tongs, parameters={"e": e, "T": 20.0}, t_end=2)
    assert run.events[-1]["kind"] == "closed"
    assert run["a"][-1] == pytest.approx(math.acos(0.5 / 0.7), rel=1e-8)
    assert run["b"][-1] == pytest.approx(math.pi - run["a"][-1], rel=1e-12)
    assert max(abs(run["u_a"][-1]), abs(run["u_b"][-1])) < 1e-12
    lost = 2 * (run["a"][0] - run["a"][-1]) * 20.0 + 2 * 2 * 0.7**2 / 3 / 2
    assert sum(x.get("lost", 0.0) for x in run.events) == pytest.approx(lost, rel=1e-7)


ABOVE_AN_END = """
multibody_sym: 1
name: above an end
gravity: [0, -10, 0]
bodies: {a: {mass: 1}, ground: {surfaces: {shelf: SHELF}}}
joints: {ja: {type: point, parent: ground, child: a, q: [x, y], initial: {q: [X, 0.5]}}}
contacts: {c: {between: [a, ground.shelf], open: true, restitution: 0.5}}
simulation: {t_end: 0.5, samples: 2}
"""
SHELVES = {
    "bar": "{segment: [[0, 0, 0], [1, 0, 0]]}",
    "upper side": "{segment: [[0, 0, 0], [1, 0, 0]], normal: y}",
    "face": "{plane: [0, 0, 0], normal: y, between: [[0, 0, 0], [1, 0, 0]]}",
}


@pytest.mark.parametrize("shelf", list(SHELVES))
@pytest.mark.parametrize("x", ["0", "1", "1 + 1e-13"])
def test_a_point_that_comes_down_onto_the_very_end_of_a_bar_strikes_it(shelf: str, x: str) -> None:
    """It is nearest to both ends at one instant, and in one place with one of them; it comes back up with half v."""
    run = mbs.simulate(mbs.loads(ABOVE_AN_END.replace("SHELF", SHELVES[shelf]).replace("X", x)))
    t = 0.5 - math.sqrt(0.1)
    assert run["y"][-1] == pytest.approx(5 * math.sqrt(0.1) * t - 5 * t**2, abs=1e-9)


@pytest.mark.parametrize("x", ["0", "1", "1 + 1e-13"])
def test_a_point_comes_to_rest_on_the_very_end_of_a_thin_bar(x: str) -> None:
    """It bounces for sqrt(0.1) (1 + 2 (1/2 + 1/4 + ..)) = 0.95 s."""
    run = mbs.simulate(mbs.loads(ABOVE_AN_END.replace("SHELF", SHELVES["bar"]).replace("X", x)), t_end=1)
    assert (run["y"][-1], run["u_y"][-1]) == pytest.approx((0, 0), abs=1e-12)


GRAZING = """
multibody_sym: 1
name: arms that graze
gravity: [0, 0, 0]
bodies:
  ground: {points: {q: [d, 0, 0]}}
  a: {mass: 1, com: [1, 0, 0], inertia: {Izz: 0.1}, points: {e: [1, 0, 0]}}
  b: {mass: 1, com: [1, 0, 0], inertia: {Izz: 0.1}, points: {e: [1, 0, 0]}}
parameters: {d: 2}
joints:
  A: {type: revolute, parent: ground, child: a, q: p, initial: {q: -20 deg, u: 1}}
  B: {type: revolute, parent: ground.q, child: b, q: r, initial: {q: 200 deg, u: -1}}
contacts: {c: {between: [a.e, b.e], restitution: 1, open: true}}
simulation: {t_end: 1, samples: 3}
"""


def test_tips_that_graze_in_line_with_their_arms_do_not_strike() -> None:
    """They are in one place for an instant, as fast as each other; nearer hinges let them meet, 2 cos p = d."""
    run = mbs.simulate(mbs.loads(GRAZING))
    assert (run.events, run.u[-1].tolist()) == ([], [1, -1])
    met = mbs.simulate(mbs.loads(GRAZING), parameters={"d": 1.99})
    assert [x["t"] for x in met.events] == pytest.approx([math.radians(20) - math.acos(0.995)], rel=1e-9)
    assert met.u[-1] == pytest.approx([-1, 1], rel=1e-9)
