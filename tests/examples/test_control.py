"""The examples that use functions of a system in loops of their own."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from twins import EXAMPLES

import multibody_sym as mbs


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / "control" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_controllers_are_short() -> None:
    for name, most in {"lqr": 20, "computed_torque": 20, "swing_up": 20, "environment": 30}.items():
        lines = (EXAMPLES / "control" / f"{name}.py").read_text().splitlines()
        assert sum(1 for line in lines if line.strip()) <= most, name


def test_an_arm_reaches_what_is_near_enough() -> None:
    reach = script("reach")
    tip = mbs.function(reach.ARM, "frame", frame="link6.end")
    for target in ((0.5, 0.4, 0.6), (-0.3, 0.5, 1.0)):
        np.testing.assert_allclose(tip(0.0, reach.reach(*target).q, np.zeros(7)).position, target, atol=1e-10)
    far = reach.reach(3.0, 0.0, 0.0)  # stretched towards what is too far away
    assert not far.reached
    assert far.missed == pytest.approx(3.0 - 7 * 0.3, abs=1e-9)


def test_a_robot_follows_its_path_by_torques_of_each_millisecond() -> None:
    """Torques are held from sample to sample: the error goes with the time between them."""
    pytest.importorskip("pinocchio", reason="whose package brings the robot descriptions")
    module = script("computed_torque")
    often, seldom = module.largest_error(1e-3), module.largest_error(2e-3)
    assert often < 1.5e-4
    assert seldom / often == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("name", ["../cart_pole", "../furuta", "arm"])
def test_lqr_places_the_eigenvalues_that_it_designs(name: str) -> None:
    system, place, law, designed = script("lqr").balanced(name)
    found = mbs.linearize(system, at=place, inputs=law).eigenvalues
    assert found[0].real < -0.1
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(designed), rtol=1e-9)
    if name != "arm":  # and what begins beside the position comes back to it
        beside = {**place, "theta": place["theta"] + 0.05}
        run = mbs.simulate(system, initial=beside, inputs=law, t_end=12, samples=13)
        off = [abs(run[q][-1] - x) for q, x in place.items() if not q.startswith("u_")]
        assert max(off) < 1e-3


def test_collocation_swings_a_pole_up() -> None:
    """The rule joins all times; the exact motion under its pushes ends near where it should."""
    module = script("swing_up")
    assert module.best.success
    assert np.abs(module.defects(module.best.x)[0]).max() < 1e-8
    rng = np.random.default_rng(0)
    at, way = module.best.x, rng.normal(size=module.best.x.size)
    (over, _), (under, _) = (module.defects(at + x * way) for x in (1e-6, -1e-6))
    np.testing.assert_allclose(module.defects(at)[1] @ way, (over - under) / 2e-6, atol=1e-7)
    assert abs(module.run["theta"][-1] - np.pi / 2) < 0.08
    middle = module.run["x"][500], module.run["theta"][500]
    assert module.best.x.reshape(-1, 5)[20, :2] == pytest.approx(middle, abs=0.02)


def test_a_sampled_controller_holds_what_its_discrete_model_holds() -> None:
    """Near upright errors shrink from sample to sample as the eigenvalues say; past the limit the rod never rests."""
    module = script("sampled")
    run, factor = module.held_up(0.05)
    off = np.abs(run["a"] - np.pi / 2)[75:300:25]  # two samples apart
    np.testing.assert_allclose(off[1:] / off[:-1], factor**2, rtol=1e-3)
    run, factor = module.held_up(0.09)
    assert factor > 1
    assert np.abs(run["a"][-250:] - np.pi / 2).max() > 0.1


def test_an_acceleration_that_is_prescribed_brings_a_load_to_rest() -> None:
    """The same by scipy on theta'' = -(g*sin(theta) + a*cos(theta))/l, whose trolley has no force."""
    module = script("crane")
    g, length = 9.81, 4.0
    rates = np.array([[0, 0, 0, 1], [0, 0, 1, 0], [0, -g / length, 0, 0], [0, 0, 0, 0]])
    np.testing.assert_allclose(module.near.A, rates, atol=1e-12)
    np.testing.assert_allclose(module.near.B[:, 0], [0, 0, -1 / length, 1], atol=1e-12)
    run, x = module.travel(), np.zeros(4)
    for k in range(250):
        a = module.law(k * module.EVERY, x[[0, 1, 3]], x[[3, 2]])

        def rate(t: float, x: np.ndarray, a: float = a) -> list[float]:
            return [x[3], x[2], -(g * np.sin(x[1]) + a * np.cos(x[1])) / length, a]

        x = solve_ivp(rate, (0, module.EVERY), x, rtol=1e-10, atol=1e-12).y[:, -1]
    k = np.searchsorted(run.t, 5.0 - 1e-9)
    assert [run[name][k] for name in ("x", "theta", "u_theta", "v")] == pytest.approx(x, abs=1e-6)
    assert run["reach"][-1] == pytest.approx(6.0, abs=0.01)


def test_masses_are_identified_as_far_as_torques_tell_them() -> None:
    """Without noise to rounding; with it the errors fall with the square root of the number of motions."""
    module = script("identify")
    found, true = module.identified(0.0)
    np.testing.assert_allclose(found, true, atol=1e-12)
    few, many = (np.linalg.norm(np.subtract(*module.identified(0.1, count))) for count in (50, 5000))
    assert few / many == pytest.approx(10, rel=0.5)


def test_a_pole_is_swung_up_by_the_best_of_what_is_tried_ahead() -> None:
    cart = script("predict").cart
    assert np.sin(cart["theta"]) > np.cos(np.radians(10.0))
    assert abs(cart["u_theta"]) < 1.0
