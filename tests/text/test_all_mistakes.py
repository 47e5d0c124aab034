"""All mistakes of a model file at once: as many as were put in, each at its place, and none that follows from them."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path

import pytest

from multibody_sym import check, loads, simulate
from multibody_sym.cli.main import main
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.errors import InputError, ModelError
from multibody_sym.mechanics.model_files import load_with_places
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.text.yaml_tree import read_text

FOUR = """\
multibody_sym: 1
name: two
bodies: {a: {mas: 1 kg}, c: {mass: 1 m}}
joints: {j: {type: revolut, parent: ground, child: b}, k: {type: fixed, parent: ground, child: c}}
"""
PLACES = [(3, 14), (3, 36), (4, 20), (4, 52)]
EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").rglob("*.yaml"))
SECTIONS = ("parameters", "bodies", "joints", "forces", "constraints", "contacts")
NAMING = ("type", "parent", "child", "on", "kind")


def places(error: InputError) -> list[tuple[int | None, int | None]]:
    return [(each.where.line, each.where.column) for each in (error, *error.others)]


def mistaken(text: str, count: int, rng: random.Random) -> tuple[str, list[tuple[int, int]]]:
    """Return a model with misspelt keys and words, one a line, and where they stand."""
    tree = read_text(text, "")
    keys = [(path, place.line, place.column) for path, place in tree.keys.items() if len(path) in (1, 3)]
    words = [(x, at.line, at.inner) for x, at in tree.values.items() if len(x) == 3 and x[2] in NAMING and at.inner]
    candidates = [each for each in (*keys, *words) if each[0][0] in SECTIONS]
    lines, put = text.split("\n"), {}
    for path, line, column in rng.sample(candidates, min(3 * count, len(candidates))):
        word = re.match(r"[a-z]{3,}\b", lines[line - 1][column - 1 :])
        nested = any(path[: len(other)] == other or other[: len(path)] == path for _, other in put.values())
        if word and line not in put and not nested and len(put) < count:
            before, after = lines[line - 1][: column - 1], lines[line - 1][column - 1 + len(word[0]) :]
            lines[line - 1] = f"{before}{word[0][:-1]}q{word[0][-1]}{after}"
            put[line] = (column, path)
    return "\n".join(lines), sorted((line, column) for line, (column, _) in put.items())


def mistakes_of(text: str, name: str) -> list[tuple[int | None, int | None]]:
    """Return where a model file has mistakes, in what it says and in what it declares."""
    try:
        system, read = load_with_places(name, text.encode())
    except InputError as error:
        return places(error)
    try:
        mechanism(system)
    except InputError as error:
        return places(read.with_others(error, mechanism))
    return []


def first_of(text: str) -> InputError:
    """Return the first mistake of a model file."""
    try:
        system, read = load_with_places("m.yaml", text.encode())
        with read.shown():
            mechanism(system)
    except InputError as error:
        return error
    raise AssertionError(text)


def test_four_mistakes_are_told_at_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "two.yaml"
    path.write_text(FOUR)
    assert main(["check", str(path), "--json"]) == 2
    printed = capsys.readouterr()
    told = json.loads(printed.out)
    assert told["error"] == told["errors"][0]
    assert [(each["where"]["line"], each["where"]["column"]) for each in told["errors"]] == PLACES
    assert [each["number"] for each in told["errors"]] == ["M101", "M105", "M104", "M106"]
    assert printed.err.count("error: ") == printed.err.count("^") == 4
    assert "joints.j.type: 'revolut' is no known type; did you mean revolute? [M104]\n" in printed.err


SETTINGS = """\
multibody_sym: 1
name: settings
gravity: [0, 0, 0]
bodies: {b: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x}}
simulation: {t_end: -1 s, samples: 0, rtol: 2, method: rk45}
"""
BAUMGARTE = ("constraints.baumgarte.alpha", "constraints.baumgarte.beta")
WRONG = {
    "t_end": "expected a positive number",
    "samples": "at least 2",
    "rtol": "ask for 1e-15 to 0.1",
    "method": "did you mean RK45?",
}


@pytest.mark.parametrize("command", ["check", "simulate", "solve"])
def test_wrong_settings_are_told_at_once(command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "settings.yaml"
    path.write_text(SETTINGS)
    assert main([command, str(path), "--json"]) == 2
    told = json.loads(capsys.readouterr().out)["errors"]
    assert [each["where"]["path"] for each in told] == [f"simulation.{name}" for name in WRONG]
    assert [each["where"]["column"] for each in told] == [21, 36, 45, 56]
    assert all(words in each["message"] for each, words in zip(told, WRONG.values(), strict=True))


def test_wrong_settings_of_options_and_of_the_file_are_told_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "settings.yaml"
    path.write_text(SETTINGS)
    options = ["--rtol", "3", "--method", "dormand_prince"]
    assert main(["simulate", str(path), "--output", str(tmp_path / "o.csv"), *options]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    starts = ("error: --rtol: rtol = 3", f"error: {path}:6:21: simulation.t_end", f"error: {path}:6:36: simulation.")
    assert len(lines) == 3
    assert all(line.startswith(start) for line, start in zip(lines, starts, strict=True))


@pytest.mark.parametrize(
    ("written", "told"),
    [
        ("{t_end: 1 kg, rtol: 2, samples: 0}", ["t_end", "rtol", "samples"]),
        ("{tend: 1 s, rtol: 2, coordinates: abs}", ["tend", "rtol", "coordinates"]),
        ("{t_end: T, rtol: 2, atol: -1}", ["t_end", "rtol", "atol"]),
        ("{rtol: 2, constraints: {baumgarte: {alpha: -1, beta: -2}}}", ["rtol", *BAUMGARTE]),
        ("{step: 0.1 s, rtol: 1e-3, atol: 1 kg, method: rk4}", ["step", "atol"]),
    ],
)
@pytest.mark.parametrize("command", ["check", "simulate"])
def test_no_wrong_setting_is_hidden(
    command: str, written: str, told: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither behind another, nor behind what is wrong elsewhere; a step that was left out is not missed."""
    path = tmp_path / "settings.yaml"
    model = SETTINGS[: SETTINGS.index("simulation")].replace("child: b, axis: x", "child: b, axis: w")
    path.write_text(f"{model}simulation: {written}\n")
    assert main([command, str(path), "--json"]) == 2
    errors = json.loads(capsys.readouterr().out)["errors"]
    assert [each["where"]["path"] for each in errors] == ["joints.j.axis", *(f"simulation.{name}" for name in told)]


def test_a_system_is_told_all_its_wrong_settings() -> None:
    with pytest.raises(InputError) as raised:
        simulate(loads(SETTINGS))
    told = [each.where.path for each in (raised.value, *raised.value.others)]
    assert sorted(told) == sorted(("simulation", name) for name in WRONG)


def test_an_exception_carries_the_others() -> None:
    with pytest.raises(ModelError) as raised:
        loads(FOUR)
    assert places(raised.value) == PLACES
    for words in ("did you mean mass?", "a quantity in kg", "did you mean revolute?", "no body is called 'b'"):
        assert words in str(raised.value)


def test_a_system_is_told_all_its_mistakes() -> None:
    system = loads(
        FOUR.replace("mas:", "mass:").replace("1 m}", "2 kg}").replace("revolut,", "revolute,")
        + "outputs: {o: 2*x + y, p: 'position(d, x)'}\nforces: {f: {type: force, on: e, value: [0, z, 0]}}"
    )
    with pytest.raises(InputError) as raised:
        check(system)
    assert [".".join(each.where.path) for each in (raised.value, *raised.value.others)] == [
        *("joints.j.child", "forces.f.on", "forces.f.value.1", "outputs.o", "outputs.o", "outputs.p"),
    ]


@pytest.mark.parametrize(
    ("written", "word", "meant", "column"),
    [
        ("outputs: {o: 2*cos(0) + boddy}", "boddy", "body", 25),
        ("outputs: {o: 'position(boddy, x)'}", "boddy", "body", 24),
        ("outputs: {o: 2*Sin(t)}", "Sin", "sin", 16),
        ("outputs: {o: 2*did you mean x}", None, None, 20),
        ("forces: {f: {type: torqe, joint: j, value: 1}}", "torqe", "torque", 20),
        ("forces: {f: {type: friction, joint: j, mu: 1}}", "mu", "static", 40),
        ("contacts: {c: {between: [body.tpo, ground]}}", "body.tpo", "body.top", 26),
        ("parameters: {body: 1 kgs}", "kgs", "kg", 22),
    ],
)
def test_an_error_says_which_word_is_wrong_and_what_is_meant(
    written: str, word: str | None, meant: str | None, column: int
) -> None:
    """As data, so that nothing reads its own messages; the caret stands below the word, within expressions too."""
    model = (
        "multibody_sym: 1\nname: one\nbodies: {body: {mass: 1 kg, points: {top: [0, 1, 0]}}}\n"
        "joints: {j: {type: prismatic, parent: ground, child: body, axis: x}}\n"
    )
    named = written if "parameters" in written else f"{written}\nparameters: {{body: 2}}"
    error = first_of(model + named)
    assert (error.word, error.meant, error.where.line, error.where.column) == (word, meant, 5, column)


def test_a_part_that_is_left_out_hides_no_mistake_that_names_ground() -> None:
    """The joint of a body that is not there goes, with all that it names but bodies: these stay what they are."""
    model = """
multibody_sym: 1
gravity: [0, -9.81, 0]
bodies: {a: {mass: 1}}
joints:
  A: {type: point, parent: ground, child: a, q: [x, y]}
  B: {type: point, parent: ground, child: cc, q: [z, w]}
contacts: {c: {between: [a, ground.floor], static: -0.3}}
"""
    with pytest.raises(InputError) as caught:
        loads(model)
    told = [str(each) for each in (caught.value, *caught.value.others)]
    words = ("name is missing", "no body is called 'cc'", "'ground.floor' is no surface", "-0.3 is negative")
    assert all(word in line for word, line in zip(words, told, strict=True)), told


def test_many_are_told_in_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "many.yaml"
    path.write_text(FOUR + "outputs:\n" + "".join(f"  o{k}: 2*unknown{k}\n" for k in range(30)))
    assert main(["check", str(path), "--json"]) == 2
    printed = capsys.readouterr()
    assert len(json.loads(printed.out)["errors"]) == 34
    assert printed.err.count("error: ") == 20
    assert printed.err.endswith("and 14 more\n")


@pytest.mark.parametrize("count", [1, 3])
def test_misspelt_examples_have_the_mistakes_that_were_put_in(count: int) -> None:
    """Each reading counts what it did not meet before: one misspelt word is one mistake, whatever depends on it."""
    rng = random.Random(count)
    for path in EXAMPLES[count::4]:
        text, put = mistaken(path.read_text(), count, rng)
        assert mistakes_of(text, str(path)) == put, path


QUESTIONS = """\
multibody_sym: 1
name: questions
parameters: {m: 1 kg}
bodies:
  A: {mass: m}
joints:
  x: {type: prismatic, parent: ground, child: A, axis: [1, 0, 0], q: x}
ask:
  a: x'' + q
  b: {of: A, at: {z: 3}}
  c: {find: mm, so: a == 0}
  d: {period_of: u_x}
  e: {max: x, until: rope slackens}
  f: {of: B, after: 2 s}
  g: {formula: xx}
  h: i + 1
  i: h*2
"""


def test_names_in_questions_are_told_with_the_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "m.yaml").write_text(QUESTIONS)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    told = capsys.readouterr().err
    places = ["a: 'q'", "b.at: ", "c.find: ", "d.period_of: ", "e.until: ", "f.of: ", "g.formula: ", "h: the answers"]
    assert [f"ask.{place}" in told for place in places] == [True] * len(places)
    assert told.count("error: ") == len(places)


MANY = """\
multibody_sym: 1
name: many
gravity: [0, -g, 0]
parameters: {m: 2 kgg, l: 1 m, alfa: 30 deg, F: 3 N, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}, c: {shape: {box: [l, -l, l], mass: 1 kg}}}
joints:
  H: {type: revolut, parent: ground, child: bob, q: th}
  K: {type: prismatic, parent: ground, child: d}
  L: {type: planar, parent: ground, child: c}
forces: {f: {type: force, on: bob, value: [F*alpha, 0]}, s: {type: spring, joint: H, stiffness: 3 s}}
ask: {t: {when: H slides}, s: {formula: s}, z: {find: q, so: l = 3}, y: {find: F, so: l == F}}
"""


def test_nothing_that_was_mended_hides_what_is_declared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Names in what is left out are still those of others, numbers are judged too, and what is missing is put in."""
    (tmp_path / "m.yaml").write_text(MANY)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    told = re.findall(r"error: \S+?m\.yaml:\d+:\d+: (\S+): ", capsys.readouterr().err)
    places = ["parameters.m", "bodies.c.shape.box", "joints.H.type", "joints.K.axis", "joints.K.child"]
    places += ["forces.f.value", "forces.f.value.0", "forces.s.stiffness", "ask.t.when", "ask.s.formula"]
    assert told == [*places, "ask.z.find", "ask.z.so", "ask.y.so"]


TWO_BODIES = """\
multibody_sym: 1
name: two
bodies: {a: {mass: 1, points: {tip: [0, 1, 0]}}, b: {mass: 1}}
joints:
  A: {type: prismatic, parent: ground, child: a, axis: y, q: y}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: z}
constraints: {c: CONSTRAINT}
"""


@pytest.mark.parametrize(
    ("constraint", "told"),
    [
        ("{type: rope, path: [a]}", ["path: expected a list of at least 2, got 1"]),
        (
            "{type: rolling, body: a, on: ground.floor}",
            ["body: a is neither a ball nor a disc", "on: 'ground.floor' is no surface and no point"],
        ),
    ],
)
def test_each_part_of_a_constraint_is_told_once_and_what_is_not_written_never(constraint: str, told: list[str]) -> None:
    with pytest.raises(ModelError) as raised:
        check(loads(TWO_BODIES.replace("CONSTRAINT", constraint)))
    assert len([raised.value, *raised.value.others]) == len(told)
    assert all(f"constraints.c.{each}" in str(raised.value) for each in told)


def told_of(text: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Return the places in the model that `check` finds wrong in a file."""
    (folder / "m.yaml").write_text(text)
    assert main(["check", str(folder / "m.yaml"), "--json"]) == 2
    return [each["where"]["path"] for each in json.loads(capsys.readouterr().out)["errors"]]


IMPOSSIBLE = """\
multibody_sym: 1
name: impossible
bodies:
  a: {mass: -2 kg, inertia: {Izz: -1}}
  b: {shape: {box: [1, -1, 1], mass: -1 kg}}
joints:
  A: {type: revolute, parent: ground, child: a, motion: 1/(t - 1 s)}
  B: {type: planar, parent: ground, child: b}
outputs: {o: 2*yy}
simulation: {rtol: 3}
"""


def test_an_impossible_mass_hides_nothing_of_its_body(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    body = ["bodies.a.mass", "bodies.a.inertia", "bodies.b.shape.box", "bodies.b.shape.mass"]
    assert told_of(IMPOSSIBLE, tmp_path, capsys) == [*body, "joints.A.motion", "outputs.o", "simulation.rtol"]


def test_a_motion_without_value_at_the_start_hides_no_setting(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = IMPOSSIBLE.replace("motion: 1/(t - 1 s)", "motion: 1/t")
    assert told_of(model, tmp_path, capsys)[-1] == "simulation.rtol"


TIPS = """\
multibody_sym: 1
name: tips
bodies: {a: {mass: 1, points: {tip: [0, 1, 0]}}, b: {mass: 1, points: {top: [0, 1, 0]}}}
joints:
  A: {type: revolute, parent: ground, child: a, q: th}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: z}
"""
THREE = """\
multibody_sym: 1
name: three
bodies: {a: {mass: 1}, b: {mass: 1}, c: {mass: 1}}
"""


@pytest.mark.parametrize(
    ("model", "told"),
    [
        (f"{TIPS}forces: {{f: {{type: force, on: b, at: p, value: 3 N}}}}\n", ["forces.f.at", "forces.f.value"]),
        (f"{TIPS}forces: {{f: {{type: force, value: [0, 0, k], frame: c}}}}\n", ["f", "f.value.2", "f.frame"]),
        (f"{TIPS}forces: {{f: {{type: torque, joint: no}}}}\n", ["forces.f", "forces.f.joint"]),
        (f"{TIPS}forces: {{f: {{type: spring, joint: no, stiffness: 1 N/m}}}}\n", ["forces.f.joint"]),
        (f"{TIPS}forces: {{f: {{type: force, on: no, at: tip, value: [0, 1 m, 0]}}}}\n", ["f.on", "f.value.1"]),
        (f"{TIPS}inputs: {{F: {{table: [[0, 0], [0, 1]], of: x}}, G: {{table: [[0, 0]]}}}}\n", ["1", "of", "table"]),
        (
            f"{TIPS}pulleys: {{P: {{at: ground.p}}}}\nconstraints: {{r: {{type: rope, path: [a.tip, P, b.p]}}}}\n",
            ["pulleys.P.at", "constraints.r.path.2"],
        ),
        (f"{TIPS}contacts: {{c: {{between: [a.tip#, b.top], static: -1, repeat: 2}}}}\n", ["c.between.0", "c.static"]),
        (f"{THREE}joints: {{A: {{type: planar, parent: ground, child: no}}}}\n", ["b", "c", "child"]),
        (f"{THREE}joints: {{A: {{type: planar, parent: a, child: a}}}}\noutputs: {{o: x}}\n", ["b", "c", "child", "o"]),
        (
            f"{THREE.replace(', c: {mass: 1}', '')}joints: {{A: {{type: free, parent: ground, child: n}}, B: {{}}}}\n",
            ["child", "B"],
        ),
        (f"{THREE}joints: {{A: {{type: no, parent: not, child: a}}}}\n", ["b", "c", "A.type", "A.parent"]),
    ],
)
def test_what_was_mended_hides_nothing_beside_it(
    model: str, told: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What stands in the place of a wrong part fits there, so that the element and what it joins stay."""
    found = told_of(model, tmp_path, capsys)
    assert len(found) == len(told), found
    assert all(place.endswith(end) for place, end in zip(found, told, strict=True)), found


@pytest.mark.parametrize("unit", ["Nsm", "furlong", "kgs/m"])
def test_nothing_follows_from_a_unit_that_could_not_be_read(
    unit: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither from that of a parameter, nor of another that depends on it."""
    model = TIPS.replace("name: tips", f"name: tips\nparameters: {{c: 5 {unit}, d: 2*c, m: 1 kg}}")
    model += 'forces: {f: {type: drag, on: b, linear: d}}\noutputs: {o: "c + m", p: "c + qq"}\n'
    assert told_of(model, tmp_path, capsys) == ["parameters.c", "outputs.p"]


def test_a_misspelt_version_key_hides_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = "multibody-sym: 1\nname: a\nbodies: {a: {mas: 1}}\njoints: {j: {type: fixd, parent: ground, child: a}}\n"
    (tmp_path / "m.yaml").write_text(model)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    printed = capsys.readouterr().err
    assert "m.yaml:1:1: multibody-sym: unknown key 'multibody-sym'; did you mean multibody_sym? [M101]" in printed
    assert [word in printed for word in ("'mas'", "'fixd'")] == [True, True]


def test_a_pulley_at_a_missing_point_is_offered_all_the_same(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The pulley stays, at its body, while the other mistakes are looked for."""
    rope = "pulleys: {P: {at: ground.top}}\nconstraints: {r: {type: rope, path: [a, P2, b]}}\n"
    model = TIPS + rope
    (tmp_path / "m.yaml").write_text(model)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    assert "no body or pulley is called 'P2'; did you mean P? [M106]" in capsys.readouterr().err


def test_no_message_tells_what_mending_puts_in(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = f"{THREE}joints: {{A: {{type: no, parent: ground, child: a, q: p}}}}\noutputs: {{o: zz + 1}}\n"
    (tmp_path / "m.yaml").write_text(model)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    assert "outputs.o: 'zz' is not declared; known: t [M107]" in capsys.readouterr().err


def nonsense(text: str, count: int, rng: random.Random) -> tuple[str, list[int]]:
    """Return a model with numbers in wrong units and names of nothing, one a line, and the lines."""
    tree = read_text(text, "")
    values = [(path, at) for path, at in tree.values.items() if at.inner and path[0] in SECTIONS and len(path) > 2]
    lines, put = text.split("\n"), dict[int, tuple[str, ...]]()
    for path, at in rng.sample(values, len(values)):
        value, start = tree.at(path), (at.inner or 1) - 1
        key = next(step for step in reversed(path) if not step.isdecimal())
        name = re.fullmatch(r"[A-Za-z][\w.]*", value) and key in ("type", "parent", "child", "on", "at")
        if len(put) == count or at.line in put or not (name or re.fullmatch(r"[\d.]+", value)) or key == "count":
            continue
        wrong = f"zqx{len(put)}w" if name else "7 cd"
        lines[at.line - 1] = f"{lines[at.line - 1][:start]}{wrong}{lines[at.line - 1][start + len(value) :]}"
        put[at.line] = path
    return "\n".join(lines), sorted(put)


@pytest.mark.parametrize("count", [2, 4])
def test_nonsense_in_examples_is_told_and_nothing_else(count: int) -> None:
    rng = random.Random(count)
    for path in EXAMPLES[count::4]:
        text, put = nonsense(path.read_text(), count, rng)
        assert sorted({line or 0 for line, _ in mistakes_of(text, str(path))}) == put, path


@pytest.mark.parametrize(("length", "told"), [("-1 m", "-1 is negative"), ("-l", "its length is -2 m")])
def test_a_negative_length_is_told_as_such_where_it_stands(
    length: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ropes = f"r: {{type: rope, path: [a, b.p], length: {length}}}, s: {{type: rope, path: [a, b], length: {length}"
    model = f"{TIPS}parameters: {{l: 2 m}}\nconstraints: {{{ropes}, slack: true}}}}\n"
    (tmp_path / "m.yaml").write_text(model.replace("length: -l", "length: -1*l", 1))
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    printed = capsys.readouterr().err
    assert "constraints.r.path.1: 'b' has no point" in printed
    assert f"constraints.r.length: {told}" in printed
    rods = f"{TIPS}constraints: {{r: {{type: distance, between: [a, b], value: {length}}}}}\nparameters: {{l: 2 m}}\n"
    assert told_of(rods, tmp_path, capsys) == ["constraints.r.value"]
    spring = f"s: {{type: spring, between: [a, b], stiffness: 1, length: {length}}}"
    springs = f"{TIPS}forces: {{{spring}}}\nparameters: {{l: 2 m}}\n"
    assert told_of(springs, tmp_path, capsys) == ["forces.s.length"]
    assert check_numbers(loads(springs.replace(length, "-1 - cos(t)"))).loads


def test_keys_that_stand_twice_hide_nothing_else() -> None:
    """What stands under such a key in an element is read once, sections are read together."""
    twice = TIPS.replace("b: {mass: 1,", "b: {mass: 1, mass: 2 s,").replace("  B:", "  A: {type: no}\n  B:")
    model = f"{twice}outputs: {{o: 2*x}}\noutputs: {{o: 3*x, p: 2*y}}\nsimulation: {{t_end: 1 kg}}\n"
    with pytest.raises(InputError) as raised:
        loads(model)
    every = [raised.value, *raised.value.others]
    told = [each.message.split(";")[0] for each in every]
    assert [each.where.line for each in every] == [3, 6, 8, 9, 9, 10]
    assert told[:2] == ["the key 'mass' stands here a second time", "the key 'A' stands here a second time"]
    assert told[2:4] == ["'x' is not declared", "the key 'outputs' stands here a second time"]
    assert [each.where.column for each in every[2:]] == [16, 1, 24, 21]
    assert all(each.excerpt for each in every)
    with pytest.raises(InputError) as alone:
        loads(TIPS + "name: again\n")
    assert not alone.value.others
    with pytest.raises(InputError) as broken:
        loads(TIPS + "name: again\noutputs: {o: [1}\n")
    assert len(broken.value.others) == 1


def test_mistakes_in_copies_are_told_once_in_the_chain(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chain = "count: 3, body: {mass: 1, com: [yy, 0, 0]}, joint: {type: revolute, parent: end, axis: [0, 0, kk]}"
    rest = "outputs: {o: 2*zz}\nforces: {f: {type: force, on: rod4, value: [1 m, 0, 0]}}\n"
    model = f"{TIPS}{rest}repeat: {{{chain}}}\n"
    places = ["outputs.o", "forces.f.on", "forces.f.value.0"]
    chained = ["repeat.body.com.0", "repeat.joint.parent", "repeat.joint.axis.2"]
    assert told_of(model, tmp_path, capsys) == [*places, *chained]
    listed = model.replace("repeat: {", "repeat: [{").replace("kk]}}", "kk]}}]")
    assert told_of(listed, tmp_path, capsys) == [*places, *(x.replace("repeat", "repeat.0") for x in chained)]
