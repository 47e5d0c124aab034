"""The matrices of laws that the compiled Program gives by their entries, against those of the dynamics in floats."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.contact import contact_problem
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.motion.prepare.problem import recall_laws
from multibody_sym.motion.switching.law_values import Laws
from multibody_sym.program.backend import Native

EXAMPLES = Path("examples")


@pytest.mark.parametrize(
    "name", ["textbook/screw_jack", "textbook/rough_hinge", "textbook/two_drums", "impacts/eleven_rods"]
)
def test_entries_stand_in_their_places(name: str) -> None:
    resolved = mechanism(mbs.load(EXAMPLES / f"{name}.yaml"))
    begin = start(resolved)
    u = np.array(begin.u) + np.random.default_rng(1).normal(size=len(begin.u))
    state = state_of(resolved, float, 0.0, begin.q, u.tolist(), begin.parameters)
    rows = contact_problem.one_way_rows(resolved, motion_of(resolved, state))
    recalled = recall_laws(resolved, code=Native(backend="python"))
    laws = Laws(resolved, recalled.compiled, recalled.metadata, np.array(begin.parameters, dtype=float))
    facts = laws.at(0.0, np.array(begin.q, dtype=float), u, rows.scale)
    closed = [element.name for element in resolved.one_way]
    ours, reference = facts.posed(closed).problem, rows.posed(closed).problem
    for part in ("matrix", "exerted", "coupling", "right"):
        assert getattr(ours, part) == pytest.approx(getattr(reference, part), rel=1e-12, abs=1e-12)
    wanted = [[float(x) for x in row.jacobian] for row in rows.rows]
    assert facts.by_speeds.whole == pytest.approx(np.array(wanted), rel=1e-12, abs=1e-12)
    x = np.random.default_rng(2).normal(size=len(u))
    assert facts.udot(x) == pytest.approx(contact_problem.accelerations_of(rows.dynamics, x), rel=1e-12, abs=1e-12)
