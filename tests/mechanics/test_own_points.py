"""`body.com` and `body.origin` name what a body alone stands for, here the one and there the other."""

from __future__ import annotations

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: m
gravity: [0, -9.81, 0]
parameters: {l: 0.5}
bodies:
  bob: {mass: 2, com: [l, 0.1, 0], inertia: {Izz: 0.1}, points: {p: [1, 0, 0]}}
  tip: {mass: 1, com: [0.2, 0, 0], inertia: {Izz: 0.1}}
joints:
  A: {type: revolute, parent: ground, child: bob, q: a, initial: {q: 0.4, u: 2}}
  B: {type: revolute, parent: PARENT, child: tip, q: b, initial: {q: 0.3}}
forces:
  s: {type: spring_damper, between: [ground.origin, tip.com], stiffness: 5, length: 0.1}
  f: {type: force, on: bob, value: [1, 2, 0]AT}
"""


def values(model: str, **asked: str) -> dict[str, float]:
    lines = "".join(f"  {name}: '{text}'\n" for name, text in asked.items())
    answers = mbs.solve(mbs.loads(f"{model}\nask:\n{lines}")).answers
    return {name: answers[name].value for name in asked}


def speeds(model: str = MODEL, **changes: str) -> list[float]:
    """Return the speeds after a moment, which tell the accelerations."""
    for name, usual in {"PARENT": "bob", "AT": ""}.items():
        model = model.replace(name, changes.get(name, usual))
    run = mbs.simulate(mbs.loads(model), t_end=0.01, samples=2, method="rk4", step=0.01, backend="python")
    return [float(u) for u in run.u[-1]]


def test_defaults_are_what_they_were() -> None:
    model = MODEL.replace("PARENT", "bob.p").replace("AT", "")
    found = values(model, own="position(bob, x)", com="position(bob.com, x)", origin="position(bob.origin, x)",
                   v="velocity(tip.com, y)", w="velocity(tip, y)", start="velocity(tip.origin, y)", 
                   p="velocity(bob.p, y)")
    import math

    assert found["own"] == found["com"] == pytest.approx(0.5 * math.cos(0.4) - 0.1 * math.sin(0.4), rel=1e-14)
    assert found["origin"] == 0.0
    assert found["v"] == found["w"]
    assert found["start"] == pytest.approx(found["p"], rel=1e-14)


def test_joints_and_forces_take_them() -> None:
    usual = speeds()
    assert speeds(PARENT="bob.origin") == pytest.approx(usual, rel=1e-14)
    assert speeds(AT=", at: com") == pytest.approx(usual, rel=1e-14)
    centre = speeds(PARENT="bob.com")
    assert centre != pytest.approx(usual, rel=1e-4)
    named = MODEL.replace("points: {p: [1, 0, 0]}", "points: {p: [l, 0.1, 0]}")
    assert centre == pytest.approx(speeds(named, PARENT="bob.p"), rel=1e-14)


def test_declared_points_of_these_names_go_first() -> None:
    model = MODEL.replace("{p: [1, 0, 0]}", "{com: [1, 0, 0]}").replace("PARENT", "bob").replace("AT", "")
    found = values(model, com="position(bob.com, x)", own="position(bob, x)")
    assert found["com"] != pytest.approx(found["own"], rel=1e-3)


def test_runs_tell_them_in_aligned_axes() -> None:
    model = MODEL.replace("PARENT", "bob.p").replace("AT", "")
    model += "outputs: {c1: 'position(tip.com, x)', c2: 'position(tip, x)', o1: 'position(tip.origin, y)',"
    model += " o2: 'position(bob.p, y)'}\n"
    run = mbs.simulate(mbs.loads(model), t_end=0.2, samples=3, backend="python")
    assert run["c1"].tolist() == run["c2"].tolist()
    assert run["o1"].tolist() == pytest.approx(run["o2"].tolist(), abs=1e-14)
