"""What notebooks show: figures, formulas and tables of results, and short words for everything."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.documents import notebook

EXAMPLES = Path(__file__).parents[2] / "examples"
PENDULUM = """
multibody_sym: 1
name: crank & "rod" <b>
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: {value: 0.5 m, positive: true}, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: crank_angle, initial: {q: 30 deg}}}
forces: {drive: {type: torque, joint: hinge, value: M}}
inputs: {M: 0}
"""


@pytest.fixture(scope="module")
def system() -> mbs.System:
    return mbs.loads(PENDULUM)


@pytest.fixture(scope="module")
def run(system: mbs.System) -> mbs.Trajectory:
    return mbs.simulate(system, t_end=0.1, samples=20, backend="python")


def test_everything_says_in_a_line_what_it_is(system: mbs.System, run: mbs.Trajectory) -> None:
    asked = [
        system, mbs.mechanism(system), mbs.state_derivative(system), mbs.prepare(system, backend="python"),
        mbs.compile(mbs.state_derivative(system), backend="python"), mbs.solve(system), mbs.linearize(system), run,
        mbs.check(system), run.table(), run.redundancy, mbs.compile(mbs.mass_matrix(system), backend="python"),
        mbs.compile(mbs.canonical_equations(system), backend="python"),
        mbs.derive(system), mbs.derive(system, method="hamilton"),
    ]  # fmt: skip
    lengths = {type(each).__name__: len(repr(each)) for each in asked}
    assert max(lengths.values()) <= 250, lengths
    assert repr(system) == '<System crank & "rod" <b>: 1 body, 1 joint, 1 force>'
    assert repr(asked[4]) == '<RightSide of crank & "rod" <b>: rhs(t, x) with x = (crank_angle, u_crank_angle)>'
    chain = mbs.load(EXAMPLES / "chain.yaml")
    assert repr(mbs.linearize(chain)) == (
        "<Linearization in joint1, joint2, joint3, joint4, joint5, .. 15 more>"
    )


def test_solutions_and_linearisations_are_formulas(system: mbs.System) -> None:
    told = notebook.solution_markdown(mbs.solve(system))
    lettered = mbs.loads(PENDULUM.replace("l: {value: 0.5 m,", "l: {value: 0.5 m, label: R_0,"))
    assert "R_{0}" in notebook.solution_markdown(mbs.solve(lettered))
    assert r"\ddot{\phi}_{\mathrm{crank}} &=" in told
    assert r"\mathrm{rad/s^2}" in told
    assert "<" not in told
    told = notebook.linearization_markdown(mbs.linearize(system, at="equilibrium"))
    assert r"\frac{d}{dt} \begin{bmatrix}\phi_{\mathrm{crank}} \\ u_{\phi,\mathrm{crank}}" in told
    assert r"\begin{bmatrix}0 & 1 \\ -19.62 & 0\end{bmatrix}" in told
    assert r"$\pm 4.4294\,i$" in told
    rows = notebook.equilibrium_markdown(mbs.equilibrium(system)).splitlines()
    assert rows[0].startswith(r"|  | $\phi_{\mathrm{crank}}$ [rad]")
    assert {row.split("|")[1].strip() for row in rows[2:]} == {"stable", "unstable"}


def test_runs_tables_and_reports_are_pages_in_which_names_are_text(run: mbs.Trajectory, system: mbs.System) -> None:
    told = notebook.run_html(run)
    name = "crank &amp; &quot;rod&quot; &lt;b&gt;"
    assert told.startswith(f'<pre style="white-space: pre-wrap">{name}: done at t = 0.1 s')
    assert "<b>" not in told
    table = notebook.table_html(run.table())
    assert table.count("<tr>") == 1 + 11
    assert "<th>crank_angle [rad]</th>" in table
    assert "20 rows" in table
    assert "no redundant constraints" in notebook.redundancy_html(run.redundancy)
    report = notebook.check_html(mbs.check(system))
    assert report.startswith('<p style="color: #1a7f37"><b>verdict: all agree')
    assert "degrees of freedom: 1" in report
    assert "<td>newton_euler</td><td>" in report
    assert "<td>angular momentum</td><td>" in report


def test_studies_steps_and_eigenvalues_are_tables_formulas_and_pictures(system: mbs.System) -> None:
    study = mbs.sweep(system, {"l": [0.2, 0.5]}, t_end=0.1, samples=3, workers=1)
    told = notebook.study_html(study)
    assert told.startswith("<table><tr><th>l [m]</th><th>t</th><th>crank_angle end [rad]</th>")
    assert "<td>0.2</td>" in told and "<p>2 runs</p>" in told  # noqa: PT018
    pytest.importorskip("matplotlib")
    assert '<img alt="crank &amp; &quot;rod&quot; &lt;b&gt; over l" src="data:image/png;base64,' in told
    steps = mbs.solve(system, steps=True).steps
    told = notebook.worked_html(steps)
    assert "<h4>Elimination</h4>" in told or "<h4>Result</h4>" in told
    assert "<math" in told
    told = notebook.linearization_markdown(mbs.linearize(system, at="equilibrium"))
    assert told.splitlines()[-1] == r"| $\pm 4.4294\,i$ | 0.705 | 0 |"


def test_what_is_printed_below_positions_is_shown_too() -> None:
    found = mbs.equilibrium(mbs.load(EXAMPLES / "double_pendulum.yaml"), initial={"u_theta1": 1})
    assert notebook.equilibrium_markdown(found).splitlines()[-1].startswith("*note: at rest, start speeds are left out")


def test_tables_become_data_frames(run: mbs.Trajectory) -> None:
    pytest.importorskip("pandas")
    frame = run.table(units="deg").to_dataframe()
    assert frame.index.name == "t"
    assert list(frame.columns) == ["crank_angle", "u_crank_angle"]
    assert frame.attrs["units"]["crank_angle"] == "deg"
    assert frame["crank_angle"].iloc[0] == pytest.approx(30)


SHELL = """
from IPython.core.interactiveshell import InteractiveShell
shell = InteractiveShell.instance()
import multibody_sym as mbs
system = mbs.load({file!r})
for each in (system, mbs.solve(system), mbs.linearize(system), mbs.derive(system)):
    print(type(each).__name__, *sorted(shell.display_formatter.format(each)[0]))
"""


def test_a_shell_is_told_of_them_when_the_package_is_imported() -> None:
    pytest.importorskip("IPython")
    program = SHELL.format(file=str(EXAMPLES / "pendulum.yaml"))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [
        "System text/html text/plain",
        "Solution text/markdown text/plain",
        "Linearization text/markdown text/plain",
        "SymbolicEquations text/latex text/plain",
    ]


def test_every_type_that_is_shown_is_there() -> None:
    for each in notebook.SHOWN:
        module: Any = __import__(each.module, fromlist=[each.name])
        assert isinstance(getattr(module, each.name), type)
        assert callable(getattr(notebook, each.function))
