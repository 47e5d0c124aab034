"""Whatever the public functions return, copied and pickled: the same values, and code that is made again elsewhere."""

from __future__ import annotations

import copy
import inspect
import io
import pickle
import pickletools
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from public_calls import calls

import multibody_sym as mbs
from multibody_sym.errors import MultibodyError, Where
from multibody_sym.motion.methods.table import METHODS, SUMMARIES
from multibody_sym.motion.runs.run import FailedRunError
from multibody_sym.program import cache

EXAMPLES = Path(__file__).parents[2] / "examples"
SYSTEM = """
multibody_sym: 1
name: driven
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81, w: 3}
bodies: {bob: {mass: m, com: [0, -l, 0], inertia: {Izz: 0.1}}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 30 deg}}}
forces: {drive: {type: torque, joint: hinge, value: F}}
inputs: {F: sin(w*t)}
outputs: {pull: "reaction(hinge, fy)"}
simulation: {t_end: 0.5, samples: 11}
"""


def pickled(value: Any) -> Any:
    """Return a value that went through a pickle."""
    return pickle.loads(pickle.dumps(value))


again = pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, pickled])
backends = pytest.mark.parametrize("backend", ["c", "python"])


@again
def test_a_run_among_others_is_copied_without_them(again: Callable[[Any], Any]) -> None:
    lengths = np.linspace(0.4, 0.6, 50).tolist()
    run = list(mbs.prepare(mbs.loads(SYSTEM)).runs({"l": lengths}, {}))[7]()
    copied = again(run)
    assert copied.as_json() == run.as_json()
    assert copied.ready.system == run.ready.system
    assert len(pickle.dumps(copied)) < 2 * len(pickle.dumps(mbs.simulate(mbs.loads(SYSTEM))))


# --- everything that is public -------------------------------------------------------------------------------------


def test_results_of_every_public_call_are_copied_and_pickled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    kinds = set()
    for call in calls(tmp_path):
        result = call(call.given)
        if type(result).__module__.startswith("matplotlib."):
            continue  # a figure is not ours
        kinds.add(type(result).__name__)
        for back in (copy.copy(result), copy.deepcopy(result), pickled(result)):
            assert type(back) is type(result), call.name
    assert kinds >= {"System", "Mechanism", "Trajectory", "SymbolicEquations", "Solution", "Linearization", "RightSide"}


PARTS_OF_ERRORS = ("message", "where", "excerpt", "number", "word", "known", "meant")


def test_every_error_comes_back_whole() -> None:
    kinds, found = [MultibodyError], []
    while kinds:
        kind = kinds.pop()
        kinds += kind.__subclasses__()
        if inspect.signature(kind).parameters.keys() == {*PARTS_OF_ERRORS}:
            found.append(kind)
            error = kind(
                "wrong",
                where=Where("a.yaml", 3, 4, ("joints", "A")),
                excerpt="x\n^",
                number="M101",
                word="mas",
                meant="mass",
            )
            back = pickled(error)
            assert (type(back), str(back), back.as_json()) == (kind, str(error), error.as_json())
            assert (back.word, back.meant) == ("mas", "mass")
    assert len(found) > 8


def test_a_failed_run_comes_back_with_its_samples() -> None:
    growing = mbs.loads(SYSTEM.replace("sin(w*t)", "exp(exp(40*t))"))
    with pytest.raises(FailedRunError) as caught:
        mbs.simulate(growing, method="rk4", step=0.01, backend="python")
    for back in (pickled(caught.value), copy.copy(caught.value)):
        assert str(back) == str(caught.value)
        np.testing.assert_array_equal(back.trajectory.q, caught.value.trajectory.q)


# --- values ---------------------------------------------------------------------------------------------------------


@again
def test_equations_say_and_compute_the_same(again: Callable[[Any], Any]) -> None:
    equations = mbs.derive(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    back = again(equations)
    assert back == equations
    assert str(back) == str(equations)
    given = [0.3, 0.2], [0.1, -0.4]
    np.testing.assert_array_equal(back.lambdify()(*given), equations.lambdify()(*given))
    function = equations.lambdify("terms")
    for a, b in zip(function(*given), again(function)(*given), strict=True):
        np.testing.assert_array_equal(a, b)


@again
@backends
def test_a_trajectory_keeps_its_samples_and_answers_alike(again: Callable[[Any], Any], backend: Any) -> None:
    run = mbs.simulate(mbs.loads(SYSTEM), backend=backend)
    back = again(run)
    for a, b in ((run.q, back.q), (run.u, back.u), (run["pull"], back["pull"]), (run.energy, back.energy)):
        np.testing.assert_array_equal(a, b)
    np.testing.assert_array_equal(run.reactions["hinge"]["fx"], back.reactions["hinge"]["fx"])
    assert back.as_json() == run.as_json()


ONE_WAY = {
    "contact": (EXAMPLES / "textbook/thrown_up.yaml", 1.0),
    "friction in a joint": (EXAMPLES / "textbook/rough_hinge.yaml", 1.0),
    "rough pulley": (EXAMPLES / "textbook/capstan.yaml", 1.0),
}
"""Each with a time in which its state changes, but for the rope, which goes on slipping."""


@pytest.mark.parametrize("name", ONE_WAY)
def test_a_run_from_state_to_state_answers_alike(name: str) -> None:
    """Each copy is taken before the run is asked for anything: what it then tells is found anew."""
    path, t_end = ONE_WAY[name]
    run = mbs.simulate(mbs.load(path), t_end=t_end, samples=11, method="rk4", step=t_end / 40)
    copies = copy.copy(run), copy.deepcopy(run), pickled(run)
    assert bool(run.changes) == (name != "rough pulley")
    assert run.modes is not None
    told = run.as_json()
    for back in copies:
        np.testing.assert_array_equal(run.q, back.q)
        assert (back.changes, back.friction_work) == (run.changes, run.friction_work)
        for joint, known in run.reactions.items():
            for component, values in known.items():
                np.testing.assert_array_equal(values, back.reactions[joint][component])
        assert back.as_json() == told


@again
@backends
def test_compiled_functions_give_the_same_bits(again: Callable[[Any], Any], backend: Any) -> None:
    system = mbs.loads(SYSTEM)
    rhs = mbs.compile(mbs.state_derivative(system), backend=backend)
    given = {"parameters": {"w": 2}, "inputs": {"F": 0.3}}
    np.testing.assert_array_equal(again(rhs)(0.1, [0.2, 0.3], **given), rhs(0.1, [0.2, 0.3], **given))
    assert again(rhs).names == rhs.names
    matrix = mbs.compile(mbs.mass_matrix(system), backend=backend)
    np.testing.assert_array_equal(again(matrix)(0.1, [0.2], [0.3]), matrix(0.1, [0.2], [0.3]))


# --- what a pickle holds -------------------------------------------------------------------------------------------


@backends
def test_a_pickle_holds_no_code_and_no_place_of_any(backend: Any) -> None:
    system = mbs.loads(SYSTEM)
    for value in (mbs.compile(mbs.state_derivative(system), backend=backend), mbs.simulate(system, backend=backend)):
        written = pickle.dumps(value)
        assert str(cache.folder()).encode() not in written
        assert b"ELF" not in written
        assert b"def mbs_" not in written
        assert not called(written) & {"ctypes", "types", "marshal", "importlib", "builtins eval", "builtins exec"}


def called(written: bytes) -> set[str]:
    """Return the modules whose names a pickle asks for, and what it asks of `builtins`."""
    names = [str(argument) for code, argument, _ in pickletools.genops(io.BytesIO(written)) if "UNICODE" in code.name]
    return {name.partition(".")[0] for name in names} | {f"builtins {name}" for name in names}


def test_a_trajectory_is_read_where_nothing_can_be_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    written = pickle.dumps(mbs.simulate(mbs.loads(SYSTEM), backend="c"))

    def no(*_: object, **__: object) -> None:
        raise AssertionError("reading samples compiles nothing")

    monkeypatch.setattr("multibody_sym.motion.prepare.problem.compile_mechanism", no)
    monkeypatch.setattr("multibody_sym.program.loading.load_c", no)
    back = pickle.loads(written)
    assert back["theta"].shape == (11,)
    assert back.statistics["backend"] == "c"


def test_code_that_the_cache_has_is_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rhs = mbs.compile(mbs.state_derivative(mbs.loads(SYSTEM)), backend="c")

    def no(*_: object, **__: object) -> None:
        raise AssertionError("the cache has the library")

    monkeypatch.setattr("multibody_sym.program.loading.build_library", no)
    monkeypatch.setattr("multibody_sym.dynamics.programs.system.programs", no)
    np.testing.assert_array_equal(pickled(rhs)(0.1, [0.2, 0.3]), rhs(0.1, [0.2, 0.3]))


_OTHER = """
import pickle, sys
import numpy as np
rhs, run, state = pickle.load(sys.stdin.buffer)
pickle.dump((rhs(0.1, state), run["pull"], rhs.ready.compiled["inputs"].__class__.__name__), sys.stdout.buffer)
"""


@pytest.mark.parametrize("backend", ["python", pytest.param("c", marks=pytest.mark.long)])
def test_a_process_with_an_empty_cache_makes_the_code_again(
    backend: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system = mbs.loads(SYSTEM)
    rhs, run = mbs.compile(mbs.state_derivative(system), backend=backend), mbs.simulate(system, backend=backend)
    written, state = pickle.dumps((rhs, run, [0.2, 0.3])), [0.2, 0.3]
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    done = subprocess.run([sys.executable, "-c", _OTHER], input=written, capture_output=True, check=True)
    rates, pull, kind = pickle.loads(done.stdout)
    np.testing.assert_array_equal(rates, rhs(0.1, state))
    np.testing.assert_array_equal(pull, run["pull"])
    assert kind == {"c": "NativeFunction", "python": "PythonFunction"}[backend]
    assert list((tmp_path / "multibody_sym").glob({"c": "*.so", "python": "*.py"}[backend]))


def test_records_of_every_method_come_back() -> None:
    for name in SUMMARIES:
        method = METHODS[name]
        back = pickled(method)
        assert (type(back), back.name, back.order) == (type(method), method.name, method.order)
        assert vars(back).keys() == vars(method).keys()


@pytest.mark.parametrize(("name", "coordinates"), [("four_bar", "relative"), ("pendulum", "absolute")])
def test_a_run_with_rows_comes_back_with_its_multipliers(name: str, coordinates: str) -> None:
    model = mbs.load(EXAMPLES / f"{name}.yaml")
    run = mbs.simulate(model, t_end=0.05, coordinates=coordinates)
    back = pickled(run)
    assert back.redundancy == run.redundancy
    assert back.events == run.events
    for name, values in run.multipliers.items():
        np.testing.assert_array_equal(back.multipliers[name], values)
