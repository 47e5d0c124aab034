"""Runs that differ in numbers alone have the bits, and the errors, of runs that are made one by one."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.errors import MultibodyError
from multibody_sym.motion import simulate as simulating
from multibody_sym.motion.runs.family import VariedSystem

EXAMPLES = Path(__file__).parents[2] / "examples"
ODD = """
multibody_sym: 1
name: odd
gravity: [0, -g, 0]
parameters:
  m: {value: 1 kg, positive: true}
  m2: 2
  k: 3
  r: 2*k^3 + sin(k)
  g: 9.81
  a: 0.1
bodies:
  ground: {points: {p: [0, a, 0]}}
  one: {mass: m, com: [0, -r/40, 0], inertia: {Izz: 0.1*k}}
  two: {mass: m2, com: [0, -0.2, 0], inertia: {Ixx: 0.2, Iyy: 0.3, Izz: 4*a, Ixy: 0.01}, points: {e: [0, a, 0]}}
joints:
  A: {type: revolute, parent: ground, child: one, axis: z, q: phi, initial: {q: k/10, u: 0.3}}
  B: {type: spherical, parent: ground, child: two, initial: {q: [1, 0.1, 0.2, 0.3], u: [0.1, 0.2, 3]}}
forces:
  s: {type: spring_damper, between: [ground.p, two.e], stiffness: 3, length: 0.1}
  t: {type: torque, joint: A, value: 'F + min(1, 1/k)'}
inputs: {F: 0.1*sin(t/a)}
outputs: {e: total_energy(), l: log(m2 + 3), w: phi/(k - 5)}
simulation: {t_end: 0.2, samples: 5, rtol: 1e-6}
"""
VALUES = (1.0, 0.5, 0.0, -1.0, -4.0, 5.0, 1e-9, 1e200, 1e-200, float("inf"), float("nan"))


def outcome(run: Any) -> Any:
    """Return the bits of a run, or its error."""
    try:
        done = run()
    except MultibodyError as error:
        return type(error).__name__, str(error)
    outputs = tuple(values.tobytes() for values in done.outputs.values())
    return done.t.tobytes(), done.q.tobytes(), done.u.tobytes(), outputs, tuple(map(repr, done.events))


@pytest.fixture(scope="module")
def odd() -> tuple[mbs.System, mbs.Prepared]:
    system = mbs.loads(ODD)
    return system, mbs.prepare(system)


@pytest.mark.parametrize("name", ["m", "m2", "k", "a", "g"])
def test_any_number_gives_the_bits_or_the_error_of_a_run_alone(odd: tuple[mbs.System, mbs.Prepared], name: str) -> None:
    system, prepared = odd
    runs = list(prepared.runs({name: VALUES}, {}))
    for value, run in zip(VALUES, runs, strict=True):
        alone = outcome(lambda value=value: mbs.simulate(system, parameters={name: value}))
        assert outcome(run) == alone
        assert outcome(lambda value=value: prepared.run(parameters={name: value})) == alone


@pytest.mark.parametrize("given", [{"phi": 0.7}, {"u_phi": -2.0, "phi": 0}, {"B_w": 0.3}, {"u_B_x": 1e300}])
def test_other_starts_give_the_bits_of_a_run_alone(odd: tuple[mbs.System, mbs.Prepared], given: dict[str, Any]) -> None:
    system, prepared = odd
    assert outcome(lambda: prepared.run(initial=given)) == outcome(lambda: mbs.simulate(system, initial=given))


def test_a_whole_number_too_large_is_told_as_simulate_tells_it(odd: tuple[mbs.System, mbs.Prepared]) -> None:
    system, prepared = odd
    alone = outcome(lambda: mbs.simulate(system, parameters={"m": 10**400}))
    assert alone[0] == "ExpressionError"
    assert outcome(lambda: prepared.run(parameters={"m": 10**400})) == alone


def test_most_of_them_are_examined_at_a_glance(
    odd: tuple[mbs.System, mbs.Prepared], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, prepared = odd
    list(prepared.runs({"m": [1.0, 2.0]}, {"phi": [0.1, 0.2]}))

    def never(*_: Any, **__: Any) -> Any:
        raise AssertionError("again")

    for name in ("prepare_system", "problem_of", "Overrides"):
        monkeypatch.setattr(simulating, name, never)
    runs = [run() for run in prepared.runs({"m": [1.0, 1.5, 2.0]}, {"phi": [0.1, 0.2, 0.3]})]
    assert [run["phi"][0] for run in runs] == [0.1, 0.2, 0.3]
    monkeypatch.undo()
    assert runs[1].ready.start.q[0] == 0.2
    assert runs[1].statistics["steps"] > 0


def test_a_run_of_a_family_tells_its_own_system(odd: tuple[mbs.System, mbs.Prepared]) -> None:
    system, prepared = odd
    run, alone = prepared.run(parameters={"m": 2.5}), mbs.simulate(system, parameters={"m": 2.5})
    assert run.ready.system == alone.ready.system
    assert run.ready.start == alone.ready.start
    assert run.as_json() == alone.as_json()
    first, second = prepared.runs({"m": [1.0, 2.5]}, {})
    assert second().as_json() == alone.as_json()
    assert second().parameters.tolist() == alone.parameters.tolist()
    assert first().ready.system != alone.ready.system


PLAIN = ("double_pendulum", "elastic_pendulum", "spinning_top", "furuta", "four_bar", "shaken_rotor")
OTHERS = ("lift",)
PRESCRIBING = {"shaken_rotor": ("shake", "w", "spin")}
"""Parameters of prescribed motions, with which each run is examined."""


@pytest.mark.parametrize("name", [*PLAIN, *OTHERS])
def test_examples_run_in_families(name: str) -> None:
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    prepared = mbs.prepare(system, t_end=0.3, samples=3)
    chance = random.Random(name)
    for key in chance.sample(sorted(system.parameters), min(2, len(system.parameters))):
        node = system.parameters[key].value
        if node.shadow is None:
            continue
        value = node.shadow * chance.uniform(0.9, 1.1)
        alone = outcome(lambda v=value, k=key: mbs.simulate(system, t_end=0.3, samples=3, parameters={k: v}))
        assert outcome(lambda v=value, k=key: prepared.run(parameters={k: v})) == alone
        family = VariedSystem(prepared.system, (key,), ())
        (member,) = family.members({key: [value]}, {})
        assert (member is not None) == (name in PLAIN and key not in PRESCRIBING.get(name, ()))


def test_threads_find_the_same_bits(odd: tuple[mbs.System, mbs.Prepared]) -> None:
    from concurrent.futures import ThreadPoolExecutor

    _, prepared = odd
    values = np.linspace(0.5, 2, 24).tolist()
    runs = list(prepared.runs({"m": values}, {}))
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda run: run().q.tobytes(), runs))
    assert together == [run().q.tobytes() for run in runs]


@pytest.fixture(scope="module")
def four_bar() -> tuple[mbs.System, mbs.Prepared]:
    system = mbs.load(EXAMPLES / "four_bar.yaml")
    return system, mbs.prepare(system, t_end=0.1, samples=3)


@pytest.mark.parametrize(
    ("name", "values"),
    [("a", (0.21, 0.19, 0.0, 5.0, -0.2, float("nan"))), ("torque", (0.4, 0.0)), ("b", (0.5, 0.3, 1e200))],
)
def test_loops_closed_by_programs_have_the_bits_or_the_error_of_a_run_alone(
    four_bar: tuple[mbs.System, mbs.Prepared], name: str, values: tuple[float, ...]
) -> None:
    """A crank of 5 m does not close, and one of no length is a singular position."""
    system, prepared = four_bar
    for value, run in zip(values, list(prepared.runs({name: values}, {})), strict=True):
        alone = outcome(lambda value=value: mbs.simulate(system, t_end=0.1, samples=3, parameters={name: value}))
        assert outcome(run) == alone


def test_loops_with_other_numbers_are_resolved_no_more(
    four_bar: tuple[mbs.System, mbs.Prepared], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tip of the coupler is as far from the pivot as the rocker is long, whatever the crank's length."""
    system, prepared = four_bar
    lengths = [0.19, 0.2, 0.21]
    list(prepared.runs({"a": lengths}, {}))

    def never(*_: Any, **__: Any) -> Any:
        raise AssertionError("again")

    for name in ("prepare_system", "problem_of", "Overrides"):
        monkeypatch.setattr(simulating, name, never)
    runs = [run() for run in prepared.runs({"a": lengths}, {})]
    monkeypatch.undo()
    for length, run in zip(lengths, runs, strict=True):
        angle = run["crank_angle"][0]
        tip = length * np.exp(1j * angle) + 0.5 * np.exp(1j * (angle + run["coupler_angle"][0]))
        assert angle == np.radians(60)
        assert abs(tip - 0.5) == pytest.approx(0.4, abs=1e-13)
    alone = mbs.simulate(system, t_end=0.1, samples=3, parameters={"a": 0.21})
    assert runs[2].ready.start == alone.ready.start


@pytest.mark.parametrize("method", ["RK45", "DOP853", "Radau", "BDF", "LSODA", "cvode_adams", "cvode_bdf", "ida"])
def test_loops_run_by_other_libraries_have_the_bits_of_a_run_alone(method: str) -> None:
    """Their steps are not put back: each run has Baumgarte's coefficients by its own mean step."""
    if method in {"cvode_adams", "cvode_bdf", "ida"}:
        pytest.importorskip("sksundae")
    system, asked = mbs.load(EXAMPLES / "four_bar.yaml"), {"t_end": 0.3, "samples": 3, "method": method, "rtol": 1e-6}
    study = mbs.sweep(system, {"torque": [0.3, 0.5]}, **asked, reduce=lambda run: {"end": run["crank_angle"][-1]})
    alone = [mbs.simulate(system, **asked, parameters={"torque": x}) for x in (0.3, 0.5)]
    assert study["end"].tolist() == [run["crank_angle"][-1] for run in alone]
    again = mbs.prepare(system, **asked).run(parameters={"torque": 0.5})
    assert (again.q.tobytes(), again.baumgarte) == (alone[1].q.tobytes(), alone[1].baumgarte)
    assert (again.baumgarte is None) == (method == "ida")
