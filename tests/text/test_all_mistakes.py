"""All mistakes of a model file at once: as many as were put in, each at its place, and none that follows from them."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from multibody_sym import loads, simulate
from multibody_sym.cli.main import main
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


SETTINGS = """\
multibody_sym: 1
name: settings
gravity: [0, 0, 0]
bodies: {b: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x}}
simulation: {t_end: -1 s, samples: 0, rtol: 2, method: rk45}
"""
WRONG = {
    "t_end": "expected a positive number",
    "samples": "at least 2",
    "rtol": "ask for 1e-15 to 0.1",
    "method": "did you mean RK45?",
}


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


@pytest.mark.parametrize("count", [1, 3])
def test_misspelt_examples_have_the_mistakes_that_were_put_in(count: int) -> None:
    """Each reading counts what it did not meet before: one misspelt word is one mistake, whatever depends on it."""
    rng = random.Random(count)
    for path in EXAMPLES[count::4]:
        text, put = mistaken(path.read_text(), count, rng)
        assert mistakes_of(text, str(path)) == put, path


TIPS = """\
multibody_sym: 1
name: tips
bodies: {a: {mass: 1, points: {tip: [0, 1, 0]}}, b: {mass: 1, points: {top: [0, 1, 0]}}}
joints:
  A: {type: revolute, parent: ground, child: a, q: th}
  B: {type: prismatic, parent: ground, child: b, axis: y, q: z}
"""


def test_a_misspelt_version_key_hides_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = "multibody-sym: 1\nname: a\nbodies: {a: {mas: 1}}\njoints: {j: {type: fixd, parent: ground, child: a}}\n"
    (tmp_path / "m.yaml").write_text(model)
    assert main(["check", str(tmp_path / "m.yaml")]) == 2
    printed = capsys.readouterr().err
    assert "m.yaml:1:1: multibody-sym: unknown key 'multibody-sym'; did you mean multibody_sym? [M101]" in printed
    assert [word in printed for word in ("'mas'", "'fixd'")] == [True, True]


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
        if any(other[:2] == path[:2] and "type" in (key, other[-1]) for other in put.values()):
            continue  # what an element of no type holds is not read
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
