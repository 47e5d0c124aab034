"""Reactions beside couplings: withheld where nothing says where the couplings' forces act, told otherwise."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.documents.runs import run_summary
from multibody_sym.documents.solution import check_text, solution_text
from multibody_sym.errors import ModelError

G, M, m, R = 9.81, 4.0, 1.5, 0.3
A = m * G / (m + M / 2)
DRUM = f"""\
multibody_sym: 1
name: drum
gravity: [0, -{G}, 0]
bodies:
  ground: {{points: {{side: [{R}, 0, 0]}}}}
  drum: {{shape: {{disc: {R}, mass: {M}}}}}
  block: {{mass: {m}}}
joints:
  axle: {{type: revolute, parent: ground, child: drum, q: phi}}
  guide: {{type: prismatic, parent: ground.side, child: block, axis: -y, q: s}}
"""
STRING = f"constraints: {{string: {{type: expression, zero: s - {R}*phi, acts: in_joints}}}}\n"
NO_PLACE = STRING.replace(", acts: in_joints", "")
TIES = {
    "expression": NO_PLACE,
    "coupler": f"constraints: {{string: {{type: coupler, joints: {{guide: 1, axle: -{R}}}, value: 0}}}}\n",
    "gear": f"constraints: {{string: {{type: gear, joints: [guide, axle], ratio: {R}}}}}\n",
    "velocity": f"constraints: {{string: {{type: velocity, zero: u_s - {R}*u_phi}}}}\n",
}


def components(found: mbs.Solution, joint: str) -> dict[str, float | None]:
    return {name: value.value for name, value in found.reactions[joint].items()}


@pytest.mark.parametrize("kind", TIES)
def test_reactions_that_a_coupling_could_reach_are_withheld(kind: str) -> None:
    """A rope may hang down from the drum or run off sideways: only the moments and forces out of the plane are sure."""
    found = mbs.solve(mbs.loads(DRUM + TIES[kind]))
    assert found.accelerations["s"].value == pytest.approx(A, rel=1e-14)
    for joint in ("axle", "guide"):
        told = components(found, joint)
        assert {name for name, value in told.items() if value is None} == {"fx", "fy", "mz"}
        assert [told[name] for name in ("fz", "mx", "my")] == [0.0, 0.0, 0.0]
    assert found.withheld == {"axle": ("fx", "fy", "mz"), "guide": ("fx", "fy", "mz")}
    (reason,) = found.withheld_reasons
    assert "string" in reason
    assert kind in reason
    assert "acts: in_joints" in reason
    tree = found.as_json()
    assert tree["reactions"]["axle"]["fy"] == {"value": None, "expression": None, "unit": "N"}
    assert tree["withheld"]["axle"] == ["fx", "fy", "mz"]
    assert tree["withheld_reasons"] == [reason]
    assert "fy(axle) =" not in solution_text(found)
    assert reason in solution_text(found)


@pytest.mark.parametrize("kind", TIES)
def test_forces_in_the_joints_are_determined(kind: str) -> None:
    """Each joint is driven along its own axis: the axle carries M g and gets the moment m (g - a) R, the guide F."""
    found = mbs.solve(mbs.loads(DRUM + TIES[kind].replace("}}\n", ", acts: in_joints}}\n")))
    force = m * (G - A)
    assert found.withheld == {}
    axle, guide = components(found, "axle"), components(found, "guide")
    assert axle == pytest.approx({"fx": 0, "fy": M * G, "fz": 0, "mx": 0, "my": 0, "mz": force * R}, rel=1e-12)
    assert guide == pytest.approx({"fx": 0, "fy": force, "fz": 0, "mx": 0, "my": 0, "mz": 0}, rel=1e-12)


def test_what_is_declared_reads_and_writes() -> None:
    system = mbs.loads(DRUM + STRING)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.Expression("s - 0.3*phi", acts="in_joints") == mbs.loads(DRUM + STRING).constraints["string"]
    with pytest.raises(ModelError, match="no choice"):
        mbs.Coupler({"A": 1}, acts="somewhere")


def test_check_tells_what_is_withheld() -> None:
    found = mbs.check(mbs.loads(DRUM + NO_PLACE))
    assert found.withheld == {"axle": ("fx", "fy", "mz"), "guide": ("fx", "fy", "mz")}
    assert found.as_json()["withheld"]["axle"] == ("fx", "fy", "mz")
    assert found.withheld_reasons[0] in check_text(found)
    assert mbs.check(mbs.loads(DRUM + STRING)).withheld == {}


OUTPUTS = 'outputs: {bearing: "2*reaction(axle, fy)", side: "reaction(axle, fz)", force: multiplier(string)}\n'


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_outputs_of_a_run_that_need_them_have_no_value(coordinates: str) -> None:
    text = DRUM + NO_PLACE + OUTPUTS + f"simulation: {{coordinates: {coordinates}}}\n"
    run = mbs.simulate(mbs.loads(text), t_end=0.1, samples=3, backend="python")
    assert np.isnan(run["bearing"]).all()
    assert run["side"].tolist() == [0.0, 0.0, 0.0]
    assert run["force"] == pytest.approx(np.full(3, -m * (G - A)), rel=1e-9)
    assert np.isnan(run.reactions["axle"]["fy"]).all()
    assert np.isfinite(run.reactions["axle"]["fz"]).all()
    assert run.as_json()["outputs"]["bearing"] == [None, None, None]
    assert run.as_json()["withheld"]["axle"] == ["fx", "fy", "mz"]
    told = run_summary(run)
    assert "withheld: fx(axle), fy(axle), mz(axle), fx(guide), fy(guide), mz(guide)" in told
    assert "bearing" in told


def test_absolute_coordinates_tell_the_same_forces_in_joints() -> None:
    text = DRUM + STRING + OUTPUTS
    runs = [
        mbs.simulate(mbs.loads(text + f"simulation: {{coordinates: {c}}}\n"), t_end=0.1, samples=3, backend="python")
        for c in ("relative", "absolute")
    ]
    for joint in ("axle", "guide"):
        for component, values in runs[0].reactions[joint].items():
            np.testing.assert_allclose(runs[1].reactions[joint][component], values, atol=1e-7)


def test_a_question_for_them_has_no_answer() -> None:
    found = mbs.solve(mbs.loads(DRUM + NO_PLACE + 'ask: {pull: "reaction(axle, fy)", side: "reaction(axle, fz)"}\n'))
    assert found.answers["pull"].value is None
    assert found.answers["side"].value == 0.0


def test_a_stop_that_needs_them_is_refused() -> None:
    text = DRUM + NO_PLACE + 'stop: {heavy: "reaction(axle, fy) > 60"}\n'
    with pytest.raises(ModelError, match="string") as caught:
        mbs.simulate(mbs.loads(text), t_end=1)
    assert caught.value.where.path == ("stop", "heavy")


def tied(text: str) -> dict[str, tuple[str, ...]]:
    return dict(mbs.check(mbs.loads(text)).withheld)


CHAIN = """\
multibody_sym: 1
name: chain
gravity: [0, -9.81, 0]
bodies:
  cart: {mass: 3, inertia: {Izz: 1}, points: {p: [1, 0, 0]}}
  arm: {mass: 1, com: [1, 0, 0], inertia: {Izz: 1}, points: {p: [2, 0, 0]}}
  hand: {mass: 1, com: [0.5, 0, 0], inertia: {Izz: 0.2}}
  wheel: {mass: 2, inertia: {Izz: 0.1}}
joints:
  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}
  shoulder: {type: revolute, parent: cart, child: arm, q: alpha}
  elbow: {type: revolute, parent: arm.p, child: hand, q: beta}
  hub: {type: revolute, parent: cart.p, child: wheel, q: gamma}
"""


def test_what_lies_beyond_a_coupling_is_told() -> None:
    """A belt from the wheel to the arm passes its forces on through hub, shoulder and cart: rail and elbow are sure."""
    assert tied(CHAIN + "constraints: {belt: {type: gear, joints: [hub, shoulder], ratio: 2}}\n") == {
        "shoulder": ("fx", "fy", "mz"),
        "hub": ("fx", "fy", "mz"),
    }


def test_what_lies_between_is_withheld_but_along_its_freedom() -> None:
    """A belt from the wheel to the hand passes the shoulder too, about which it does no work: mz there is the drive's.

    On the cart the belt's forces cancel.
    """
    assert tied(CHAIN + "constraints: {belt: {type: gear, joints: [hub, elbow], ratio: 2}}\n") == {
        "shoulder": ("fx", "fy"),
        "elbow": ("fx", "fy", "mz"),
        "hub": ("fx", "fy", "mz"),
    }


def test_in_space_forces_may_be_oblique() -> None:
    inertia = "inertia: {Ixx: 1, Iyy: 2, Izz: 2}"
    text = CHAIN.replace("inertia: {Izz: 1}", inertia).replace("axis: x, q: x", "axis: z, q: x")
    found = tied(text + "constraints: {belt: {type: gear, joints: [hub, elbow], ratio: 2}}\n")
    assert found["elbow"] == ("fx", "fy", "fz", "mx", "my", "mz")
    assert found["shoulder"] == ("fx", "fy", "fz", "mx", "my")
    assert "rail" not in found


FOUR_BAR = """\
multibody_sym: 1
name: four_bar
gravity: [0, -9.81, 0]
bodies:
  ground: {points: {d: [3, 0, 0], o: [0, -1, 0]}}
  crank: {mass: 1, inertia: {Izz: 1}, points: {e: [1, 0, 0]}}
  coupler: {mass: 2, inertia: {Izz: 1}, points: {e: [3, 0, 0]}}
  rocker: {mass: 1, inertia: {Izz: 1}, points: {e: [2, 0, 0]}}
  flywheel: {mass: 5, inertia: {Izz: 1}}
joints:
  A: {type: revolute, parent: ground, child: crank, initial: {q: 60 deg, known: true}}
  B: {type: revolute, parent: crank.e, child: coupler, initial: {q: -40 deg}}
  C: {type: revolute, parent: ground.d, child: rocker, initial: {q: 100 deg}}
  D: {type: revolute, parent: coupler.e, child: rocker.e}
  F: {type: revolute, parent: ground.o, child: flywheel}
"""


def test_a_loop_beyond_a_gear_is_told() -> None:
    """The gear's force on the crank is borne by A: its moment about A is known, and so is all that the loop carries."""
    assert tied(FOUR_BAR + "constraints: {mesh: {type: gear, joints: [F, A], ratio: -2}}\n") == {
        "A": ("fx", "fy", "mz"),
        "F": ("fx", "fy", "mz"),
    }


def test_a_loop_between_is_withheld() -> None:
    """From the flywheel to B a force takes its way through the loop: its forces are unsure, its drives are not."""
    assert tied(FOUR_BAR + "constraints: {mesh: {type: gear, joints: [F, B], ratio: -2}}\n") == {
        "A": ("fx", "fy"),
        "B": ("fx", "fy", "mz"),
        "C": ("fx", "fy"),
        "D": ("fx", "fy"),
        "F": ("fx", "fy", "mz"),
    }


EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.stem)
def test_examples_withhold_nothing_that_is_determined(file: Path) -> None:
    """In all of them every force has a place: the sleigh's edge acts in the joint that stands for the table."""
    from multibody_sym.mechanics.resolve import mechanism

    found = {name: each.components for name, each in mechanism(mbs.load(file)).withheld.items()}
    assert found == {}


def test_the_command_tells_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "drum.yaml"
    file.write_text(DRUM + NO_PLACE)
    assert main(["solve", str(file), "--json"]) == 0
    tree: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert tree["reactions"]["axle"]["fy"]["value"] is None
    assert tree["withheld"]["axle"] == ["fx", "fy", "mz"]


def test_equations_body_by_body_say_what_they_take_for_granted() -> None:
    """They put a coupling's force along the joints' axes; where that is not declared, it is told."""
    from multibody_sym.documents.derivation import derivation_data, derivation_document
    from multibody_sym.documents.document import write_document

    for text, withheld in ((DRUM + NO_PLACE, True), (DRUM + STRING, False)):
        derived = mbs.derive(mbs.loads(text), method="newton_euler")
        told, latex = (write_document(derivation_document(derived), form) for form in ("text", "latex"))
        assert ("not determined: fx(axle), fy(axle), mz(axle), fx(guide)" in told) is withheld
        assert ("not determined: fx(axle)" in latex) is withheld
        parts = ["fx", "fy", "mz"]
        assert derivation_data(derived)["withheld"] == ({"axle": parts, "guide": parts} if withheld else {})
    composite = mbs.derive(mbs.loads(DRUM + NO_PLACE), method="composite_body")
    assert "not determined" not in write_document(derivation_document(composite), "text")


def test_exported_code_leaves_out_outputs_without_a_value(tmp_path: Path) -> None:
    mbs.export(mbs.loads(DRUM + NO_PLACE + OUTPUTS), "python", tmp_path)
    names = json.loads((tmp_path / "names.json").read_text())
    assert names["outputs"] == ["side", "force"]
    assert names["withheld_outputs"] == ["bearing"]
    assert "string" in names["withheld_reasons"][0]


def test_a_rack_is_told_to_let_its_wheel_roll() -> None:
    """Radii are for wheels on hinges: a rack has none, and where its pinion rolls on it the force acts."""
    for kind, told in (("gear", "type: rolling"), ("coupler", "declare a rope")):
        (reason,) = mbs.solve(mbs.loads(DRUM + TIES[kind])).withheld_reasons
        assert told in reason
        assert "acts: in_joints" in reason
    wheels = DRUM.replace(
        "prismatic, parent: ground.side, child: block, axis: -y", "revolute, parent: ground.side, child: block"
    )
    (reason,) = mbs.solve(mbs.loads(wheels + TIES["gear"])).withheld_reasons
    assert "give the gear radii" in reason
    assert "rolling" not in reason
