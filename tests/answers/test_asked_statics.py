"""Steps of questions about structures: virtual work, and why a force is open."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.documents.document import worked_document, write_document

_PRESS = """
multibody_sym: 1
name: press
parameters: {L: 0.5 m, q: 0.3, P: 400 N}
bodies:
  ground: {points: {W: [2*L*cos(q), 0, 0]}}
  AB: {points: {B: [L, 0, 0]}}
  BC: {points: {C: [L, 0, 0]}}
joints:
  A: {type: revolute, parent: ground, child: AB, q: th, initial: {q: q, known: true}}
  B: {type: revolute, parent: AB.B, child: BC, q: be, initial: {q: -2*q}}
constraints:
  guide: {type: point_in_plane, point: BC.C, plane: {through: ground, normal: y}}
  piece: {type: point_in_plane, point: BC.C, plane: {through: ground.W, normal: x}}
forces: {P: {type: force, on: AB, at: AB.B, value: [0, -P, 0]}}
ask: {F: -multiplier(piece)}
"""
_BEAM = """
multibody_sym: 1
name: beam
parameters: {L: 5 m, F: 6 kN}
bodies: {ground: {points: {B: [L, 0, 0]}}, beam: {points: {B: [L, 0, 0]}}}
joints: {A: {type: weld, parent: ground, child: beam}}
constraints: {B: {type: point_in_plane, point: beam.B, plane: {through: ground.B, normal: y}}}
forces: {F: {type: force, on: beam, at: beam.B, value: [0, -F, 0]}}
ask: {By: multiplier(B)}
"""


def _solved(text: str) -> tuple[mbs.Solution, str]:
    found = mbs.solve(mbs.loads(text), steps=True)
    assert found.steps is not None
    return found, " ".join(write_document(worked_document(found.steps), "text").split())


def test_a_force_follows_from_virtual_work() -> None:
    """The work of P on the way of B is that of F on the way of C; both by differences of the geometry."""
    found, lines = _solved(_PRESS)
    h = 1e-5
    up, out = ([f(0.3 + s * h) for s in (-1, 1)] for f in (lambda q: np.sin(q) / 2, np.cos))
    assert found.answers["F"].value == pytest.approx(-400.0 * (up[1] - up[0]) / (out[1] - out[0]), rel=1e-8)
    assert "virtual work: without piece one freedom is left" in lines
    assert "delta_W = " in lines


def test_a_redundant_support_says_why_its_force_is_open() -> None:
    found, lines = _solved(_BEAM)
    assert found.answers["By"].value is None
    assert "equilibrium leaves 1 force open (statically indeterminate to the degree 1)" in lines
