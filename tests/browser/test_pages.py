"""Pages in Chromium: animations play and reports open without an error in the console and without a request."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest
from browser_pages import opened

import multibody_sym as mbs
from multibody_sym.documents.formulas import latex_in_mathml

pytestmark = pytest.mark.browser
EXAMPLES = Path(__file__).parents[2] / "examples"
FILES = sorted(EXAMPLES.rglob("*.yaml"))
CHAIN = (
    "{multibody_sym: 1, name: chain, gravity: [0, -9.81, 0], repeat: {count: 100, body: {mass: 0.1, com: [0, -0.2, 0],"
    " points: {end: [0, -0.2, 0]}}, joint: {type: revolute, parent: end, axis: z, initial: {q: 2 deg}}},"
    " simulation: {t_end: 30 s, rtol: 1e-6, atol: 1e-6}}"
)

STOPS = """
multibody_sym: 1
name: stops
gravity: [0, -9.81, 0]
bodies: {cart: {mass: 1}, rod: {mass: 0.2, com: [0, -0.5, 0]}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x, initial: {u: 1}, limits: {lower: -.6, upper: .2}}
  hinge: {type: revolute, parent: cart, child: rod, axis: z, q: phi, limits: {lower: -50 deg, upper: 60 deg}}
simulation: {t_end: 1 s}
"""
NAMES = """
return [...document.querySelectorAll('.names text')].map((t) => {
  const r = t.getBoundingClientRect(); return [t.textContent, r.left, r.top, r.right, r.bottom];
});
"""


def played(browser: Any, seconds: float) -> float:
    """Play an animation and return how many frames a second it drew; it must have gone on."""
    browser.execute_script("document.querySelector('.animation button').click()")
    time.sleep(seconds)
    told = browser.find_element("css selector", ".animation output").text
    assert told.startswith("t = ")
    assert float(told.split()[2]) > 0.0
    return float(browser.execute_script("return Number(document.querySelector('.animation').dataset.frames)")) / seconds


@pytest.mark.parametrize("file", FILES, ids=lambda path: path.stem)
def test_animations_play_and_reports_open(file: Path, browser: Any, tmp_path: Path) -> None:
    report = mbs.report(mbs.load(file))
    report.write(tmp_path / "report.html")
    opened(browser, tmp_path / "report.html")
    assert browser.find_elements("css selector", "figure svg")
    run = report.findings.run
    if isinstance(run, mbs.Trajectory) and len(run) > 1:
        mbs.animate(run, tmp_path / "motion.html")
        opened(browser, tmp_path / "motion.html")
        assert played(browser, 0.4) > 0.0


@pytest.mark.parametrize("latex", [r"\dot{y}", r"\ddot{x}", r"\ddot{\theta}", r"\dot{\varphi}", r"\ddot{I}"])
def test_dots_stand_apart_from_their_letter(latex: str, browser: Any, tmp_path: Path) -> None:
    """A row without ink lies between dots and letter, in the size that formulas of reports have."""
    import io

    from matplotlib.image import imread

    page, math = tmp_path / "dots.html", f"<math>{latex_in_mathml(latex)}</math>"
    page.write_text(f'<!DOCTYPE html><body style="font: 16px serif; margin: 40px">{math}</body>', "utf-8")
    opened(browser, page)
    ink = (imread(io.BytesIO(browser.get_screenshot_as_png()))[..., 0] < 0.9).any(axis=1)
    assert (ink[1:] & ~ink[:-1]).sum() == 2


def test_a_plot_is_zoomed_by_dragging_and_shown_whole_by_a_double_click(browser: Any, tmp_path: Path) -> None:
    """From a quarter to three quarters of the panel, whose axis begins 62 and ends 12 pixels from its edges."""
    from selenium.webdriver import ActionChains

    mbs.report(mbs.load(EXAMPLES / "pendulum.yaml")).write(tmp_path / "report.html")
    opened(browser, tmp_path / "report.html")
    canvas = browser.find_element("css selector", "canvas[title^='drag to zoom']")

    def span() -> tuple[float, float]:
        return float(canvas.get_attribute("data-from")), float(canvas.get_attribute("data-to"))

    whole, way = span(), (canvas.size["width"] - 74) // 4
    middle = 62 + 2 * way - canvas.size["width"] // 2
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    drag = ActionChains(browser).move_to_element_with_offset(canvas, middle - way, 0).click_and_hold()
    drag.move_by_offset(2 * way, 0).release().perform()
    length = whole[1] - whole[0]
    assert span() == pytest.approx((whole[0] + length / 4, whole[1] - length / 4), abs=0.02 * length)
    ActionChains(browser).move_to_element_with_offset(canvas, middle, 0).double_click().perform()
    assert span() == pytest.approx(whole)


def overlapping(names: list[tuple[str, float, float, float, float]]) -> list[tuple[str, str]]:
    """Return the names of which one lies over the other, by more than half a pixel."""
    pairs = ((a, b) for k, a in enumerate(names) for b in names[:k])
    apart = ((a, b, min(a[3], b[3]) - max(a[1], b[1]), min(a[4], b[4]) - max(a[2], b[2])) for a, b in pairs)
    return [(a[0], b[0]) for a, b, wide, high in apart if min(wide, high) > 0.5]


@pytest.mark.parametrize("name", ["stewart_platform", "gyroscope", "andrews_squeezer", "stops"])
def test_names_do_not_lie_over_each_other_while_things_move_and_turn(name: str, browser: Any, tmp_path: Path) -> None:
    """Four joints of the platform are at one place, and all of a gyroscope are."""
    from selenium.webdriver import ActionChains

    system = mbs.loads(STOPS) if name == "stops" else mbs.load(EXAMPLES / f"{name}.yaml")
    mbs.animate(mbs.simulate(system, samples=60), tmp_path / "motion.html")
    opened(browser, tmp_path / "motion.html")
    slider = "const slider = document.querySelector('input[type=range]'); slider.value = arguments[0];"
    move = slider + "slider.dispatchEvent(new Event('input'));"
    found = {}
    for part in (0.0, 0.3, 0.6, 0.9):
        browser.execute_script(move, part)
        names = browser.execute_script(NAMES)
        found[part] = overlapping(names)
        for canvas in browser.find_elements("css selector", ".stage canvas"):
            ActionChains(browser).drag_and_drop_by_offset(canvas, 90, 30).perform()
    assert {part: pairs for part, pairs in found.items() if pairs} == {}
    assert names
    if name == "stops":
        assert {"x ≤ 0.2 m", "x ≥ −0.6 m", "φ ≥ −50°", "φ ≤ 60°"} <= {label for label, *_ in names}


def test_a_chain_of_100_links_is_smooth_and_small(browser: Any, tmp_path: Path) -> None:
    report = mbs.report(mbs.loads(CHAIN))
    run = report.findings.run
    assert isinstance(run, mbs.Trajectory)
    animation = mbs.animate(run, tmp_path / "chain.html")
    assert len(animation.html) <= 2_000_000
    assert len(report.html) <= 6_000_000
    opened(browser, tmp_path / "chain.html")
    rate = played(browser, 3.0)
    print(f"{len(animation.html)} bytes, report {len(report.html)}, {rate:.0f} frames a second")
