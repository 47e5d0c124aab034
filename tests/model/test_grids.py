"""Inputs over two arguments, and words for what is outside of tables: against scipy's interpolation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, RectBivariateSpline, RegularGridInterpolator

import multibody_sym as mbs

X, Y = np.array([-2.0, -1.0, 0.0, 1.5, 2.0]), np.array([-3.0, -1.0, 0.5, 1.0, 2.0, 4.0])
Z = np.random.default_rng(1).normal(size=(5, 6))
INSIDE = np.random.default_rng(2).uniform([-2, -3], [2, 4], (60, 2))
BEYOND = np.array([[3.0, 1.0], [0.3, 7.0], [-5.0, -9.0]])


def driven(given: Any) -> mbs.System:
    """Return x'' = F for a mass of 1 kg."""
    return mbs.System(
        "driven",
        bodies={"b": mbs.Body(mass=1)},
        joints={"j": mbs.Prismatic("ground", "b", axis="x", q="x", initial={"q": 0.1, "u": 0.2})},
        inputs={"F": given},
        forces={"f": mbs.Force(on="b", value=["F", 0, 0])},
    )


def grid(interpolation: str, outside: str = "hold", **given: Any) -> mbs.System:
    fields = {"x": X, "y": Y, "values": Z, "of": ["x", "u_x"], **given}
    return driven(mbs.Grid(interpolation=interpolation, outside=outside, **fields))


def at(function: mbs.Function, places: Any) -> Any:
    return function(0.0, places[:, :1], places[:, 1:])


def natural(x: float, y: float, dx: int = 0, dy: int = 0) -> float:
    """Return the natural spline along y through those along x, or a derivative, as scipy has it."""
    return float(CubicSpline(Y, CubicSpline(X, Z, bc_type="natural")(x, dx), bc_type="natural")(y, dy))


@pytest.mark.parametrize("backend", ["c", "python"])
@pytest.mark.parametrize("turned", [False, True])
def test_values_and_slopes_are_those_of_scipy(backend: Any, turned: bool) -> None:
    given = {"x": Y, "y": X, "values": Z.T, "of": ["u_x", "x"]} if turned else {}
    lines = mbs.function(grid("linear", **given), "state_derivative", backend=backend)
    want = RegularGridInterpolator((X, Y), Z)
    assert at(lines, INSIDE).udot[:, 0] == pytest.approx(want(INSIDE), abs=1e-14)
    held = want(np.clip(BEYOND, [X[0], Y[0]], [X[-1], Y[-1]]))
    assert at(lines, BEYOND).udot[:, 0] == pytest.approx(held, abs=1e-14)
    spline = mbs.function(grid("cubic", **given), "state_derivative", backend=backend)
    assert at(spline, INSIDE).udot[:, 0] == pytest.approx([natural(*p) for p in INSIDE], abs=1e-13)
    slopes = at(spline.derivative("q"), INSIDE).udot[:, 0, 0], at(spline.derivative("u"), INSIDE).udot[:, 0, 0]
    assert slopes[0] == pytest.approx([natural(*p, dx=1) for p in INSIDE], abs=1e-13)
    assert slopes[1] == pytest.approx([natural(*p, dy=1) for p in INSIDE], abs=1e-13)
    mixed = at(spline.derivative("q").derivative("u"), INSIDE).udot[:, 0, 0, 0]
    assert mixed == pytest.approx([natural(*p, dx=1, dy=1) for p in INSIDE], abs=1e-12)


def test_a_surface_of_low_degree_is_that_of_any_spline() -> None:
    """Of x y all natural and other splines are the surface itself, on any grid."""
    values = np.outer(X, Y)
    found = at(mbs.function(grid("cubic", values=values), "state_derivative", backend="python"), INSIDE).udot[:, 0]
    assert found == pytest.approx(RectBivariateSpline(X, Y, values).ev(*INSIDE.T), abs=1e-13)
    assert found == pytest.approx(INSIDE[:, 0] * INSIDE[:, 1], abs=1e-13)


@pytest.mark.parametrize("backend", ["c", "python"])
def test_outside_of_grids(backend: Any) -> None:
    on = mbs.function(grid("linear", "extrapolate"), "state_derivative", backend=backend)
    want = RegularGridInterpolator((X, Y), Z, bounds_error=False, fill_value=None)
    assert at(on, BEYOND).udot[:, 0] == pytest.approx(want(BEYOND), abs=1e-13)
    assert at(on, INSIDE).udot[:, 0] == pytest.approx(want(INSIDE), abs=1e-14)
    spline = mbs.function(grid("cubic", "extrapolate"), "state_derivative", backend=backend)
    straight = [natural(2, y) + natural(2, y, dx=1) for y in (0.0, 1.7)]
    assert at(spline, np.array([[3.0, 0.0], [3.0, 1.7]])).udot[:, 0] == pytest.approx(straight, abs=1e-13)
    none = mbs.function(grid("cubic", "error"), "state_derivative", backend=backend)
    assert np.isnan(at(none, BEYOND).udot).all()
    assert at(none, INSIDE).udot[:, 0] == pytest.approx([natural(*p) for p in INSIDE], abs=1e-13)


def test_outside_of_tables() -> None:
    rows = np.array([[0.0, 1.0], [1.0, 3.0], [3.0, 2.0]])
    places = np.array([[-1.0, 0.0], [0.5, 0.0], [2.0, 0.0], [5.0, 0.0]])
    spline = CubicSpline(*rows.T, bc_type="natural")
    first, last = spline(0) - spline(0, 1), spline(3) + 2 * spline(3, 1)
    for interpolation, outside, want in (
        ("linear", "hold", [1, 2, 2.5, 2]),
        ("linear", "extrapolate", [-1, 2, 2.5, 1]),
        ("linear", "error", [np.nan, 2, 2.5, np.nan]),
        ("cubic", "hold", [1, spline(0.5), spline(2), 2]),
        ("cubic", "extrapolate", [first, spline(0.5), spline(2), last]),
    ):
        system = driven(mbs.Table(table=rows, of="x", interpolation=interpolation, outside=outside))
        found = at(mbs.function(system, "state_derivative", backend="python"), places).udot[:, 0]
        assert found == pytest.approx(np.array(want, dtype=float), abs=1e-14, nan_ok=True)
        assert mbs.loads(mbs.dumps(system)) == system


def test_runs_over_grids() -> None:
    """F = -4 x by a plane on a grid: x = cos 2t; the run ends where it leaves a grid that says so."""
    x, y = np.linspace(-2, 2, 9), np.array([-5.0, 0.0, 5.0])
    plane = {"x": x, "y": y, "values": -4 * x[:, None] + 0 * y}
    for interpolation in ("linear", "cubic"):
        system = grid(interpolation, **plane)
        run = mbs.simulate(system, t_end=3, initial={"x": 1, "u_x": 0})
        assert run["x"] == pytest.approx(np.cos(2 * run.t), abs=2e-8)
    assert len(mbs.simulate(system, t_end=1).ready.mechanism.kinks) == 4  # the ends of both sides, once each
    outside = "the input F has no finite value there; an argument is outside"
    with pytest.raises(mbs.FailedRunError, match=outside) as caught:
        mbs.simulate(grid("linear", "error", **plane), t_end=3, initial={"x": 0, "u_x": 4.5})
    assert caught.value.trajectory.t_final == pytest.approx(np.arcsin(2 / 2.25) / 2, abs=1e-6)
    assert mbs.solve(system, initial={"x": 0.3}).accelerations["x"].value == pytest.approx(-1.2)
    assert not mbs.check(system).failure


GRID = """
multibody_sym: 1
name: motor
bodies: {b: {mass: 1 kg}}
joints: {j: {type: prismatic, parent: ground, child: b, axis: x, q: x, initial: {q: 1 cm, u: 0.2}}}
inputs:
  F: {x: [0, 2 cm], y: [0, 1 s], values: [[0, 1 N], [2 N, 3 N]], of: [x, t], interpolation: cubic, outside: extrapolate}
forces: {f: {type: force, on: b, value: [F, 0, 0]}}
simulation: {t_end: 0.1}
"""


def test_units_and_files() -> None:
    system = mbs.loads(GRID)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.solve(system).accelerations["x"].value == pytest.approx(1.0)
    assert str(system.inputs["F"].dimension) == "N"


@pytest.mark.parametrize(
    ("was", "now", "message"),
    [
        ("[0, 2 cm]", "[0, 0 cm]", r"inputs\.F\.x\.1: arguments increase; 0 comes after 0"),
        ("[0, 2 cm]", "[2 cm]", r"inputs\.F\.x: a grid has at least two arguments"),
        ("[0, 2 cm]", "2 cm", r"inputs\.F\.x: expected a list of numbers, got '2 cm'"),
        ("[0, 2 cm]", "[0, 2 kg]", r"inputs\.F\.x\.1: '2 kg' does not fit here: expected a quantity in m"),
        ("[0, 1 s]", "[0, 1 m]", r"inputs\.F\.y\.1: '1 m' does not fit here: expected a quantity in s"),
        ("[0, 1 s]", "[0, 1 s, 2 s]", r"inputs\.F\.values\.0: there are 3 numbers y, but 2 values here"),
        ("[0, 2 cm]", "[0, 2 cm, 4 cm]", r"inputs\.F\.values: there are 3 numbers x, but values for 2"),
        ("[0, 1 N]", "[0, k]", r"inputs\.F\.values\.0\.1: a grid holds numbers, got k"),
        ("[0, 1 N]", "[0, 1 m]", r"inputs\.F\.values: the values are in m and in N"),
        ("[[0, 1 N], [2 N, 3 N]]", "3", r"inputs\.F\.values: expected a list for each x"),
        ("of: [x, t]", "of: x", r"inputs\.F\.of: expected a list of 2, got 1"),
        ("of: [x, t], ", "", r"of is missing: the two arguments"),
        ("outside: extrapolate", "outside: clamp", "did you mean hold"),
        ("interpolation: cubic", "interpolation: spline", "did you mean cubic"),
    ],
)
def test_wrong_grids(was: str, now: str, message: str) -> None:
    assert was in GRID
    with pytest.raises(mbs.InputError, match=message):
        mbs.simulate(mbs.loads(GRID.replace(was, now, 1)))


def test_too_large_grids() -> None:
    with pytest.raises(mbs.InputError, match="a grid has at most 250,000 values, and 256 along its shorter side"):
        mbs.Grid(x=range(300), y=range(300), values=[[0]], of=["x", "t"])
