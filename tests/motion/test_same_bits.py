"""A run has the same bits in C and Python, at every level of optimisation, alone and among others in threads."""

from __future__ import annotations

from pathlib import Path
from zlib import crc32

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.program import loading
from multibody_sym.program.backend import Backend

LEANS = """
multibody_sym: 1
name: ladder that slides
gravity: [0, -9.81, 0]
parameters: {mu: 0.2}
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}, wall: {plane: [0, 0, 0], normal: x}}}
  rod: {mass: 2, com: [0, 0, 0], inertia: {Izz: 0.2}, points: {low: [0, -0.5, 0], high: [0, 0.5, 0]}}
joints:
  J: {type: planar, parent: ground, child: rod, q: [x, y, a], initial: {q: [0.3, 0.4, atan(3/4)]}}
contacts:
  low: {between: [rod.low, ground.floor], static: mu}
  high: {between: [rod.high, ground.wall], static: mu}
simulation: {t_end: 0.5, samples: 21}
"""
CRANKS = (Path(__file__).parents[2] / "examples" / "three_cranks.yaml").read_text(encoding="utf-8")
MODELS = {"mu": mbs.loads(LEANS), "M": mbs.loads(CRANKS)}
"""One slides in two contacts until one opens, one has rows that depend on each other; by a parameter to vary."""
each = pytest.mark.parametrize("parameter", MODELS)


def bits(run: mbs.Trajectory) -> bytes:
    return run.q.tobytes() + run.u.tobytes() + repr(run.events).encode()


def moved(parameter: str, backend: Backend | None = None, **parameters: float) -> bytes:
    """Return the bits of a run."""
    system = MODELS[parameter]
    return bits(mbs.simulate(system, t_end=0.5, samples=21, backend=backend, parameters=parameters))


@each
def test_in_c_and_in_python(parameter: str) -> None:
    assert moved(parameter, "c") == moved(parameter, "python")


def test_at_every_level_of_optimisation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = [moved(parameter) for parameter in MODELS]
    for level in ("-O0", "-O1", "-O2", "-O3"):
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / level))
        monkeypatch.setattr(loading._Build, "_flags", lambda build, _unit, level=level: (*build.compiler.flags, level))
        assert [moved(parameter) for parameter in MODELS] == wanted, level


@each
def test_alone_and_among_others_in_one_thread_and_two(parameter: str) -> None:
    values = np.linspace(0.1, 0.3, 8).tolist()
    wanted = [crc32(moved(parameter, **{parameter: value})) for value in values]
    assert len(set(wanted)) == len(values)
    for workers in (1, 2):
        study = mbs.sweep(
            MODELS[parameter],
            {parameter: values},
            reduce=lambda run: {"bits": crc32(bits(run))},
            t_end=0.5,
            samples=21,
            workers=workers,
        )
        assert study["bits"].tolist() == wanted
