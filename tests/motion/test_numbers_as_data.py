"""Runs of many bodies with literal numbers: other numbers compile nothing, and each run has its own."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from random import Random

import numpy as np
import pytest
from windows import windows

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.programs import system as derivation
from multibody_sym.dynamics.programs.system import MANY_BODIES
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions


def chain(seed: int) -> mbs.System:
    """Return a chain of hinges whose numbers are all unlike, and a parameter."""
    of, bodies, joints = Random(seed).uniform, {}, {}
    for k in range(MANY_BODIES):
        inertia = {"Ixx": of(0.01, 0.011), "Iyy": of(0.012, 0.014), "Izz": of(0.009, 0.01)}
        ends = {"end": [0.01, of(-0.2, -0.1), 0]}
        bodies[f"b{k}"] = mbs.Body(mass=of(1, 2), com=[0, of(-0.1, -0.01), 0.02], inertia=inertia, points=ends)
        joints[f"j{k}"] = mbs.Revolute(f"b{k - 1}.end" if k else "ground", f"b{k}", axis="zx"[k % 2])
    bodies["b0"] = replace(bodies["b0"], mass="m")
    return mbs.System("chain", [0, -9.81, 0], {"m": 1.5}, bodies, joints, simulation={"t_end": "0.01", "samples": 2})


def accelerations(system: mbs.System, q: np.ndarray, u: np.ndarray, mass: float) -> np.ndarray:
    """Return udot by another formalism in floats, with the numbers where they are written."""
    literal = mechanism(system)
    return np.array(
        composite_body(literal, state_of(literal, float, 0.0, q.tolist(), u.tolist(), [mass])).bias_acceleration
    )


def test_other_numbers_derive_and_compile_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    first = mbs.simulate(chain(1))

    def derive(*_arguments: object, **_options: object) -> None:
        raise AssertionError("derived again")

    monkeypatch.setattr(derivation, "programs", derive)
    second = mbs.simulate(chain(2), initial={"j3": 0.1})
    assert second.ready.compiled.path == first.ready.compiled.path
    rng = np.random.default_rng(0)
    q, u = rng.normal(size=(2, MANY_BODIES))
    for seed in (1, 2):
        wanted = accelerations(chain(seed), q, u, 1.5)
        found = mbs.compile(mbs.state_derivative(chain(seed)))(0.0, np.concatenate([q, u]))
        assert np.abs(found[MANY_BODIES:] - wanted).max() <= 1e-9 * np.abs(wanted).max()


def test_other_numbers_of_closed_loops_derive_and_compile_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengths, masses and places of a row of four-bars: the second closes from its own numbers by the first's code."""
    loops = MANY_BODIES // 2
    first = mbs.simulate(windows(loops, 0.02, seed=1), backend="python", samples=3)

    def derive(*_arguments: object, **_options: object) -> None:
        raise AssertionError("derived again")

    monkeypatch.setattr(derivation, "programs", derive)
    second = mbs.simulate(windows(loops, 0.02, seed=2), backend="python", samples=3)
    for found, seed in ((first, 1), (second, 2)):
        literal = mechanism(windows(loops, seed=seed))
        begin = parameter_values(literal, {})
        for k in range(3):
            state = state_of(literal, float, found.t[k], found.q[k].tolist(), found.u[k].tolist(), begin)
            rows = row_motions(motion_of(literal, state))
            assert max(max(abs(row.phi), abs(row.phidot)) for row in rows) < 1e-12
    assert np.abs(first.u[-1] - second.u[-1]).max() > 1e-3


def test_parameters_by_name_and_as_a_vector_of_those_with_names() -> None:
    rhs = mbs.compile(mbs.state_derivative(chain(1)))
    rng = np.random.default_rng(1)
    q, u = rng.normal(size=(2, MANY_BODIES))
    wanted = accelerations(chain(1), q, u, 2.5)
    for given in ({"m": 2.5}, [2.5]):
        found = rhs(0.0, np.concatenate([q, u]), parameters=given)[MANY_BODIES:]
        assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    with pytest.raises(mbs.InputError, match="there are 1 parameters"):
        rhs(0.0, np.concatenate([q, u]), parameters=[2.5, 1.0])


def test_an_export_tells_the_constants(tmp_path: Path) -> None:
    texts = []
    for seed in (1, 2):
        mbs.export(chain(seed), "c", tmp_path / str(seed))
        texts.append((tmp_path / str(seed) / "model.c").read_text())
        entries = json.loads((tmp_path / str(seed) / "names.json").read_text())["parameters"]
        told = {entry["name"]: entry["value"] for entry in entries}
        assert told["m"] == 1.5
        assert told["b5 mass mass"] == mechanism(chain(seed)).bodies[5].mass.mass.shadow
    assert texts[0] == texts[1]
