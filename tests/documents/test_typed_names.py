"""Every name that commands print is a name that expressions take, and it has the printed number."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text
from multibody_sym.model.settings import Ask
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import FORCE_NAMES
from multibody_sym.text.values import Units

EXAMPLES = Path(__file__).parents[2] / "examples"
STOPPED = """
multibody_sym: 1
name: told
gravity: [0, -9.81, 0]
bodies: {ground: {}, a: {mass: 2}}
joints: {s: {type: prismatic, parent: ground, child: a, axis: y, q: y, limits: {lower: 0, acts: true}}}
"""
BOX = """
multibody_sym: 1
name: told
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  box: {shape: {box: [1, 0.5, 1], mass: 3}}
joints: {j: {type: planar, parent: ground, child: box, q: [x, y, phi], initial: {q: [0, 0.25, 0]}}}
forces: {pull: {type: force, on: box, value: [4, 0, 0]}}
contacts: {c: {between: [box, ground.floor], static: 0.5}}
"""
CROSS = """
multibody_sym: 1
name: told
gravity: [0, 0, -9.81]
bodies: {ground: {}, bob: {mass: 2, com: [0.1, 0.2, -0.5], inertia: {Ixx: 0.2, Iyy: 0.3, Izz: 0.1}}}
joints: {J: {type: universal, parent: ground, child: bob, q: [a, b], initial: {q: [0.4, 0.3], u: [1, -2]}}}
forces: {rub: {type: friction, joint: J, radius: 0.02, kinetic: 0.3}}
"""
ROWS = """
multibody_sym: 1
name: told
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 2 kg}
bodies: {ground: {points: {o: [0, 1, 0]}}, a: {mass: m}, b: {mass: 3}}
joints:
  A: {type: point, parent: ground, child: a, q: [ax, ay], initial: {q: [0, 0]}}
  B: {type: point, parent: ground, child: b, q: [bx, by], initial: {q: [1, 0]}}
constraints:
  string: {type: rope, path: [ground.o, a]}
  rod: {type: distance, between: [a, b], value: 1}
  shelf: {type: point_in_plane, point: b, plane: {through: ground, normal: y}}
"""
DEAR = {
    "andrews_squeezer", "elastic_rod", "four_bar", "furuta", "slider_crank", "spatial_chain", "spatial_four_bar",
    "stewart_platform", "brachistochrone", "disc_in_a_parabolic_hollow", "rolling_ellipse", "eleven_rods",
    "newtons_cradle", "two_billiard_balls", "coupled_pendulums", "disc_in_a_hollow", "governor", "driven_oscillator",
    "loop_the_loop", "over_a_wall",
}  # fmt: skip
"""Examples that take a second or more: 40 s together."""
MODELS = [
    str(path.relative_to(EXAMPLES).with_suffix(""))
    for path in sorted(EXAMPLES.rglob("*.yaml"))
    if path.stem not in DEAR
]
NAMED = re.compile(r"  (\w+'+|\w+\([^=]*\)) = ")


def printed(text: str) -> Iterator[str]:
    """Yield the names before a value, but for those of another question."""
    for line in text.splitlines():
        if (match := NAMED.match(line)) and "not unique" not in line:
            yield match[1]


def read(model: str) -> mbs.System:
    """Return a model: of one with several stages the first one, whose values are printed."""
    system = mbs.loads(model) if "\n" in model else mbs.load(EXAMPLES / f"{model}.yaml")
    return system.with_fields({"then": (), "ask": {}}) if system.then else system


@pytest.mark.parametrize("model", [STOPPED, BOX, CROSS, ROWS, *MODELS])
def test_solve_answers_every_name_that_it_prints_with_the_same_number(model: str) -> None:
    """Typed as questions the printed names give the numbers that stand behind them: all examples but dear ones."""
    system = read(model)
    names = list(printed(solution_text(mbs.solve(system))))
    assert names or system.impact
    told = numbers(mbs.solve(asking(system, "ask", names)))
    for k, name in enumerate(names):
        assert told[f"said{k}"] == told[name], name


@pytest.mark.parametrize("model", [BOX, CROSS, "textbook/capstan"])
def test_runs_have_columns_of_every_name_that_solve_prints(model: str) -> None:
    """The first sample of each column is the number that `solve` prints, to the digits there."""
    system = read(model)
    told = numbers(mbs.solve(system))
    names = list(printed(solution_text(mbs.solve(system))))
    run = mbs.simulate(asking(system, "outputs", names), t_end=1e-3, samples=2)
    for k, name in enumerate(names):
        assert run.outputs[f"said{k}"][0] == pytest.approx(float(told[name].split()[0]), rel=1e-8, abs=1e-9), name


CALL = re.compile(r"[a-z_]+\([A-Za-z_][\w.]*(?:, \w+)?\)")
COMMANDS = ["equilibrium", "check", "solve --steps", "simulate --t-end 0.01"]
LONG = [pytest.param(x, marks=pytest.mark.long) for x in (ROWS, "four_bar", "three_cranks", "rolling_coin")]


@pytest.mark.parametrize("model", [BOX, *LONG])
def test_every_force_that_a_command_names_can_be_typed(
    model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whatever check, solve with its steps, equilibrium and simulate call a force is a question to solve."""
    monkeypatch.chdir(tmp_path)
    system = read(model)
    Path("m.yaml").write_text(mbs.dumps(system))
    for command in COMMANDS:
        verb, *options = command.split()
        assert main([verb, "m.yaml", *options]) in (0, 3), command
    pages = "".join(capsys.readouterr())
    calls = dict.fromkeys(CALL.findall(pages))
    names = [call for call in calls if call.partition("(")[0] in {*FORCE_NAMES, "tension", "multiplier"}]
    assert names
    answers = mbs.solve(asking(system, "ask", names)).answers
    assert len(answers) >= len(names)


@pytest.mark.parametrize("model", ["three_cranks", "four_bar"])
def test_forces_that_check_calls_not_unique_can_be_asked(model: str) -> None:
    system = read(model)
    found = mbs.check(system)
    told = check_text(found).partition("forces that are not unique: ")[2].splitlines()[0]
    parts = [part for name in found.ambiguous_forces for part in name.rstrip(")").split("(")]
    assert not [part for part in parts if part not in told]
    answers = mbs.solve(asking(system, "ask", found.ambiguous_forces)).answers
    assert all(answers[f"said{k}"].value is None for k in range(len(found.ambiguous_forces)))


def test_redundant_rows_of_contacts_and_friction_have_the_names_of_their_forces() -> None:
    """Corners of a box that sticks depend on each other, and so do friction in a hinge and a constraint that holds it.

    Each name that `check` lists is a question to `solve`, but for a constraint of one row, which has its own name.
    """
    held = """
  rod: {mass: 2, com: [0.25, 0, 0], inertia: {Izz: 0.1}}"""
    model = BOX.replace("\njoints: {", held + "\njoints: {\n  A: {type: revolute, parent: ground, child: rod, q: th}, ")
    model = model.replace("forces: {", "forces: {rub: {type: friction, joint: A, static: 0.1, radius: 0.01}, ")
    system = read(model + "constraints: {weld: {type: expression, zero: th}}\n")
    told = [line for line in check_text(mbs.check(system)).splitlines() if "redundant" in line or "each of" in line]
    assert told[0].startswith("redundant constraints: friction(c.corner2), friction(rub) (")
    assert "  each of friction(c.corner1), friction(c.corner2) follows from the others" in told
    assert "  each of weld, friction(rub) follows from the others" in told
    names = dict.fromkeys(CALL.findall("\n".join(told)))
    assert len(mbs.solve(asking(system, "ask", list(names))).answers) == len(names) == 3


def test_rows_of_oblique_cut_joints_can_be_asked() -> None:
    """The slide C along (1, 2, 0) bears along z, where nothing moves, and along n2 = (2, -1, 0)/sqrt(5).

    `check` lists the rows by their names; that of n2 is the component of the reaction along it.
    """
    system = mbs.loads("""
multibody_sym: 1
name: oblique
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {o: [1, 0, 0]}}
  a: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 0.1}, points: {p: [1, 0, 0]}}
  b: {mass: 2, com: [0.5, 0, 0], inertia: {Izz: 0.1}, points: {p: [1, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: a, axis: z, q: th, initial: {q: 2.03}}
  B: {type: revolute, parent: ground.o, child: b, axis: z, q: ph, initial: {q: 2.03}}
  C: {type: prismatic, parent: a.p, child: b.p, axis: [1, 2, 0], cut: true}
""")
    assert "redundant constraints: C.n1, mx(C), my(C)" in check_text(mbs.check(system))
    names = ["multiplier(C.n1)", "multiplier(C.n2)", "fx(C)", "fy(C)"]
    told = mbs.solve(asking(system, "ask", names)).answers
    fx, fy = told["said2"].value, told["said3"].value
    assert told["said1"].value == pytest.approx((2 * fx - fy) / math.sqrt(5), rel=1e-9)
    assert abs(told["said1"].value) == pytest.approx(math.hypot(fx, fy), rel=1e-9)
    assert told["said1"].unit == "N"
    with pytest.raises(mbs.InputError, match=r"'A\.n1' is"):
        mbs.solve(asking(system, "ask", ["multiplier(A.n1)"]))


def test_the_place_of_pressure_is_that_of_moments() -> None:
    """About the middle of a box m g a = F h/2; in flight, where nothing presses, it is the middle of the corners."""
    answers = mbs.solve(asking(read(BOX), "ask", ["at_x(c)", "at_x(c.corner1)", "at_y(c)"])).answers
    assert [x.value for x in answers.values()] == pytest.approx([4 * 0.25 / (3 * 9.81), -0.5, 0.0], rel=1e-12)
    assert [x.unit for x in answers.values()] == ["m"] * 3
    flying = read(BOX.replace("-9.81", "9.81"))
    answers = mbs.solve(asking(flying, "ask", ["at_x(c)", "at_x(c.corner2)"])).answers
    assert [x.value for x in answers.values()] == pytest.approx([0.0, 0.5], abs=1e-12)
    with pytest.raises(mbs.InputError, match=r"'s\.lower' is a stop, which has force"):
        mbs.solve(asking(read(STOPPED), "ask", ["at_x(s.lower)"]))
    with pytest.raises(mbs.InputError, match=r"'x' is no component; did you mean fx\?"):
        mbs.solve(asking(read(STOPPED), "ask", ["reaction(s, x)"]))


ON_A_BOX = """
multibody_sym: 1
name: told
gravity: [0, {gravity}]
bodies: {{box: {{shape: {{box: [1, 1, 1], mass: 5}}}}, b: {{shape: {{{shape}: 0.3, mass: 1}}}}}}
joints:
  W: {{type: fixed, parent: ground, child: box}}
  B: {{type: {joint}, parent: ground, child: b, initial: {{q: {q}}}}}
contacts: {{c: {{between: [b, box], static: 0.3}}}}
"""


@pytest.mark.parametrize(
    ("shape", "gravity", "joint", "q", "place"),
    [
        ("disc", "-9.81, 0", "planar", "[0.2, 0.8, 0]", [0.2, 0.5, 0.0]),
        ("sphere", "0, -9.81", "free", "[0.2, 0.1, 0.8, 1, 0, 0, 0]", [0.2, 0.1, 0.5]),
    ],
)
def test_what_is_round_presses_right_below_its_centre(
    shape: str, gravity: str, joint: str, q: str, place: list[float]
) -> None:
    model = ON_A_BOX.format(shape=shape, gravity=gravity, joint=joint, q=q)
    solution = mbs.solve(asking(read(model), "ask", ["at_x(c)", "at_y(c)", "at_z(c)"]))
    assert [x.value for x in solution.answers.values()] == pytest.approx(place, abs=1e-12)
    assert [solution.reactions["c"][x].value for x in ("at_x", "at_y", "at_z")] == pytest.approx(place, abs=1e-12)


@pytest.mark.parametrize("model", ["textbook/across_the_slope", "textbook/ball_in_socket"])
def test_friction_in_space_is_the_length_of_its_components(model: str) -> None:
    """It is mu N where it slides; a run has the column too."""
    system = read(model)
    parts = [x for x in printed(solution_text(mbs.solve(system))) if x.startswith("friction_")]
    whole = "friction" + parts[0].removeprefix("friction_1")
    told = [x for name, x in mbs.solve(asking(system, "ask", [whole, *parts])).answers.items() if "said" in name]
    assert told[0].value == pytest.approx(math.hypot(*(x.value for x in told[1:])), rel=1e-12)
    assert told[0].value > 0.1
    assert {x.unit for x in told} == {told[0].unit}
    run = mbs.simulate(asking(system, "outputs", [whole]), t_end=1e-3, samples=2)
    assert run.outputs["said0"][0] == pytest.approx(told[0].value, rel=1e-9)


def test_impulses_of_friction_in_space_have_a_length() -> None:
    """A ball that comes down at 3 m/s and slides on without turning back gets mu m 3 m/s along the floor."""
    model = """
multibody_sym: 1
name: struck
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: z}}}
  ball: {shape: {sphere: 0.1, mass: 2}, surfaces: {skin: {sphere: 0.1}}}
joints: {J: {type: free, parent: ground, child: ball, initial: {q: [0, 0, 0.1, 1, 0, 0, 0], u: [5, 2, -3, 0, 0, 0]}}}
contacts: {c: {between: [ball.skin, ground.floor], static: 0.2, kinetic: 0.2, restitution: 0}}
impact: {contacts: c}
"""
    told = mbs.solve(asking(mbs.loads(model), "ask", ["friction(c)", "friction_1(c)", "friction_2(c)"])).answers
    whole, *parts = (told[f"said{k}"].value for k in range(3))
    assert whole == pytest.approx(math.hypot(*parts), rel=1e-12) == pytest.approx(0.2 * 2 * 3, rel=1e-9)


SLIDE = """
multibody_sym: 1
name: slide
gravity: [0, -9.81, 0]
parameters: {v0: 2 m/s}
bodies: {ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}, block: {shape: {box: [0.2, 0.2, 0.2], mass: 2}}}
joints:
  j: {type: planar, parent: ground, child: block, q: [x, y, phi], initial: {q: [0, 0.1, 0], u: [v0, 0, 0]}}
contacts: {c: {between: [block, ground.floor], static: 0.3, kinetic: 0.2}}
"""
STATE = re.compile(r"^  (\w+) +(-?[0-9.e-]+)( |$)", re.MULTILINE)


@pytest.mark.parametrize("model", [SLIDE, CROSS])
def test_the_state_that_a_run_ends_in_is_typed_as_the_start_of_another(model: str) -> None:
    system = read(model)
    run = mbs.simulate(system, t_end=0.2, samples=2)
    state = {name: float(x) for name, x, _ in STATE.findall(run_summary(run).partition("total energy")[0])}
    assert len(state) == len(run.q[0]) + len(run.u[0])
    again = mbs.simulate(system, initial=state, t_end=1e-9, samples=2)
    for name, x in state.items():
        assert again[name][0] == pytest.approx(x, abs=1e-9), name


def test_names_of_a_state_and_words_of_events_are_typed_where_a_run_stops_and_in_what_is_to_be_found() -> None:
    """From 2 m/s the block stops after v0/(0.2 g) s and v0^2/(0.4 g) m: what a run prints of that is typed."""
    system = read(SLIDE)
    run = mbs.simulate(system, t_end=2.0)
    told = [line for line in run_summary(run).splitlines() if " s: c" in line]
    time, event = re.fullmatch(r"  t = ([0-9.]+) s: (c.corner2 stick)", told[-1]).groups()  # type: ignore[union-attr]
    assert float(time) == pytest.approx(2.0 / (0.2 * 9.81), rel=1e-5)
    stopped = mbs.simulate(mbs.loads(f"{SLIDE}stop: {{rest: {event}}}\n"), t_end=2.0)
    assert stopped.t[-1] == pytest.approx(2.0 / (0.2 * 9.81), rel=1e-9)
    halfway = mbs.simulate(mbs.loads(f"{SLIDE}stop: {{half: u_x < 1}}\n"), t_end=2.0)
    assert halfway.t[-1] == pytest.approx(1.0 / (0.2 * 9.81), rel=1e-9)
    ask = f"way: {{value: x, when: {event}}}, v: {{find: u_x, so: way == 1, between: [1, 4]}}"
    answers = mbs.solve(mbs.loads(SLIDE.replace("v0, 0, 0]", "2, 0, 0]") + f"ask: {{{ask}}}\n")).answers
    assert answers["way"].value == pytest.approx(4.0 / (0.4 * 9.81), rel=1e-9)
    assert answers["v"].value == pytest.approx(math.sqrt(0.4 * 9.81), rel=1e-9)


def test_stops_have_a_force() -> None:
    assert mbs.solve(asking(read(STOPPED), "ask", ["force(s.lower)"])).answers["said0"].value == pytest.approx(19.62)


def test_primes_are_rates_of_coordinates_and_speeds() -> None:
    """phi' is the speed, phi'' and the prime of the speed the acceleration -3 g sin(phi)/(2 l) of a rod."""
    model = """
multibody_sym: 1
name: rod
gravity: [0, -9.81, 0]
bodies: {ground: {}, rod: {mass: 2, com: [0, -0.5, 0], inertia: {Izz: 1/6}}}
joints: {A: {type: revolute, parent: ground, child: rod, q: phi, initial: {q: 0.5, u: 3}}}
"""
    answers = mbs.solve(asking(mbs.loads(model), "ask", ["phi'", "phi''", "u_phi'", "phi'^2*2"])).answers
    acceleration = -1.5 * 9.81 * math.sin(0.5)
    assert [x.value for x in answers.values()] == pytest.approx([3.0, acceleration, acceleration, 18.0], rel=1e-12)
    assert [x.unit for x in answers.values()][:3] == ["rad/s", "rad/s^2", "rad/s^2"]
    with pytest.raises(mbs.InputError, match="stop and ask only; here the speed is u_phi"):
        mbs.solve(mbs.loads(model + "forces: {M: {type: torque, on: rod, value: [0, 0, phi']}}\n"))


def numbers(solution: mbs.Solution) -> dict[str, str]:
    """Return the last of the numbers with its unit that stands behind each name."""
    lines = (line.strip().split(" = ") for line in solution_text(solution, Units(digits=10)).splitlines())
    return {name: others[-1] for name, *others in lines if others}


def asking(system: mbs.System, where: str, names: Sequence[str]) -> mbs.System:
    """Return a system with outputs or questions of these names beside its own."""
    nodes = {f"said{k}": parse(name) for k, name in enumerate(names)}
    asked = nodes if where == "outputs" else {name: Ask(value=node) for name, node in nodes.items()}
    return replace(system, **{where: {**getattr(system, where), **asked}})
