"""Springs whose ends meet: without rest length they pull with k d, which has a value there; others are named."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.errors import ModelError

KINDS = {
    "planar": mbs.Planar("ground", "bob", q=["x", "y", "th"]),
    "spherical": mbs.Spherical("ground", "bob"),
    "free": mbs.Free("ground", "bob"),
    "prismatic": mbs.Prismatic("ground", "bob", axis="y", q="y"),
}


def hung(joint: object, **spring: object) -> mbs.System:
    return mbs.System(
        "hung",
        gravity=[0, -9.81, 0],
        bodies={"bob": mbs.Body(mass=1, inertia={"Ixx": 1, "Iyy": 1, "Izz": 1})},
        joints={"j": joint},
        forces={"s": mbs.SpringDamper(between=("ground", "bob"), stiffness=10, **spring)},
        outputs={"e": "total_energy()"},
    )


@pytest.mark.parametrize("kind", KINDS)
def test_a_spring_without_rest_length_is_checked_where_its_ends_meet(kind: str) -> None:
    found = mbs.check(hung(KINDS[kind]))
    assert found.agrees, found.agreement


def test_a_mass_hung_from_where_it_is_falls_as_the_closed_form_says() -> None:
    """m y'' = -k y - m g from rest at 0: y = -(m g/k) (1 - cos(w t))."""
    run = mbs.simulate(hung(KINDS["planar"]), t_end=2, samples=21, rtol=1e-11, backend="python")
    y = -0.981 * (1 - np.cos(math.sqrt(10) * run.t))
    np.testing.assert_allclose(run["y"], y, atol=1e-8)


@pytest.mark.parametrize("command", [mbs.check, mbs.solve, mbs.linearize, mbs.equilibrium])
@pytest.mark.parametrize("force", [
    mbs.SpringDamper(between=("ground", "bob"), stiffness=10, length=0.2),
    mbs.SpringDamper(between=("ground", "bob"), stiffness=10, damping=1),
    mbs.Pull(("ground", "bob"), "3*distance - 1"),
], ids=["spring", "damper", "pull"])
def test_what_has_no_direction_is_named(command: object, force: object) -> None:
    base = hung(KINDS["planar"])
    system = mbs.System(base.name, base.gravity, bodies=base.bodies, joints=base.joints, forces={"s": force})
    with pytest.raises(ModelError, match=r"ground and bob are at the same place at the start.*no direction") as caught:
        command(system)
    assert caught.value.where.path == ("forces", "s")
