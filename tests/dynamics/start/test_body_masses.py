"""Masses and inertias that bodies can have, against points of mass, by hand, and in every command."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.cli.main import main
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.errors import ModelError

EXAMPLES = Path(__file__).parents[3] / "examples"
COMMANDS: dict[str, Callable[[mbs.System], Any]] = {
    "check": mbs.check,
    "solve": mbs.solve,
    "simulate": lambda system: mbs.simulate(system, t_end=0.01, samples=2, backend="python"),
    "linearize": mbs.linearize,
    "equilibrium": mbs.equilibrium,
    "derive": mbs.derive,
    "compile": lambda system: mbs.compile(mbs.state_derivative(system), backend="python"),
    "mass_matrix": lambda system: mbs.compile(mbs.mass_matrix(system), backend="python"),
}


def swing(**bodies: mbs.Body) -> mbs.System:
    """Return bodies welded one to the other, the first on a hinge about z, each at (1, 0.5, 0.25) of the one before."""
    names = list(bodies)
    joints: dict[str, Any] = {"hinge": mbs.Revolute("ground", names[0], axis="z", q="phi", initial={"q": 0.3})}
    placed = {}
    for name, body in bodies.items():
        turned = {"position": [1, 0.5, 0.25], "rotate": [{"axis": [1, 2, 3], "angle": 0.7}]}
        placed[name] = mbs.Body(body.mass, body.com, body.inertia, frames={"next": turned})
    joints |= {f"weld {b}": mbs.Fixed(f"{a}.next", b) for a, b in pairwise(names)}
    return mbs.System("swing", gravity=[0, -9.81, 0], bodies=placed, joints=joints)


def tensor(matrix: Any) -> dict[str, float]:
    """Return an inertia matrix as a body declares it."""
    m = np.asarray(matrix, dtype=float)
    pairs = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
    return {key: float(m[place]) for key, place in pairs.items()}


def of_points(masses: Any, places: Any) -> tuple[float, list[float], dict[str, float]]:
    """Return mass, centre of mass and inertia about it of points."""
    m, r = np.asarray(masses, dtype=float), np.asarray(places, dtype=float)
    com = m @ r / m.sum()
    d = r - com
    J = sum(mk * (dk @ dk * np.eye(3) - np.outer(dk, dk)) for mk, dk in zip(m, d, strict=True))
    return float(m.sum()), com.tolist(), tensor(J)


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize(
    ("body", "told"),
    [
        (mbs.Body(mass=-1, inertia={"Izz": 10}), "the mass of rod is -1 kg"),
        (mbs.Body(mass=1, com=[1, 0, 0], inertia={"Izz": -0.1}), "none is negative"),
        (mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 3}), "more than the sum of the others"),
        (mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1, "Ixy": 1.1}), "none is negative"),
    ],
)
def test_what_no_body_has_is_refused_by_every_command(name: str, body: mbs.Body, told: str) -> None:
    with pytest.raises(ModelError, match=told) as caught:
        COMMANDS[name](swing(rod=body))
    assert caught.value.where.path == ("bodies", "rod", "mass" if told.startswith("the mass") else "inertia")


@pytest.mark.parametrize("command", ["check", "solve", "simulate", "linearize", "equilibrium", "derive", "export"])
def test_a_negative_mass_from_an_option_is_refused(command: str, tmp_path: Path, capsys: Any) -> None:
    more = {"export": ["--to", "c", "-o", str(tmp_path / "out")]}.get(command, [])
    code = main([command, str(EXAMPLES / "four_bar.yaml"), "--set", "a=-0.2 m", "--json", *more])
    (error,) = json.loads(capsys.readouterr().out)["errors"]
    assert (code, error["code"], error["where"]["path"]) == (2, "model", "bodies.crank.shape.mass")
    assert "the mass of crank is -0.4 kg" in error["message"]
    assert not (tmp_path / "out").exists()


def test_bodies_of_points_are_accepted_wherever_they_are() -> None:
    """Two points have a moment of zero, points in a plane moments that add up exactly: rounding is no reason."""
    rng = np.random.default_rng(3)
    for seed in range(200):
        count = 1 + seed % 6
        places = rng.normal(size=(count, 3)) * 10.0 ** rng.integers(-3, 3)
        places[:, 2] *= float(seed % 3 > 0)
        m, com, inertia = of_points(rng.uniform(0.1, 5, count), places + rng.normal(size=3))
        other = of_points([1, 2, 3], rng.normal(size=(3, 3)))
        bodies = {"a": mbs.Body(m, com, inertia), "b": mbs.Body(*other), "c": mbs.Body(mass=1)}
        check_numbers(swing(**bodies))


def test_triangle_inequality_is_judged_at_its_limit() -> None:
    for excess, fine in ((0.0, True), (1e-9, True), (1e-3, False)):
        system = swing(a=mbs.Body(mass=1, inertia={"Ixx": 0.3, "Iyy": 0.2, "Izz": 0.5 * (1 + excess)}))
        if fine:
            check_numbers(system)
        else:
            with pytest.raises(ModelError, match="more than the sum"):
                check_numbers(system)


def test_holes_are_taken_out_of_what_they_are_welded_to() -> None:
    """A disc with a hole of half its radius beside the centre: what is left is a body; the rest of it is none."""
    disc = mbs.Body(mass=4, inertia={"Ixx": 1, "Iyy": 1, "Izz": 2})
    frames = {"side": {"position": [0.4, 0, 0]}}
    plate = mbs.Body(disc.mass, disc.com, disc.inertia, frames=frames)
    hole = mbs.Body(mass=-1, inertia={"Ixx": -0.0625, "Iyy": -0.0625, "Izz": -0.125})
    joints = {"hinge": mbs.Revolute("ground", "plate", axis="z", q="phi"), "weld": mbs.Fixed("plate.side", "hole")}
    system = mbs.System("holed", gravity=[0, -9.81, 0], bodies={"plate": plate, "hole": hole}, joints=joints)
    found = mbs.check(system)
    assert found.agrees
    assert "body hole has a negative mass: it counts as a hole, taken out of plate" in found.hints
    # Izz about the hinge: 2 - (0.125 + 1 * 0.4^2); torque of the weight: -(-1) * 9.81 * 0.4
    solution = mbs.solve(system)
    assert solution.accelerations["phi"].value == pytest.approx(9.81 * 0.4 / (2 - 0.125 - 0.16), rel=1e-12)
    heavy = mbs.Body(mass=-5, inertia=hole.inertia)
    with pytest.raises(ModelError, match="the mass of plate together with hole is -1 kg") as caught:
        mbs.check(mbs.System("holed", bodies={"plate": plate, "hole": heavy}, joints=joints))
    assert caught.value.where.path == ("bodies", "hole", "mass")
    far = mbs.Body(mass=4, inertia=disc.inertia, frames={"side": {"position": [2, 0, 0]}})
    with pytest.raises(ModelError, match="none is negative"):
        mbs.check(mbs.System("holed", bodies={"plate": far, "hole": hole}, joints=joints))


def test_a_hole_as_heavy_as_its_body_has_its_centre() -> None:
    """What is left has no mass; a static moment m_i r_i of nothing is no body's, its moment of inertia may be one."""

    def left(place: list[float], com: float = 0.0) -> mbs.System:
        inertia = {"Ixx": 0.25, "Iyy": 0.25, "Izz": 0.5}
        disc = mbs.Body(mass=4, com=[com, 0, 0], inertia=inertia, frames={"side": {"position": place}})
        hole = mbs.Body(mass=-4, inertia={"Ixx": -0.05, "Iyy": -0.05, "Izz": -0.1})
        joints = {"hinge": mbs.Revolute("ground", "disc", q="phi"), "weld": mbs.Fixed("disc.side", "hole")}
        return mbs.System("holed", bodies={"disc": disc, "hole": hole}, joints=joints)

    for place in ([0.2, 0, 0], [0, 1e-3, 0], [0.2, 0, 0.1]):
        with pytest.raises(
            ModelError, match="the mass of disc together with hole is 0, but not its static moment"
        ) as caught:
            check_numbers(left(place))
        assert caught.value.where.path == ("bodies", "hole")
    with pytest.raises(ModelError, match=r"static moment: 0\.8 kg m"):
        check_numbers(left([0.2, 0, 0]))
    check_numbers(left([0, 0, 0]))
    check_numbers(left([1 / 3, 0, 0], com=0.33333333))


@pytest.mark.parametrize(
    "inertia",
    [{"Izz": 0.3}, {"Izz": 0.3, "Iyy": 0.1}, {"Ixx": 5}, {"Izz": 0.3, "Ixy": 0.1}, {"Izz": 0}, None],
    ids=str,
)
def test_moments_that_are_left_out_are_no_contradiction(inertia: dict[str, float] | None) -> None:
    body = mbs.Body(mass=1, com=[0.3, 0.2, 0], inertia=inertia)
    check_numbers(swing(a=body))
    check_numbers(swing(a=body, b=body, c=mbs.Body(mass=2)))
    check_numbers(swing(a=mbs.Body(), b=body))


def test_massless_bodies_and_rotors_of_inertia_alone_are_fine() -> None:
    check_numbers(swing(link=mbs.Body(), bob=mbs.Body(mass=1)))
    check_numbers(swing(rotor=mbs.Body(inertia={"Ixx": 1, "Iyy": 1, "Izz": 2})))
