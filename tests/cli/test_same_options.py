"""The same call, the same options: what a command takes its function takes by the same name, and the other way round.

Each shared option means what the same change in the file means, whichever function or command takes it.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.cli.options import COMMANDS, _parser
from multibody_sym.mechanics.changes import Overrides

FUNCTIONS: Mapping[str, tuple[Callable[..., Any], ...]] = {
    "check": (mbs.check,),
    "draw": (mbs.draw,),
    "derive": (mbs.derive,),
    "solve": (mbs.solve,),
    "equilibrium": (mbs.equilibrium, mbs.range_of_rest, mbs.least_for_motion),
    "linearize": (mbs.linearize, mbs.period_multipliers),
    "modes": (mbs.modes,),
    "simulate": (mbs.simulate,),
    "sweep": (mbs.sweep,),
    "animate": (mbs.simulate, mbs.animate),
    "live": (mbs.live,),
    "report": (mbs.simulate, mbs.report),
    "export": (mbs.export,),
    "import": (mbs.load_urdf,),
    "schema": (mbs.schema,),
}
OF_MODELS = [name for name in FUNCTIONS if name not in ("import", "schema", "animate", "report")]
"""Commands whose functions take a system; those that show a run take the options of `simulate` with theirs."""
SHARED = {"parameters", "initial", "inputs", "coordinates", "project", "formalism"}
SUBJECT = {"system", "model", "path"}
"""What the function is asked about: the FILE of a command, without a name there."""
PRINTED = {
    "json": "how the answer is printed: a function returns it",
    "help": "prints",
    "color": "how the answer is printed: a function returns it",
    "digits": "how many digits are printed: a function returns numbers; value.told() takes units with digits",
    "units": "in which units answers are printed: a function returns SI; run.plot() and run.table() take units",
    ("derive", "steps"): "how much of the equations is printed: they hold all of it",
    ("derive", "format"): "how the equations are printed: they are text, LaTeX and data at once",
    ("derive", "theorems"): "what is printed beside the equations: check(system).symmetries holds what is conserved",
    ("simulate", "times"): "what the stages of the command took",
    ("simulate", "verify"): "what run.verified() returns",
    ("modes", "format"): "how the answer is printed: it is text, LaTeX and data at once",
    ("solve", "format"): "how the steps are printed: they are text, LaTeX and HTML at once",
    ("simulate", "output"): "the file for the table that run.table() is",
    ("report", "output"): "the file that report(system, file) writes",
    ("animate", "output"): "the file that animate(run, file) writes",
    ("live", "output"): "the file that live(system, path) writes",
    ("simulate", "show"): "what plot(run, show=..) draws",
    ("simulate", "x"): "over what plot(run, x=..) draws it",
    ("simulate", "plot"): "the file that run.plot(file) writes",
    ("equilibrium", "steps"): "answers.worked.rest.worked_rest writes them",
    ("draw", "output"): "the file that draw(system, path) writes",
    ("sweep", "plot"): "the file that study.plot(file) writes",
    ("sweep", "show"): "what study.plot() is asked to show",
    ("sweep", "scheduler"): "whose Client(address).get_executor() is the executor",
    ("import", "output"): "the file that dump(system, file) writes",
    ("schema", "output"): "the file for what the function returns",
}
NOT_TYPED = {
    ("simulate", "on_progress"): "a function; the command shows its progress itself",
    ("draw", "on_progress"): "a function; the command shows its progress itself",
    ("report", "on_progress"): "a function; a report is written at its end",
    ("report", "command"): "the words that were typed",
    ("report", "units"): "how numbers are printed",
    ("report", "digits"): "how numbers are printed",
    ("animate", "on_progress"): "a function; the command shows its progress itself",
    ("animate", "run"): "the run of the model, which the command makes itself",
    ("animate", "units"): "how the plots beside it are printed",
    ("sweep", "on_progress"): "a function; the command shows its progress itself",
    ("sweep", "reduce"): "a function",
    ("sweep", "key"): "what such a function computes, in a word",
    ("sweep", "executor"): "an object; the command makes that of the scheduler it is given",
}
FILES_ONLY = {
    "new": "it copies a file, of which no function knows",
    "explain": "it tells a page of the documentation",
}


def options(name: str) -> set[str]:
    """Return the options of a command by the names under which they come back, without those that only print."""
    actions = _parser()[1][name]._actions
    taken = {action.dest for action in actions if action.option_strings}
    return {dest for dest in taken if dest not in PRINTED and (name, dest) not in PRINTED}


def arguments(name: str) -> set[str]:
    """Return the arguments of a command's functions, without what they are asked about."""
    taken = {x for function in FUNCTIONS[name] for x in inspect.signature(function).parameters}
    return {x for x in taken - SUBJECT if (name, x) not in NOT_TYPED}


def test_every_command_has_its_function() -> None:
    names = set(COMMANDS)
    assert names == {*FUNCTIONS, *FILES_ONLY}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_options_and_arguments_are_the_same(name: str) -> None:
    assert options(name) - arguments(name) == set(), "options without an argument of the same name"
    assert arguments(name) - options(name) == set(), "arguments without an option of the same name"
    for action in _parser()[1][name]._actions:
        named = [option.removeprefix("--").removeprefix("no-").replace("-", "_") for option in action.option_strings]
        assert not named or action.dest in named, f"{action.option_strings} is called {action.dest}"


@pytest.mark.parametrize("name", OF_MODELS)
def test_the_shared_options_are_those_of_every_function(name: str) -> None:
    for function in FUNCTIONS[name]:
        assert set(inspect.signature(function).parameters) >= SHARED
    assert set(vars(Overrides())) == SHARED - {"formalism"}


def test_what_is_left_out_of_the_comparison_exists() -> None:
    """An exception that nothing needs any more has to go."""
    for entry in (*PRINTED, *NOT_TYPED):
        if isinstance(entry, tuple):
            dests = {action.dest for action in _parser()[1][entry[0]]._actions}
            assert entry[1] in dests or entry in NOT_TYPED
            taken = {x for function in FUNCTIONS[entry[0]] for x in inspect.signature(function).parameters}
            assert entry[1] not in taken or entry in NOT_TYPED


# --- what the options do -------------------------------------------------------------------------------------------

ASKED = """\
multibody_sym: 1
name: arm and cart
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2, k: 3}
bodies:
  arm: {mass: m, com: [0, -l, 0], inertia: {Izz: 0.1}}
  cart: {mass: 0.5}
joints:
  A: {type: revolute, parent: ground, child: arm, q: phi, initial: {q: 30 deg}}
  B: {type: prismatic, parent: ground, child: cart, axis: x, q: s}
forces:
  drive: {type: torque, joint: A, value: F}
  c1: {type: damper, joint: A, damping: 0.2}
  c2: {type: spring_damper, joint: B, stiffness: 2*k, damping: 0.1}
inputs: {F: k*t}
outputs: {pull: "reaction(A, fy)"}
simulation: {t_end: 0.05, samples: 3}
"""
SAME = {
    "parameters": ({"m": "1500 g", "k": "2*l"}, [("m: 1 kg", "m: 1500 g"), ("k: 3", "k: 2*l")]),
    "initial": (
        {"phi": None, "s": "-20 cm", "u_s": "l/2"},
        [("initial: {q: 30 deg}", "initial: {q: ~}"), ("q: s}", "q: s, initial: {q: -20 cm, u: l/2}}")],
    ),
    "inputs": ({"F": "2*k*sin(phi)"}, [("F: k*t", "F: 2*k*sin(phi)")]),
    "coordinates": ("absolute", [("samples: 3", "samples: 3, coordinates: absolute")]),
    "project": (True, [("samples: 3", "samples: 3, project: true")]),
}


def written(given: Mapping[str, Any]) -> str:
    """Return the model file with the changes made by hand that the options `given` ask for."""
    text = ASKED
    for name in given:
        for old, new in SAME[name][1]:
            assert text.count(old) == 1
            text = text.replace(old, new)
    return text


CHOICES = [*({name: value} for name, (value, _) in SAME.items()), {name: value for name, (value, _) in SAME.items()}]


@pytest.mark.parametrize("given", CHOICES, ids=[*SAME, "all"])
def test_an_option_is_the_same_change_in_the_file(given: Mapping[str, Any]) -> None:
    system = Overrides(**given).of(mbs.loads(ASKED))
    assert system == mbs.loads(written(given))
    assert system != mbs.loads(ASKED)


GIVEN: Mapping[str, Any] = {
    "parameters": {"m": "1500 g"}, "initial": {"phi": 0.1, "s": "-20 cm"}, "inputs": {"F": "k/2"},
    "coordinates": "absolute", "project": True,
}
WORDS = "--set", "m=1500 g", "--initial", "phi=0.1", "--initial", "s=-20 cm", "--inputs", "F=k/2", "--project"
RUN: Mapping[str, Any] = {"method": "rk4", "step": 0.01, "backend": "python"}


def given_to(name: str) -> dict[str, Any]:
    """Return the options for a function; looking for all equilibria takes long in absolute coordinates."""
    return {key: x for key, x in GIVEN.items() if (name, key) != ("equilibrium", "coordinates")}


def exported(folder: Path) -> list[bytes]:
    return [file.read_bytes() for file in sorted(folder.iterdir())]


def asked(name: str, system: mbs.System, folder: Path, **given: Any) -> Any:
    """Return what the function of a command says."""
    if name == "simulate":
        return mbs.simulate(system, **RUN, **given).final
    if name == "export":
        mbs.export(system, "python", folder, **given)
        return exported(folder)
    if name == "draw":
        return mbs.draw(system, **given).svg
    if name == "sweep":
        return mbs.sweep(system, {"l": [0.4]}, **RUN, **given)["phi end"].tolist()
    found = FUNCTIONS[name][0](system, **given)
    return found.html if name == "live" else repr(found.forcing) if name == "derive" else found.as_json()


@pytest.mark.parametrize("name", OF_MODELS)
def test_every_function_takes_them_all(name: str, tmp_path: Path) -> None:
    system = mbs.loads(ASKED)
    given = given_to(name)
    changed = asked(name, Overrides(**given).of(system), tmp_path / "changed")
    assert asked(name, system, tmp_path / "asked", **given) == changed
    assert asked(name, system, tmp_path / "declared") != changed


@pytest.mark.parametrize("name", OF_MODELS)
def test_every_command_takes_them_all(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "declared.yaml").write_text(ASKED, encoding="utf-8")
    given = given_to(name)
    mbs.dump(Overrides(**given).of(mbs.loads(ASKED)), tmp_path / "changed.yaml")
    words = [*WORDS, *(("--coordinates", "absolute") if "coordinates" in given else ())]
    own = {"simulate": ("--method", "rk4", "--step", "0.01", "--backend", "python"), "export": ("--to", "python")}
    own["sweep"] = (*own["simulate"], "--vary", "l=.4")

    def printed(file: str, *words: str) -> Any:
        out = tmp_path / f"out{len(words)}"
        page = {"draw": f"{out}.svg", "live": f"{out}.html"}.get(name)
        target = {"export": ("--directory", str(out))} if page is None else {name: ("--output", page)}
        more = (*own.get(name, ()), *target.get(name, ()))
        assert main([name, str(tmp_path / file), "--json", *more, *words]) == 0
        told = json.loads(capsys.readouterr().out)
        if page is not None:
            return Path(page).read_text(encoding="utf-8")
        return exported(out) if name == "export" else {key: x for key, x in told.items() if key != "statistics"}

    assert printed("declared.yaml", *words) == printed("changed.yaml")
    assert printed("declared.yaml", "--no-project") != printed("changed.yaml")


# --- what they refuse ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "option", "message"),
    [
        (("--initial", "ph=1"), "--initial ph", "did you mean phi?"),
        (("--initial", "phi=1 kg"), "--initial phi", "expected a quantity in rad"),
        (("--initial", "u_s=1 m"), "--initial u_s", "expected a quantity in m/s"),
        (("--initial", "phi=q"), "--initial phi", "'q' is not declared"),
        (("--initial", "phi=1/(l-l)"), "--initial phi", "zero"),
        (("--initial", "phi"), "--initial", "NAME=VALUE"),
        (("--inputs", "G=1"), "--inputs G", "there is no input 'G'"),
        (("--inputs", "F=F"), "--inputs F", "'F' is an input"),
        (("--inputs", "F=2*"), "--inputs F", "missing"),
        (("--parameters", "k=1/0"), "--set k", "zero"),
        (("--coordinates", "joints"), "--coordinates", "relative"),
        (("--formalism", "kane"), "--formalism", "there is no formalism"),
    ],
)
@pytest.mark.parametrize("name", ["check", "derive", "equilibrium", "simulate"])
def test_an_error_names_its_option(
    name: str, words: tuple[str, ...], option: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "arm.yaml").write_text(ASKED, encoding="utf-8")
    assert main([name, str(tmp_path / "arm.yaml"), "--json", *words]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert message in error["message"]
    assert error["where"]["path"] == option
    assert error["where"]["file"] is None


def test_a_part_of_a_quaternion_is_refused_by_name() -> None:
    bodies = {"b": {"mass": 1, "inertia": {"Ixx": 1, "Iyy": 1, "Izz": 1}}}
    system = mbs.System("ball", bodies=bodies, joints={"F": mbs.Spherical("ground", "b")})
    with pytest.raises(mbs.ModelError, match="all four or none") as error:
        mbs.check(system, initial={"F_qx": 0.1})
    assert error.value.where.path[:2] == ("initial", "F_qx")
    turned = {"F_qw": 0.6, "F_qx": 0.8, "F_qy": 0, "F_qz": 0}
    assert mbs.solve(system, initial=turned).coordinates == pytest.approx(turned)


def test_a_run_goes_on_where_another_ended() -> None:
    """What equilibria and final states are called is what `initial` takes."""
    system = mbs.loads(ASKED)
    whole = mbs.simulate(system, method="rk4", step=0.01, t_end=0.1, inputs={"F": 1}, backend="python")
    half = mbs.simulate(system, method="rk4", step=0.01, t_end=0.05, inputs={"F": 1}, backend="python").final
    begin = {**half["coordinates"], **half["speeds"]}
    rest = mbs.simulate(
        system, method="rk4", step=0.01, t_end=0.05, inputs={"F": 1}, initial=begin, backend="python"
    )
    assert rest.final["speeds"] == pytest.approx(whole.final["speeds"], abs=1e-12)
    hanging = mbs.equilibrium(system).positions[0]
    assert max(abs(x.value or 0.0) for x in mbs.solve(system, initial=hanging).accelerations.values()) < 1e-9


def test_a_resolved_mechanism_is_not_changed() -> None:
    resolved = mbs.mechanism(mbs.loads(ASKED))
    with pytest.raises(mbs.InputError, match="hand over the System"):
        mbs.derive(resolved, parameters={"m": 2})


def test_derive_takes_one_route() -> None:
    system = mbs.loads(ASKED)
    assert mbs.derive(system, formalism="composite_body").method == "composite_body"
    with pytest.raises(mbs.InputError, match="one of them"):
        mbs.derive(system, "lagrange", formalism="composite_body")
    with pytest.raises(mbs.NoSolutionError, match="too large"):
        mbs.derive(system, budget=1e-9)
