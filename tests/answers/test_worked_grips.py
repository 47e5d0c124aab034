"""`solve --steps` of ropes over rough wheels: two tensions, as a book has them, and how far they may differ."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from test_worked_steps import formulas, sentences, steps, verify

import multibody_sym as mbs
from multibody_sym.answers.records import Worked
from multibody_sym.documents.document import worked_document, write_document

TEXTBOOK = Path(__file__).parents[2] / "examples" / "textbook"
CAPSTAN = (TEXTBOOK / "capstan.yaml").read_text(encoding="utf-8")

WHEEL = """
multibody_sym: 1
name: rough_wheel
gravity: [0, -g, 0]
parameters:
  g: {value: 10 m/s^2, positive: true}
  m1: {value: 1 kg, positive: true}
  m2: {value: 2 kg, positive: true}
  J: {value: 0.01 kg*m^2, positive: true}
  R: {value: 0.1 m, positive: true}
  mu: {value: 0.2, positive: true}
bodies:
  ground: {points: {top: [0, 2 m, 0], left: [-R, 0, 0], right: [R, 0, 0]}}
  wheel: {mass: 1 kg, inertia: {Izz: J}}
  a: {mass: m1}
  b: {mass: m2}
joints:
  axle: {type: revolute, parent: ground.top, child: wheel, axis: z, q: phi}
  line1: {type: prismatic, parent: ground.left, child: a, axis: y, q: y1}
  line2: {type: prismatic, parent: ground.right, child: b, axis: -y, q: y2}
pulleys: {drum: {body: wheel, radius: R, rough: mu}}
constraints: {string: {type: rope, path: [a, drum, b]}}
"""


def value(worked: Worked, letter: str) -> float:
    """Return the number of what is spelt so."""
    (found,) = (x for s, x in worked.values.items() if worked.notation.text(s) == letter)
    return found


def test_a_load_on_a_capstan_and_the_hand_have_their_own_tensions() -> None:
    """T1 = m g, T2 = m0 g + F, by hand."""
    worked = steps(mbs.loads(CAPSTAN))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert formulas(worked, "load, cut free") == ["m*y1'' = T1 - m*g"]
    assert formulas(worked, "hand, cut free") == ["m0*y2'' = T2 - m0*g - F"]
    assert sentences(worked, "load, cut free") == ["m*g: weight, down", "T1: tension of rope, up"]
    assert "mean" not in text
    assert f"post grips: tension 100 N, at most {math.exp(0.3 * math.pi):.6g} times the 51 N on its other side" in text
    assert "F_" not in text
    assert "post grips as long as: T1 <= T2*exp(pi*mu)" in text
    assert [value(worked, x) for x in ("T1", "T2")] == pytest.approx([100.0, 51.0], rel=1e-13)
    assert r"\le" in write_document(worked_document(worked), "latex")
    assert "&le;" in write_document(worked_document(worked), "html")


@pytest.mark.parametrize(("force", "told"), [("10 N", "T1 = T2*exp(pi*mu)"), ("900 N", "T2 = T1*exp(pi*mu)")])
def test_where_the_rope_slips_the_greater_tension_is_told_by_the_less(force: str, told: str) -> None:
    worked = steps(mbs.loads(CAPSTAN.replace("50 N", force)))
    verify(worked)
    text = write_document(worked_document(worked), "text")
    assert f"post: {told}" in text
    sticks = text[text.index("Assume that post sticks") :]
    larger, less = ("T1", "T2") if told.startswith("T1") else ("T2", "T1")
    assert f"    {larger} = " in sticks
    assert f"    {less}*exp(pi*mu) = " in sticks


@pytest.mark.parametrize("parameters", [{}, {"M": 3.0}])
def test_over_two_drums_there_are_three_tensions(parameters: dict[str, float]) -> None:
    system = mbs.load(TEXTBOOK / "two_drums.yaml")
    solution = mbs.solve(system, parameters=parameters, steps=True)
    assert solution.steps is not None
    verify(solution.steps)
    assert formulas(solution.steps, "load, cut free") == ["M*depth'' = M*g - T3"]
    if not parameters:
        laws = formulas(solution.steps, "Laws of forces")
        assert laws == ["F = mu*N", "T2 = T1*exp(pi*mu1/2)", "T3 = T2*exp(pi*mu2)"]
        asked = [solution.reactions["rope"][f"tension{k}"].value for k in (1, 2, 3)]
        assert [value(solution.steps, f"T{k}") for k in (1, 2, 3)] == pytest.approx(asked, rel=1e-12)


@pytest.mark.parametrize("mass", [1.2, 2.0, 9.0])
def test_a_wheel_is_turned_by_the_difference_of_both_tensions(mass: float) -> None:
    """Gripped: (m1 + m2 + J/R^2) a = (m2 - m1) g; slipping: T2 = T1 exp(mu pi) and m a as of two bodies."""
    solution = mbs.solve(mbs.loads(WHEEL), parameters={"m2": mass}, steps=True)
    assert solution.steps is not None
    verify(solution.steps)
    k = math.exp(0.2 * math.pi)
    a = (mass - 1) * 10 / (mass + 2)
    if mass * (10 - a) > k * (10 + a):
        a = 10 * (mass - k) / (mass + k)
    expected = [10 + a, mass * (10 - a)]
    assert [value(solution.steps, x) for x in ("T1", "T2")] == pytest.approx(expected, rel=1e-12)
    asked = solution.reactions["string"]
    assert [asked["tension1"].value, asked["tension2"].value] == pytest.approx(expected, rel=1e-12)
    wheel = formulas(solution.steps, "wheel, cut free")
    assert "J*phi'' = R*T1 - R*T2" in wheel
    assert any(line.endswith("- T1 - T2") for line in wheel)


def test_a_letter_that_the_model_gives_is_numbered_along_the_rope() -> None:
    worked = steps(mbs.loads(CAPSTAN.replace("{type: rope,", "{type: rope, label: S,")))
    verify(worked)
    assert formulas(worked, "load, cut free") == ["m*y1'' = S1 - m*g"]
    taken = steps(mbs.loads(CAPSTAN.replace("m0", "T1")))
    verify(taken)
    assert formulas(taken, "load, cut free") == ["m*y1'' = T_rope_1 - m*g"]


@pytest.mark.parametrize("mass", [1.2, 9.0])
def test_a_wheel_that_grips_and_a_post_that_rubs_part_a_rope_into_three_tensions(mass: float) -> None:
    """(m1 + J/R^2) a = T2 - m1 g, m2 a = m2 g - T3, T1 = m1 (g + a); a = 0, or T3 = T2 exp(mu pi/2)."""
    model = WHEEL.replace("top: [0, 2 m, 0]", "top: [0, 2 m, 0], high: [1 m, 2 m, 0]").replace(
        "[R, 0, 0]", "[1 + R, 0, 0]"
    )
    model = model.replace("rough: mu}", "}").replace("R, }}", "R}, post: {at: ground.high, radius: R, rough: mu}}")
    model = model.replace("drum, b]", "drum, post, b]")
    found = mbs.solve(mbs.loads(model), parameters={"m2": mass}, steps=True)
    assert found.steps is not None
    verify(found.steps)
    k = math.exp(0.2 * math.pi / 2)
    a = max(0.0, 10 * (mass - k) / (mass + 2 * k))
    expected = [10 + a, 10 + 2 * a, mass * (10 - a)]
    assert [value(found.steps, f"T{n}") for n in (1, 2, 3)] == pytest.approx(expected, rel=1e-12)
    assert formulas(found.steps, "b, cut free") == ["m2*y2'' = m2*g - T3"]


def test_a_rope_around_a_very_rough_post_is_told_without_a_ratio_of_tensions() -> None:
    """exp(20 pi) = 2e27: doubles cannot tell how much less than all of it the less tension may be."""
    worked = steps(mbs.loads(CAPSTAN.replace("value: 0.3,", "value: 20,")))
    verify(worked)
    assert "post grips: tension 100 N, 51 N on its other side" in write_document(worked_document(worked), "text")
