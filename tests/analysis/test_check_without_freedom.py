"""`check` and its kin on what has no freedom, no mass, or a force with a kink at the start."""

from __future__ import annotations

from pathlib import Path

import pytest

import multibody_sym as mbs
from multibody_sym.analysis import state_asked_about
from multibody_sym.analysis.check import check
from multibody_sym.cli.main import main
from multibody_sym.documents.solution import check_text

BEAM = """
multibody_sym: 1
name: beam held at both ends
parameters: {L: {value: 4 m, positive: true}, P: {value: 1 kN, positive: true}}
bodies: {ground: {points: {B: [L, 0, 0]}}, beam: {mass: 0, points: {B: [L, 0, 0], C: [L/3, 0, 0]}}}
joints:
  A: {type: fixed, parent: ground, child: beam}
  B: {type: fixed, parent: ground.B, child: beam.B, cut: true}
forces: {P: {type: force, on: beam, at: beam.C, value: [0, -P, 0]}}
"""
CANTILEVER = """
multibody_sym: 1
name: cantilever
bodies: {beam: {mass: 2, com: [1, 0, 0]}}
joints: {A: {type: fixed, parent: ground, child: beam}}
gravity: [0, -9.81, 0]
"""
DRIVEN = """
multibody_sym: 1
name: driven crank
bodies: {wheel: {mass: 1}}
joints: {A: {type: revolute, parent: ground, child: wheel, motion: 2*t}}
"""
MASSLESS = """
multibody_sym: 1
name: slider crank without mass
parameters: {r: 0.1 m, l: 0.3 m, w: 20 rad/s}
bodies: {crank: {mass: 0, points: {pin: [r, 0, 0]}}, rod: {mass: 0, points: {end: [l, 0, 0]}}, piston: {mass: 0}}
joints:
  O: {type: revolute, parent: ground, child: crank, motion: pi/3 + w*t}
  A: {type: revolute, parent: crank.pin, child: rod, q: psi}
  P: {type: prismatic, parent: ground, child: piston, axis: x, q: x, initial: {q: 0.33 m}}
  B: {type: revolute, parent: piston, child: rod.end, cut: true}
"""
KNOT = """
multibody_sym: 1
name: a torque by a table, which the start meets at a knot
bodies: {rotor: {inertia: {Izz: 0.05}, mass: 1}}
joints: {M: {type: revolute, parent: ground, child: rotor, q: phi, initial: {u: %s}}}
forces: {drive: {type: torque, joint: M, value: tau}}
inputs: {tau: {table: [[0, 40], [5, 20], [10, 0]], of: u_phi}}
"""
COMMANDS = ("check", "solve", "draw", "derive", "equilibrium", "linearize", "modes", "simulate", "report")


@pytest.mark.parametrize("model", [BEAM, CANTILEVER, DRIVEN, MASSLESS], ids=["beam", "cantilever", "driven", "light"])
def test_no_command_fails_as_a_defect(model: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setattr(state_asked_about, "SECONDS", 0.5)  # how long `modes` looks for a rest that the drive prevents
    Path("m.yaml").write_text(model)
    more = {"simulate": ["--t-end", "0.01", "--backend", "python"], "report": ["--t-end", "0.01"]}
    codes = {name: main([name, "m.yaml", *more.get(name, [])]) for name in COMMANDS}
    assert {name: code for name, code in codes.items() if code not in (0, 2, 3)} == {}
    assert codes["check"] == codes["draw"] == codes["solve"] == 0
    assert codes["equilibrium"] == (3 if model == MASSLESS else 0)  # the drive goes on: it is never at rest


def test_a_beam_held_at_both_ends_is_indeterminate_by_three() -> None:
    found = check(mbs.loads(BEAM))
    assert found.degrees_of_freedom == 0
    assert any("statically indeterminate by 3 in the plane" in hint for hint in found.hints)
    assert not any("indeterminate" in hint for hint in check(mbs.loads(CANTILEVER)).hints)


def test_what_cannot_move_is_at_rest_in_its_only_position() -> None:
    found = mbs.equilibrium(mbs.loads(CANTILEVER))
    assert (found.positions, found.stable, found.complete) == (({},), (True,), True)
    held = mbs.solve(mbs.loads(CANTILEVER)).reactions["A"]
    assert held["fy"].value == pytest.approx(2 * 9.81)
    assert held["mz"].value == pytest.approx(2 * 9.81 * 1)


def test_routes_agree_where_nothing_has_mass() -> None:
    found = check(mbs.loads(MASSLESS))
    assert found.agrees
    assert set(found.agreement) > {"newton_euler", "multipliers"}
    assert "all forces are zero" in check_text(found)


@pytest.mark.parametrize("speed", ["0", "5", "4.9999999", "10"])
def test_theorems_hold_beside_a_knot(speed: str) -> None:
    found = check(mbs.loads(KNOT % speed))
    assert found.missing == ()
    assert found.agrees


def test_the_verdict_names_what_misses(monkeypatch: pytest.MonkeyPatch) -> None:
    from multibody_sym.analysis import check as checking

    monkeypatch.setattr(checking, "short_run_misses", lambda *_: {"angular_impulse": 1e-3})
    found = check(mbs.loads(CANTILEVER.replace("fixed", "revolute")))
    assert found.missing == ("theorem of angular impulse",)
    assert "THEY DISAGREE: theorem of angular impulse" in check_text(found)


def test_forces_that_bend_with_a_distance_or_a_place_are_followed_along_a_short_run() -> None:
    """A string pulls when stretched, a wall pushes on one side: what switches them is no slot of the state."""
    model = """\
multibody_sym: 1
name: string and wall
gravity: [0, -9.81, 0]
bodies: {p: {mass: 0.5}}
joints: {line: {type: prismatic, parent: ground, child: p, axis: -y, q: h, initial: {q: 0.1}}}
forces:
  string: {type: pull, between: [ground, p], value: "20*max(distance - 1, 0)"}
  wall: {type: potential, on: p, value: "10*max(-1 - y, 0)^2"}
"""
    report = check(mbs.loads(model))
    assert report.agrees, report.missing
    assert report.theorems["work"] < 1e-9
