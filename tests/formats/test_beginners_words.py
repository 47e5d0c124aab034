"""Mistakes that beginners make: each message says where, what is wrong, and what to write."""

from __future__ import annotations

from pathlib import Path

import pytest

from multibody_sym.cli.main import main

MODEL = """\
multibody_sym: 1
name: pendulum
gravity: [0, -g, 0]
parameters: {m: 1 kg, l: 0.5 m, g: 9.81 m/s^2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: phi, initial: {q: 0.5}}}
"""


@pytest.mark.parametrize(
    ("was", "written", "place", "words"),
    [
        ("g: 9.81 m/s^2", "g: 9,81", ":4:", "decimal point, 9.81"),
        ("com: [0, -l, 0]", "com: [0, -L, 0]", ":5:", "did you mean l?"),
        ("{bob: {mass: m, com: [0, -l, 0]}}", "[{name: bob}]", ":5:", "without dashes: {bob: {"),
        ("{q: 0.5}", "{phi: 30 deg}", ":6:", "of coordinates stand under q, of speeds under u: {q:"),
        ("{q: 0.5}", "30 deg", ":6:", "such as {q: 30 deg}"),
        ("parent: ground, child: bob, ", "", ":6:", "parent and child are missing"),
        ("{mass: m, com: [0, -l, 0]}", "{shape: {cylinder: l, mass: m}}", ":5:", "cylinder: [radius, length]"),
        ("{mass: m, com: [0, -l, 0]}", "{shape: {spher: l, mass: m}}", ":5:", "did you mean sphere?"),
        ("{type: revolute", "{typ: revolute", ":6:", "did you mean type?"),
        ("m: 1 kg", "m: {val: 1 kg}", ":4:", "did you mean value?"),
        ("com: [0, -l, 0]", "com: [0, 3 m + l, 0]", ":5:", "give the number with the unit a name"),
        ("", "constraints: {r: {type: distance, between: [bob, ground]}}", ":7:", "how far apart they stay, not 0"),
        ("", "outputs: {w: phi_dot}", ":7:", "did you mean u_phi, the speed?"),
        ("", "outputs: {w: phidot}", ":7:", "did you mean u_phi, the speed?"),
        ("", "outputs: {w: dphi}", ":7:", "did you mean u_phi, the speed?"),
        ("", "outputs: {w: psi}", ":7:", "did you mean phi?"),
        ("", "forces: {f: {type: force, on: bob, value: 5 N}}", ":7:", "along x it is [5 N, 0, 0]"),
        ("", "forces: {f: {type: friction, on: bob}}", ":7:", "joint: NAME; where bodies touch"),
        ("", "forces: {f: {type: friction, joint: hinge, mu: 0.3}}", ":7:", "did you mean static?"),
        ("", "ask: {v: {when: hinge rests}}", ":7:", "the words are sticks, slides, opens, closes"),
        ("", "stop: {end: c1 resting}", ":7:", "the words are sticks, slides, opens, closes"),
        (
            "",
            "constraints: {r: {type: distance, between: [bob.com, ground], value: 3 m}}",
            ":7:",
            "its ends are 2.5 m too near",
        ),
    ],
)
def test_a_message_says_where_what_and_what_to_write(
    was: str, written: str, place: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "m.yaml").write_text(MODEL.replace(was, written) if was else MODEL + written + "\n")
    assert main(["check", str(tmp_path / "m.yaml")]) in (2, 3)
    told = "".join(capsys.readouterr())
    assert words in told
    assert place in told or "no motion" in told
