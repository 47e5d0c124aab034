"""Systems, compiled functions and results sent between processes, and compiled functions called by several threads."""

from __future__ import annotations

import multiprocessing
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.runs.run import FailedRunError

THREADS = 8
EXAMPLES = Path(__file__).parents[2] / "examples"
SYSTEM = """
multibody_sym: 1
name: two_bobs
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81}
bodies:
  upper: {mass: m, com: [0, -l, 0], points: {end: [0, -l, 0]}}
  lower: {mass: m, com: [0, -l, 0]}
joints:
  A: {type: revolute, parent: ground, child: upper, axis: z, initial: {q: 90 deg}}
  B: {type: revolute, parent: upper.end, child: lower, axis: z}
outputs: {pull: "reaction(A, fy)"}
simulation: {t_end: 1, samples: 21}
"""


# --- processes -----------------------------------------------------------------------------------------------------


def test_functions_go_to_a_new_process_and_results_come_back() -> None:
    """The worker is started afresh: it has nothing but what it is sent, and the cache."""
    model = mbs.loads(SYSTEM)
    rhs, state = mbs.compile(mbs.state_derivative(model)), [0.3, 0.2, 0.1, -0.4]
    failing = "forces: {f: {type: torque, joint: A, value: log(0.5 - t)}}\noutputs:"
    growing = mbs.loads(SYSTEM.replace("outputs:", failing))
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        rates = pool.submit(rhs, 0.1, state)
        run = pool.submit(mbs.simulate, model)
        failed = pool.submit(mbs.simulate, growing, method="rk4", step=0.1, backend="python")
        np.testing.assert_array_equal(rates.result(), rhs(0.1, state))
        here = mbs.simulate(model)
        np.testing.assert_array_equal(run.result().q, here.q)
        np.testing.assert_array_equal(run.result()["pull"], here["pull"])
        with pytest.raises(FailedRunError, match="no finite value") as caught:
            failed.result()
        assert len(caught.value.trajectory) > 0


# --- threads -------------------------------------------------------------------------------------------------------


@pytest.fixture
def restless() -> Iterator[None]:
    """Let threads take turns as often as they can."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(interval)


CHAIN = """
multibody_sym: 1
name: chain
gravity: [0, -9.81, 0]
repeat:
  count: 40
  body: {mass: 1, com: [0, -0.1, 0], points: {end: [0, -0.1, 0]}}
  joint: {type: revolute, parent: end, axis: z}
"""
MODELS = {
    "tree": (SYSTEM, "c"),
    "in Python": (SYSTEM, "python"),
    "loops over like bodies": (CHAIN, "c"),
    "closed loop": ((EXAMPLES / "four_bar.yaml").read_text(), "c"),
}


@pytest.mark.usefixtures("restless")
@pytest.mark.parametrize("model", MODELS)
def test_threads_call_one_compiled_function_and_get_the_bits_of_serial_calls(model: str) -> None:
    text, backend = MODELS[model]
    rhs: Any = mbs.compile(mbs.state_derivative(mbs.loads(text)), backend=backend)  # type: ignore[call-overload]
    states = rhs.x0 + 0.1 * np.random.default_rng(2).standard_normal((64, len(rhs.x0)))
    serial = [rhs(0.1, x) for x in states]
    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(3):
            for one, other in zip(pool.map(lambda x: rhs(0.1, x), states), serial, strict=True):
                np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("model", ["loops over like bodies", "closed loop"])
def test_threads_are_inside_of_compiled_code_together_without_a_trace(model: str) -> None:
    """What one call keeps in work arrays no other one sees: each thread stays inside for some milliseconds."""
    ready = mbs.compile(mbs.state_derivative(mbs.loads(MODELS[model][0]))).ready
    rng, count = np.random.default_rng(3), (1000 if model == "closed loop" else 200)
    given = [
        (0.1, ready.q0 + 0.1 * rng.standard_normal((count, len(ready.q0))), ready.u0, ready.parameters, [], [])
        for _ in range(THREADS)
    ]

    def rates(arguments: tuple[Any, ...]) -> Any:
        return ready.compiled.map("state_derivative", *arguments)[1]

    serial = [rates(arguments) for arguments in given]
    with ThreadPoolExecutor(THREADS) as pool:
        for _ in range(5):
            for one, other in zip(pool.map(rates, given), serial, strict=True):
                np.testing.assert_array_equal(one, other)


@pytest.mark.usefixtures("restless")
@pytest.mark.parametrize("method", ["dormand_prince", "radau_5", "adams_bashforth_moulton"])
def test_threads_run_one_system_and_get_the_bits_of_serial_runs(method: str) -> None:
    model = mbs.loads(SYSTEM)
    given: dict[str, Any] = {"method": method, "step": 0.002 if method.startswith("adams") else None, "t_end": 0.4}

    def run(mass: int) -> mbs.Trajectory:
        return mbs.simulate(model, parameters={"m": 1 + mass, "l": 0.5 + 0.1 * mass}, **given)

    serial = [run(k) for k in range(THREADS)]
    with ThreadPoolExecutor(THREADS) as pool:
        for one, other in zip(pool.map(run, range(THREADS)), serial, strict=True):
            np.testing.assert_array_equal(one.q, other.q)
            np.testing.assert_array_equal(one["pull"], other["pull"])
            assert one.statistics == other.statistics
