"""Compiled calls let go of the interpreter: other threads run while one is inside of them, by every way in."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hand_models import OSCILLATOR

from multibody_sym.motion.loop.integrate import integrate
from multibody_sym.motion.loop.problem import NO_MODE, Problem
from multibody_sym.motion.methods.table import METHODS
from multibody_sym.program.loading import Compiled

WAITING = replace(
    OSCILLATOR,
    state_derivative="""
    volatile double *flags = (volatile double *)(unsigned long long)p[0];
    flags[0] = 1.0;
    for (long long k = 0; k < 4000000000 && flags[1] == 0.0; ++k)
        ;
    out[0][0] = flags[1];
    out[1][0] = 0.0;
""",
)
"""Tells that it is inside, and waits there, some seconds at most, until a thread of Python has answered."""
WAYS: dict[str, Callable[[Compiled, float], float]] = {
    "call": lambda compiled, place: compiled["state_derivative"](0.0, [0.0], [0.0], [place], [], [])[0][0],
    "map": lambda compiled, place: compiled.map("state_derivative", [0.0], [0.0], [0.0], [place], [], [])[0][0, 0],
    "loop": lambda compiled, place: integrate(euler_step(compiled, place)).q[-1, 0],
}


def euler_step(compiled: Compiled, place: float) -> Problem:
    """Return a run of one step of length 1 from zero, whose end is the first rate."""
    zero, given = np.zeros(1), np.array([place])
    return Problem(compiled, METHODS["explicit_euler"], 0.0, 1.0, zero, zero, given, NO_MODE, step=1.0, samples=2)


@pytest.mark.parametrize("way", WAYS)
def test_a_thread_answers_while_another_is_inside_of_compiled_code(way: str) -> None:
    compiled, flags = WAITING.load(), np.zeros(2)

    def answer() -> None:
        while flags[0] == 0.0:
            time.sleep(1e-4)
        flags[1] = 1.0

    thread = threading.Thread(target=answer)
    thread.start()
    try:
        assert WAYS[way](compiled, float(flags.ctypes.data)) == 1.0
    finally:
        flags[0] = 1.0
        thread.join()
