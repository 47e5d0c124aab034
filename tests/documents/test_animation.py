"""Animations: the page holds the motion of the run and nothing from elsewhere; GIF and MP4 are films of it."""

from __future__ import annotations

import base64
import json
import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from writing_pages import Page

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.animation.animate import packed_columns, space_stage
from multibody_sym.documents.animation.frames import WINDOW, frames_of
from multibody_sym.motion.results.plot import outputs_and_places, plot_of
from multibody_sym.pictures.draw import item_marks
from multibody_sym.pictures.marks.sheet import Sheet
from multibody_sym.pictures.page.picture import BODY, Hatch, Projection
from multibody_sym.pictures.scene.items import Face
from multibody_sym.program.target_layout import template_text
from multibody_sym.text.values import Units

PAPER = '<pattern id="squares"'
EXAMPLES = Path(__file__).parents[2] / "examples"
HOSTILE = "</script><script>alert(1)</script>\" onload='x' ]]> <!--"


def data_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" class="animation-data">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return dict(json.loads(found[1]))


def unpacked(part: dict[str, Any], rows: int) -> Any:
    """What animation.js makes of packed numbers."""
    raw = np.frombuffer(base64.b64decode(part["data"]), "<i2").astype(float).reshape(rows, -1)
    low, high = np.array(part["low"]), np.array(part["high"])
    return np.where(raw == -32768, np.nan, low + (high - low) * (raw + 32767) / 65534)


@pytest.fixture(scope="module")
def run() -> mbs.Trajectory:
    return mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml"), t_end=1, samples=60, backend="python")


def test_packed_numbers_come_back_to_a_part_of_their_range() -> None:
    some = np.where(np.arange(50) % 7, np.arange(50), np.nan)
    rows = np.column_stack([np.linspace(-3, 5, 50), np.full(50, 7.0), some])
    back = unpacked(packed_columns(rows), 50)
    assert np.array_equal(np.isnan(rows), np.isnan(back))
    assert np.nanmax(np.abs(back - rows)) <= 49 / 65534
    assert packed_columns(np.full((2, 1), np.nan))["low"] == [0.0]
    assert packed_columns(np.zeros((3, 0)))["data"] == ""


def test_a_plane_page_moves_bodies_to_where_the_run_has_them(run: mbs.Trajectory) -> None:
    animation = mbs.animate(run, trace="upper,lower")
    frames, data = frames_of(run), data_of(animation.html)
    poses = unpacked(data["poses"], len(run)).reshape(len(run), -1, 3)
    scale = frames.projection().scale
    angles = np.unwrap(poses[:, 0, 2])
    assert np.allclose(angles - angles[0], run["theta1"] - run["theta1"][0], atol=2e-4)
    assert np.allclose(poses[:, 1, :2] / scale, [placed.poses[1][:2, 3] for placed in frames.placed], atol=1e-4)
    assert [trace["body"] for trace in data["traces"]] == [0, 1]
    assert len({trace["colour"] for trace in data["traces"]}) == 2
    angles_shown, energy = data["plot"]["panels"]  # what is constant comes last
    assert energy["label"] == "energy [J]"
    assert angles_shown["label"] == "theta1, theta2 [rad]"
    curve = unpacked(angles_shown["packed"], len(run))[:, 0]
    assert np.allclose(curve, run["theta1"], atol=1e-4)
    assert len(animation.html) < 50_000


def test_a_page_asks_for_nothing_and_names_end_no_script() -> None:
    text = (EXAMPLES / "elastic_pendulum.yaml").read_text()
    text = text.replace("name: elastic_pendulum", "name: " + json.dumps(HOSTILE))
    run = mbs.simulate(mbs.loads(text), t_end=0.1, samples=5, backend="python")
    html = mbs.animate(run).html
    page = Page(html)
    assert page.asked == []
    assert page.tags.count("script") == 2
    assert page.tags.count("img") == 0
    assert "drag to zoom" in html
    assert "default-src 'none'" in html
    assert "alert(1)</script>" not in html


def test_space_is_drawn_from_poses_with_steady_quaternions() -> None:
    pytest.importorskip("meshcat")
    run = mbs.simulate(mbs.load(EXAMPLES / "spinning_top.yaml"), t_end=0.5, samples=80, backend="python")
    data = data_of(mbs.animate(run).html)
    poses = unpacked(data["poses"], len(run)).reshape(len(run), -1, 7)
    assert np.allclose(np.linalg.norm(poses[:, -1, 3:], axis=1), 1, atol=1e-3)
    assert (np.abs(np.diff(poses[:, -1, 3:], axis=0)).max() < 0.5).all()
    assert np.allclose(np.abs(poses[:, -1, 6]), np.abs(run[next(iter(run.coordinates))]), atol=1e-3)
    assert data["items"]
    assert "Stage);</script>" in mbs.animate(run).html
    flat = mbs.simulate(mbs.load(EXAMPLES / "pendulum.yaml"), t_end=0.1, samples=5, backend="python")
    assert "THREE" in mbs.animate(flat, view="iso").html


def test_plots_beside_a_motion_show_no_quaternions(run: mbs.Trajectory) -> None:
    """A top has outputs; a free body has places beside its quaternion; a ball joint alone has its speeds to show."""
    joints = {"free": ["j_x, j_y, j_z [m]"], "spherical": ["j_wx, j_wy, j_wz [rad/s]"]}
    for joint, labels in joints.items():
        text = "{multibody_sym: 1, name: s, bodies: {b: {shape: {sphere: 0.1 m, mass: 1}}}, joints: "
        system = mbs.loads(text + f"{{j: {{type: {joint}, parent: ground, child: b}}}}}}")
        done = mbs.simulate(system, t_end=0.1, samples=3, backend="python")
        assert [panel.label for panel in plot_of({"": done}, Units(), outputs_and_places(done)).panels] == labels
    shown = data_of(mbs.animate(run, units="ms").html)["plot"]
    assert shown["x"][-1] == pytest.approx(shown["second"] * 1.0)


def test_films_have_frames_in_real_time(run: mbs.Trajectory, tmp_path: Path) -> None:
    image = pytest.importorskip("PIL.Image")
    shown: list[float] = []
    mbs.animate(run, tmp_path / "a.gif", trace="lower,upper", on_progress=shown.append)
    assert shown == pytest.approx(np.arange(25) / 25)
    with image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == 25
        assert film.info["duration"] == 40
        blue = []
        for k in (1, 12, 24):
            film.seek(k)
            blue.append((np.asarray(film.convert("RGB"), dtype=int) @ (-1, 0, 1) > 60).sum())
        assert blue[0] < blue[1] < blue[2]  # the path of a body grows
    pytest.importorskip("imageio_ffmpeg")
    mbs.animate(run, tmp_path / "a.mp4")
    assert (tmp_path / "a.mp4").read_bytes()[4:8] == b"ftyp"


def test_wrong_words_are_told(run: mbs.Trajectory, tmp_path: Path) -> None:
    with pytest.raises(mbs.InputError, match="no point 'uper' to trace; did you mean upper"):
        mbs.animate(run, trace="uper")
    with pytest.raises(mbs.InputError, match=r"\.html, \.gif, \.mp4"):
        mbs.animate(run, tmp_path / "a.avi")
    for odd in (0, "fast", True, float("nan")):
        with pytest.raises(mbs.InputError, match="speed: expected a positive number"):
            mbs.animate(run, speed=odd)
    with pytest.raises(mbs.InputError, match="expected a Trajectory"):
        mbs.animate("run")  # type: ignore[arg-type]


def test_the_command_writes_a_page_and_a_notebook_shows_it(
    run: mbs.Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    asked = ["animate", str(EXAMPLES / "pendulum.yaml"), "--t-end", "0.2", "--samples", "9", "--backend", "python"]
    assert main([*asked, "--show", "theta", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["written"] == ["pendulum.html"]
    assert told["frames"] == 9
    assert (tmp_path / "pendulum.html").read_text().startswith("<!DOCTYPE html>")
    assert main([*asked, "-o", "a.avi"]) == 2
    shown = mbs.animate(run)._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert shown.count("<") == 2


@pytest.mark.parametrize(("ending", "written"), [(".html", ["m.html"]), (".gif", [])])
def test_ctrl_c_keeps_the_motion_until_then_and_no_part_of_a_film(
    ending: str, written: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The signal comes while the run goes on; for a film a second one, while frames are drawn."""
    signals: list[float] = []

    def reached(part: float) -> None:
        signals.append(part)
        if len(signals) == 1 or ending == ".gif":
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("multibody_sym.cli.commands.animate.reached", reached)
    asked = ["animate", str(EXAMPLES / "pendulum.yaml"), "--t-end", "1e5", "--samples", "2000", "--backend", "python"]
    assert main([*asked, "-o", str(tmp_path / f"m{ending}")]) == 130
    assert [path.name for path in tmp_path.iterdir()] == written
    told = capsys.readouterr()
    assert ("where the run was interrupted" in told.out) == (ending == ".html")
    assert ("interrupted" in told.err) == (ending == ".gif")


def test_space_has_a_ground_below_everything_and_the_names_of_the_figure() -> None:
    """A bob on 1 m that starts 1 rad from straight down sinks to 1 m below its ball: the grid lies below that."""
    system = mbs.loads(
        "{multibody_sym: 1, name: s, gravity: [0, 0, -9.81], bodies: {bob: {mass: 1, com: [0, 0, -1]}},"
        " joints: {J_1: {type: universal, parent: ground, child: bob, axes: [x, y], label: J_1, initial: {q: [1, 0]}}}}"
    )
    frames = frames_of(mbs.simulate(system, t_end=2, samples=60, backend="python"))
    _, data = space_stage(frames, Projection((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), [])
    assert data["floor"]["middle"][2] < -1.0
    assert data["floor"]["width"] > 0.5
    middle, up = np.array(data["middle"]), np.array([0.0, 0.0, 1.0])
    assert np.all(np.abs((frames.extent - middle) @ up) < data["reach"] / 2)
    assert np.all(np.abs((frames.extent - middle) @ (1.0, 0.0, 0.0)) < 1.6 * data["reach"] / 2)
    assert data["reach"] < 2.0
    told = {"".join(text for text, _ in each["runs"]): each for each in data["names"]}
    assert set(told) == {"J1"}  # the only body needs no name
    assert told["J1"]["at"] == [0.0, 0.0, 0.0]
    forms = {item["form"] for item in data["items"]} - {"Axes", "Rail", "Symbol"}
    script = template_text("html/space.js")
    assert all(f" {form}(group" in script for form in forms | {"Sphere", "Bowl", "Disc", "Barrel", "Block", "Face"})


def test_a_racket_that_is_a_face_alone_has_room_on_its_page() -> None:
    """The picture is higher than the racket is long, which is longer than both margins about the way of the ball."""
    run = mbs.simulate(mbs.load(EXAMPLES / "impacts/moving_racket.yaml"), t_end=0.01, samples=2, backend="python")
    html = mbs.animate(run).html
    height = float(re.search(r'viewBox="0 0 [\d.]+ ([\d.]+)"', html)[1])
    (racket,) = re.findall(r'<g data-body="0">(.*?)</g>', html)
    ways = [float(y) for y in re.findall(r"[ML][\d.-]+[ ,]([\d.-]+)", racket)]
    assert 60.0 < np.ptp(ways) < height - 10.0


@pytest.mark.parametrize(
    ("joint", "speed", "near", "follow"),
    [("free", "[10, 0, 0, 0, 0, 0]", 0.2, True), ("free", "[0, 0, 0, 0, 0, 1]", None, True),
     ("prismatic, axis: x", "10", 0.2, False)],
)  # fmt: skip
def test_what_goes_far_in_space_may_be_followed(joint: str, speed: str, near: float | None, follow: bool) -> None:
    """A ball of 0.2 m goes 10 m in a second; what only turns needs no following, and a rail is not left behind."""
    system = mbs.loads(
        "{multibody_sym: 1, name: s, bodies: {b: {shape: {sphere: 0.1 m, mass: 1}}}, joints: "
        f"{{j: {{type: {joint}, parent: ground, child: b, initial: {{u: {speed}}}}}}}}}"
    )
    frames = frames_of(mbs.simulate(system, t_end=1, samples=20, backend="python"))
    _, data = space_stage(frames, Projection((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), [])
    assert (data["near"] is None) == (near is None)
    if near is not None:
        assert near <= data["near"] <= near * np.sqrt(3.0) + 1e-9
    assert data["follow"] == follow


def test_what_goes_far_in_the_plane_is_followed() -> None:
    """A cylinder of 0.2 m rolls down for many metres on its slope; a superball flies up from its floor, over paper."""
    rolling = mbs.simulate(mbs.load(EXAMPLES / "textbook/cylinder_down_an_incline.yaml"))
    html = mbs.animate(rolling).html
    wide, high = WINDOW
    assert f'viewBox="0 0 {wide:g} {high:g}"' in html
    frames = frames_of(rolling)
    middles = unpacked(data_of(html)["middles"], len(frames.times))
    scale = frames.window(frames.projection()).projection.scale
    assert np.allclose(np.ptp(middles, axis=0) / scale, np.ptp([p.poses[0][:2, 3] for p in frames.placed], axis=0))
    disc = max(float(radius) for radius in re.findall(r'<circle [^>]*r="([\d.]+)"', html))
    assert 8.0 < disc < high / 4
    assert html.count("<path") < 100  # hatching of 20,000 pt is one line
    assert len(html) < 60_000
    assert PAPER not in html
    flying = mbs.animate(mbs.simulate(mbs.load(EXAMPLES / "impacts/superball.yaml"))).html
    assert data_of(flying)["middles"]
    assert PAPER in flying
    along_a_rail = mbs.simulate(mbs.load(EXAMPLES / "textbook/t1_two_blocks.yaml"), samples=11)
    assert data_of(mbs.animate(along_a_rail).html)["middles"] is None
    sleigh = mbs.animate(mbs.simulate(mbs.load(EXAMPLES / "chaplygin_sleigh.yaml"))).html
    assert data_of(sleigh)["middles"]
    assert PAPER in sleigh  # there is no ground to see it move on


def test_a_film_follows_what_its_page_follows(tmp_path: Path) -> None:
    """The cylinder goes 6.5 m in 2 s, is 0.2 m wide, and is drawn as large as on its page, at the same place."""
    image = pytest.importorskip("PIL.Image")
    run = mbs.simulate(mbs.load(EXAMPLES / "textbook/cylinder_down_an_incline.yaml"), t_end=2, samples=9)
    mbs.animate(run, tmp_path / "a.gif")
    with image.open(tmp_path / "a.gif") as film:
        (wide, high), fill = film.size, [int(BODY[k : k + 2], 16) for k in (1, 3, 5)]
        assert wide / high == pytest.approx(WINDOW[0] / WINDOW[1], rel=0.01)
        for k in (5, film.n_frames - 1):
            film.seek(k)
            disc = np.argwhere(np.all(np.abs(np.asarray(film.convert("RGB"), dtype=int) - fill) < 6, axis=2))
            assert np.allclose(disc.mean(axis=0), [high / 2, wide / 2], atol=0.03 * wide)
            assert np.ptp(disc, axis=0).min() > high / 12


def test_ground_reaches_as_far_as_what_touches_it_goes() -> None:
    """A ball slides and rolls for 22 m: its floor ended where it began."""
    run = mbs.simulate(mbs.load(EXAMPLES / "textbook/sliding_into_rolling.yaml"), samples=50, backend="python")
    frames = frames_of(run)
    seen = frames.projection()
    home = frames.placed[0]
    sheet = Sheet(frames.scene, home, home, seen, others=frames.looked_at)
    (floor,) = [i for i in frames.scene.items if i.role == "surface" and isinstance(i.form, Face)]
    (line,) = [mark for mark in item_marks(sheet, floor) if isinstance(mark, Hatch)]
    ways = np.asarray(line.points)[:, 0] / seen.scale
    assert ways.min() < run["x"].min()
    assert ways.max() > run["x"].max() > 20.0
