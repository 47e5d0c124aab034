"""Live pages in Chromium compute the motion of a run, answer keys, sliders and drags, and open in a state."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_pages import opened

import multibody_sym as mbs

pytestmark = pytest.mark.browser
EXAMPLES = Path(__file__).parents[2] / "examples"
SHOWN = ["double_pendulum", "four_bar", "spinning_top", "swinging_atwood"]
ROOT = "const root = document.querySelector('.live');"


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder, found = tmp_path_factory.mktemp("live"), {}
    for name in SHOWN:
        found[name] = folder / f"{name}.html"
        mbs.live(mbs.load(EXAMPLES / f"{name}.yaml"), found[name])
    return found


def state(browser: Any) -> list[float]:
    found: list[float] = browser.execute_script(f"{ROOT} return [...root.model.q, ...root.model.u]")
    return found


@pytest.mark.parametrize("name", SHOWN)
def test_two_seconds_are_those_of_a_run(browser: Any, pages: dict[str, Path], name: str) -> None:
    opened(browser, pages[name])
    browser.execute_script(f"{ROOT} root.model.advance(2.0)")
    run = mbs.simulate(mbs.load(EXAMPLES / f"{name}.yaml"), t_end=2.0, samples=2, rtol=1e-11)
    assert np.allclose(state(browser), [*run.q[-1], *run.u[-1]], rtol=1e-6, atol=1e-6)


def test_keys_start_step_and_restart(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["double_pendulum"])
    start = state(browser)
    browser.find_element("css selector", "[data-do=play]").click()
    time.sleep(1.0)
    browser.find_element("css selector", "[data-do=play]").click()
    assert int(browser.execute_script(f"{ROOT} return root.dataset.frames")) > 10
    assert float(browser.execute_script(f"{ROOT} return root.dataset.busy")) < 50.0
    after = state(browser)
    assert after != start
    browser.find_element("css selector", "[data-do=step]").click()
    assert state(browser) != after
    browser.find_element("css selector", "[data-do=restart]").click()
    assert state(browser) == start


def test_a_drag_takes_the_mechanism_along_and_the_address_holds_it(browser: Any, pages: dict[str, Path]) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    opened(browser, pages["four_bar"])
    start = state(browser)
    body = browser.find_elements("css selector", ".stage g[data-body] > *")[-1]
    ActionChains(browser).move_to_element(body).click_and_hold().move_by_offset(-30, 20).release().perform()
    moved = state(browser)
    assert np.max(np.abs(np.subtract(moved, start))) > 1e-3
    nq = len(start) // 2
    system = mbs.load(EXAMPLES / "four_bar.yaml")
    names = [c.name for c in mbs.mechanism(system).coordinates]
    placed = mbs.simulate(system, initial=dict(zip(names, moved[:nq], strict=True)), t_end=1e-3, samples=2)
    assert np.allclose(placed.q[0], moved[:nq], atol=1e-9)  # its loop is closed
    address = browser.current_url
    browser.get("about:blank")
    browser.get(address)
    time.sleep(0.2)
    assert np.allclose(state(browser), moved, rtol=0.0, atol=1e-12)


def test_a_slider_changes_the_motion(browser: Any, pages: dict[str, Path]) -> None:
    opened(browser, pages["double_pendulum"])
    change = "arguments[0].value = 3; arguments[0].dispatchEvent(new Event('input'))"
    browser.execute_script(change, browser.find_element("css selector", ".parameters input[aria-label=m2]"))
    browser.execute_script(f"{ROOT} root.model.advance(1.0)")
    run = mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml"), parameters={"m2": 3.0}, t_end=1.0, samples=2)
    assert np.allclose(state(browser), [*run.q[-1], *run.u[-1]], rtol=1e-6, atol=1e-6)
    assert "p.m2=3" in browser.current_url


def test_it_fits_a_phone(browser: Any, pages: dict[str, Path]) -> None:
    size = {"width": 390, "height": 800, "deviceScaleFactor": 1, "mobile": True}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    opened(browser, pages["double_pendulum"])
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
