"""Answers of motions whose accelerations change where a condition comes to fail: by hand, from piece to piece."""

from __future__ import annotations

import math
from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.text.values import Value

STRING = """
multibody_sym: 1
name: elastic string that begins to pull at a
gravity: [0, 0, 0]
parameters: {k: 50 N/m, a: 0.3 m, T: 0.5 s}
bodies: {m: {mass: 2 kg}, n: {mass: 1 kg}, ground: {points: {l: [-1, 0, 0]}}}
joints:
  P: {type: prismatic, parent: ground, child: m, axis: x, q: x, initial: {u: 1.5}}
  Q: {type: prismatic, parent: ground, child: n, axis: y, q: y, initial: {u: 3}}
forces: {f: {type: pull, between: [ground.l, m], value: "k*max(distance - (1 + a), 0)"}}
ask:
  time: {when: {x: 0.5}}
  early: {when: {x: 0.2}}
  speed: {of: m, at: {x: 0.5}}
  path: {of: m, after: T}
  back: {when: {x: -0.1}}
  other: {of: n, after: T}
"""

BRAKE = """
multibody_sym: 1
name: a force that acts from b on
gravity: [0, 0, 0]
parameters: {b: 1 s, F: 2 N}
bodies: {r: {mass: 2 kg}}
joints: {C: {type: prismatic, parent: ground, child: r, axis: x, q: z, initial: {u: 1.5}}}
forces: {h: {type: force, on: r, value: ["where(t > b, -F, 0)", 0, 0]}}
ask:
  time: {when: {z: 2}}
  early: {when: {z: 1.2}}
  speed: {of: r, at: {z: 2}}
  path: {of: r, after: 3}
  behind: {when: {z: -1}}
  again: {when: {z: 0}}
"""

BUNGEE = """
multibody_sym: 1
name: bungee
gravity: [0, -9.81, 0]
parameters: {k: 100 N/m, a: 20 m}
bodies: {ground: {points: {o: [0, 0, 0]}}, man: {mass: 70 kg}}
joints: {P: {type: prismatic, parent: ground, child: man, axis: -y, q: s, initial: {q: 0.001}}}
forces: {cord: {type: pull, between: [ground.o, man], value: "k*max(distance - a, 0)"}}
ask: {time: {when: {s: 30}}, speed: {of: man, at: {s: 30 m}}, path: {of: man, after: 3 s}}
"""

GRAZE = """
multibody_sym: 1
name: a wind above h, which a ball hardly reaches
gravity: [0, -10, 0]
parameters: {h: 4.999 m, F: 300 N}
bodies: {b: {mass: 1 kg}}
joints: {C: {type: prismatic, parent: ground, child: b, axis: y, q: y, initial: {u: 10}}}
forces: {w: {type: force, on: b, value: [0, "where(y > h, -F, 0)", 0]}}
ask: {time: {when: {y: -16000}}}
simulation: {t_end: 100}
"""


def answers(model: str, **parameters: Any) -> dict[str, Value]:
    solution = mbs.solve(mbs.loads(model), parameters)
    assert not [told for told in solution.conditions if "longer" in told]
    return solution.answers


def number(value: Value) -> float:
    assert value.value is not None
    return value.value


def test_a_string_that_begins_to_pull_slows_what_it_holds() -> None:
    found = answers(STRING)
    w, begun = math.sqrt(50 / 2), 0.3 / 1.5  # x - a = 1.5/w sin(w (t - begun)) from there on
    met = begun + math.asin(0.2 * w / 1.5) / w
    assert number(found["time"]) == pytest.approx(met, rel=1e-9)
    assert number(found["speed"]) == pytest.approx(1.5 * math.cos(w * (met - begun)), rel=1e-9)
    assert number(found["path"]) == pytest.approx(0.3 + 1.5 / w * math.sin(w * (0.5 - begun)), rel=1e-8)
    assert number(found["back"]) == pytest.approx(begun + math.pi / w + 0.4 / 1.5, rel=1e-9)


def test_closed_forms_stay_where_their_conditions_hold_or_have_no_say() -> None:
    found = answers(STRING)
    assert number(found["early"]) == pytest.approx(0.2 / 1.5, rel=1e-14)
    assert number(found["other"]) == pytest.approx(3 * 0.5, rel=1e-14)
    assert found["early"].expression is not None
    assert found["other"].expression is not None


def test_a_force_that_begins_later_changes_answers_behind_it_alone() -> None:
    found = answers(BRAKE)  # z = 1.5 t - (t - 1)^2/2 from t = 1 on
    assert number(found["time"]) == pytest.approx(2.5 - math.sqrt(1.25), rel=1e-9)
    assert number(found["speed"]) == pytest.approx(math.sqrt(1.25), rel=1e-9)
    assert number(found["path"]) == pytest.approx(2.625 + 0.125, rel=1e-7)  # it turns at t = 2.5
    assert number(found["early"]) == pytest.approx(0.8, rel=1e-14)
    assert found["early"].expression is not None


def test_a_force_that_begins_later_brings_back_what_went() -> None:
    found = answers(BRAKE)
    assert number(found["behind"]) == pytest.approx(2.5 + math.sqrt(7.25), rel=1e-9)
    assert number(found["again"]) == pytest.approx(2.5 + math.sqrt(5.25), rel=1e-9)


def test_a_force_that_begins_later_moves_what_rests_at_the_start() -> None:
    found = answers(BRAKE.replace("u: 1.5", "u: 0"), F=-2)  # z = (t - 1)^2/2
    assert number(found["path"]) == pytest.approx(2.0, rel=1e-7)
    assert number(found["time"]) == pytest.approx(3.0, rel=1e-9)
    assert number(found["speed"]) == pytest.approx(2.0, rel=1e-9)
    assert found["behind"].value is None


def test_a_cord_of_a_length_that_is_a_parameter_holds_who_falls() -> None:
    found = answers(BUNGEE)
    g, w = 9.81, math.sqrt(100 / 70)
    begun, speed, rest = math.sqrt(2 * 19.999 / g), math.sqrt(2 * g * 19.999), 9.81 / w**2

    def below(t: float) -> float:
        """Return how far below the cord's end a time after it begins to pull."""
        return rest + speed / w * math.sin(w * t) - rest * math.cos(w * t)

    time = number(found["time"])
    assert below(time - begun) == pytest.approx(10.0, rel=1e-9)
    assert 0.0 < time - begun < math.pi / w / 2
    energy = 2 * g * 29.999 - w**2 * 10.0**2
    assert number(found["speed"]) == pytest.approx(math.sqrt(energy), rel=1e-9)
    assert number(found["path"]) == pytest.approx(19.999 + below(3 - begun), rel=1e-8)


def test_a_condition_that_fails_for_a_moment_alone_is_seen() -> None:
    found = number(answers(GRAZE)["time"])
    top = math.sqrt(100.0 - 20.0 * 4.999)  # the speed at h, from where 310 m/s^2 turn it back
    assert found == pytest.approx(1.0 + math.sqrt(3201.0) - top / 5.0 + top / 155.0, rel=1e-9)
