"""The parameter vector by name: who gives each entry its value, and that nobody reads it by a place of his own."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator

import pytest
from package_trees import nodes

import multibody_sym as mbs
from multibody_sym.mechanics.mechanism import ALPHA, BETA, INDEPENDENT, RopeLength, Source, measured_name


def atwood(**rope: object) -> mbs.System:
    a, b = mbs.Body(mass="m"), mbs.Body(mass="2*m")
    return mbs.System(
        "atwood",
        parameters={"m": "1 kg", "l": "2 m"},
        bodies={"a": a, "b": b, "ground": mbs.Body(points={"top": [0, 1, 0]})},
        joints={"x": mbs.Prismatic("ground", "a", axis="y"), "y": mbs.Prismatic("ground", "b", axis="y")},
        constraints={"rope": mbs.Rope(["a", "ground.top", "b"], **rope)},
    )


def test_entries_say_who_gives_their_values() -> None:
    vector = mbs.mechanism(atwood()).parameters
    assert [(entry.name, entry.source) for entry in vector] == [
        ("m", Source.DECLARED),
        ("l", Source.DECLARED),
        (measured_name("rope", RopeLength("rope")), Source.MEASURED),
        (INDEPENDENT, Source.CHOSEN),
        (ALPHA, Source.CHOSEN),
        (BETA, Source.CHOSEN),
    ]
    assert vector.value(vector.changed([1.0, 2.0, 3.0, 1.0, 0.0, 0.0], {BETA: 5.0}), BETA) == 5.0
    assert vector.independent_rows([1.0, 2.0, 3.0, 1.0, 0.0, 0.0]) == 1


def test_a_rope_with_a_length_measures_nothing_and_a_tree_chooses_nothing() -> None:
    declared = mbs.mechanism(atwood(length="l")).parameters
    assert measured_name("rope", RopeLength("rope")) not in declared.places
    tree = mbs.mechanism(
        mbs.System("tree", bodies={"a": mbs.Body(mass="1 kg")}, joints={"x": mbs.Prismatic("ground", "a", axis="x")})
    ).parameters
    assert len(tree) == 0
    assert tree.independent_rows([]) == 0


@pytest.mark.parametrize("name", [INDEPENDENT, ALPHA, measured_name("rope", RopeLength("rope"))])
def test_what_is_not_declared_cannot_be_given(name: str) -> None:
    with pytest.raises(mbs.InputError, match=name):
        mbs.simulate(atwood(), parameters={name: 1.0}, backend="python")


def subscripts(within: Iterable[ast.AST]) -> Iterator[ast.Subscript]:
    """Yield what takes entries of something called parameters by a number or a slice of numbers."""
    for node in within:
        if isinstance(node, ast.Subscript) and "parameters" in ast.unparse(node.value).rpartition(".")[2]:
            index = node.slice
            bounds = [index.lower, index.upper] if isinstance(index, ast.Slice) else [index]
            if any(isinstance(n, ast.Constant) and isinstance(n.value, int) for b in bounds if b for n in ast.walk(b)):
                yield node


def test_nothing_reads_the_vector_by_position() -> None:
    assert list(subscripts(ast.walk(ast.parse("x.parameters[-3] + parameters[:-2]"))))
    found = [f"{name}:{node.lineno}" for name, within in nodes().items() for node in subscripts(within)]
    assert found == []
