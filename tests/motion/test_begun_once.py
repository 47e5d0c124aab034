"""What a run with contacts takes before it begins is done once: rows of the start, and Programs of its first mode."""

from __future__ import annotations

import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact import contact_problem
from multibody_sym.motion.prepare import problem

BALL = """
multibody_sym: 1
name: ball
gravity: [0, -10, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 2}
joints: {fall: {type: prismatic, parent: ground, child: ball, axis: y, q: y, initial: {q: 1.25}}}
contacts: {c: {between: [ball, ground.floor], restitution: 0.5}}
"""


def counted(monkeypatch: pytest.MonkeyPatch, module: object, name: str) -> list[object]:
    """Return the list of calls of a function of a module from here on."""
    calls: list[object] = []
    function = getattr(module, name)
    monkeypatch.setattr(module, name, lambda *given: calls.append(given) or function(*given))
    return calls


def test_a_run_looks_at_its_rows_once_and_compiles_one_set_of_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    rows, keys = counted(monkeypatch, contact_problem, "one_way_rows"), counted(monkeypatch, problem, "structure_key")
    run = mbs.simulate(mbs.loads(BALL), t_end=0.9, samples=2, backend="python")
    assert len(rows) == 1
    assert len({id(key[0]) for key in keys}) == 1
    assert all(key[1].startswith("laws") for key in keys)
    assert len({id(leg.program.compiled) for leg in run.modes.legs}) == 1
    assert run["y"][-1] == pytest.approx(2.5 * 0.4 - 5 * 0.16, rel=1e-9)
