"""What does something else for each kind of row, load, step, force, constraint or statement raises for a foreign one.

Where a new kind is forgotten, an error says so; nothing goes on as if it were another one.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from types import SimpleNamespace
from typing import Any, get_args

import pytest

import multibody_sym as mbs
from multibody_sym.analysis.check import _cancellation
from multibody_sym.mechanics.alignment import _in_axes
from multibody_sym.mechanics.energy import stored_energy
from multibody_sym.mechanics.load_records import JointForce, Load
from multibody_sym.mechanics.references import _vectors_and_axes
from multibody_sym.mechanics.row_records import AngleRow, ContactRow, DistanceRow, PositionRow, Row
from multibody_sym.model.constraints import CONSTRAINTS
from multibody_sym.model.fields import Element, Point, Text, Vector, holds
from multibody_sym.model.forces import FORCES
from multibody_sym.model.steps import Step
from multibody_sym.program.program import operation_count, verify
from multibody_sym.program.statements import Array, Statement, callees, operands, targets
from multibody_sym.program.trace import fold_input
from multibody_sym.scalars.node import ONE, ZERO


def kinds_of(base: type) -> Iterator[type]:
    """Yield the classes below `base` that stand for something: those of which there can be one."""
    for cls in base.__subclasses__():
        if not inspect.isabstract(cls) and cls.__module__.startswith("multibody_sym."):
            yield cls
        yield from kinds_of(cls)


FAMILIES: dict[str, set[type]] = {
    "rows": set(kinds_of(Row)),
    "loads": set(kinds_of(Load)),
    "steps": set(kinds_of(Step)),
    "forces": set(FORCES.table.values()),
    "constraints": set(CONSTRAINTS.table.values()),
    "statements": set(get_args(Statement)),
}


class Foreign:
    """Of no kind that is known."""


@cache
def dispatchers() -> dict[str, Any]:
    """Return every function of the package that does something else for each class of its first argument."""
    found = {}
    for module in pkgutil.walk_packages(mbs.__path__, "multibody_sym."):
        if not module.name.endswith("__main__"):
            for name, x in vars(importlib.import_module(module.name)).items():
                if hasattr(x, "registry") and hasattr(x, "dispatch") and x.__module__ == module.name:
                    found[f"{module.name}.{name}"] = x
    return found


def answer(function: Any, *arguments: Any) -> Any:
    """Call a function with as many further arguments as it takes."""
    count = len(inspect.signature(function).parameters) - len(arguments)
    return function(*arguments, *[None] * count)


def test_there_are_such_functions() -> None:
    assert len(dispatchers()) >= 18
    least = {"rows": 8, "loads": 7, "steps": 4, "forces": 7, "constraints": 10, "statements": 4}
    assert all(len(FAMILIES[name]) >= count for name, count in least.items())


def test_each_raises_for_a_foreign_kind() -> None:
    for name, function in dispatchers().items():
        with pytest.raises(TypeError, match=r"Foreign"):
            pytest.fail(f"{name} took it for {answer(function, Foreign())!r}")


def test_each_handles_every_kind_of_a_family_that_it_has_a_rule_for() -> None:
    """One rule for a class serves what is below it; what a base answers, such as 0 for what is no spring, it answers
    for those only that say so."""
    by_question = {stored_energy, _in_axes, _vectors_and_axes}  # these ask, and raise below
    for name, function in dispatchers().items():
        known = set(function.registry) - {object}
        for family, kinds in FAMILIES.items():
            if function not in by_question and known & kinds and not name.endswith("_is_passed"):
                missing = {kind.__name__ for kind in kinds if function.dispatch(kind) is function.dispatch(object)}
                assert not missing, (name, family)


@pytest.mark.parametrize("family", ["rows", "loads"])
def test_a_kind_that_leaves_a_question_open_is_refused(family: str) -> None:
    base = Row if family == "rows" else Load

    @dataclass(frozen=True)
    class Half(base):  # type: ignore[misc, valid-type]
        """It has a name."""

    with pytest.raises(TypeError, match="abstract") as caught:
        Half("half")
    assert "points" in str(caught.value)


class UnknownLoad(JointForce):
    """A load that says it is a spring."""

    @property
    def spring(self) -> Any:
        return ONE, ZERO


class Pushed(JointForce):
    """A load that says it is given along the axes of a body."""

    @property
    def axes_of(self) -> int | None:
        return 0


@dataclass(frozen=True)
class Wind(Element):
    """A force with a direction."""

    direction: Point = holds(Vector())


@dataclass(frozen=True)
class Push(Element):
    """A force without any."""

    on: str = holds(Text())


def test_a_spring_without_a_law_is_told() -> None:
    load = UnknownLoad("s", "J", ZERO, ZERO)
    for function in (stored_energy, lambda load, motion: _cancellation(motion, load)):
        with pytest.raises(TypeError, match=r"nothing says .*UnknownLoad"):
            function(load, None)
    assert stored_energy(JointForce("f", "J", ZERO, ZERO), None) == 0  # type: ignore[arg-type]


def test_what_is_given_along_a_bodys_axes_is_not_left_as_it_is() -> None:
    with pytest.raises(TypeError, match="nothing says how Pushed"):
        _in_axes(Pushed("p", "J", ZERO, ZERO), {})
    plain = JointForce("f", "J", ZERO, ONE)
    assert _in_axes(plain, {}) == plain


def test_a_direction_is_not_taken_for_one_in_the_plane() -> None:
    with pytest.raises(TypeError, match="nothing says which vectors of Wind"):
        _vectors_and_axes(Wind([0, 0, 1]))
    assert _vectors_and_axes(Push("b")) == ((), ())


@pytest.mark.parametrize(
    ("row", "acts"),
    [
        (PositionRow("r", None, (ONE, ZERO, ZERO)), True),  # type: ignore[arg-type]
        (PositionRow("r", None, (ZERO, ZERO, ONE)), False),  # type: ignore[arg-type]
        (AngleRow("r", None, ((ONE, ZERO, ZERO), (ZERO, ONE, ZERO))), True),  # type: ignore[arg-type]
        (AngleRow("r", None, ((ZERO, ZERO, ONE), (ZERO, ONE, ZERO))), False),  # type: ignore[arg-type]
        (ContactRow("r", (), "t1", (ZERO, ZERO, ONE)), False),  # type: ignore[arg-type]
        (ContactRow("r", (), "t2"), False),  # type: ignore[arg-type]
        (ContactRow("r", (), "normal"), True),  # type: ignore[arg-type]
        (DistanceRow("r", None, ONE), True),  # type: ignore[arg-type]
    ],
)
def test_rows_that_act_in_the_plane(row: Row, acts: bool) -> None:
    assert row.acts_in_plane is acts


def holding(statement: Any) -> Any:
    """Return what is like a Program of one statement, which its verifier has not seen."""
    inputs = [Array("q", (0,))]
    return SimpleNamespace(name="p", inputs=inputs, input=lambda name: inputs[0], statements=[statement], outputs=[])


@pytest.mark.parametrize(
    "function",
    [
        operands,
        targets,
        callees,
        lambda statement: verify(holding(statement)),
        lambda statement: operation_count(holding(statement)),
        lambda statement: fold_input(holding(statement), "q", []),
    ],
)
def test_a_foreign_statement_is_told(function: Callable[[Any], Any]) -> None:
    with pytest.raises((AssertionError, KeyError, TypeError), match="Foreign"):
        function(Foreign())
