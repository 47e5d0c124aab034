"""Ctrl-C of long batches of a Function: they end within 50 ms of CPU time, alone and on threads."""

from __future__ import annotations

import signal
import time
from types import FrameType

import numpy as np
import pytest

import multibody_sym as mbs

CHAIN = """
multibody_sym: 1
name: chain
gravity: [0, -9.81, 0]
repeat: {count: 12, body: {shape: {rod: 1, mass: 1}, points: {end: [1, 0, 0]}},
  joint: {type: revolute, axis: z, parent: end, initial: {q: 0.1}}, body_name: rod, joint_name: h}
"""
MANY = 1_500_000


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timer of CPU time on this system")
@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupted_batch_ends_soon(threads: int) -> None:
    f = mbs.function(mbs.loads(CHAIN), "energies")
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
