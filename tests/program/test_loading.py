"""Loaded programs: called, mapped, taken from the cache, rebuilt when damaged, remembered for a warm start."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hand_models import DOUBLE_PENDULUM, OSCILLATOR, planar_pendulum

from multibody_sym.errors import OutputError
from multibody_sym.program import cache, loading
from multibody_sym.program.backend import Native
from multibody_sym.program.loading import FallbackNotice, load, load_c, load_python, recall, remember
from multibody_sym.program.native import Signature
from multibody_sym.program.program import interpret
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import log, sin, sqrt
from multibody_sym.scalars.node import as_node

IN_PYTHON = """
def state_derivative(t, q, u, parameters, inputs, modes):
    return [u[0]], [-parameters[0]*parameters[0]*q[0]], [], [0.0, 0.0, 0.0]

PROGRAMS = {"state_derivative": state_derivative}
"""


@pytest.fixture
def fresh(tmp_path, monkeypatch, runtime):
    """A cache with nothing in it but the compiled runtime, which all models share."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for file in runtime:
        shutil.copy2(file, cache.folder())
    return tmp_path / "multibody_sym"


@pytest.fixture(params=["c", "python"])
def oscillator(request):
    if request.param == "c":
        return OSCILLATOR.load()
    return load_python(OSCILLATOR.signatures(), "hand", lambda: IN_PYTHON)


def no_sources():
    raise AssertionError("the source was printed although the cache has the library")


# --- calls ---------------------------------------------------------------------------------------------------------


def test_a_program_is_a_function_of_arrays(oscillator):
    qdot, udot, multipliers, report = oscillator["state_derivative"](0.0, [3.0], [5.0], [2.0], [], [])
    assert (qdot.tolist(), udot.tolist(), multipliers.shape, report.tolist()) == ([5.0], [-12.0], (0,), [0, 0, 0])
    assert "state_derivative" in oscillator
    assert "energy" not in oscillator


def test_arrays_need_not_be_contiguous(oscillator):
    wide = np.arange(6.0).reshape(3, 2)
    assert oscillator["state_derivative"](0, wide[1:2, 1], wide[2:, 0], np.array([1]), [], [])[1] == -3.0


def test_map_stacks_what_changes_and_keeps_what_does_not(oscillator):
    q, u, t = np.arange(4.0)[:, None], -np.arange(4.0)[:, None], np.linspace(0, 1, 4)
    qdot, udot, multipliers, report = oscillator.map("state_derivative", t, q, u, [2.0], [], [])
    np.testing.assert_array_equal(qdot, u)
    np.testing.assert_array_equal(udot, -4 * q)
    assert (multipliers.shape, report.shape) == ((4, 0), (4, 3))


def test_map_agrees_with_calls_for_several_inputs():
    compiled, rng = planar_pendulum().load(), np.random.default_rng(1)
    q, u = rng.standard_normal((2, 50, 2))
    parameters = rng.uniform(1, 2, (50, 4))
    mapped = compiled.map("state_derivative", 0.0, q, u, parameters, [], [])
    for sample in range(50):
        one = compiled["state_derivative"](0.0, q[sample], u[sample], parameters[sample], [], [])
        for a, b in zip(one, mapped, strict=True):
            np.testing.assert_array_equal(a, b[sample])


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ((0.0, [1.0], [1.0], [1.0], []), r"takes 6 arrays \(t, q, u, parameters, inputs, modes\), not 5"),
        ((0.0, [1.0, 2.0], [1.0], [1.0], [], []), r"state_derivative: q has the shape \(2,\), not \(1,\)"),
        (([0.0], [1.0], [1.0], [1.0], [], []), r"t has the shape \(1,\), not \(\)"),
    ],
)
def test_arrays_of_another_shape_are_refused(oscillator, arrays, message):
    with pytest.raises(ValueError, match=message):
        oscillator["state_derivative"](*arrays)


def test_map_refuses_different_numbers_of_samples(oscillator):
    with pytest.raises(ValueError, match=r"\[3, 4\] samples"):
        oscillator.map("state_derivative", np.zeros(3), np.zeros((4, 1)), [0.0], [1.0], [], [])
    with pytest.raises(ValueError, match=r"\[\] samples"):
        oscillator.map("state_derivative", 0.0, [0.0], [0.0], [1.0], [], [])
    with pytest.raises(ValueError, match="q has the shape"):
        oscillator.map("state_derivative", np.zeros(3), np.zeros((3, 2)), [0.0], [1.0], [], [])


def test_a_signature_survives_json():
    import json

    for signature in planar_pendulum().signatures():
        assert Signature.from_json(json.loads(json.dumps(signature.as_json()))) == signature


# --- the cache -----------------------------------------------------------------------------------------------------


def test_a_warm_start_neither_prints_nor_starts_anything(fresh, monkeypatch):
    cold = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    monkeypatch.setattr(subprocess, "Popen", no_sources)
    warm = load_c(OSCILLATOR.signatures(), "key", no_sources)
    assert warm.path == cold.path
    assert warm["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0


def test_another_key_with_the_same_source_is_not_compiled_again(fresh, monkeypatch):
    cold = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    libraries = sorted(fresh.glob("*.so"))
    assert load_c(OSCILLATOR.signatures(), "another", OSCILLATOR.sources).path == cold.path
    assert sorted(fresh.glob("*.so")) == libraries


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A cache with the oscillator in it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("filled")))
        load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
        yield cache.folder()


@pytest.fixture(scope="module")
def runtime(filled):
    """The files of the cache that hold the compiled runtime."""
    objects = list(filled.glob("*.o"))
    return [*objects, *(key for key in filled.glob("*.json") if any(o.name in key.read_text() for o in objects))]


def truncated(data):
    return data[: len(data) // 2]


def garbage(_):
    return b"garbage"


def emptied(_):
    return b""


@pytest.mark.parametrize(
    ("pattern", "damage"), [("*.so", truncated), ("*.json", garbage), ("*.o", emptied), ("*", truncated)]
)  # every damage to either kind of file: test_cache
def test_a_damaged_cache_is_rebuilt(fresh, filled, pattern, damage):
    # files that this process has not loaded: those it has, the system does not read again
    shutil.copytree(filled, fresh, dirs_exist_ok=True)
    damaged = list(fresh.glob(pattern))
    for file in damaged:
        file.write_bytes(damage(file.read_bytes()))
    assert damaged
    again = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    assert again["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0


def test_a_key_that_leads_to_something_else_is_rebuilt(fresh):
    load_c(DOUBLE_PENDULUM.signatures(), "key", DOUBLE_PENDULUM.sources)
    right = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    assert right["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0
    for file in fresh.glob("*.json"):
        file.unlink()
    origin = cache.digest("c", "key", loading.find_compiler().identity, cache.toolkit())
    cache.store(origin, cache.keep(b"no library", "somewhere", ".so"), {})
    right = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    assert right["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0


def test_generated_python_is_a_checked_file_of_the_cache(fresh):
    cold = load_python(OSCILLATOR.signatures(), "key", lambda: IN_PYTHON)
    assert cold.path.parent == fresh
    assert load_python(OSCILLATOR.signatures(), "key", no_sources).path == cold.path
    cold.path.write_text(IN_PYTHON + "raise SystemExit('changed')\n")
    again = load_python(OSCILLATOR.signatures(), "key", lambda: IN_PYTHON)
    assert again["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0
    assert not list(fresh.rglob("*.pyc"))
    with pytest.raises(ValueError, match="no program energy"):
        load_python([Signature("energy", (), ())], "another key", lambda: IN_PYTHON)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_recall_gives_programs_and_metadata(fresh, monkeypatch, backend):
    if backend == "c":
        compiled = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    else:
        compiled = load_python(OSCILLATOR.signatures(), "key", lambda: IN_PYTHON)
    remember("system 1", compiled, {"coordinates": ["theta"], "value": 0.1})
    monkeypatch.setattr(subprocess, "Popen", no_sources)
    found = recall("system 1", Native(backend=backend))
    assert found.metadata == {"coordinates": ["theta"], "value": 0.1}
    assert found.compiled["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0
    assert recall("system 2", Native(backend=backend)) is None
    assert recall("system 1", Native(backend="python" if backend == "c" else "c")) is None
    assert recall("system 1", Native(True, backend)) is None or backend == "python"
    monkeypatch.setattr(cache, "toolkit", lambda: "another version")
    assert recall("system 1", Native(backend=backend)) is None


OLD_FORMATS = {
    "truncated": lambda body: body[: len(body) // 2],
    "no text": lambda _: b"\xff\xfe\x00",
    "a list": lambda _: b"[1, 2]",
    "nothing": lambda _: b"null",
    "no file": lambda _: b'{"metadata": {}}',
    "a file that is no name": lambda _: b'{"file": 3, "metadata": {}}',
    "a folder": lambda _: b'{"file": ".", "metadata": {}}',
    "a file that is gone": lambda body: body.replace(b'"file": "', b'"file": "0'),
    "metadata that are no map": lambda body: body.replace(b'"metadata": {', b'"metadata": 1, "old": {'),
    "no programs": lambda body: body.replace(b'"programs"', b'"functions"'),
    "programs by number": lambda body: body.replace(b'"programs": [', b'"programs": [1, '),
    "another kind of signature": lambda body: body.replace(b'"inputs"', b'"arguments"'),
}


@pytest.mark.parametrize("checked", [True, False], ids=["with its checksum", "without"])
@pytest.mark.parametrize("written", OLD_FORMATS.values(), ids=OLD_FORMATS)
def test_an_entry_in_the_format_of_another_version_is_replaced(fresh, written, checked):
    first = load_python(OSCILLATOR.signatures(), "key", lambda: IN_PYTHON)
    remember("system", first, {"a": 1})
    version = cache.toolkit()
    keys = [cache.digest("python", "key", version), cache.digest("recall", "system", "python", version)]
    for key in keys:
        file = fresh / cache._key_name(key)
        _, _, body = file.read_bytes().partition(b"\n")
        changed = written(body)
        file.write_bytes((cache.digest(key, changed).encode() + b"\n" if checked else b"") + changed)
    assert recall("system", Native(backend="python")) is None
    again = load_python(OSCILLATOR.signatures(), "key", lambda: IN_PYTHON)
    assert again["state_derivative"](0, [1], [0], [3], [], [])[1] == -9.0
    remember("system", again, {"a": 2})
    assert recall("system", Native(backend="python")).metadata == {"a": 2}


def test_a_warm_start_imports_nothing_heavy(fresh, monkeypatch):
    monkeypatch.setattr(cache, "toolkit", lambda: "this version")  # whatever is being edited meanwhile
    compiled = load_c(OSCILLATOR.signatures(), "key", OSCILLATOR.sources)
    remember("system", compiled, {})
    code = (
        "import sys, numpy as np\n"
        "from multibody_sym.motion.methods.table import METHODS\n"
        "from multibody_sym.program import cache\n"
        "from multibody_sym.program.loading import recall\n"
        "from multibody_sym.motion.loop.problem import NO_MODE, Problem\n"
        "from multibody_sym.motion.loop.integrate import integrate\n"
        "cache.toolkit = lambda: 'this version'\n"
        "one = np.ones(1)\n"
        "compiled = recall('system').compiled\n"
        "run = integrate(Problem(compiled, METHODS['dormand_prince'], 0.0, 1.0, one, one, one, NO_MODE))\n"
        "print(run.q[-1, 0], {'sympy', 'scipy', 'jinja2', 'matplotlib', 'pyarrow', 'yaml'} & set(sys.modules))\n"
        "print(sorted(m.rpartition('.')[2] for m in sys.modules if m.startswith('multibody_sym.program.')))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    run = subprocess.run([sys.executable, "-c", code], env=environment, stdout=subprocess.PIPE, text=True, check=True)
    first, second = run.stdout.splitlines()
    assert float(first.split()[0]) == pytest.approx(np.cos(1) + np.sin(1), abs=1e-7)
    assert first.split(" ", 1)[1] == "set()"
    assert second == "['backend', 'cache', 'loading', 'native', 'runtime_constants']"


# --- Programs ------------------------------------------------------------------------------------------------------


def small_program(name="state_derivative", factor=2):
    trace = Trace(name, [Array("t"), Array("q", (2,)), Array("parameters", (1,))])
    (t,), (x, y), (p,) = trace["t"], trace["q"], trace["parameters"]
    found = trace.solve([[x, y], [y, factor * x]], [sin(p * t), as_node(1)])
    return trace.finish({"solution": ((2,), found.solution), "energy": ((), (x * x + y * p,))})


@pytest.fixture
def unseen(monkeypatch):
    """Forget which notices were given."""
    loading._warn_once.cache_clear()


@pytest.mark.parametrize("backend", ["c", "python"])
def test_programs_give_what_the_interpreter_gives(fresh, backend):
    program = small_program()
    compiled = load({"state_derivative": program}, Native(backend=backend))
    arrays = (0.3, [1.5, -0.7], [1.1])
    assert compiled.backend == backend
    for found, wanted in zip(compiled["state_derivative"](*arrays), interpret(program, *arrays), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-15)
        assert found.shape == wanted.shape


@pytest.mark.parametrize("backend", ["c", "python"])
def test_programs_are_printed_once(fresh, monkeypatch, backend):
    programs = {"one": small_program("one"), "other": small_program("other", 3)}
    cold = load(programs, Native(backend=backend))
    printer = "c_target.c_source" if backend == "c" else "list_target.python_source"
    monkeypatch.setattr(f"multibody_sym.program.{printer}", no_sources)
    monkeypatch.setattr(subprocess, "Popen", no_sources)
    assert load(programs, Native(backend=backend)).path == cold.path


@pytest.mark.parametrize("way", ["no compiler", "failing", "hanging", "no library"])
def test_without_c_python_takes_over_with_one_notice(fresh, monkeypatch, tmp_path, unseen, way):
    to_last = 'while [ "$1" ]; do out="$1"; shift; done; echo > "$out"'
    scripts = {"failing": "exit 1", "hanging": "sleep 9", "no library": to_last}
    if way == "no compiler":
        monkeypatch.setenv("PATH", str(tmp_path))
        monkeypatch.delenv("CC", raising=False)
    else:
        (tmp_path / "cc").write_text(f'#!/bin/sh\n[ "$1" = --version ] && exit 0\n{scripts[way]}\n')
        (tmp_path / "cc").chmod(0o755)
        monkeypatch.setenv("CC", str(tmp_path / "cc"))
        monkeypatch.setattr(loading, "_SECONDS", 0.2)
        monkeypatch.setattr(loading, "_BYTES_PER_SECOND", 1e9)
    programs = {"state_derivative": small_program()}
    with pytest.warns(FallbackNotice, match="runs as Python") as given:
        compiled, again = load(programs), load(programs)
    assert len(given) == 1
    assert compiled.backend == "python"
    assert compiled.notice == again.notice
    assert compiled["state_derivative"](0.0, [1, 2], [3])[1] == 7.0
    with pytest.raises(OutputError, match="C is not available"):
        load(programs, Native(backend="c"))


def test_python_asked_for_gives_no_notice(fresh, recwarn):
    compiled = load({"state_derivative": small_program()}, Native(backend="python"))
    assert compiled.notice is None
    assert not recwarn.list


def test_a_recalled_fallback_gives_its_notice(fresh, monkeypatch, unseen):
    remember("system", load({"state_derivative": small_program()}, Native(backend="python")), {})
    monkeypatch.setenv("CC", "/no/compiler")
    with pytest.warns(FallbackNotice):
        found = recall("system")
    assert found.compiled.backend == "python"
    assert "no C compiler" in found.compiled.notice


def test_code_that_cannot_be_written_anywhere_is_an_output_error(fresh, monkeypatch, unseen):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OutputError, match="No space left"):
        load({"state_derivative": small_program()})


def test_what_has_no_value_is_nan_in_both_languages(fresh):
    trace = Trace("state_derivative", [Array("q", (2,))])
    x, y = trace["q"]
    program = trace.finish({"values": ((3,), (x / y, log(x), sqrt(x)))})
    for backend in ("c", "python"):
        (values,) = load({"state_derivative": program}, Native(backend=backend))["state_derivative"]([-1.0, 0.0])
        assert not np.isfinite(values).any(), backend
