"""What is told beside answers: extremes that the end of a run cut off, the first of several, other roots, units."""

from __future__ import annotations

from math import pi, sqrt

import pytest

import multibody_sym as mbs
from multibody_sym.answers.ask import from_runs
from multibody_sym.errors import InputError

RISING = """
multibody_sym: 1
name: rising
parameters: {M: {value: 6e24 kg, positive: true}, m: 100 kg, R: {value: 6.4e6 m, positive: true},
  v: {value: 5000 m/s, positive: true}}
bodies: {ground: {points: {o: [0, 0, 0]}}, s: {mass: m}}
joints: {j: {type: prismatic, parent: ground, child: s, axis: x, q: x, initial: {q: R, u: v}}}
forces: {g: {type: gravitation, between: [ground.o, s], masses: [M, m]}}
"""
SWINGING = """
multibody_sym: 1
name: swinging
parameters: {m: {value: 2 kg, positive: true}, k: {value: 8 N/m, positive: true}, x0: 0.3 m, v0: 0.5 m/s}
bodies: {a: {mass: m}}
joints: {A: {type: prismatic, parent: ground, child: a, axis: x, q: x, initial: {q: x0, u: v0}}}
forces: {s: {type: spring_damper, joint: A, stiffness: k}}
simulation: {t_end: 10 s}
"""
BRAKING = """
multibody_sym: 1
name: braking
gravity: [0, -g, 0]
parameters: {g: {value: 9.81 m/s^2, positive: true}, m: {value: 2 kg, positive: true}, mu: {value: 0.3, positive: true},
  v: {value: 4 m/s, positive: true}}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, b: {mass: m}}
joints: {j: {type: point, parent: ground, child: b, q: [x, y], initial: {u: [v, 0]}}}
contacts: {c: {between: [b, ground.floor], static: mu, kinetic: mu}}
simulation: {t_end: 5 s}
"""
HOOP = """
multibody_sym: 1
name: hoop
gravity: [0, 0, -g]
parameters: {g: {value: 9.81 m/s^2, positive: true}, m: {value: 0.1 kg, positive: true}, w: {value: 8, positive: true},
  R: {value: 0.3 m, positive: true}}
bodies: {hoop: {}, bead: {mass: m, com: [0, 0, -R]}}
joints:
  axle: {type: revolute, parent: ground, child: hoop, axis: z, motion: w*t}
  slide: {type: revolute, parent: hoop, child: bead, axis: x, q: theta, initial: {q: "acos(g/(R*w^2))"}}
"""


def solved(model: str, *questions: str) -> mbs.Solution:
    return mbs.solve(mbs.loads(f"{model}ask:\n" + "".join(f"  {question}\n" for question in questions)))


def test_extremes_that_the_end_of_the_run_cuts_off_are_told() -> None:
    short = RISING + "simulation: {t_end: 300 s}\n"
    ends = "early: {max: x, until: 100 s}", "late: {max: x, until: x < R/2}"
    solution = solved(short, "top: {max: x}", "near: {min: x}", *ends)
    said = "the largest value is that at the end of the run, t_end = 300 s"
    assert [each[:4] for each in solution.conditions if said in each] == ["top:", "late"]
    assert not any("near" in each for each in solution.conditions)


def test_what_is_found_where_the_run_cuts_an_extreme_off_is_told() -> None:
    """v = sqrt(G*M/R) leads to 2*R, at which this run has not arrived; a larger speed is there at its end."""
    solution = solved(RISING + "simulation: {t_end: 800 s}\n", "top: {max: x}", "v2: {find: v, so: top == 2*R}")
    assert solution.answers["v2"].value > sqrt(6.6743e-11 * 6e24 / 6.4e6)
    assert any(each.startswith("v2: there top: the largest value is that at the end") for each in solution.conditions)


def test_of_several_equal_extremes_the_first_is_told() -> None:
    """x = A sin(2 t + p): its speed is largest first where 2 t + p = 2 pi, least where it is pi."""
    later = "again: {max: u_x, after: 4 s}", "far: {max: x^2}"
    solution = solved(SWINGING, "fast: {max: u_x}", "slow: {min: u_x}", *later)
    answers, phase = solution.answers, 0.8760580505981934  # atan2(0.3, 0.25)
    assert answers["fast"].t == pytest.approx((2 * pi - phase) / 2, rel=1e-8)
    assert answers["again"].t == pytest.approx((4 * pi - phase) / 2, rel=1e-8)
    assert answers["slow"].t == pytest.approx((pi - phase) / 2, rel=1e-8)
    assert answers["far"].t == pytest.approx((pi / 2 - phase) / 2, rel=1e-8)
    assert answers["fast"].value == pytest.approx(2 * sqrt(0.3**2 + 0.25**2), rel=1e-10)
    assert not solution.conditions


@pytest.mark.parametrize(
    ("so", "said"),
    [
        ("far == 0.5 kg", r"ask\.f\.so: far == 0\.5 kg: the left side is a quantity in m, the right one in kg"),
        ("far == m", "the left side is a quantity in m, the right one in kg"),
        ("far + k == 1", "a sum of"),
        ("3 s == far", "the left side is a quantity in s, the right one in m"),
    ],
)
def test_units_of_the_sides_are_compared(so: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        solved(SWINGING, "far: {max: x}", f"f: {{find: v0, so: {so}}}")


def test_an_equation_with_a_unit_is_written_as_it_is_read() -> None:
    system = mbs.loads(SWINGING + "ask: {far: {max: x}, f: {find: v0, so: far == 50 cm}}\n")
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.solve(system).answers["f"].value == pytest.approx(2 * sqrt(0.5**2 - 0.3**2), rel=1e-9)


def test_other_roots_are_told_without_bounds_where_there_is_a_formula() -> None:
    """A throw over a given way has two angles."""
    model = """
multibody_sym: 1
name: thrown
gravity: [0, -g, 0]
parameters: {g: 9.81 m/s^2, v: 20 m/s, a: 30 deg}
bodies: {ball: {mass: 1 kg}}
joints: {j: {type: point, parent: ground, child: ball, q: [x, y], initial: {u: [v*cos(a), v*sin(a)]}}}
simulation: {t_end: 6 s}
"""
    solution = solved(model, "range: {value: x, when: y < 0}", "f: {find: a, so: range == 30 m}")
    steep = pi / 2 - solution.answers["f"].value
    told = next(each for each in solution.conditions if each.startswith("f: others are"))
    assert told.endswith(" rad")
    assert float(told.split()[-2]) == pytest.approx(steep, rel=1e-9)


def test_by_runs_it_is_told_that_others_were_not_looked_for() -> None:
    solution = solved(BRAKING, "s: {value: x, after: 2.5 s}", "need: {find: v, so: s == 5}")
    assert solution.answers["need"].value == pytest.approx(sqrt(2 * 0.3 * 9.81 * 5), rel=1e-9)
    assert any("first on the way out from 4, others were not looked for" in each for each in solution.conditions)


def test_a_formula_is_found_beyond_its_pole() -> None:
    """The stopping way v^2/(2 g mu) has a pole at mu = 0, nearer to the start than the value that is looked for."""
    solution = solved(BRAKING, "way: {max: x}", "rough: {find: mu, so: way == 1}")
    assert str(solution.answers["rough"]).startswith("v^2/(2*g) = ")


def test_a_root_of_the_square_of_a_parameter_has_a_formula() -> None:
    answer = solved(HOOP, "w1: frequency(1)", "turn: {find: w, so: w1 == 4}").answers["turn"]
    assert answer.expression is not None
    assert answer.value == pytest.approx(sqrt(8 + sqrt(64 + (9.81 / 0.3) ** 2)), rel=1e-12)


def test_a_find_takes_few_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values at a moment come from the run that ends there; how far two numbers are apart takes none.

    These were 216 runs for two questions, five a value tried.
    """
    runs = []
    simulate = from_runs.simulate
    monkeypatch.setattr(from_runs, "simulate", lambda *given, **how: runs.append(1) or simulate(*given, **how))
    solved(BRAKING, "s: {value: x, when: c sticks}", "need: {find: v, so: s == 5}")
    assert len(runs) <= 20


def test_what_has_no_value_at_some_time_has_an_extreme_at_others() -> None:
    solution = solved(SWINGING, "low: {max: log(x/x0)}", "none: {max: log(-1 - x^2/x0^2)}")
    assert solution.answers["low"].t == pytest.approx(0.3473691381, rel=1e-8)
    assert "low: it has no value at some of the time, which is left out" in solution.conditions
    assert solution.answers["none"].value is None


def test_an_angle_beside_a_pure_number_has_no_unit() -> None:
    system = mbs.loads(SWINGING + "ask: {far: {max: x/x0}, f: {find: v0, so: far == 60 deg}}\n")
    assert "1" not in str(system.ask["f"].so).replace("pi/3", "")


ATWOOD = """
multibody_sym: 1
name: atwood
gravity: [0, -g, 0]
parameters: {g: 10, m: 1, M: 3, h: 1, a: 0.5}
bodies: {ground: {points: {left: [0, 0, 0], right: [a, 0, 0]}}, one: {mass: m}, two: {mass: M}}
joints:
  A: {type: prismatic, parent: ground, child: one, axis: y, q: y1, initial: {q: -h}}
  B: {type: prismatic, parent: ground.right, child: two, axis: y, q: y2, initial: {q: -h}}
constraints: {cord: {type: rope, path: [one, ground.left, ground.right, two]}}
ask: {motion: {formula: y1}, T: "tension(cord)", twice: 2*top, top: {max: y1}, T2: 2*T}
simulation: {t_end: 2 s}
"""


def test_a_run_that_fails_leaves_its_own_questions_alone_without_an_answer() -> None:
    # y1 = -h + g (M - m)/(M + m) t^2/2 is at its pulley, where the rope has no direction, after sqrt(2/5) s
    found = mbs.solve(mbs.loads(ATWOOD))
    assert [found.answers[name].value for name in ("T", "T2")] == pytest.approx([15.0, 30.0], rel=1e-12)
    told = {name: [x for x in found.conditions if x.startswith(f"{name}: ")] for name in ("motion", "top", "twice")}
    for name, (line,) in told.items():
        assert found.answers[name].value is None
        assert found.answers[name].expression is None
        assert ("hangs on" if name == "twice" else "simulation fails: the step became too small at t = 0.632") in line


FALLING = """
multibody_sym: 1
name: falling
gravity: [0, 0, 0]
bodies: {s: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: s, axis: x, q: x, initial: {q: 1 m}}}
forces: {g: {type: force, on: s, value: [-1/x^2, 0, 0]}}
simulation: {t_end: 3 s}
ask: {half: {x: 0.5}, v: {of: s, at: {x: 0.5}}, u: {value: u_x, when: {x: 0.5}}, beyond: {x: 2}, all: {min: x},
  part: {min: u_x, until: {x: 0.5}}}
"""


def test_moments_before_a_run_fails_have_answers() -> None:
    # A fall into the centre at t = pi/sqrt(8); t = (sqrt(x - x^2) + acos(sqrt(x)))/sqrt(2), u = -sqrt(2/x - 2).
    found = mbs.solve(mbs.loads(FALLING))
    time = (0.5 + pi / 4) / sqrt(2)
    values = [found.answers[name].value for name in ("half", "v", "u", "part")]
    assert values == pytest.approx([time, sqrt(2), -sqrt(2), -sqrt(2)], rel=1e-9)
    assert [found.answers[name].value for name in ("beyond", "all")] == [None, None]
    lines = [x for x in found.conditions if "simulation fails" in x]
    assert [x.partition(":")[0] for x in lines] == ["beyond", "all"]
    assert not any("end of the run" in x for x in found.conditions)


THROWN = """
multibody_sym: 1
name: thrown
parameters: {g: 9.81 m/s^2, v: 5 m/s, c: 1e-12 kg/m}
gravity: [0, -g, 0]
bodies: {ground: {surfaces: {floor: {plane: [0, -2, 0], normal: y}}}, b: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {u: v}}}
forces: {drag: {type: force, on: b, value: [0, -c*u_y*abs(u_y), 0]}}
simulation: {t_end: 3 s}
ask: {back: {y: 0}, speed: {of: b, at: {y: 0}}}
"""
AGAIN = "back: y = 0 at the start, and not again before t_end of the simulation"


@pytest.mark.parametrize(
    ("change", "time", "said"),
    [
        (("-c*u_y*abs(u_y)", "0"), 2 * 5 / 9.81, ""),
        (("", ""), 2 * 5 / 9.81, ""),
        (("v: 5", "v: -5"), None, "back: y has this value at the start, and never again"),
        (("v: 5", "v: -5"), None, AGAIN),
        (("u: v", "u: 0"), None, "back: y has this value at the start, and never again"),
        (("u: v", "u: 0"), None, AGAIN),
        (("[0, -g, 0]", "[0, 0, 0]"), None, "back: y has this value at the start, and never again"),
        (("9.81", "0"), None, AGAIN),
        (("9.81 m/s^2, v: 5 m/s", "0 m/s^2, v: 0 m/s"), 0.0, ""),
        (("9.81 m/s^2, v: 5 m/s", "0 m/s^2, v: 0 m/s"), 0.0, "back: y = 0 from the start on"),
    ],
)
def test_a_value_of_the_start_is_asked_for_when_it_comes_back(
    change: tuple[str, str], time: float | None, said: str
) -> None:
    """One rule for formulas and for runs, which a drag too small to matter makes of the same motion."""
    uniform = THROWN.replace("-c*u_y*abs(u_y)", "0")
    found = mbs.solve(mbs.loads((uniform if "never" in said else THROWN).replace(*change)))
    assert found.answers["back"].value == (None if time is None else pytest.approx(time, rel=1e-9))
    assert said in ("", *found.conditions)


def test_what_a_bounce_brings_back_comes_back() -> None:
    """Thrown down onto a floor 2 m below, and back without loss; by the formula of the fall it never comes back."""
    floor = "contacts: {c: {between: [b, ground.floor], open: true, restitution: 1}}\n"
    found = mbs.solve(mbs.loads(THROWN.replace("v: 5", "v: -5") + floor))
    down = (sqrt(5**2 + 2 * 9.81 * 2) - 5) / 9.81
    assert found.answers["back"].value == pytest.approx(2 * down, rel=1e-9)
    assert found.answers["speed"].value == pytest.approx(5, rel=1e-9)


@pytest.mark.parametrize("asked", ["later: {value: y, after: t}", "t: y < -1, later: {value: y*t, after: t}"])
def test_a_question_after_the_time_itself_is_refused(asked: str) -> None:
    model = f"""
multibody_sym: 1
name: faller
gravity: [0, -9.81, 0]
bodies: {{ball: {{mass: 1}}}}
joints: {{j: {{type: point, parent: ground, child: ball, q: [x, y]}}}}
ask: {{{asked}}}
simulation: {{t_end: 1}}
"""
    with pytest.raises(InputError, match=r"ask\.later\.after: t is the time"):
        mbs.solve(mbs.loads(model))
