"""Loads along lines: the accelerations that their resultants give by hand, the same by all formalisms."""

from __future__ import annotations

import math

import multibody_sym as mbs

Q, L, ALPHA = 3.0, 1.5, 0.4


def plate(**forces: mbs.Force | mbs.Torque | mbs.Distributed) -> mbs.System:
    return mbs.System(
        "plate",
        gravity=[0, -9.81, 0],
        bodies={
            "b": mbs.Body(mass=2, com=[0.1, 0.2, 0], inertia={"Izz": 0.3}, points={"p": [0.3, 0, 0], "q": [0.3, L, 0]})
        },
        joints={"j": mbs.Planar("ground", "b", q=["x", "y", "phi"], initial={"q": [0.2, 0.1, ALPHA], "u": [1, 0, 2]})},
        forces=forces,
    )


def accelerations(system: mbs.System) -> list[float]:
    return [value.value or 0.0 for value in mbs.solve(system).accelerations.values()]


def test_a_load_along_a_line_acts_as_its_resultant_and_moment() -> None:
    """w = q s^2 along ground's y and q sin(pi s/L) along the body's x, from p to q: by integrals from a table."""
    along = plate(
        up=mbs.Distributed("b", ["p", "q"], [0, f"{Q}*s^2", 0]),
        side=mbs.Distributed("b", ["p", "q"], [f"{Q}*sin(pi*s/{L})", 0, 0], frame="b"),
    )
    up, side = Q * L**3 / 3, 2 * Q * L / math.pi  # at 3 L/4 and L/2 from p
    arm = -math.sin(ALPHA) * 3 * L / 4  # x of the first resultant's place from p, in ground's axes
    resultants = plate(
        up=mbs.Force("b", [0, up, 0], at="p"),
        side=mbs.Force("b", [side, 0, 0], at="p", frame="b"),
        turn=mbs.Torque([0, 0, arm * up - side * L / 2], on="b"),
    )
    for found, expected in zip(accelerations(along), accelerations(resultants), strict=True):
        assert math.isclose(found, expected, rel_tol=1e-12)
    assert mbs.check(along).agrees
