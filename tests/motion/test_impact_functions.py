"""Impacts as compiled functions of the state: written out and scanned, in Python and C, against `solve`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from impact_problems import STONES

import multibody_sym as mbs
from multibody_sym.contact_laws.impact_sequence import strike
from multibody_sym.dynamics.contact.contact_problem import accelerations_of
from multibody_sym.dynamics.contact.impact_problem import pose, struck_rows
from multibody_sym.dynamics.contact.impact_programs import StruckMode, impact_program
from multibody_sym.dynamics.start.declared_impact import outcome, posed_impact
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.motion import state_of
from multibody_sym.scalars.node import slot

CHAIN = """
multibody_sym: 1
name: struck chain
parameters: {m: 1, e: 0.5, mu: 0.1}
repeat: {count: COUNT, body: {shape: {rod: 1, mass: m}, points: {end: [1, 0, 0], middle: [0.5, 0, 0]}},
  joint: {type: revolute, axis: z, parent: end, initial: {q: 0, u: -0.1}}, body_name: rod, joint_name: h}
bodies: {ground: {points: {hit: [COUNT, 0, 0], two: [2.5, 0, 0]}}}
impact: SECTION
"""
LOOP = """
multibody_sym: 1
name: struck four-bar
parameters: {m: 1, e: 0.5}
bodies:
  left: {mass: m, com: [0, 0.5, 0], inertia: {Izz: m/12}, points: {end: [0, 1, 0]}}
  right: {mass: m, com: [0, 0.5, 0], inertia: {Izz: m/12}, points: {end: [0, 1, 0]}}
  beam: {mass: m, com: [1, 0, 0], inertia: {Izz: m/3}, points: {end: [2, 0, 0], middle: [1, 0, 0]}}
  ground: {points: {b: [2, 0, 0]}}
  ball: {mass: m}
joints:
  A: {type: revolute, parent: ground, child: left, axis: z, q: a, initial: {q: 0, u: 1}}
  B: {type: revolute, parent: left.end, child: beam, axis: z}
  C: {type: revolute, parent: ground.b, child: right, axis: z}
  D: {type: revolute, parent: right.end, child: beam.end, axis: z, cut: true}
  E: {type: point, parent: ground, child: ball, axes: xy, initial: {q: [1, 1], u: [0, -3]}}
impact: {between: [ball, beam.middle], normal: [1, 1, 0], restitution: e}
"""
BETWEEN = "{between: [rodCOUNT.end, ground.hit], normal: y, restitution: e, kinetic: mu}"
BOTH = """{push: {impulse: [0.3, 1, 0.2], at: rod2.middle}, turn: {couple: [0, 0, -2], on: rod4},
  a: {between: [rodCOUNT.end, ground.hit], normal: y, restitution: e},
  b: {between: [rod3.middle, ground.two], normal: y, restitution: e}, sequence: simultaneous}"""


def chain(count: int, section: str) -> mbs.System:
    return mbs.loads(CHAIN.replace("SECTION", section).replace("COUNT", str(count)))


def assert_as_solved(system: mbs.System, *, native: bool) -> None:
    told, begin = mbs.solve(system), mbs.solve(system)
    function = mbs.compile(mbs.impact(system), native=native, backend="c" if native else "python")
    found = function(0.0, list(begin.coordinates.values()), list(begin.speeds.values()))
    impact = told.impact
    assert impact is not None
    assert found.u == pytest.approx([x.value for x in impact.after.values()], abs=1e-13)
    for name, parts in impact.joint_impulses.items():
        for component, x in parts.items():
            assert not x.unique or found.joints[name][component] == pytest.approx(x.value, abs=1e-12), (name, component)
    for name, parts in impact.impulses.items():
        assert found.impulses[f"{name}.normal"] == pytest.approx(parts["normal"].value, abs=1e-12)


@pytest.mark.parametrize("section", [BETWEEN, BOTH])
@pytest.mark.parametrize("count", [5, 12])
def test_as_solved_in_python(count: int, section: str) -> None:
    """Twelve rods are scanned, five written out."""
    assert_as_solved(chain(count, section), native=False)


@pytest.mark.parametrize("system", [chain(12, BOTH), mbs.loads(LOOP)])
def test_as_solved_in_c(system: mbs.System) -> None:
    assert_as_solved(system, native=False)
    assert_as_solved(system, native=True)


def test_a_closed_loop_from_other_states_keeps_its_rows_and_newtons_rule() -> None:
    function = mbs.compile(mbs.impact(mbs.loads(LOOP)), backend="python")
    for speed in (1.0, 2.0):
        found = function(0.0, [0.0, 0.0, 0.0, 1.0, 1.0], [speed, -speed, speed, 0.0, -3.0])
        assert found.u[0] + found.u[1] == pytest.approx(0.0, abs=1e-13)
        before, after = -speed, -found.u[0]  # the beam moves along x
        normal = np.array([1.0, 1.0]) / np.sqrt(2.0)
        closing = normal @ [0.0 - before, -3.0]
        assert normal @ [found.u[3] - after, found.u[4]] == pytest.approx(-0.5 * closing, abs=1e-13)


def test_many_bodies_are_scanned_not_written_out() -> None:
    sizes = []
    for count in (20, 40):
        posed = posed_impact(chain(count, BETWEEN))
        program = impact_program(StruckMode(posed.blow, struck_rows(posed.blow, outcome(posed))))
        sizes.append(len(program.statements))
    assert sizes[0] == sizes[1] < 10


@pytest.mark.parametrize("section", [BETWEEN, BOTH.replace("restitution: e},", "restitution: e, kinetic: mu},", 1)])
def test_a_scanned_chain_finds_the_mode_of_each_state(section: str) -> None:
    """At other states it slides the other way, sticks on the way, or is not struck: as the laws have it in numbers."""
    posed = posed_impact(chain(12, section))
    function = mbs.compile(mbs.impact(posed.system), backend="python")
    rng, modes = np.random.default_rng(4), set[tuple[object, ...]]()
    for _ in range(8):
        q, u = rng.normal(size=12) * 0.3, rng.normal(size=12)
        given = [posed.blow.state.slots[slot("parameters", k)] for k in range(len(posed.begin.parameters))]
        state = state_of(posed.blow.mechanism, float, 0.0, q.tolist(), u.tolist(), given)
        blow = replace(posed.blow, state=state)
        there = strike(pose(blow, posed.law, posed.order, posed.coefficients))
        if there.impacts > 1:
            continue
        rows = struck_rows(blow, there)
        if len(posed.blow.elements) > 1 and any(len(there.course(k)) > 1 for k in range(len(rows.mode.slips))):
            with pytest.raises(mbs.NoSolutionError, match="slip stops or turns round"):
                function(0.0, q, u)
            continue
        found = function(0.0, q, u).u
        modes.add((tuple(x.name for x in rows.acting), tuple(rows.mode.slips.values())))
        after = u + accelerations_of(blow.dynamics, there.x)
        assert found == pytest.approx(after, abs=1e-10 * np.abs(after).max()), there.phases
    assert len(modes) > 2


def test_what_has_no_one_mode_is_refused() -> None:
    with pytest.raises(mbs.ModelError, match="has no impact"):
        mbs.impact(mbs.System("none", bodies={"a": mbs.Body(1)}, joints={"A": mbs.Prismatic("ground", "a", axis="x")}))


ROD = """
multibody_sym: 1
name: rod on a floor
parameters: {m: 1, l: 1, e: 0.5, mu: 0.3, b: 0}
bodies:
  rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {tip: [l/2, 0, 0], heel: [-l/2, 0, 0]}}
  ground: {points: {spot: [0.3, 0, 0]}}
joints: {P: {type: planar, parent: ground, child: rod, q: [x, y, a],
  initial: {q: [0, 0.4, 'asin(-0.8)'], u: [0.2, -3, 0]}}}
impact: {c: {between: [rod.tip, ground.spot], normal: y, kinetic: mu, restitution: e, tangential_restitution: b},
  law: LAW}
"""


@pytest.mark.parametrize("law", ["newton", "poisson", "stronge"])
def test_one_program_follows_slip_that_sticks_or_turns_round_by_each_law(law: str) -> None:
    """From states and coefficients at random: slip one way, stopped, reversed, and what separates."""
    system = mbs.loads(ROD.replace("LAW", law))
    functions = [mbs.compile(mbs.impact(system), backend="python")]
    functions += [mbs.compile(mbs.impact(system), native=True)] if law == "stronge" else []
    rng, words = np.random.default_rng(5), set[tuple[int, ...]]()
    for k in range(12):
        u = [rng.normal() * (0.1, 3.0)[k % 2], -rng.uniform(0.5, 3), rng.normal() * (0.1, 1.0)[k % 2]]
        changed = {"mu": rng.uniform(0.05, 1.2), "e": rng.uniform(0, 1), "b": (0.0, 0.0, 0.5)[k % 3]}
        start, told = dict(zip(("u_x", "u_y", "u_a"), u, strict=True)), None
        try:
            posed = posed_impact(Overrides(changed, start).of(system))
        except mbs.NoSolutionError:
            words.add(())
            after = u
        else:
            told = outcome(posed)
            words.add(told.course(0))
            after = np.array(u) + accelerations_of(posed.blow.dynamics, told.x)
        for function in functions:
            if told is not None and told.impacts > 1:  # what friction gives back presses again
                with pytest.raises(mbs.NoSolutionError, match="follow each other"):
                    function(0.0, [0, 0.4, np.arcsin(-0.8)], u, parameters=changed)
                continue
            found = function(0.0, [0, 0.4, np.arcsin(-0.8)], u, parameters=changed)
            assert found.u == pytest.approx(after, abs=1e-11), (changed, u)
    assert len(words) > 3


def test_a_function_of_several_contacts_finds_the_mode_of_each_state() -> None:
    """Two ends strike at once, or one alone: what is not struck at the start is elsewhere."""
    system = mbs.loads(STONES)
    function = mbs.compile(mbs.impact(system), backend="python")
    for u in ([2, -3, 0], [-2, -3, 0.5], [0.01, -3, 0.1], [2, -1, 8], [2, -1, -8], [3, -3, 0]):
        start = dict(zip(("u_x", "u_y", "u_a"), u, strict=True))
        told = mbs.solve(system, initial=start).impact
        assert told is not None
        if len(told.steps) > 1:
            with pytest.raises(mbs.NoSolutionError, match="follow each other"):
                function(0.0, [0, 0, 0], u)
            continue
        assert function(0.0, [0, 0, 0], u).u == pytest.approx([x.value for x in told.after.values()], abs=1e-12), u
