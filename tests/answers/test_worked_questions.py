"""Answers to `ask` as steps: each equation holds in the motion that runs show, and the last line is the answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.answers.instant.instant import solved_start
from multibody_sym.answers.records import Formula, Sentence, WorkedStep
from multibody_sym.answers.worked.worked import depends_on_quaternions
from multibody_sym.cli.main import main
from multibody_sym.text.values import Quantity

EXAMPLES = Path(__file__).parents[2] / "examples"
SLIDE = """
multibody_sym: 1
name: slide
gravity: [0, -g, 0]
parameters: {m: {value: 3 kg, positive: true}, alpha: 30 deg, mu: 0.2, g: 9.81 m/s^2, L: 4 m, v: 2 m/s}
bodies: {block: {mass: m}, ground: {frames: {slope: {rotate: [{axis: z, angle: -alpha}]}}}}
joints: {slide: {type: prismatic, parent: ground.slope, child: block, axis: x, q: s, initial: {u: v}}}
forces: {sole: {type: friction, joint: slide, static: mu, kinetic: mu}}
ask: {speed: {of: block, at: {s: L}}, time: {s: L}, way: {of: block, after: 2 s}, twice: 2*speed}
"""
LOOP = EXAMPLES / "questions" / "loop_the_loop.yaml"
WALL = EXAMPLES / "questions" / "over_a_wall.yaml"
PENDULUMS = EXAMPLES / "oscillations" / "coupled_pendulums.yaml"


def later_steps(solution: mbs.Solution) -> dict[str, WorkedStep]:
    assert solution.steps is not None
    return {step.title.partition(":")[0]: step for step in solution.steps.steps if step.is_later}


def line_texts(solution: mbs.Solution, name: str) -> list[str]:
    """The lines of a question, words before mathematics."""
    assert solution.steps is not None
    notation = solution.steps.notation

    def told(line: Formula | Sentence) -> str:
        words = line.before if isinstance(line, Formula) else line.words
        spoken = "".join(word if isinstance(word, str) else notation.text(word) for word in words)
        sides = " = ".join(map(notation.text, line.sides)) if isinstance(line, Formula) else ""
        return f"{spoken}: {sides}" if spoken and sides else spoken + sides

    return [told(line) for line in later_steps(solution)[name].lines]


@pytest.fixture(scope="module")
def slide() -> mbs.Solution:
    return mbs.solve(mbs.loads(SLIDE), steps=True)


@pytest.fixture(scope="module")
def wall() -> mbs.Solution:
    return mbs.solve(mbs.load(WALL), steps=True)


@pytest.fixture(scope="module")
def loop() -> mbs.Solution:
    return mbs.solve(mbs.load(LOOP), steps=True)


def test_constant_accelerations_give_squares_of_speeds_and_times(slide: mbs.Solution) -> None:
    assert line_texts(slide, "speed")[0] == "s is uniformly accelerated: s'^2 = 2*L*s'' + v^2"
    assert line_texts(slide, "time")[0] == "s is uniformly accelerated: L = t^2*s''/2 + v*t"
    assert line_texts(slide, "twice") == ["twice = 2*sqrt(v^2 - 2*g*mu*L*cos(alpha) + 2*g*L*sin(alpha))"]


def test_a_throw_is_integrated_and_its_moment_put_in(wall: mbs.Solution) -> None:
    assert line_texts(wall, "range") == [
        "x'' = 0",
        "integrated from the start: x = v*t*cos(a)",
        "y'' = -g",
        "integrated from the start: y = v*t*sin(a) - g*t^2/2",
        "at the moment: g*t^2/2 - v*t*sin(a) = 0",
        "this factor vanishes: g*t - 2*v*sin(a) = 0",
        "so: t = 2*v*sin(a)/g",
        "range = 2*v^2*sin(a)*cos(a)/g",
    ]


def test_energy_gives_the_speed_and_the_slope_the_place(loop: mbs.Solution) -> None:
    lines = line_texts(loop, "least")
    assert lines[1] == "so: phi'^2 = (v0^2 - 2*g*R + 2*g*R*cos(phi))/R^2"
    assert lines[3:5] == ["its slope vanishes where: -3*m*g*sin(phi) = 0", "so: phi = pi"]


def test_frequencies_come_from_small_motions() -> None:
    solution = mbs.solve(mbs.load(PENDULUMS), steps=True)
    assert line_texts(solution, "w1")[1] == "m*l^2*phi1'' - a^2*k*phi2 + (m*g*l + a^2*k)*phi1 = 0"
    assert line_texts(solution, "w2") == [
        "as for w1, down to: (m*g*l - m*l^2*omega^2 + a^2*k)^2 - a^4*k^2 = 0",
        "this factor vanishes: 2*a^2*k - m*l^2*omega^2 + m*g*l = 0",
        "of the roots omega > 0 this is number 2 by size",
        "then the amplitudes are: phi2 = -phi1",
        "w2 = frequency(2) = sqrt((2*a^2*k + m*g*l)/m)/l",
    ]


def test_bodies_are_cut_free_in_motion_where_forces_differ_from_those_at_the_start(
    slide: mbs.Solution, loop: mbs.Solution
) -> None:
    """Drag is missing at rest, and against the motion on both ways; a slope is the same all along."""
    fall = mbs.System(
        name="fall",
        gravity=["0", "-g", "0"],
        parameters={"m": 2, "g": 9.81, "k": 0.3},
        bodies={"man": mbs.Body(mass="m")},
        joints={"j": mbs.Prismatic("ground", "man", axis="y", q="y")},
        forces={"air": mbs.Drag(on="man", quadratic="k")},
        ask={"first": {"y": -1}},
    )
    dropped, thrown = (mbs.solve(fall, initial={"u_y": u}, steps=True) for u in (0, 3))
    title = "man, cut free"
    assert line_texts(dropped, title)[1] == "k*y'^2: force air, up"
    assert line_texts(dropped, title)[-1] == "along y: m*y'' = k*y'^2 - m*g"
    assert line_texts(thrown, title)[-1] == "along y: m*y'' = -k*y'^2 - m*g"
    unasked = mbs.solve(replace(fall, ask={}), steps=True)
    assert line_texts(unasked, f"{title} in motion") == line_texts(dropped, title)
    assert loop.steps is not None
    tags = [line.tag for step in loop.steps.steps for line in step.lines if isinstance(line, Formula) and line.tag]
    assert tags == [*range(1, len(tags) + 1)]
    assert not [title for title in later_steps(slide) if "in motion" in title]


@pytest.mark.parametrize(
    ("name", "asked", "moment"),
    [
        ("slide", "speed", {"s": "L"}),
        ("slide", "time", {"s": "L"}),
        ("wall", "range", "y < 0"),
        ("wall", "at_the_wall", {"x": "d"}),
        ("loop", "half_way", {"phi": "pi/2"}),
    ],
)
def test_equations_hold_at_the_moment_as_a_run_shows_it(
    name: str, asked: str, moment: Any, request: pytest.FixtureRequest
) -> None:
    """Laws, solutions and energies are put to the state that a run reaches, roots to its time."""
    system = mbs.loads(SLIDE) if name == "slide" else mbs.load(LOOP if name == "loop" else WALL)
    solution: mbs.Solution = request.getfixturevalue(name)
    time = mbs.solve(system.with_fields({"ask": {"t": moment}})).answers["t"].value
    assert time is not None
    there, worked = mbs.simulate(system, t_end=time * 1.1)(time), solution.steps
    assert worked is not None
    named = {worked.notation.text(s): value for s, value in worked.values.items()}
    named |= {"t": time} | {f"{x}''": value.value or 0.0 for x, value in solution.accelerations.items()}
    for x in solution.coordinates:
        named |= {x: float(there[x][0]), f"{x}'": float(there[f"u_{x}"][0])}
    lines = [line for line in later_steps(solution)[asked].lines[:-1] if isinstance(line, Formula)]
    equations = [line.sides for line in lines if len(line.sides) == 2]
    assert equations
    for sides in equations:
        values = [side.subs({s: named[worked.notation.text(s)] for s in side.free_symbols}) for side in sides]
        assert float(values[0]) == pytest.approx(float(values[1]), rel=1e-7, abs=1e-6)


def test_a_number_that_only_a_run_knows_says_so_and_one_without_value_why() -> None:
    system = mbs.loads(SLIDE.replace("ask: {", "ask: {far: {max: s}, back: {s: -3 m}, half: back/2, "))
    solution = mbs.solve(system, steps=True)
    assert line_texts(solution, "back") == ["s never has this value"]
    assert line_texts(solution, "half") == ["it hangs on an answer that has no value"]


def test_an_impact_answers_after_it() -> None:
    system = mbs.load(EXAMPLES / "impacts" / "ballistic_pendulum.yaml")
    asked = mbs.solve(system.with_fields({"ask": {"left": "kinetic_energy()"}}), steps=True)
    (line,) = later_steps(asked)["left"].lines
    assert isinstance(line, Formula)
    assert line.value is not None
    assert line.value.number == pytest.approx(asked.answers["left"].value)


def test_steps_of_questions_are_printed_and_typeset(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "slide.yaml"
    file.write_text(SLIDE)
    assert main(["solve", str(file), "--steps"]) == 0
    assert "speed: speed of block when s = L\n    s is uniformly accelerated: s'^2" in capsys.readouterr().out
    assert main(["solve", str(file), "--steps", "--format", "latex"]) == 0
    assert r"\dot{s}^{2} = 2 L \ddot{s} + v^{2}" in capsys.readouterr().out


def test_a_mass_that_is_a_number_has_a_letter_in_the_balance() -> None:
    system = mbs.loads(SLIDE.replace("mass: m", "mass: 3 kg")).with_fields({"ask": {"a": "s''"}})
    worked = mbs.solve(system, steps=True).steps
    assert worked is not None
    given, *_ = (step.lines[0] for step in worked.steps)
    assert isinstance(given, Formula)
    assert (worked.notation.text(given.sides[0]), given.value) == ("m_block", Quantity(3.0, "kg"))
    tagged = [line for line in worked.formulas if line.tag == 1]
    assert [worked.notation.text(side) for side in tagged[0].sides] == ["m_block*s''", "m_block*g*sin(alpha) - F"]


def test_a_body_that_no_torque_turns_has_eulers_equations_in_motion() -> None:
    """Without a force its orientation has no say; on an arm the weight has one."""
    top = """
multibody_sym: 1
name: top
gravity: [0, 0, -9.81]
bodies: {body: {mass: 1 kg, com: [0, 0, 0], inertia: {Ixx: 0.2 kg*m^2, Iyy: 0.3 kg*m^2, Izz: 0.4 kg*m^2}}}
joints: {J: {type: spherical, parent: ground, child: body, initial: {u: [0.1 rad/s, 2 rad/s, 0]}}}
"""
    assert not depends_on_quaternions(solved_start(mbs.loads(top)))
    assert depends_on_quaternions(solved_start(mbs.loads(top.replace("[0, 0, 0], in", "[0, 0, 0.1], in"))))
