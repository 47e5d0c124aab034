"""Least forces that end rest: by minimisation where a box tips before it slips; each angle is looked at once."""

from __future__ import annotations

import math

import pytest
from scipy.optimize import minimize_scalar

import multibody_sym as mbs
from multibody_sym.analysis.rest import ranges
from multibody_sym.documents.analysis import least_text
from multibody_sym.text.printer import text

PULL = """\
multibody_sym: 1
name: pull
gravity: [0, -g, 0]
parameters:
  {g: {value: 10, positive: true}, m: {value: 30, positive: true}, mu: 0.5, a: 0.2, F: 50 N, beta: 20 deg, b: 0.4, h: 1}
bodies:
  ground: {surfaces: {slope: {plane: [0, 0, 0], normal: [-sin(a), cos(a), 0]}}}
  block: {mass: m}
joints: {free: {type: point, parent: ground, child: block}}
contacts: {c: {between: [block, ground.slope], static: mu}}
forces: {pull: {type: force, on: block, value: [F*cos(a + beta), F*sin(a + beta), 0]}}
"""
BOX = PULL.replace("block: {mass: m}", "block: {shape: {box: [b, h, 1], mass: m}, points: {top: [b/2, h/2, 0]}}")
BOX = BOX.replace("type: point, parent: ground, child: block", "type: planar, parent: ground, child: block, initial: I")
BOX = (
    BOX.replace("initial: I", "initial: {q: [0, h/2, 0]}")
    .replace("a: 0.2", "a: 0")
    .replace("on: block", "on: block, at: top")
)


def test_a_tall_box_tips_first():
    """Pulled at its upper edge the moment about the lower one, F (h cos beta), needs b/2 m g; 0 < beta < pi / 2."""
    found = mbs.least_for_motion(mbs.loads(BOX), "F", "beta")

    def force(beta: float) -> float:
        along, up, weight = math.cos(beta), math.sin(beta), 300.0
        slips = 0.5 * weight / (abs(along) + 0.5 * up)
        right = weight * 0.2 / (along * 1.0) if along > 0 else math.inf  # about the lower right edge
        lever = -along * 1.0 + up * 0.4  # about the lower left edge
        left = weight * 0.2 / lever if lever > 0 else math.inf
        return min(x for x in (slips, right, left) if x > 0)

    best = min(
        (minimize_scalar(force, bounds=(x, x + 0.1), method="bounded") for x in [-3.1 + 0.1 * k for k in range(62)]),
        key=lambda x: x.fun,
    )
    assert found.value.value == pytest.approx(best.fun, rel=1e-9)
    assert found.at.value == pytest.approx(best.x, abs=1e-4)
    assert "tips about its" in found.value.gives_way[0]


@pytest.mark.parametrize("mu", [0.1, 0.0])
def test_where_zero_does_not_hold_the_least_that_holds_is_found_too(monkeypatch, mu: float) -> None:
    """On a slope steeper than phi = atan(mu): W sin(a - phi) at beta = -phi holds, W sin(a + phi) at phi moves it up.

    Each angle is looked at once: the search took half a minute.
    """
    looked = []
    first_range = ranges.first_range
    monkeypatch.setattr(ranges, "first_range", lambda *given: looked.append(given) or first_range(*given))
    phi = math.atan(mu)
    found = mbs.least_for_motion(mbs.loads(PULL), "F", "beta", parameters={"mu": mu})
    assert found.holds is not None
    assert found.holds_at is not None
    assert found.holds.value == pytest.approx(300 * math.sin(0.2 - phi), rel=1e-13)
    assert found.holds_at.value == pytest.approx(-phi, rel=1e-13, abs=1e-15)
    assert found.value.value == pytest.approx(300 * math.sin(0.2 + phi), rel=1e-13)
    assert found.at.value == pytest.approx(phi, rel=1e-13, abs=1e-15)
    assert (found.holds.gives_way, found.value.gives_way) == (("slips at c",), ("slips at c",))
    if mu:
        assert text(found.holds.expression) == "g*m*(sin(a) - mu*cos(a))/sqrt(mu^2 + 1)"
        assert text(found.value.expression) == "g*m*(mu*cos(a) + sin(a))/sqrt(mu^2 + 1)"
        assert least_text(found).startswith("the least that holds is F = g*m*(sin(a) - mu*cos(a))/sqrt(mu^2 + 1) = ")
        assert found.as_json()["holds_at"]["expression"] == "-atan(mu)"
    assert len(looked) < 200
