"""The chain of eleven rods struck at any rod: its row against bodies cut free, mirrored chains, and what stays.

Source: J. Wittenburg, Dynamics of Multibody Systems, example 6.2.
"""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

import numpy as np
import pytest
from twins import EXAMPLES


def module() -> Any:
    spec = importlib.util.spec_from_file_location("struck_chain", EXAMPLES / "impacts/struck_chain.py")
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = found  # where its dataclasses look up their annotations
    spec.loader.exec_module(found)
    return found


STRUCK = module()
ANGLES = {"pi/10": np.pi / 10, "pi/11": np.pi / 11}
FEW = [(3, "inside", "pi/11"), (6, "outside", "pi/10")]
ALL = [(k, side, turn) for turn in ANGLES for side in STRUCK.SIDES for k in STRUCK.RODS]


def impulse_of_free_bodies(struck: int, turn: float) -> float:
    """2 v over the sum of 1/m of the particle and of the chain: which a unit impulse moves, all hinges cut."""
    angles = [(6 - i) * turn for i in range(1, 12)]
    arms = np.array([[np.cos(a), np.sin(a)] for a in angles]) / 2
    n = np.array([-arms[struck - 1, 1], arms[struck - 1, 0]]) * 2
    size = 33 + 20
    A, r = np.zeros((size, size)), np.zeros(size)
    A[range(33), range(33)] = [1.0, 1.0, 1 / 12] * 11
    r[3 * struck - 3 : 3 * struck - 1] = n
    for h in range(10):
        for body, sign in ((h, 1.0), (h + 1, -1.0)):
            arm = sign * arms[body]
            for k, lever in enumerate((-arm[1], arm[0])):
                row = 33 + 2 * h + k
                A[3 * body + k, row] -= sign
                A[3 * body + 2, row] -= sign * lever
                A[row, 3 * body + k] += sign
                A[row, 3 * body + 2] += sign * lever
    speed = np.linalg.solve(A, r)[3 * struck - 3 : 3 * struck - 1] @ n
    return 2 / (1 + speed)


@pytest.fixture(scope="module")
def rows() -> dict[tuple[int, str, str], Any]:
    return {}


@pytest.mark.parametrize("case", [case if case in FEW else pytest.param(case, marks=pytest.mark.long) for case in ALL])
def test_a_chain_keeps_momenta_and_energy_through_its_first_self_contact(case: tuple[int, str, str], rows: Any) -> None:
    found = rows[case] = STRUCK.Row.of(*case)
    p = impulse_of_free_bodies(case[0], ANGLES[case[2]])
    assert found.impulse == pytest.approx(p, rel=1e-12)
    assert found.apparent_mass == pytest.approx(p / 2, rel=1e-12)
    assert max(found.kept) < 1e-10
    assert max(found.missed) < 1e-10
    assert found.meeting.impulse > 1e-3
    mirrored = rows.get((12 - case[0], *case[1:]))
    if mirrored is not None:
        assert found.meeting.t == pytest.approx(mirrored.meeting.t, rel=1e-8)
        assert found.meeting.impulse == pytest.approx(mirrored.meeting.impulse, rel=1e-7)


def test_ends_meet_end_on_end_where_the_middle_is_struck(rows: Any) -> None:
    """By symmetry: the rods beside the axis come together with opposite velocities, and spring back with these."""
    meeting = (rows.get(FEW[1]) or STRUCK.Row.of(*FEW[1])).meeting
    assert (meeting.corner, meeting.other) == ("rod1.tip", "rod11.end")


def test_the_command_prints_one_chain(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    row = STRUCK.Row(1.25, 0.625, STRUCK.Meeting(2.5, "rod1.tip", "rod3", 0.5), (1e-12, 2e-12, 3e-13), (0, 0, 0))
    monkeypatch.setattr(STRUCK.Row, "of", lambda *case: row)
    STRUCK.main(["--rod", "4"])
    told = capsys.readouterr().out
    assert "| 4 | 0.013373818 | centre 40.052671, 31.049524 | 0.463649928, -0.323680557 |" in told
    assert f"| 4 | outside | pi/10 | {row}" in told


def test_of_all_chains_the_largest_misses_are_told_last(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    meeting = STRUCK.Meeting(2.5, "rod1.tip", "rod3", 0.5)
    misses = {(3, "inside", "pi/11"): (4e-12, 0.0, 1e-13), (9, "outside", "pi/10"): (1e-12, 5e-11, 2e-13)}
    monkeypatch.setattr(
        STRUCK.Row, "of", lambda *case: STRUCK.Row(1.0, 0.5, meeting, (0, 0, 0), misses.get(case, (0, 0, 0)))
    )
    STRUCK.main(["--all"])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + 44 + 2
    told = "largest relative miss of 44 motions: momentum 4.0e-12, angular momentum 5.0e-11, energy 2.0e-13"
    assert lines[-1] == told


def test_misses_are_measured_by_the_sum_of_the_sizes_of_terms() -> None:
    """Two terms (3, 4) and (-3, -4) of 5 and 5, of which one grows by a thousandth in both components."""
    terms = np.array([[[3.0, 3.003], [4.0, 4.004]], [[-3.0, -3.0], [-4.0, -4.0]]])
    change, beside = STRUCK.largest_change(terms)
    assert change == pytest.approx(0.005, rel=1e-9)
    assert beside == pytest.approx(0.005 / 10.005, rel=1e-9)
