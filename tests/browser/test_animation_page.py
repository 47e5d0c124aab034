"""The page of an animation in Chromium: keys, roles, colours, widths, paths, saved frames, names beside rods."""

from __future__ import annotations

import io
import json
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser_pages import opened
from matplotlib.image import imread

import multibody_sym as mbs

pytestmark = pytest.mark.browser
EXAMPLES = Path(__file__).parents[2] / "examples"
SHOWN = ["double_pendulum", "spinning_top", "textbook/cylinder_down_an_incline", "hostile"]
HOSTILE = "</script><script>document.title='run'</script><img src=x onerror=document.title='run'>" + "long_name_" * 20
TEXTS = """
// Of each text that is shown: its beginning, its colour and the colour behind it.
const of = (text) => {
  const pen = document.createElement('canvas').getContext('2d');
  pen.fillStyle = text;
  pen.fillRect(0, 0, 1, 1);
  return [...pen.getImageData(0, 0, 1, 1).data];
};
const behind = (e) => {
  const colour = e ? of(getComputedStyle(e).backgroundColor) : [255, 255, 255, 255];
  return colour[3] ? colour : behind(e.parentElement);
};
const told = (e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim());
return [...document.querySelectorAll('body *')]
  .filter((e) => e.matches('.plots canvas') || (!e.closest('script') && told(e) && e.getClientRects().length))
  .map((e) => [e.textContent.slice(0, 30), of(getComputedStyle(e)[e.closest('svg') ? 'fill' : 'color']), behind(e)]);
"""
COVERED = """
// How many points of what is drawn lie under names, whose letters leave 2 px of their line free above and below.
const boxes = [...document.querySelectorAll('.names text')].map((t) => t.getBoundingClientRect());
const drawn = '[data-body] > *, [data-strand] > *, path[data-rope], g > g:not([data-body], [data-strand]) > *';
return [...document.querySelector('.stage svg').querySelectorAll(drawn)].flatMap((shape) => {
  const length = shape.getTotalLength(), m = shape.getScreenCTM();
  return Array.from({ length: 60 }, (_, k) => shape.getPointAtLength(length * k / 60).matrixTransform(m));
}).filter((p) => boxes.some((b) => p.x > b.left && p.x < b.right && p.y > b.top + 2 && p.y < b.bottom - 2)).length;
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The pages of SHOWN by name; the last is of a model whose name would run as a script."""
    folder, found = tmp_path_factory.mktemp("pages"), {}
    text = (EXAMPLES / "pendulum.yaml").read_text().replace("name: pendulum", "name: " + json.dumps(HOSTILE))
    for name in SHOWN:
        system = mbs.loads(text) if name == "hostile" else mbs.load(EXAMPLES / f"{name}.yaml")
        found[name] = folder / f"{Path(name).name}.html"
        mbs.animate(mbs.simulate(system, samples=101), found[name])
    return found


def looked_at(browser: Any, page: Path, scheme: str = "light", width: int = 1280, height: int = 800) -> None:
    scheme_asked = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", scheme_asked)
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    opened(browser, page)


def chosen(browser: Any, name: str, value: str) -> None:
    change = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('change'))"
    browser.execute_script(change, browser.find_element("css selector", f"[data-for={name}]"), value)


def moved_to(browser: Any, part: float) -> None:
    move = "arguments[0].value = arguments[1]; arguments[0].dispatchEvent(new Event('input'))"
    browser.execute_script(move, browser.find_element("css selector", "input[type=range]"), part)


def test_keys_play_move_step_loop_and_reset(browser: Any, pages: dict[str, Path]) -> None:
    """The run has 101 samples over 10 s: a frame is 0.1 s, an arrow a fiftieth of the whole."""
    looked_at(browser, pages["double_pendulum"])
    body = browser.find_element("css selector", "body")
    slider = browser.find_element("css selector", "input[type=range]")

    def after(key: str) -> str:
        body.send_keys(key)
        return str(slider.get_attribute("aria-valuetext"))

    left, right, end, home = "\ue012", "\ue014", "\ue010", "\ue011"
    told = [after(key) for key in (right, right, left, ".", ".", ",", end, ",", home)]
    assert told == ["0.20 s", "0.40 s", "0.20 s", "0.30 s", "0.40 s", "0.30 s", "10.00 s", "9.90 s", "0.00 s"]
    moved_to(browser, 0.132)
    assert slider.get_attribute("aria-valuetext") == "1.32 s"
    assert browser.find_element("css selector", "output").text == "t = 1.32 s"
    assert [after(key) for key in (".", ",", ",")] == ["1.40 s", "1.30 s", "1.20 s"]
    slider.send_keys(right)
    assert slider.get_attribute("aria-valuetext") == "1.40 s"
    play, loop = (browser.find_element("css selector", f"[data-do={name}]") for name in ("play", "loop"))
    chosen(browser, "speed", "10")
    after("l")
    assert loop.get_attribute("aria-pressed") == "true"
    after(" ")
    assert play.text == "Pause"
    time.sleep(1.3)  # more than the whole run, which begins again
    assert play.text == "Pause"
    after("l")
    time.sleep(1.3)
    assert play.text == "Play"
    assert slider.get_attribute("aria-valuetext") == "10.00 s"

    def view() -> list[float]:
        return list(browser.execute_script("const v = arguments[0].viewBox.baseVal; return [v.x, v.y, v.width]", svg))

    svg = browser.find_element("css selector", ".stage svg")
    first, turn = view(), "{ctrlKey: true, deltaY: -200, clientX: 600, clientY: 300}"
    browser.execute_script(f"arguments[0].dispatchEvent(new WheelEvent('wheel', {turn}))", svg)
    assert view()[2] < 0.9 * first[2]
    after("r")
    assert view() == pytest.approx(first, abs=0.01)
    after("f")
    assert browser.execute_script("return document.fullscreenElement.className").split()[0] == "animation"
    after("f")


@pytest.mark.parametrize("name", SHOWN)
def test_controls_have_roles_and_names_and_nothing_is_wider_than_a_telephone(
    name: str, browser: Any, pages: dict[str, Path]
) -> None:
    looked_at(browser, pages[name], width=390, height=844)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
    assert browser.title != "run"
    nodes = browser.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
    told = [(n["role"]["value"], n.get("name", {}).get("value", "")) for n in nodes if not n["ignored"] and "role" in n]
    assert all(words for role, words in told if role in ("button", "slider", "combobox", "checkbox", "image", "img"))
    assert {"button", "slider", "combobox", "group", "region", "heading"} <= {role for role, _ in told}
    buttons = {words for role, words in told if role == "button"}
    assert {"Play", "frame before", "next frame", "Loop", "Names", "Reset view", "Save PNG", "Full screen"} <= buttons
    (stage,) = (words for role, words in told if role in ("image", "img") and words.startswith("The mechanism"))
    assert "Bodies: " in stage
    assert " over t [s]" in "".join(words for role, words in told if role in ("image", "img"))


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", SHOWN[:3])
def test_letters_contrast_with_what_is_behind_them(
    name: str, scheme: str, browser: Any, pages: dict[str, Path]
) -> None:
    """4.5:1 at least, as WCAG 2.2 computes it; a dark page is asked for by preference alone, and its stage is dark."""

    def luminance(colour: list[int]) -> float:
        parts = np.array(colour[:3]) / 255
        linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])

    looked_at(browser, pages[name], scheme)
    chosen(browser, "paths", "trail")
    texts = browser.execute_script(TEXTS)
    assert len(texts) > 12
    for text, ink, paper in texts:
        low, high = sorted((luminance(ink), luminance(paper)))
        assert (high + 0.05) / (low + 0.05) >= 4.5, text
    picture = imread(io.BytesIO(browser.find_element("css selector", ".stage").screenshot_as_png))[..., :3]
    assert (np.median(picture) < 0.3) == (scheme == "dark")
    assert np.abs(picture - np.median(picture, axis=(0, 1))).max() > 0.5  # the mechanism is seen on it


def test_each_path_has_a_colour_and_a_trail_is_its_last_tenth(browser: Any, pages: dict[str, Path]) -> None:
    looked_at(browser, pages["double_pendulum"])
    moved_to(browser, 0.5)
    read = """return [...document.querySelectorAll('.stage path[stroke-opacity]')].map(
        (p) => [p.getAttribute('stroke'), p.getTotalLength(), Number(p.getAttribute('stroke-opacity'))])"""

    def paths(shown: str) -> dict[str, list[tuple[float, float]]]:
        chosen(browser, "paths", shown)
        found: dict[str, list[tuple[float, float]]] = {}
        for colour, length, opacity in browser.execute_script(read):
            found.setdefault(colour, []).append((length, opacity))
        return found

    whole, trail, off = paths("whole"), paths("trail"), paths("off")
    assert len(whole) == len(trail) == 2
    assert {length for pieces in off.values() for length, _ in pieces} == {0.0}
    for colour, pieces in trail.items():
        part = sum(length for length, _ in pieces) / sum(length for length, _ in whole[colour])
        assert 0.05 < part < 0.6
        opacities = [opacity for _, opacity in pieces]
        assert opacities == sorted(set(opacities))
    chosen(browser, "paths", "whole")
    browser.find_element("css selector", ".key input").click()
    assert sum(length > 0.0 for _, length, _ in browser.execute_script(read)) == len(trail[next(iter(trail))])


@pytest.mark.parametrize("name", ["double_pendulum", "spinning_top"])
def test_a_saved_frame_is_a_picture_on_white(name: str, browser: Any, pages: dict[str, Path], tmp_path: Path) -> None:
    looked_at(browser, pages[name], "dark")
    download = {"behavior": "allow", "downloadPath": str(tmp_path)}
    browser.execute_cdp_cmd("Browser.setDownloadBehavior", download)
    moved_to(browser, 0.25)
    browser.find_element("css selector", "[data-do=save]").click()
    for _ in range(40):
        time.sleep(0.1)
        if files := list(tmp_path.glob("*.png")):
            break
    (file,) = files
    assert file.name.startswith(f"{name} at ")
    picture = imread(io.BytesIO(file.read_bytes()))
    stage = browser.find_element("css selector", ".stage")
    size = browser.execute_script("return [arguments[0].clientHeight, arguments[0].clientWidth]", stage)
    assert list(picture.shape[:2]) == [2 * each for each in size]
    assert np.median(picture[..., :3]) == 1.0
    assert 0.001 < (picture[..., :3].min(axis=2) < 0.5).mean() < 0.2


@pytest.mark.parametrize("name", ["double_pendulum", "andrews_squeezer", "elastic_pendulum", "textbook/t7_atwood"])
def test_names_lie_on_no_rod_spring_or_rope_while_things_move(name: str, browser: Any, tmp_path: Path) -> None:
    """Seven bars and ten joints, of which four are at one place; a spring that swings; two parts of a rope."""
    mbs.animate(mbs.simulate(mbs.load(EXAMPLES / f"{name}.yaml"), samples=101), tmp_path / "motion.html")
    looked_at(browser, tmp_path / "motion.html")
    covered = {}
    for part in np.linspace(0.0, 1.0, 21):
        moved_to(browser, float(part))
        covered[float(part)] = browser.execute_script(COVERED)
    assert not any(covered.values()), covered


def test_a_cylinder_that_rolls_far_stays_in_the_middle_of_the_stage(browser: Any, pages: dict[str, Path]) -> None:
    looked_at(browser, pages["textbook/cylinder_down_an_incline"])
    for part in (0.0, 0.3, 0.6, 1.0):
        moved_to(browser, part)
        middle, size, stage = browser.execute_script(
            """const b = document.querySelector('g[data-body] circle').getBoundingClientRect();
            const s = document.querySelector('.stage').getBoundingClientRect();
            return [[b.x + b.width / 2 - s.x, b.y + b.height / 2 - s.y], b.width, [s.width, s.height]]"""
        )
        assert np.allclose(middle, np.array(stage) / 2, atol=0.1 * stage[1])
        assert size > stage[1] / 30
    browser.find_element("css selector", "[data-do=follow]").click()
    width = "return document.querySelector('g[data-body] circle').getBoundingClientRect().width"
    assert 0.0 < browser.execute_script(width) < stage[1] / 100
    browser.find_element("css selector", "[data-do=follow]").click()
    assert browser.execute_script(width) == pytest.approx(size)


def test_numbers_beside_names_are_those_of_the_run(browser: Any, pages: dict[str, Path]) -> None:
    looked_at(browser, pages["double_pendulum"])
    moved_to(browser, 0.25)
    told = browser.execute_script("return [...document.querySelectorAll('figcaption b')].map((b) => b.textContent)")
    run = mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml"), samples=101)
    expected = [run["theta1"][25], run["theta2"][25]]
    assert [float(text.replace("\N{MINUS SIGN}", "-")) for text in told[:2]] == pytest.approx(expected, abs=6e-3)


def test_keys_in_a_report_act_where_the_animation_has_the_focus(browser: Any, tmp_path: Path) -> None:
    mbs.report(mbs.load(EXAMPLES / "pendulum.yaml")).write(tmp_path / "report.html")
    looked_at(browser, tmp_path / "report.html")
    slider = browser.find_element("css selector", "input[type=range]")
    before = slider.get_attribute("aria-valuetext")
    browser.find_element("css selector", "body").send_keys("\ue010")
    assert slider.get_attribute("aria-valuetext") == before
    slider.send_keys("\ue010")
    assert slider.get_attribute("aria-valuetext") != before
