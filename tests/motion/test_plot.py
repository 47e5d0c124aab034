"""What plots show: a panel for each unit, names asked for, paths, several runs, changes; nothing dropped unsaid."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.results.plot import plot_of
from multibody_sym.text.values import SI

pytest.importorskip("matplotlib")
EXAMPLES = Path(__file__).parents[2] / "examples"
FIRST, SECOND = (rf"$\mathit{{θ}}$$_{{\mathrm{{{k}}}}}$" for k in (1, 2))
RATE = r"$\dot{\mathit{θ}}$$_{\mathrm{1}}$"
CHAIN = (
    "{multibody_sym: 1, name: chain, repeat: {count: 40, body: {mass: 1, com: [1, 0, 0], points: {end: [1, 0, 0]}},"
    " joint: {type: revolute, parent: end}}}"
)


@pytest.fixture(scope="module")
def run() -> mbs.Trajectory:
    return mbs.simulate(mbs.load(EXAMPLES / "double_pendulum.yaml"), t_end=1, samples=50, backend="python")


def labels(axis: Any) -> list[str]:
    return [text.get_text() for text in axis.get_legend().get_texts()]


def test_a_panel_holds_what_has_one_unit_and_energy_that_only_drifts_is_told_as_constant(run: mbs.Trajectory) -> None:
    figure = run.plot()
    rates = f"{FIRST}, {SECOND}".replace(r"\mathit{θ}", r"\dot{\mathit{θ}}")
    told = ["energy [J]", f"{FIRST}, {SECOND} [deg]", f"{rates} [rad/s]"]
    assert [axis.get_ylabel() for axis in figure.axes] == told
    (told,) = labels(figure.axes[0])
    low, high = figure.axes[0].get_ylim()
    drift = run.energy.max() - run.energy.min()
    assert told == f"energy,\nchanges by {drift:.1e}"
    assert high - low == pytest.approx(0.1 * run.kinetic_energy.max(), rel=1e-5)
    assert np.ptp(run.plot(show="energy_change").axes[0].get_ylim()) < 3 * drift  # asked for, it is drawn to its scale


def test_names_are_chosen_and_drawn_over_another(run: mbs.Trajectory) -> None:
    figure = run.plot(show="u_theta1, kinetic_energy", x="theta1", units="deg")
    assert [labels(axis) for axis in figure.axes] == [[RATE], ["kinetic energy"]]
    assert figure.axes[-1].get_xlabel() == "theta1 [deg]"
    line, start = figure.axes[0].get_lines()
    assert np.allclose(line.get_data(), np.degrees([run["theta1"], run["u_theta1"]]))
    assert [x[0] for x in start.get_data()] == pytest.approx([90, 0])
    with pytest.raises(mbs.InputError, match="called 'theta3'; did you mean theta"):
        run.plot(show=["theta3"])
    with pytest.raises(mbs.InputError, match="called 'phi'"):
        run.plot(x="phi")
    with pytest.raises(mbs.InputError, match="show: expected names"):
        run.plot(show=[])


def test_two_lengths_are_a_path_to_scale(run: mbs.Trajectory) -> None:
    system = mbs.loads(
        "{multibody_sym: 1, name: thrown, gravity: [0, -10, 0], bodies: {b: {mass: 1}}, joints: {p: {type: point,"
        " parent: ground, child: b, axes: xy, q: [x, y], initial: {u: [1, 5]}}}, simulation: {t_end: 1, samples: 5}}"
    )
    figure = mbs.simulate(system, backend="python").plot(show="y", x="x")
    assert figure.axes[0].get_aspect() == 1
    assert run.plot(show="u_theta1", x="theta1").axes[0].get_aspect() == "auto"


def test_runs_lie_over_each_other_by_name(run: mbs.Trajectory) -> None:
    figure = mbs.plot({"long": run, "short": run}, show="theta1,theta2")
    lines = figure.axes[0].get_lines()
    assert labels(figure.axes[0]) == [f"{FIRST}, long", f"{SECOND}, long", f"{FIRST}, short", f"{SECOND}, short"]
    looks = [(line.get_color(), line.get_linestyle()) for line in lines]
    assert len(set(looks)) == 4
    assert looks[0][0] == looks[1][0] != looks[2][0]
    assert labels(mbs.plot([run, run], show="theta1").axes[0]) == [f"{FIRST}, run 1", f"{FIRST}, run 2"]
    for odd in ({}, [1], "run"):
        with pytest.raises(mbs.InputError, match="runs: expected"):
            mbs.plot(odd)  # type: ignore[arg-type]


def test_more_than_eight_curves_have_small_axes_with_names_and_one_scale() -> None:
    run = mbs.simulate(mbs.loads(CHAIN), t_end=0.01, samples=3)
    axes = run.plot(show=list(run.coordinates)).axes
    assert [len(axis.get_lines()) for axis in axes] == [1] * 40
    assert [axis.get_title() for axis in axes] == [rf"joint$_{{\mathrm{{{k}}}}}$" for k in range(1, 41)]
    assert len({axis.get_ylim() for axis in axes}) == 1
    assert [axis.get_ylabel() for axis in axes] == ["angle [deg]", *[""] * 39]
    (few,) = run.plot(show=list(run.coordinates)[:8]).axes
    assert labels(few) == [rf"joint$_{{\mathrm{{{k}}}}}$" for k in range(1, 9)]
    assert len({(line.get_color(), line.get_linestyle()) for line in few.get_lines()}) == 8


def test_angles_are_in_degrees_and_many_of_them_in_turns() -> None:
    for speed, unit, size in ((5.0, "deg", 180 / np.pi), (50.0, "turn", 0.5 / np.pi)):
        system = mbs.loads(
            "{multibody_sym: 1, name: wheel, bodies: {b: {mass: 1, inertia: {Izz: 1}}}, joints: {j: {type: revolute,"
            f" parent: ground, child: b, q: phi, initial: {{u: {speed}}}}}}}, simulation: {{t_end: 1, samples: 3}}}}"
        )
        run = mbs.simulate(system, backend="python")
        angle, rate = run.plot().axes
        assert angle.get_ylabel().endswith(f" [{unit}]")
        assert angle.get_lines()[0].get_ydata() == pytest.approx(run["phi"] * size)
        assert rate.get_ylabel().endswith(" [rad/s]")
        assert run.plot(units="rad").axes[0].get_ylabel().endswith(" [rad]")


def test_changes_are_marked_and_those_without_a_name_are_counted() -> None:
    run = mbs.simulate(mbs.load(EXAMPLES / "textbook" / "mass_on_a_belt.yaml"), samples=200)
    figure, marks = run.plot(show="x"), plot_of({"": run}, SI, "x").marks
    assert [mark.x for mark in marks] == [event["t"] for event in run.changes]
    assert len(figure.axes[0].get_lines()) == 1 + len(marks)
    assert [text.get_text() for text in figure.axes[0].texts] == [mark.text for mark in marks]
    path = plot_of({"": run}, SI, "u_x", "x").marks
    assert all(abs(place[1] - run["x"][np.searchsorted(run.t, event["t"])]) < 1e-12
               for mark, event in zip(path, run.changes, strict=True) for place in mark.places)  # fmt: skip


def test_figures_are_the_same_bytes_twice_and_show_themselves(run: mbs.Trajectory, tmp_path: Path) -> None:
    for ending in ("svg", "png", "pdf"):
        files = [tmp_path / f"{k}.{ending}" for k in range(2)]
        for file in files:
            run.plot(file, show="theta1")
        assert files[0].read_bytes() == files[1].read_bytes()
    assert run.plot(show="theta1")._repr_png_().startswith(b"\x89PNG")
