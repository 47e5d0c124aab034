"""Short pulses of force on what sticks: nothing moves that would tell of them, but time alone says when they come."""

from __future__ import annotations

import math

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.motion.switching.legs import times_to_check
from multibody_sym.scalars.node import symbol

G, W, AT = 9.81, 2e-4, 4.7183
TEXT = f"""
multibody_sym: 1
name: pulse
gravity: [0, -{G}, 0]
parameters: {{w: {W}, c: {AT}}}
bodies: {{b: {{mass: 1}}, ground: {{surfaces: {{f: {{plane: [0, 0, 0], normal: y}}}}}}}}
joints: {{j: {{type: point, parent: ground, child: b, q: [x, y]}}}}
contacts: {{c: {{between: [b, ground.f], static: 0.5, kinetic: 0.3}}}}
forces: {{p: {{type: force, on: b, value: ["PULSE", 0, 0]}}}}
"""
BELL, BLOCK = "t/4 + exp(-((t - c)/w)^2)/w", "where(t > c and t < c + w, 1/w, 0)"


SOON, NARROW = 0.047183, 2e-5
"""When a bell comes, and how wide it is, in a run of 0.7 s, which ends soon after what it moved has come to rest."""


def pulsed(pulse, t_end=10.0, **options):
    return mbs.simulate(mbs.loads(TEXT.replace("PULSE", pulse)), t_end=t_end, samples=11, **options)


@pytest.mark.parametrize(
    "options", [{}, {"backend": "python"}, pytest.param({"method": "LSODA"}, marks=pytest.mark.long)], ids=str
)
def test_a_bell_of_a_ten_thousandth_of_a_run_moves_what_sticks(options) -> None:
    """From where the force is static friction, to where all that it gave is taken by kinetic friction."""
    t_end, at, w = (10.0, AT, W) if "method" in options else (0.7, SOON, NARROW)
    bell = BELL.removeprefix("t/4 + ").replace("c)/w", f"{at})/{w}").replace("/w", f"/{w}")
    run = pulsed(bell, t_end, rtol=1e-10, atol=1e-12, **options)
    begins = at - w * math.sqrt(math.log(1 / (w * 0.5 * G)))
    given = math.sqrt(math.pi) / 2 * (1 + math.erf((at - begins) / w))
    assert [event["kind"] for event in run.events] == ["slide+", "stick"]
    assert [event["t"] for event in run.events] == pytest.approx([begins, begins + given / 0.3 / G], rel=1e-8)


@pytest.mark.parametrize("method", ["dormand_prince", "LSODA", pytest.param("cvode_bdf", marks=pytest.mark.long)])
def test_a_force_that_is_there_for_a_moment_moves_what_sticks(method) -> None:
    if method == "cvode_bdf":
        pytest.importorskip("sksundae")
    run = pulsed(BLOCK, method=method)
    assert [event["kind"] for event in run.events] == ["slide+", "stick"]
    assert [event["t"] for event in run.events] == pytest.approx([AT, AT + 1 / 0.3 / G], rel=1e-7)


def test_a_run_looks_where_what_depends_on_time_alone_moves() -> None:
    """At each quarter of its range, whatever stands beside it; what depends on motion too it need not look at."""
    values = {symbol("w"): W, symbol("c"): AT}
    found = times_to_check(mbs.loads(TEXT.replace("PULSE", BELL)), values, 10.0)
    near = found[np.abs(found - AT) < 3 * W]
    heights = np.concatenate([[0], np.exp(-(((near - AT) / W) ** 2)), [0]])
    assert len(near) >= 6
    assert np.abs(np.diff(heights)).max() < 0.6
    assert len(found) < 20
    assert len(times_to_check(mbs.loads(TEXT.replace("PULSE", "5 + x*t")), values, 10.0)) == 0
    swinging = mbs.loads(TEXT.replace("PULSE", "sin(2*pi*t)"))
    assert len(times_to_check(swinging, values, 10.0)) == pytest.approx(80, abs=3)
