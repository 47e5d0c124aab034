"""Long batches of a Function tell their progress, and end within 50 ms of CPU time after Ctrl-C, on threads, too."""

from __future__ import annotations

import signal
import time
from types import FrameType
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.program import native

CHAIN = """
multibody_sym: 1
name: chain
gravity: [0, -9.81, 0]
repeat: {count: 12, body: {shape: {rod: 1, mass: 1}, points: {end: [1, 0, 0]}},
  joint: {type: revolute, axis: z, parent: end, initial: {q: 0.1}}, body_name: rod, joint_name: h}
"""
MANY = 1_500_000


@pytest.fixture(scope="module")
def energies() -> mbs.Function[Any]:
    return mbs.function(mbs.loads(CHAIN), "energies")


@pytest.mark.parametrize("threads", [1, 2])
def test_a_long_batch_tells_which_part_is_done(
    energies: mbs.Function[Any], threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(native, "_TELLING", 0.0)
    told = list[float]()
    energies(np.zeros(1000), np.full(12, 0.1), np.zeros(12), threads=threads, on_progress=told.append)
    assert told == sorted(told)
    assert 64 / 1000 <= told[0] < told[-1] <= 1.0
    assert threads == 2 or told[-1] == 1.0


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer of CPU time on this system")
@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupted_batch_ends_soon(energies: mbs.Function[Any], threads: int) -> None:
    f = energies
    q, u, t = np.full(12, 0.1), np.linspace(-1.0, 1.0, 12), np.linspace(0.0, 1.0, MANY)
    alone, out = f(0.0, q, u), f(t[:1000], q, u)
    space = np.empty(MANY), np.empty(MANY)
    sent, heard = 0.05, list[float]()

    def interrupt(_: int, __: FrameType | None) -> None:
        heard.append(time.process_time())
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGPROF, interrupt)
    begun = time.process_time()
    try:
        signal.setitimer(signal.ITIMER_PROF, sent)  # which counts the CPU time of all threads
        with pytest.raises(KeyboardInterrupt):
            f(t, q, u, threads=threads, out=space)
    finally:
        ended = time.process_time()
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
    first = begun + sent if threads == 1 else heard[0]  # a busy core wakes a thread that waits for others late
    assert heard[0] > begun + 0.8 * sent
    assert ended - first < 0.05 * threads
    assert (out.kinetic == alone.kinetic).all()
    assert f(0.0, q, u) == alone
