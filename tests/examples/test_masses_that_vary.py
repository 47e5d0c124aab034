"""Examples of variable masses: theorems along their runs, numbers of their comments, and second routes."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from problem_files import PROBLEMS

import multibody_sym as mbs

FOLDER = Path(__file__).parents[2] / "examples/variable_mass"


def ran(name: str, *, samples: int = 7) -> mbs.Trajectory:
    system = mbs.load(FOLDER / f"{name}.yaml")
    return mbs.simulate(system, samples=samples, rtol=1e-11, atol=1e-13, method="dormand_prince_8", backend="python")


@pytest.mark.parametrize("name", ["rocket", "chain_on_a_scale", "cayleys_chain", "jet_damping"])  # all: long tests
def test_theorems_hold_with_what_the_mass_takes(name: str) -> None:
    missed = ran(name, samples=3).verified()
    assert {theorem: miss for theorem, miss in missed.items() if not miss.relative <= 1e-9} == {}


def test_numbers_of_the_comments_are_those_of_the_files() -> None:
    told = {"rocket": ("u_y", "y"), "rocket_sled": ("u_x",), "loaded_wagon": ("u_x",), "leaking_wagon": ("u_x",)}
    for name, asked in told.items():
        comment = "".join(line for line in (FOLDER / f"{name}.yaml").open() if line.startswith("#"))
        written = [float(x) for x in re.findall(r"= (\d+\.\d+) m", comment)]
        run = ran(name)
        assert written == [pytest.approx(float(run[x][-1]), rel=1e-6) for x in asked], name


def test_table_of_the_examples_names_each() -> None:
    told = re.findall(r"^\| `(\w+)` \|", (FOLDER / "README.md").read_text(), re.MULTILINE)
    assert sorted(told) == sorted(path.stem for path in FOLDER.glob("*.yaml"))
    proved = {path.stem for path in PROBLEMS.glob("examples/*.yaml") if "example: variable_mass/" in path.read_text()}
    assert set(told) == {*proved, "leaking_pendulum"}


# --- second routes ---------------------------------------------------------------------------------------------------


def thrown_off(m0: float, k: float, c: float, t: float, n: int) -> float:
    """Return the speed of a rocket without weight that throws off n lumps, each with c relative to it before."""
    lump, v, m = k * t / n, 0.0, m0
    for _ in range(n):
        v += lump * c / m
        m -= lump
    return v


def test_rocket_is_the_limit_of_lumps_thrown_off() -> None:
    run = mbs.simulate(mbs.load(FOLDER / "rocket.yaml"), parameters={"g": 1e-30}, samples=2, rtol=1e-12, atol=1e-13)
    lumps = [thrown_off(100.0, 2.0, 2000.0, 10.0, 2**k) for k in range(4, 12)]
    while len(lumps) > 1:  # Richardson: errors go with the powers of 1/n
        order = 9 - len(lumps)
        lumps = [(2**order * b - a) / (2**order - 1) for a, b in pairwise(lumps)]
    assert run["u_y"][-1] == pytest.approx(lumps[0], rel=1e-10)


def swung(n: int) -> tuple[float, float]:
    """Return angle and speed of the leaking pendulum after 2 s, of which n drops fall off at its hole.

    Between drops it is a pendulum; each takes along the angular momentum about the hinge that it has there.
    """
    m, k, l, r, g, t_end = 2.0, 0.1, 1.5, 0.2, 9.81, 2.0
    size = l * l + 2 * r * r / 5
    theta, w, lump, h = np.pi / 3, 0.0, k * t_end / n, t_end / n

    def fall(theta: float, w: float, time: float) -> tuple[float, float]:
        x, steps = np.array([theta, w]), 4
        for _ in range(steps):
            dt = time / steps

            def f(x: np.ndarray) -> np.ndarray:
                return np.array([x[1], -g * l / size * np.sin(x[0])])

            a = f(x)
            b = f(x + dt / 2 * a)
            c = f(x + dt / 2 * b)
            d = f(x + dt * c)
            x = x + dt / 6 * (a + 2 * b + 2 * c + d)
        return float(x[0]), float(x[1])

    for _ in range(n):
        theta, w = fall(theta, w, h / 2)
        w *= m * size / ((m - lump) * size + lump * (l + r) ** 2)
        m -= lump
        theta, w = fall(theta, w, h / 2)
    return theta, w


def test_leaking_pendulum_is_the_limit_of_drops() -> None:
    run = mbs.simulate(mbs.load(FOLDER / "leaking_pendulum.yaml"), t_end=2, samples=2, rtol=1e-12, atol=1e-13)
    rows = [np.array(swung(2**k)) for k in range(5, 10)]
    once = [2 * b - a for a, b in pairwise(rows)]
    twice = [(4 * b - a) / 3 for a, b in pairwise(once)]
    limit = (8 * twice[-1] - twice[-2]) / 7
    assert [run["theta"][-1], run["u_theta"][-1]] == pytest.approx(limit.tolist(), rel=1e-7)
