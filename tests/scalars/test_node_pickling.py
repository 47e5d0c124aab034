"""Nodes in pickles: rebuilt by their constructors, shared parts once, however deep they are, by any pickler."""

from __future__ import annotations

import gc
import io
import os
import pickle
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from random_expressions import random_expression

from multibody_sym.model.system import parameters
from multibody_sym.scalars import node as interning
from multibody_sym.scalars.elementary import BUILD, postorder
from multibody_sym.scalars.functions import cos, sin, where
from multibody_sym.scalars.node import PI, Node, number, quantity, real, slot, symbol

x, y, z = symbol("x"), symbol("y"), symbol("z")
PROTOCOLS = range(2, pickle.HIGHEST_PROTOCOL + 1)


def again(value: Any) -> Any:
    """Return a value that went through a pickle."""
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_leaves_and_conditions_come_back_as_themselves(protocol: int) -> None:
    (m,) = parameters("m", ["2 kg"], positive=True)
    made = [x, number(3), real(0.1), PI, m, 2 * m, slot("q", 1), quantity("reaction", ("C", "fx")), where(x < y, x, z)]
    for node in made:
        assert pickle.loads(pickle.dumps(node, protocol)) is node


def test_every_constructor_makes_what_it_was_made_from() -> None:
    rng, seen = np.random.default_rng(7), set()
    for _ in range(400):
        for node in postorder([random_expression(rng, 6)]):
            if node.op in BUILD:
                seen.add(node.op)
                assert BUILD[node.op](*node.args) is node
    assert len(seen) > 12


def test_random_expressions_come_back_as_themselves_alone_and_together() -> None:
    rng = np.random.default_rng(3)
    made = [random_expression(rng, 6) for _ in range(200)]
    assert all(again(node) is node for node in made)
    assert all(a is b for a, b in zip(again([made, {"all": tuple(made)}])[0], made, strict=True))


def test_what_was_forgotten_meanwhile_is_rebuilt() -> None:
    written = pickle.dumps([sin(symbol("gone") + 1), symbol("gone") + 1])
    gc.collect()
    interning.forget_unused()
    first, second = pickle.loads(written)
    assert first is sin(symbol("gone") + 1)
    assert first.args[0] is second


# --- size and depth ------------------------------------------------------------------------------------------------


def sums(count: int) -> list[Node]:
    """Return x, and expressions each of which holds the one before it twice."""
    made = [x]
    for _ in range(count):
        made.append(sin(made[-1]) * y + made[-1])
    return made


@pytest.mark.parametrize("whole", [lambda made: made[-1], lambda made: made, lambda made: made[::-1]])
def test_deep_and_shared_expressions_stay_linear_in_size(whole: Any) -> None:
    sizes = [len(pickle.dumps(whole(sums(count)))) for count in (1_000, 2_000)]
    assert sizes[1] < 2.2 * sizes[0]
    made = whole(sums(2_000))
    back = again(made)
    assert back is made if isinstance(made, Node) else all(a is b for a, b in zip(back, made, strict=True))


def test_no_depth_is_too_much_for_the_limit_of_recursion() -> None:
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(250)
    try:
        deep = sums(10_000)[-1]
        assert again({"deep": [deep]}) == {"deep": [deep]}
    finally:
        sys.setrecursionlimit(limit)


def test_parameters_that_declare_each_other_may_be_many() -> None:
    (last,) = parameters("p0", [1])
    for k in range(1, 400):
        (last,) = parameters(f"p{k}", [last + 1])
    assert again(last) is last


# --- picklers ------------------------------------------------------------------------------------------------------


class Plain(pickle._Pickler):  # type: ignore[name-defined,misc]
    """The pickler written in Python, which libraries derive theirs from."""


@pytest.mark.parametrize("kind", [pickle.Pickler, Plain])
@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_pickler_that_goes_on_writes_what_is_new(kind: Any, protocol: int) -> None:
    made, file = sums(3_000), io.BytesIO()
    pickler = kind(file, protocol)
    for part in (made[1_000], made[2_000], made):
        pickler.dump(part)
    file.seek(0)
    unpickler = pickle.Unpickler(file)
    assert unpickler.load() is made[1_000]
    assert unpickler.load() is made[2_000]
    assert all(a is b for a, b in zip(unpickler.load(), made, strict=True))


def test_picklers_that_take_turns_write_wholes_of_their_own() -> None:
    made, files = sums(3_000), [io.BytesIO(), io.BytesIO()]
    picklers = [pickle.Pickler(file) for file in files]
    for part in (made[1_000], made[3_000]):
        for pickler in picklers:
            pickler.dump(part)
    for file in files:
        file.seek(0)
        unpickler = pickle.Unpickler(file)
        assert unpickler.load() is made[1_000]
        assert unpickler.load() is made[3_000]


def test_threads_pickle_the_same_nodes_at_once() -> None:
    made = sums(2_000)
    with ThreadPoolExecutor(4) as pool:
        for back in pool.map(again, [made[-1], made, made[::-1], made[1_000]]):
            assert back in (made[-1], made[1_000]) if isinstance(back, Node) else back in (made, made[::-1])


def test_a_failed_pickle_leaves_nothing_behind() -> None:
    deep = sums(3_000)[-1]
    with pytest.raises((AttributeError, pickle.PicklingError)):
        pickle.dumps([deep, lambda: None])
    assert again(deep) is deep


def test_pickling_keeps_no_node_alive() -> None:
    again(sin(symbol("short_lived")))
    gc.collect()
    interning.forget_unused()
    assert not any("short_lived" in str(data) for _, data, _ in interning._table)


# --- another process -----------------------------------------------------------------------------------------------

_OTHER = """
import pickle, sys
from multibody_sym.scalars.functions import cos, sin, where
from multibody_sym.scalars.node import number, symbol
x, y = symbol("x"), symbol("y")
first, second = pickle.load(sys.stdin.buffer)
assert first is (y*3 + sin(x - 1)/number(7) - cos(y)**2) * where(x < y, x, y), first
assert second is symbol("y"), second
"""


@pytest.mark.parametrize("seed", ["0", "1", "random"])
def test_another_process_finds_what_it_builds_itself(seed: str) -> None:
    made = (y * 3 + sin(x - 1) / number(7) - cos(y) ** 2) * where(x < y, x, y)
    subprocess.run(
        [sys.executable, "-c", _OTHER], input=pickle.dumps([made, y]), check=True,
        env={**os.environ, "PYTHONHASHSEED": seed},
    )
