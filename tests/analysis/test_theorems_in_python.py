"""The general theorems and what is conserved, by their public names."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

SYSTEM = mbs.System(
    "pendulum",
    gravity=[0, "-g", 0],
    parameters={"m": mbs.Parameter(2, positive=True), "l": mbs.Parameter(0.5, positive=True), "g": 9.81, "c": 0},
    bodies={"bob": mbs.Body(mass="m", com=[0, "-l", 0])},
    joints={"hinge": mbs.Revolute("ground", "bob", q="theta", initial={"q": 0.4})},
    forces={"air": mbs.Drag(on="bob", linear="c")},
)


def test_theorems_follow_the_equations() -> None:
    told = mbs.theorems(SYSTEM)
    assert told.mass_matrix == mbs.derive(SYSTEM).mass_matrix
    titles = [step.title for step in told.steps]
    assert titles[-4:-1] == [
        "Theorem of momentum", "Theorem of angular momentum about the origin", "Theorem of energy",
    ]
    energy = told.steps[-2].equations
    assert [told.notation.text(energy[-1].left), told.notation.text(energy[-1].right)] == ["d(T + V)/dt", "P_air"]
    assert told.steps[-1].note.startswith("total_energy(): ")


def test_what_is_conserved_depends_on_values() -> None:
    (energy,) = mbs.conserved_quantities(SYSTEM)
    assert isinstance(energy, mbs.Conserved)
    assert (energy.name, energy.kind, energy.exact) == ("total_energy()", "energy", True)
    assert mbs.conserved_quantities(SYSTEM, parameters={"c": 0.1}) == []
    assert "Conserved" not in [step.title for step in mbs.theorems(SYSTEM, parameters={"c": 0.1}).steps]


def test_methods_and_errors_are_those_of_derive() -> None:
    assert mbs.theorems(SYSTEM, "newton_euler").method == "newton_euler"
    with pytest.raises(mbs.InputError, match="there is no method 'euler'"):
        mbs.theorems(SYSTEM, "euler")
    with pytest.raises(mbs.InputError):
        mbs.conserved_quantities("pendulum.yaml")  # type: ignore[arg-type]
