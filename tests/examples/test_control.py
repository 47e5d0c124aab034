"""The examples that use functions of a system in loops of their own."""

from __future__ import annotations

import importlib.util
from types import ModuleType

import numpy as np
import pytest
from twins import EXAMPLES

import multibody_sym as mbs


def script(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / "control" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_an_arm_reaches_what_is_near_enough() -> None:
    reach = script("reach")
    tip = mbs.function(reach.arm(), "frame", frame="link2.end")
    for target in ([0.5, 0.4], [-0.3, 0.5]):
        q = reach.reach(np.array(target))
        assert (np.abs(q) <= 2.0).all()
        np.testing.assert_allclose(tip(0.0, q, np.zeros(3)).position[:2], target, atol=1e-12)
    q = reach.reach(np.array([1.2, 0.3]))  # stretched towards what is too far away
    np.testing.assert_allclose(q, [np.arctan2(0.3, 1.2), 0.0, 0.0], atol=1e-6)


def test_an_arm_follows_its_path_as_well_as_it_knows_its_masses() -> None:
    module = script("computed_torque")
    assert module.largest_error(1.0) < 1e-8
    # with masses a tenth wrong M (e'' + KD e' + KP e) is a tenth of what moves the arm: e = 0.1 a / KP at most
    wrong = module.largest_error(1.1)
    assert 1e-3 < wrong < 0.1 * (9.81 / 0.3 + 10.0) / module.KP * 2
    assert wrong == pytest.approx(0.012, rel=0.2)


@pytest.mark.parametrize("name", ["cart_pole", "furuta", "arm"])
def test_lqr_places_the_eigenvalues_that_it_designs(name: str) -> None:
    module = script("lqr")
    closed, designed, place = module.balanced(*module.CASES[name])
    found = mbs.linearize(closed, at=place).eigenvalues
    assert found[0].real < -0.1
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(designed), rtol=1e-9)
    if name != "arm":  # and what begins beside the position comes back to it
        beside = {**place, "theta": place["theta"] + 0.05}
        run = mbs.simulate(closed, initial=beside, t_end=12, samples=13)
        off = [abs(run[q][-1] - x) for q, x in place.items() if not q.startswith("u_")]
        assert max(off) < 1e-3


def test_masses_are_identified_as_far_as_torques_tell_them() -> None:
    """Without noise torques of other motions follow to rounding, whatever the model took the payload for."""
    module = script("identify")
    exact, count = module.identified(0.8, 0.0)
    assert exact < 1e-10
    assert 8 < count < 30
    noisy, _ = module.identified(0.8, 0.1)
    assert 0.001 < noisy < 0.3


def test_a_pole_is_swung_up_by_the_best_of_what_is_tried_ahead() -> None:
    cart = script("predict").swing_up()
    assert np.sin(cart["theta"]) > np.cos(np.radians(10.0))
    assert abs(cart["u_theta"]) < 1.0
