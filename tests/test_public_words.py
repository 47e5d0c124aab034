"""Every public callable, method and property has words and types; wrong arguments meet errors that the words name."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from public_calls import MODEL, Call, calls

import multibody_sym as mbs
from multibody_sym.model.fields import Element

WRONG: list[Any] = [
    None, object(), "no such name", "", float("nan"), float("inf"), -1, 2.5, 1j, [], {}, [1, 2, 3], ["x"], {"x": 1},
    {1: 2}, np.array([]), np.array(["x"]), np.zeros((2, 2)), b"x", len, 10**400,
]  # fmt: skip
GIVEN: Mapping[str, Any] = {
    "t": 0.0, "x": [0.1, 0.2], "q": [0.1], "u": [0.1], "p": [0.1], "by": "q", "s": 1j, "dt": 0.1, "output": "theta",
    "input": "F", "expression": 0, "weights": {"udot": [1.0]}, "rates": {"q": [1.0]}, "parameters": {"m": [1.0]},
    "initial": {"theta": [0.1]}, "state": None, "ending": ".svg", "path": "drawn.svg", "results": None, "name": "theta",
    "units": "deg", "K": [[1.0, 1.0]],
}  # fmt: skip
"""A value for each parameter without a default."""
ASKED = ("__call__", "__getitem__")
CODE = (property, cached_property, classmethod, staticmethod, type(lambda: 0))


@pytest.fixture(scope="module")
def results() -> Mapping[str, Any]:
    """One object of each class that public functions return."""
    system, code = mbs.loads(MODEL), {"backend": "python"}
    still = mbs.loads(MODEL.replace("q: 30 deg", "q: 0").replace("T*sin(t)", "0"))
    run, near = mbs.simulate(system, **code), mbs.linearize(still, at={"theta": 0})
    struck = replace(system, impact=mbs.Impact(impulse=[1, 0, 0], at="bob"))
    rates = mbs.function(system, "state_derivative", **code)
    found = [
        run, run([0.01, 0.02]), run.table(), mbs.sweep(system, {"m": [1, 2]}, **code), mbs.prepare(system, **code),
        mbs.prepare(system, **code).stepper(0.01), near, near.discrete(0.1), rates, rates.ode(), rates.derivative("q"),
        mbs.compile(mbs.state_derivative(system), **code), mbs.compile(mbs.canonical_equations(system), **code),
        mbs.compile(mbs.impact(struck), **code), mbs.bode(still, [1.0], at={"theta": 0}), mbs.solve(system),
        mbs.trim(still, at={"theta": 0}, unknown="F"), mbs.modes(still, at={"theta": 0}), mbs.equilibrium(still),
        mbs.range_of_rest(still, vary="m"), mbs.derive(system), mbs.derive(system, "hamilton"), mbs.check(system),
        mbs.draw(system), mbs.animate(run), mbs.report(system), *mbs.conserved_quantities(still)[:1],
        mbs.inverse_kinematics(system, frame="bob", position=[0, 0, 0]), mbs.base_parameters(system),
        mbs.period_multipliers(still, 0.1, at="equilibrium"), mbs.prepare(system, **code).stepper(0.01).state,
    ]  # fmt: skip
    return {f"{type(each).__name__} {k}": each for k, each in enumerate(found)}


def members(cls: type[Any]) -> Iterator[tuple[str, Any]]:
    """Yield the public members of a class that this package declares, and its calls."""
    for base in cls.__mro__:
        if base.__module__.startswith("multibody_sym") and not issubclass(base, Element):  # these have fields alone
            yield from ((n, x) for n, x in vars(base).items() if not n.startswith("_") or n in ASKED)


def takes_arguments(function: Any) -> bool:
    return inspect.isfunction(function) and len(inspect.signature(function).parameters) > 1


def is_typed(function: Any) -> bool:
    """Return whether each parameter has a type, and what is returned."""
    signature = inspect.signature(function)
    typed = (p.annotation is not p.empty for p in signature.parameters.values() if p.name != "self")
    return all(typed) and signature.return_annotation is not signature.empty


def test_all_have_words_and_types(results: Mapping[str, Any]) -> None:
    public = [getattr(mbs, name) for name in mbs.__all__]
    classes = {*(x for x in public if isinstance(x, type)), *map(type, results.values())}
    lacking, seen = [], 0
    for function in (x for x in public if inspect.isfunction(x)):
        lacking += [function.__name__] if not inspect.getdoc(function) or not is_typed(function) else []
        seen += 1
    for cls in classes:
        in_help = {n: x for n, x in inspect.getmembers_static(cls) if isinstance(x, CODE) and not n.startswith("_")}
        lacking += [f"{cls.__name__}.{name}" for name in in_help if not inspect.getdoc(getattr(cls, name))]
        lacking += [] if (cls.__doc__ or "").strip() else [cls.__name__]
        for name, x in members(cls):
            read = x.fget if isinstance(x, property) else x.func if isinstance(x, cached_property) else x
            if inspect.isfunction(read):
                seen += 1
                lacking += [] if inspect.getdoc(read) and is_typed(read) else [f"{cls.__name__}.{name}"]
    assert lacking == []
    assert seen > 250


def methods(results: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield name, object and function of each public method that takes arguments, once a class."""
    seen = set()
    for told, x in results.items():
        for name, function in members(type(x)):
            if takes_arguments(function) and function not in seen:
                seen.add(function)
                yield f"{told}.{name}", x, function


def test_methods_say_which_arguments_do_not_fit(results: Mapping[str, Any]) -> None:
    count = 0
    for name, x, function in methods(results):
        if name.rpartition(".")[2].startswith("__getitem"):  # run[name] takes no names of arguments
            continue
        with pytest.raises(mbs.InputError, match=r"has no argument 'no_such'|is given|is missing|takes"):
            function(x, no_such=1)
        count += 1
    assert count > 35


def attempts(results: Mapping[str, Any]) -> Iterator[Call]:
    """Yield the methods as calls with arguments that are taken."""
    for name, x, function in methods(results):
        kinds = list(inspect.signature(function).parameters.values())[1:]
        plain = [p for p in kinds if p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
        given = {p.name: GIVEN.get(p.name) if p.default is p.empty else p.default for p in plain}
        yield Call(name, function.__get__(x), given)


def complaint(call: Call, name: str, value: Any) -> str:
    """Return what is wrong about the answer to a wrong argument, empty where it is taken, or refused in words."""
    try:
        answer = call({**call.given, name: value})
        if inspect.isgenerator(answer):
            list(answer)
    except mbs.MultibodyError as error:
        if not error.message.strip():
            return "an empty message"
        words = inspect.getdoc(call.function) or ""
        named = any(f"{cls.__name__}" in words for cls in type(error).__mro__ if issubclass(cls, mbs.MultibodyError))
        return "" if named and "raises" in words.lower() else f"{type(error).__name__} is not in its words"
    except Exception as error:
        return f"{type(error).__name__}: {error}"[:100]
    return ""


def test_wrong_arguments_of_methods(
    results: Mapping[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = Counter[str]()
    for call in attempts(results):
        for name in call.given:
            for value in WRONG if name != "on_progress" else WRONG[:3]:  # what is called raises what it likes
                found[f"{call.name}({name}): {complaint(call, name, value)}"] += 1
    wrong = [text for text in found if not text.endswith(": ")]
    assert wrong == []
    assert found.total() > 1500


def test_wrong_arguments_of_functions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    found = Counter[str]()
    for call in calls(tmp_path):
        of_operator = call.name.startswith("t ")  # between numbers and others it raises what Python does
        for name in call.given if not of_operator else ():
            for value in WRONG[:: 1 if inspect.isroutine(call.function) and not call.slow else 4]:
                if name != "backend" or value is not None:  # that is C
                    told = complaint(call, name, value)
                    of_record = "is not in its words" in told and not inspect.isroutine(call.function)
                    found[f"{call.name}({name}): {'' if of_record else told}"] += 1
    assert [text for text in found if not text.endswith(": ")] == []
    assert found.total() > 4000
