"""What tells one `reduce` from another: all that it holds, the same in every process."""

from __future__ import annotations

import functools
import subprocess
import sys
import threading
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.errors import InputError
from multibody_sym.studies.functions import UntoldError, told

FACTORY = """
import functools, math, re
import numpy as np
K = {k}
def deeper(x): return math.sin(x)*K
def helper(x): return deeper(x)
@functools.lru_cache
def cached(x): return x + K
class Held:
    __slots__ = ("c", "me")
    def __init__(self, c): self.c, self.me = c, self
    def __call__(self, run): return {{"a": self.c}}
    def method(self, run): return {{"a": 1}}
class Child(dict):
    def __call__(self, run): return self.scaled(run)
    def scaled(self, run): return {{"a": self["c"]*K}}
def closure(c):
    def inner(run): return {{"a": c}}
    return lambda run: inner(run)
def plain(c, run): return {{"a": c}}
def default(c): return lambda run, c=c: {{"a": c}}
def keyword(c): return lambda run, *, c=c: {{"a": c}}
def unmade(c):
    def inner(run): return later
    return inner
    later = c
def made(c):
    return {{
        "closure": closure(c), "object": Held(c), "partial": functools.partial(plain, c), "default": default(c),
        "keyword": keyword(c), "array": closure(np.full(3, c)), "set": closure({{"a", "b", "cd", c}}),
        "method": Held(c).method, "child": Child(c=c), "nested": closure([{{"x": (c, plain)}}]),
        "named": functools.partial(plain, c=c), "pattern": closure(re.compile(f"a{{c}}")),
        "objects": closure(np.array([c, "x"], dtype=object)),
    }}
def by_globals():
    return {{"global": lambda run: {{"a": helper(1)}}, "cached": lambda run: cached(1), "child": Child(c=1)}}
"""


@pytest.fixture
def module(tmp_path: Path) -> Callable[[int], dict[str, Any]]:
    """Return a function that gives a module of somebody's own, with another value of K."""

    def made(k: int) -> dict[str, Any]:
        file = tmp_path / f"own_{k}.py"
        file.write_text(FACTORY.format(k=k))
        spec = spec_from_file_location("own", file)
        assert spec is not None
        assert spec.loader is not None
        found = module_from_spec(spec)
        spec.loader.exec_module(found)
        return vars(found)

    return made


def test_functions_that_hold_other_values_are_others(module: Callable[[int], dict[str, Any]]) -> None:
    made = module(1)["made"]
    one, same, two = ({name: told(each) for name, each in made(c).items()} for c in (1, 1, 2))
    assert one == same
    assert not [name for name in one if one[name] == two[name]]
    assert len(set(one.values())) == len(one)


def test_functions_whose_globals_have_other_values_are_others(module: Callable[[int], dict[str, Any]]) -> None:
    one, same, two = ({name: told(f) for name, f in module(k)["by_globals"]().items()} for k in (1, 1, 2))
    assert one == same
    assert not [name for name in one if one[name] == two[name]]
    assert told(module(1)["unmade"](1))


def test_another_process_tells_the_same() -> None:
    """Sets have another order there, and things other addresses."""
    script = f"{FACTORY.format(k=1)}\nfrom multibody_sym.studies.functions import told\n"
    script += "print(*(told(f) for f in (*made(1).values(), *by_globals().values())))"
    start = [sys.executable, "-c", script]
    found = [subprocess.run(start, capture_output=True, text=True, check=True).stdout for _ in range(2)]
    assert found[0] == found[1]
    assert len(found[0].split()) == 16


@pytest.mark.parametrize("held", [threading.Lock(), (x for x in "ab"), [iter([1])], sys.stderr])
def test_what_cannot_be_told_is_said(held: Any) -> None:
    if isinstance(held, list):
        assert told(lambda run: held)
        return
    with pytest.raises(UntoldError, match="object of type"):
        told(lambda run: held)


def deep(count: int) -> list[Any]:
    return functools.reduce(lambda inner, _: [inner], range(count), [])


def test_what_is_too_deep_or_too_much_is_said() -> None:
    with pytest.raises(UntoldError, match="too deeply"):
        told(functools.partial(lambda x, run: x, deep(100_000)))
    with pytest.raises(UntoldError, match="more than"):
        told(functools.partial(lambda x, run: x, [[k] for k in range(200_000)]))


SYSTEM = """
multibody_sym: 1
name: falling
bodies: {b: {mass: 1}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {u: 1}}}
simulation: {t_end: 1, samples: 2}
"""


def stopped(done: int, total: int) -> None:
    if done > 1:
        raise KeyboardInterrupt


def interrupted(reduce: Callable[..., Any], out: Path) -> str:
    """Return what is told of a study that is interrupted after two of its runs."""
    with pytest.raises(KeyboardInterrupt) as told_of:
        mbs.sweep(mbs.loads(SYSTEM), {"x": (1, 2, 6)}, reduce=reduce, output=out, workers=1, on_progress=stopped)
    return str(told_of.value)


def constant(value: float, lock: Any = None) -> Callable[[Any], dict[str, float]]:
    def reduce(_: Any) -> dict[str, float]:
        assert lock is None or lock.acquire(blocking=False)
        if lock is not None:
            lock.release()
        return {"a": value}

    return reduce


def test_a_table_has_no_rows_of_two_functions(tmp_path: Path) -> None:
    out, system, vary = tmp_path / "o.csv", mbs.loads(SYSTEM), {"x": (1, 2, 6)}
    assert "the same call goes on" in interrupted(constant(1.0), out)
    with pytest.raises(InputError, match=r"another study.*reduce"):
        mbs.sweep(system, vary, reduce=constant(2.0), output=out)
    study = mbs.sweep(system, vary, reduce=constant(1.0), output=out)
    assert study.computed < 6
    assert study["a"].tolist() == [1.0] * 6


def test_a_function_that_cannot_be_told_keeps_no_rows(tmp_path: Path) -> None:
    out, lock = tmp_path / "o.csv", threading.Lock()
    assert "no run is kept: reduce holds an object of type _thread.lock" in interrupted(constant(1.0, lock), out)
    assert list(tmp_path.iterdir()) == []
    found = mbs.sweep(mbs.loads(SYSTEM), {"x": (1, 2, 6)}, reduce=constant(2.0, lock), output=out)
    assert (found.computed, found["a"].tolist()) == (6, [2.0] * 6)
