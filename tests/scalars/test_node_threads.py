"""Nodes under threads: equality is identity whoever makes them, while what is unused is forgotten, and after fork."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import Written, expressions
from multibody_sym.scalars import node as interning
from multibody_sym.scalars.functions import sin
from multibody_sym.scalars.node import Node, number, symbol


@pytest.fixture(autouse=True)
def restless() -> Iterator[None]:
    """Let threads take turns as often as they can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


def together(threads: int, work: Callable[[int], None]) -> None:
    """Run `work(k)` in threads k = 0, 1, ...; raise what one of them raises."""
    errors: list[BaseException] = []

    def run(k: int) -> None:
        try:
            work(k)
        except BaseException as error:
            errors.append(error)

    started = [threading.Thread(target=run, args=(k,)) for k in range(threads)]
    for thread in started:
        thread.start()
    for thread in started:
        thread.join()
    for error in errors:
        raise error


@pytest.mark.parametrize(
    ("threads", "count", "rounds"), [(4, 5_000, 1), pytest.param(8, 60_000, 10, marks=pytest.mark.long)]
)
def test_equal_nodes_of_several_threads_are_one(threads: int, count: int, rounds: int) -> None:
    for turn in range(rounds):
        made: list[list[Node]] = [[] for _ in range(threads)]
        gate = threading.Barrier(threads)

        def work(k: int, turn: int = turn, made: list[list[Node]] = made, gate: threading.Barrier = gate) -> None:
            gate.wait(60)
            made[k] = [2 * sin(symbol(f"turn{turn}_{i}")) + number(7 * i) for i in range(count)]

        together(threads, work)
        unequal = sum(any(node is not first for node in rest) for first, *rest in zip(*made, strict=True))
        assert unequal == 0


@pytest.mark.parametrize(("threads", "rounds"), [(2, 1), pytest.param(8, 10, marks=pytest.mark.long)])
def test_threads_that_build_equal_models_get_the_same_nodes(threads: int, rounds: int) -> None:
    text = (Path(__file__).parents[2] / "examples" / "four_bar.yaml").read_text()
    for turn in range(rounds):
        changed = text.replace("coupler", f"coupler{turn}").replace("9.81", f"9.81{turn}")
        made: list[list[Written]] = [[] for _ in range(threads)]
        derived: list[dict[str, bytes]] = [{} for _ in range(threads)]

        def work(k: int, changed: str = changed, made: Any = made, derived: Any = derived) -> None:
            system = mbs.loads(changed)
            made[k] = list(expressions(system))
            programs_of = programs(mechanism(system), FORMALISMS["composite_body"]).as_mapping()
            derived[k] = {name: program.digest for name, program in programs_of.items()}

        together(threads, work)
        assert len(made[0]) > 20
        for written, programs_made in zip(made, derived, strict=True):
            assert all(a.node is b.node for a, b in zip(made[0], written, strict=True))
            assert programs_made == derived[0]


def test_a_node_taken_in_the_moment_in_which_it_is_forgotten_goes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[Node] = []
    holder = [symbol("unused, and then wanted")]
    more = _count(holder[0]) - sys.getrefcount(holder[0])  # what a function of Python's own holds besides

    def count(node: Node) -> int:
        found = sys.getrefcount(node) - more
        if node.data == "unused, and then wanted" and not taken:
            together(1, lambda _: taken.append(symbol("unused, and then wanted")))
        return found

    monkeypatch.setattr(interning, "getrefcount", count)
    holder.clear()
    interning.forget_unused()
    assert taken
    assert symbol("unused, and then wanted") is taken[0]


def _count(node: Node) -> int:
    return sys.getrefcount(node)


@pytest.mark.long
def test_a_node_found_while_unused_ones_are_forgotten_stays_the_only_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interning, "_table", {})  # a small one, which takes no time to look through
    unequal, threads, done = [0], 3, threading.Event()
    gate = threading.Barrier(threads)
    made: list[Node | None] = [None] * threads

    def work(k: int) -> None:
        try:
            for turn in range(2_000):
                if k == 0:
                    symbol(f"unused{turn}")  # in the table, and nobody's
                gate.wait(60)
                made[k] = symbol(f"unused{turn}")
                gate.wait(60)
                unequal[0] += k == 0 and len(set(map(id, made))) > 1
                gate.wait(60)
                made[k] = None
        finally:
            done.set()

    def forget() -> None:
        while not done.is_set():
            with interning._changing:
                interning.forget_unused()

    together(threads + 1, lambda k: work(k) if k < threads else forget())
    assert unequal == [0]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")  # that forking with threads is dangerous is the point
def test_a_child_made_by_fork_while_threads_make_nodes_makes_nodes_too() -> None:
    done = threading.Event()

    def work(k: int) -> None:
        turn = 0
        while not done.is_set():
            turn += 1
            symbol(f"thread{k}_{turn}")

    def fork() -> None:
        try:
            codes = [forked() for _ in range(8)]
            assert codes == [0] * 8
        finally:
            done.set()

    together(4, lambda k: fork() if k == 0 else work(k))


def forked() -> int:
    """Return the exit code of a child that makes new Nodes; one that waits for a lock forever ends by a signal."""
    child = os.fork()
    if child == 0:
        signal.alarm(5)
        for k in range(100):
            symbol(f"child{k}")
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
