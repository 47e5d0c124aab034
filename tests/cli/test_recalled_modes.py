"""Runs of what holds one way only, recalled: they go their way once more, to the byte, or are made anew."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest

from multibody_sym.cli import runs
from multibody_sym.cli.main import main
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.prepare import records
from multibody_sym.motion.runs import replay
from multibody_sym.program import cache

SPEED, RUBS, BOUNCES, HEIGHT, G = 3.0, 0.4, 0.8, 1.0, 9.81
MODEL = f"""multibody_sym: 1
name: one_way
gravity: [0, -g, 0]
parameters: {{g: {G}, mu: {RUBS}, e: {BOUNCES}, v: {SPEED}}}
bodies:
  ground: {{surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  block: {{mass: 2 kg}}
  ball: {{mass: 1 kg}}
joints:
  slide: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: [v, 0]}}}}
  fall: {{type: prismatic, parent: ground, child: ball, axis: y, q: h, initial: {{q: {HEIGHT}}}}}
contacts:
  rubs: {{between: [block, ground.floor], kinetic: mu}}
  hits: {{between: [ball, ground.floor], restitution: e}}
outputs: {{twice: 2*x}}
simulation: {{t_end: 3 s, samples: 61}}
"""
OPTIONS = [
    (),
    ("--json",),
    ("--verify",),
    ("--units", "mm,deg"),
    ("--set", "mu=0.3"),
    ("--method", "rk4", "--step", "0.01"),
]


@pytest.fixture(autouse=True)
def told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Give what was done of each run: "recalled", and "made" where the model was read for one that is."""
    monkeypatch.chdir(tmp_path)
    Path("model.yaml").write_text(MODEL)
    found: list[str] = []
    recall, made = replay.recall_run, runs._Anew._made

    def recalled(*given: Any) -> Any:
        run = recall(*given)
        found.extend(["recalled"] * (run is not None))
        return run

    def begun(*given: Any) -> Any:
        found.append("made")
        return made(*given)

    monkeypatch.setattr(replay, "recall_run", recalled)
    monkeypatch.setattr(runs._Anew, "_made", begun)
    return found


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[str, bytes]]:
    """Give the function that makes a run, and returns what it prints and its table."""

    def once(*words: str) -> tuple[str, bytes]:
        capsys.readouterr()
        code = main(["simulate", "model.yaml", "-o", "out.csv", *words])
        shown = capsys.readouterr()
        assert code == 0, shown.err
        return shown.out, Path("out.csv").read_bytes()

    return once


@pytest.mark.parametrize("words", OPTIONS, ids=" ".join)
def test_what_is_told_is_the_same(words: tuple[str, ...], told: list[str], run: Callable[..., Any]) -> None:
    first = run(*words)
    assert told == []
    assert run(*words) == first
    assert told == ["recalled", "made"] if words == ("--verify",) else ["recalled"]


def test_a_recalled_run_moves_as_the_closed_form_says(told: list[str], run: Callable[..., Any]) -> None:
    """The block stops after v/(mu g), having lost m v^2/2; the ball strikes after sqrt(2h/g), then 2 e^k sqrt(2h/g)."""
    run("--json")
    found = json.loads(run("--json")[0])
    assert told == ["recalled"]
    (stick,) = (event["t"] for event in found["events"] if event["kind"] == "stick")
    assert stick == pytest.approx(SPEED / (RUBS * G), abs=1e-12)
    assert found["final"]["coordinates"]["x"] == pytest.approx(SPEED**2 / (2 * RUBS * G), rel=1e-12)
    assert found["friction_work"]["rubs"]["total"] == pytest.approx(-(SPEED**2), rel=1e-10)
    hits = [event["t"] for event in found["events"] if event["kind"] == "impact"]
    down = math.sqrt(2 * HEIGHT / G)
    closed = [down * (1 + 2 * sum(BOUNCES**k for k in range(1, n + 1))) for n in range(6)]
    assert hits[:6] == pytest.approx([t for t in closed if t < 3.0], abs=1e-12)
    energy = G * HEIGHT * (1 - BOUNCES ** (2 * len(hits)))
    assert found["impact_losses"]["hits"] == pytest.approx(energy, rel=1e-10)


def test_a_run_that_ends_in_a_state_ends_there(told: list[str], run: Callable[..., Any]) -> None:
    Path("model.yaml").write_text(MODEL + "stop: {rests: rubs sticks}\n")
    first = run()
    assert f"stopped by 'rests' at t = {SPEED / (RUBS * G):g} s" in first[0]
    assert run() == first
    assert told == ["recalled"]


def test_a_run_that_ends_where_it_begins_has_its_one_sample_in_a_mode(told: list[str], run: Callable[..., Any]) -> None:
    Path("model.yaml").write_text(MODEL + "stop: {low: h < 2}\n")
    first = run()
    assert "the condition of stop 'low' holds at the start" in first[0]
    assert f"total energy {SPEED**2 + G * HEIGHT:g} J at the start" in first[0]
    assert run() == first
    assert told == ["recalled"]


@pytest.mark.parametrize("condition", ["u_h > 0", "hits strikes"])
def test_a_run_that_ends_at_an_impact_ends_there(condition: str, told: list[str], run: Callable[..., Any]) -> None:
    """Behind it where it makes a comparison true, before it where something strikes."""
    Path("model.yaml").write_text(MODEL + f"stop: {{hit: {condition}}}\n")
    first = run("--json")
    down = math.sqrt(2 * HEIGHT / G)
    final = json.loads(first[0])["final"]
    assert final["t"] == pytest.approx(down, rel=1e-10)
    assert final["speeds"]["u_h"] == pytest.approx((-1 if "strikes" in condition else BOUNCES) * G * down, rel=1e-10)
    assert run("--json") == first
    assert told == ["recalled"]


@pytest.mark.parametrize("bent", ["leg", "jump", "more", "less"])
def test_a_run_that_comes_elsewhere_is_made_from_its_model(
    bent: str, told: list[str], run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As with other functions of the system's library, some digits of which differ; no row is told twice."""
    first = run()
    read = replay.RecalledModes.of

    def changed(values: Any, *given: Any) -> Any:
        if bent == "leg":
            values["legs"][0][2] = math.nextafter(values["legs"][0][2], 9.0)
        if bent == "jump":
            values["answers"][2][1] = math.nextafter(values["answers"][2][1], 9.0)
        if bent == "more":
            values["answers"].insert(0, values["answers"][3])
        if bent == "less":
            del values["legs"][1:]
        return read(values, *given)

    monkeypatch.setattr(replay.RecalledModes, "of", changed)
    assert run() == first
    assert told == ["recalled", "made"]


@pytest.mark.parametrize(
    ("words", "names"),
    [((), ['"asked"']), (("--method", "radau_5"), ['"asked"', '"run": ""'])],
    ids=["one library", "one for each mode"],
)
def test_what_is_damaged_is_made_again(
    words: tuple[str, ...],
    names: list[str],
    told: list[str],
    run: Callable[..., Any],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All files of the run; those of its modes but the first: in a cache that no other test has."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    right = run(*words)
    for name in names:
        kept = [path for path in cache.folder().glob("*.json") if name.encode() in path.read_bytes()]
        assert kept
        for path in kept:
            path.write_bytes(path.read_bytes()[:-9])
        assert run(*words) == right
        assert told == []
    assert run(*words) == right
    assert told == ["recalled"]


@pytest.mark.parametrize("lost", ["legs", "answers", "taken", "account", "outcome", "modes"])
def test_what_a_valid_file_says_wrongly_is_made_again(
    lost: str, told: list[str], run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As a version would leave it that forgot to change its name."""
    right = run()
    recall = replay.loading.recall

    def changed(*given: Any, **named: Any) -> Any:
        found = recall(*given, **named)
        if found is not None and found.metadata.get("run"):
            kept = json.loads(found.metadata["run"])
            del kept["modes"][lost]
            found.metadata["run"] = json.dumps(kept)
        return found

    monkeypatch.setattr(replay.loading, "recall", changed)
    assert run() == right
    assert told == []


def test_many_switches_are_not_remembered(
    told: list[str], run: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replay, "MOST", 3)
    assert run() == run()
    assert told == []


def test_nothing_of_a_problem_is_forgotten() -> None:
    made = {"compiled", "jump", "course", "like"}  # found elsewhere, or made of the others
    assert records.TOLD.isdisjoint(made)
    assert records.TOLD | made == {field.name for field in fields(Problem)}
