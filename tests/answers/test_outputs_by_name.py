"""Outputs by their names in questions, stops and other outputs, against the same with their expressions written out."""

from __future__ import annotations

from math import sqrt

import pytest

import multibody_sym as mbs

MODEL = """
multibody_sym: 1
name: swing
gravity: [0, -g, 0]
parameters: {g: 9.81, m: 2, l: 1, v0: 3}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {A: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {u: v0/l}}}
outputs: {N: m*l*u_theta^2 + m*g*cos(theta), twice: 2*N, E: total_energy()}
ask: {n: N, low: {min: N}, turned: {value: theta, when: N < 20}, fast: {find: v0, so: max(N) == 60},
  E: E/2, both: twice + n}
stop: {slack: N < 12}
simulation: {t_end: 0.5 s}
"""
N = "(m*l*u_theta^2 + m*g*cos(theta))"
WRITTEN_OUT = MODEL.replace("2*N", f"2*{N}").replace("n: N,", f"n: '{N}',").replace("min: N}", f"min: '{N}'}}")
WRITTEN_OUT = WRITTEN_OUT.replace("when: N <", f"when: '{N} <").replace("< 20}", "< 20'}")
WRITTEN_OUT = WRITTEN_OUT.replace("max(N) == 60}", f"'max({N}) == 60'}}").replace("slack: N < 12", f"slack: '{N} < 12'")
WRITTEN_OUT = WRITTEN_OUT.replace("E: E/2", "E: total_energy()/2").replace("twice + n", f"2*{N} + n")


def test_questions_name_outputs() -> None:
    named, written_out = (mbs.solve(mbs.loads(each)).answers for each in (MODEL, WRITTEN_OUT))
    assert named == written_out
    assert str(named["n"]) == "m*(g*l + v0^2)/l = 37.62"
    assert named["E"].value == pytest.approx(2 * 3**2 / 4 - 2 * 9.81 / 2, rel=1e-12)
    assert named["fast"].value == pytest.approx(sqrt((60 - 2 * 9.81) / 2), rel=1e-9)  # at the lowest point
    assert named["both"].value == pytest.approx(3 * 37.62, rel=1e-12)


def test_outputs_and_stops_name_outputs() -> None:
    named, written_out = (mbs.simulate(mbs.loads(each)) for each in (MODEL, WRITTEN_OUT))
    assert named.stop == written_out.stop
    assert named.stop is not None
    assert (named["twice"] == 2 * named["N"]).all()
    assert named["N"][-1] == pytest.approx(12, rel=1e-8)


def test_what_adds_up_along_a_run_is_asked_by_its_name() -> None:
    text = MODEL.replace("E: total_energy()}", "E: total_energy(), W: work(weight)}")
    ask = "\nask: {W: {value: W, after: 0.2 s}, least: {min: W}}\nsimulation: {t_end: 0.5 s}\n"
    answers = mbs.solve(mbs.loads(text[: text.index("\nask:")] + ask)).answers
    run = mbs.simulate(mbs.loads(text), t_end=0.2)
    assert answers["W"].value == pytest.approx(run["W"][-1], rel=1e-9)
    assert answers["W"].unit == "J"
