"""Switches that a run has met before are verified, not searched: to the last bit, runs do not change by that."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

import mpmath
import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.switching import mode_run, modes, prepared
from multibody_sym.program.runtime_constants import CLEAR_BY, DETERMINED
from multibody_sym.scalars.least_norm import solve_lists

PAIR = """
multibody_sym: 1
name: pair_on_a_belt
gravity: [0, -9.81, 0]
parameters: {A: 0.02, w: 12, B: 0.01, n: 31, k: 300, s1: 0.4, k1: 0.3, s2: 0.3, k2: 0.3, m: 2, v: 0.1}
bodies:
  one: {mass: 1}
  two: {mass: m}
  belt: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
joints:
  slide1: {type: point, parent: ground, child: one, q: [x1, y1], initial: {u: [v, 0]}}
  slide2: {type: point, parent: ground, child: two, q: [x2, y2], initial: {q: [1, 0], u: [-v, 0]}}
  shake: {type: prismatic, parent: ground, child: belt, axis: x, motion: A*sin(w*t) + B*sin(n*t)}
forces:
  spring: {type: spring_damper, between: [one, two], stiffness: k, length: 1}
contacts:
  c1: {between: [one, belt.top], static: s1, kinetic: k1}
  c2: {between: [two, belt.top], static: s2, kinetic: k2}
"""
HOPPING = """
multibody_sym: 1
name: block_on_a_sieve
gravity: [0, -9.81, 0]
parameters: {A: 0.02, w: 25, B: 0.03, n: 17, s: 0.3, k: 0.2}
bodies:
  block: {mass: 1}
  sieve: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
joints:
  free: {type: point, parent: ground, child: block, q: [x, y], initial: {u: [0.3, B*n]}}
  up: {type: prismatic, parent: ground, child: sieve, axis: y, motion: B*sin(n*t)}
forces:
  shaking: {type: force, on: block, value: [A*w^2*sin(w*t), 0, 0]}
contacts:
  c: {between: [block, sieve.top], static: s, kinetic: k}
"""


def drawn(rng: np.random.Generator, text: str) -> dict[str, float]:
    if text is HOPPING:
        kinetic = float(rng.uniform(0.1, 0.5))
        fast = float(rng.uniform(12.0, 30.0))
        static = kinetic * float(rng.choice([1.0, 1.3]))
        least = float(rng.uniform(0.8, 1.4)) * 9.81 / fast**2
        return {"A": float(rng.uniform(0.2, 2.0)) * 9.81 / 625.0, "B": least, "n": fast, "s": static, "k": kinetic}
    kinetic1, kinetic2 = rng.uniform(0.1, 0.6, size=2).tolist()
    return {
        "A": float(rng.uniform(0.3, 3.0)) * 3.0 / 144.0,
        "B": float(rng.choice([0.0, 1.0])) * float(rng.uniform(0.2, 1.0)) * 3.0 / 961.0,
        "k": float(10.0 ** rng.uniform(1, 3)),
        "m": float(10.0 ** rng.uniform(-1, 1)),
        "v": float(rng.uniform(0.0, 0.5)),
        **{"k1": kinetic1, "s1": kinetic1 * float(rng.choice([1.0, 1.4])), "k2": kinetic2, "s2": kinetic2},
    }


def both_ways(monkeypatch: pytest.MonkeyPatch, text: str, **options: Any) -> tuple[Any, Any, Counter[str]]:
    """Return the run with what it remembers and without, and how many switches were decided how."""
    system, taken = mbs.loads(text), Counter[str]()

    def counted(name: str, function: Any) -> Any:
        def called(*arguments: Any, **more: Any) -> Any:
            found = function(*arguments, **more)
            taken[name] += name != "in Python" or found is not None
            return found

        return called

    with monkeypatch.context() as patched:
        patched.setattr(mode_run, "follow_known_switch", counted("in Python", mode_run.follow_known_switch))
        patched.setattr(prepared, "next_state", counted("searched", prepared.next_state))
        patched.setattr(mode_run, "_note_turn", counted("in C", mode_run._note_turn))
        first = mbs.simulate(system, **options)
    with monkeypatch.context() as patched:
        patched.setattr(prepared, "known_switch", lambda *_: None)
        other = mbs.simulate(system, **options)
    return first, other, taken


def verify_same(first: Any, other: Any) -> None:
    assert first.events == other.events
    assert first.q.tobytes() == other.q.tobytes()
    assert first.u.tobytes() == other.u.tobytes()
    counts, others = dict(first.statistics), dict(other.statistics)
    assert counts.pop("mean_step") == pytest.approx(others.pop("mean_step"), rel=1e-12)
    assert counts == others
    assert first.modes.account == other.modes.account


def compare(monkeypatch: pytest.MonkeyPatch, text: str, seeds: Iterable[int], backend: str = "c") -> Counter[str]:
    taken = Counter[str]()
    for seed in seeds:
        options = {"t_end": 3.0, "rtol": 1e-6, "samples": 301, "backend": backend}
        values = drawn(np.random.default_rng(seed), text)
        first, other, counted = both_ways(monkeypatch, text, parameters=values, **options)
        verify_same(first, other)
        taken += counted
    return taken


@pytest.mark.parametrize("text", [PAIR, HOPPING], ids=["pair", "hopping"])
def test_what_is_remembered_changes_no_bit_of_a_run(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    taken = compare(monkeypatch, text, (0, 1, 2, 112))
    assert taken["in C"] > 15


def test_what_is_forgotten_changes_no_bit_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """One mode and one switch are remembered, those that were needed last."""
    values = drawn(np.random.default_rng(1), PAIR)
    options: dict[str, Any] = {"t_end": 3.0, "rtol": 1e-6, "samples": 301, "parameters": values}
    first = mbs.simulate(mbs.loads(PAIR), **options)
    for module, name in ((modes, "MOST_KEPT"), (prepared, "MOST_KEPT"), (prepared, "_MOST_SWITCHES")):
        monkeypatch.setattr(module, name, 1)
    other = mbs.simulate(mbs.loads(PAIR), **options)
    verify_same(first, other)
    every, latest = (
        (len(x.memory.legs), len(x.memory._led), len(x.modes._known))
        for x in (run.modes.prepared for run in (first, other))
    )
    assert min(every) > 1
    assert latest == (1, 1, 1)


def test_forces_are_known_better_than_their_inequalities_are_judged() -> None:
    """Forces of rows just independent enough, against those of 40 digits."""
    rng, worst, judged = np.random.default_rng(3), 0.0, 0
    for _ in range(300):
        rows = rng.standard_normal((5, 5))
        rows[4] = rows[:4].T @ rng.standard_normal(4) + 10.0 ** rng.uniform(-7, -4) * rows[4]
        rows /= np.linalg.norm(rows, axis=1)[:, None]
        right = rng.standard_normal(5)
        forces, _, (rank, left, _) = solve_lists(rows.tolist(), right.tolist(), 5, math.inf)
        if rank == 5 and DETERMINED < left < 10 * DETERMINED:
            with mpmath.workdps(40):
                exact = mpmath.lu_solve(mpmath.matrix(rows.tolist()), mpmath.matrix(right.tolist()))
                error = max(abs(x - y) for x, y in zip(exact, forces, strict=True)) / max(map(abs, exact))
            worst, judged = max(worst, float(error)), judged + 1
    assert judged > 30
    assert worst < CLEAR_BY / 10


CHATTERING = {"k": 0.0, "A": 0.08, "B": 0.0, "s1": 0.3, "m": 1.0, "v": 0.0}


@pytest.mark.long
def test_nor_of_a_run_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"t_end": 0.9, "rtol": 1e-4, "samples": 11, "backend": "python"}
    first, other, taken = both_ways(monkeypatch, PAIR, parameters=CHATTERING, **options)
    verify_same(first, other)
    assert taken["in Python"] >= 2
    assert taken["in C"] == 0


@pytest.mark.long
@pytest.mark.parametrize("text", [PAIR, HOPPING], ids=["pair", "hopping"])
def test_what_is_remembered_changes_no_bit_of_many_runs(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    taken = compare(monkeypatch, text, range(100, 200))
    assert taken["in C"] > taken["searched"]


def test_a_chattering_block_is_decided_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block that slides to and fro on a belt: of twenty switches few are searched."""
    _, _, taken = both_ways(monkeypatch, PAIR, parameters=CHATTERING, t_end=5.0, samples=51)
    assert taken["in C"] >= 13
    assert taken["searched"] <= 6
