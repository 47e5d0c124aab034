"""The theorems in symbols: what a book writes, and the same numbers as the quantities of outputs."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.derivation.theorems import with_theorems
from multibody_sym.documents.derivation import derivation_data
from multibody_sym.dynamics.conserved import conserved_quantities

EXAMPLES = Path(mbs.__file__).parents[1] / "examples"


def lines_of(name: str) -> dict[str, list[str]]:
    """Return the equations of each step of an example, as text."""
    system = mbs.load(EXAMPLES / f"{name}.yaml")
    data = derivation_data(with_theorems(mbs.derive(system), conserved_quantities(system)))
    steps = [step for step in data["steps"] if step["title"].startswith(("Theorem", "Conserved"))]
    return {step["title"]: [e["text"] for e in step["equations"]] or step["note"].splitlines() for step in steps}


def test_pushed_cart_with_a_pole() -> None:
    found = lines_of("cart_pole")
    assert found["Theorem of momentum"] == [
        "p_x = (M + m)*x' - m*l*theta'*sin(theta)/2",
        "F_motor_x = push",
        "dp_x/dt = F_motor_x",
        "p_y = m*l*theta'*cos(theta)/2",
        "F_weight_y = -(M + m)*g",
        "dp_y/dt = F_weight_y + R_track_y",
    ]
    assert found["Theorem of energy"] == ["P_motor = push*x'", "d(T + V)/dt = P_motor"]
    assert "Conserved" not in found


def test_hinge_at_the_origin_exerts_no_moment() -> None:
    found = lines_of("double_pendulum")
    assert found["Theorem of angular momentum about the origin"][1:] == [
        "M_weight_z = -(m1 + m2)*g*l1*sin(theta1) - m2*g*l2*sin(theta1 + theta2)",
        "dL_z/dt = M_weight_z",
    ]
    assert found["Theorem of energy"] == ["d(T + V)/dt = 0"]
    assert found["Conserved"][0].startswith("total_energy(): time")


def test_joints_that_exert_nothing_have_no_letters() -> None:
    """A planet's polar coordinates are no guide, and a massless string turns no particle about itself."""
    planet, string = lines_of("kepler"), lines_of("spherical_pendulum")
    assert planet["Theorem of momentum"][2::3] == ["dp_x/dt = F_sun_x", "dp_y/dt = F_sun_y"]
    assert planet["Theorem of angular momentum about the origin"][-1] == "dL_z/dt = 0"
    told = string["Theorem of angular momentum about the origin"]
    assert [line for line in told if "/dt" in line] == ["dL_x/dt = M_weight_x", "dL_y/dt = M_weight_y", "dL_z/dt = 0"]


def test_forces_of_rows_without_a_place_are_their_joints() -> None:
    found = lines_of("chaplygin_sleigh")
    assert found["Theorem of momentum"][1::2] == ["dp_x/dt = R_table_x", "dp_y/dt = R_table_y"]
    assert found["Theorem of angular momentum about the origin"][-1] == "dL_z/dt = M_table_z"


def test_rods_on_ground_are_forces_from_outside() -> None:
    found = lines_of("pendulum_xy")
    assert found["Theorem of momentum"][:3] == [
        "p_x = m*x'",
        "F_rod_x = -x*lambda_rod/sqrt(x^2 + y^2)",
        "dp_x/dt = F_rod_x",
    ]


@pytest.mark.parametrize("form", ["text", "latex", "html", "json"])
def test_command(form: str, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["derive", str(EXAMPLES / "spherical_pendulum.yaml"), "--theorems", "--format", form]
    assert main(given) == 0
    out = capsys.readouterr().out
    assert "Theorem of energy" in out
    assert "angular_momentum(z)" in out.replace("\\_", "_")
    if form == "json":
        assert any(step["title"] == "Conserved" for step in json.loads(out)["steps"])
