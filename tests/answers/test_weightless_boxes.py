"""A box in a lift that is let go presses with nothing, which acts nowhere; braked, it presses beneath its middle."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.documents.solution import solution_text

LIFT = """
multibody_sym: 1
name: lift_let_go
gravity: [0, -g, 0]
parameters: {{g: 10 m/s^2, L: 1 m, M: 100 kg, m: 1 kg, B: 0 N}}
bodies:
  lift: {{mass: M, surfaces: {{floor: {{plane: [0, 0, 0], normal: y}}}}}}
  box: {{shape: {{box: [L, L, L], mass: m}}}}
joints:
  lift: {{type: prismatic, parent: ground, child: lift, axis: y, q: Y}}
  box: {{type: planar, parent: ground, child: box, q: [x, y, p], initial: {{q: [0.2, 0.5, 0]}}}}
forces: {{brake: {{type: force, on: lift, value: [0, B, 0]}}}}
contacts: {{c: {{between: [box, lift.floor]{rough}}}}}
"""


@pytest.mark.parametrize("rough", ["", ", static: 0.3"])
def test_where_nothing_presses_no_place_is_told(rough: str) -> None:
    system = mbs.loads(LIFT.format(rough=rough))
    found = mbs.solve(system)
    assert found.accelerations["Y"].value == found.accelerations["y"].value == -10.0
    assert found.reactions["c"]["normal"].value == 0.0
    assert not any(name.startswith("at_") for name in found.reactions["c"])
    assert "  normal(c) = B*m/(M + m) = 0 N\n" in solution_text(found)
    assert "at_x(" not in solution_text(found)


def test_where_the_brake_makes_it_press_it_does_beneath_the_middle() -> None:
    braked = mbs.solve(mbs.loads(LIFT.format(rough="")), parameters={"B": 202.0})
    told = {name: value.value for name, value in braked.reactions["c"].items()}
    assert told["normal"] == pytest.approx(202.0 * 1.0 / 101.0, rel=1e-12)  # m (g + a), with a = B/(M + m) - g
    assert [told["at_x"], told["at_y"]] == pytest.approx([0.2, 0.0], abs=1e-12)
    assert "  at_x(c) = " in solution_text(braked)
