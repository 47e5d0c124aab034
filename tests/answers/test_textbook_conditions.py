"""Textbook problems at a hundred other parameter sets: formulas hold where their conditions do, and only there.

The second route is the state that the laws leave at those parameters, and the bodies' equations solved there in floats.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.answers.solve import acceleration_names
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.state import state_at
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.row_records import RopeRow
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import Node, symbol
from multibody_sym.text.parser import parse

FILES = Path(__file__).parents[2] / "examples" / "textbook"
SETS = 100


def found_in_floats(declared: Mechanism, given: Mapping[str, float]) -> tuple[dict[str, str], dict[str, float]]:
    """Return the states' words, and accelerations and forces of rows by name, at other parameters."""
    state = state_at(declared, overrides=given)
    mechanism, begin = state.in_joints
    there = composite_body(mechanism, state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters))
    found = forward_dynamics(there)
    values = dict(zip(acceleration_names(mechanism), found.udot.tolist(), strict=True))
    values |= {row.name: z for row, z in zip(mechanism.rows, found.multipliers.tolist(), strict=True)}
    words = dict(state.words)
    for row in mechanism.rows:
        if isinstance(row, RopeRow) and row.name not in words:
            words[row.name] = "taut" if values[row.name] >= 0.0 else "pushes"
    return words, values


def formulas(solution: mbs.Solution) -> dict[str, Node]:
    """Return what `found_in_floats` names as formulas."""
    found = {name: value.expression for name, value in solution.accelerations.items()}
    for name, parts in solution.reactions.items():
        found |= {name: parts["tension"].expression} if "tension" in parts else {}
        found |= {f"{name}.normal": parts["normal"].expression} if "normal" in parts else {}
    return {name: node for name, node in found.items() if node is not None}


@pytest.mark.parametrize(
    ("name", "least"),
    [
        ("t1_two_blocks", 100),
        ("t2_rough_plane", 10),
        ("t3_three_loads", 100),
        ("t4_table_edge", 20),
        ("t5_incline", 10),
        ("t6_double_incline", 10),
        ("t7_atwood", 100),
        ("t8_blocks_in_a_row", 100),
        ("t9_block_on_block", 20),
    ],
)
def test_formulas_hold_where_their_conditions_do_and_only_there(name: str, least: int) -> None:
    system = replace(mbs.load(FILES / f"{name}.yaml"), ask={})  # signs in answers are conditions of theirs
    solution, declared = mbs.solve(system), check_numbers(system)
    conditions = [parse(condition) for condition in solution.conditions]
    named = formulas(solution)
    assert named.keys() >= solution.accelerations.keys()
    sample = {p: evaluate_float([x.value], {})[0] for p, x in system.parameters.items()}
    at_sample, _ = found_in_floats(declared, sample)
    rng, inside = np.random.default_rng(11), 0
    for _ in range(SETS):
        given = {p: value * 10 ** rng.uniform(-0.3, 0.3) for p, value in sample.items()}
        letters = {symbol(p): value for p, value in given.items()}
        words, values = found_in_floats(declared, given)
        holds = all(evaluate_float(conditions, letters)) if conditions else True
        assert holds == (words == at_sample), (given, words)
        inside += holds
        size = max(abs(x) for x in values.values())
        for key, node in named.items() if holds else ():
            assert evaluate_float([node], letters)[0] == pytest.approx(values[key], rel=1e-9, abs=1e-9 * size), key
    assert inside >= least


SLOPE = """
multibody_sym: 1
name: slope
gravity: [0, -g, 0]
parameters: {m: {value: 2 kg, positive: true}, alpha: 30 deg, mu: 0.4, g: {value: 9.81 m/s^2, positive: true}}
bodies: {block: {mass: m}, ground: {frames: {slope: {rotate: [{axis: z, angle: -alpha}]}}}}
joints: {slide: {type: prismatic, parent: ground.slope, child: block, axis: x, q: s}}
forces: {rub: {type: friction, joint: slide, static: mu}}
"""
PULLED = """
multibody_sym: 1
name: pulled
gravity: [0, -g, 0]
parameters: {m: {value: 5 kg, positive: true}, F: 20 N, mu: 0.3, g: {value: 9.81 m/s^2, positive: true}}
bodies: {block: {mass: m}}
joints: {slide: {type: prismatic, parent: ground, child: block, axis: x, q: s}}
forces: {rub: {type: friction, joint: slide, static: mu}, pull: {type: torque, joint: slide, value: F}}
"""
WEDGE = """
multibody_sym: 1
name: wedge
gravity: [0, -g, 0]
parameters: {M: {value: 3 kg, positive: true}, m: {value: 1 kg, positive: true}, alpha: 30 deg, mu: 0.4,
  g: {value: 9.81 m/s^2, positive: true}}
bodies: {wedge: {mass: M, frames: {face: {rotate: [{axis: z, angle: -alpha}]}}}, block: {mass: m}}
joints:
  floor: {type: prismatic, parent: ground, child: wedge, axis: x, q: X}
  slide: {type: prismatic, parent: wedge.face, child: block, axis: x, q: s}
forces: {rub: {type: friction, joint: slide, static: mu}}
"""


@pytest.mark.parametrize("question", ["T: {when: {s: 0.5 m}}", "v: {of: block, at: {s: 0.5 m}}"])
@pytest.mark.parametrize("model", [SLOPE, PULLED, WEDGE], ids=["slope", "pulled", "wedge"])
def test_a_question_leaves_the_conditions_of_the_state(model: str, question: str) -> None:
    system = mbs.loads(f"{model}ask: {{{question}}}\n")
    solution, declared = mbs.solve(system), check_numbers(system)
    conditions = [parse(condition) for condition in solution.conditions]
    sample = {p: evaluate_float([x.value], {})[0] for p, x in system.parameters.items()}
    at_sample, _ = found_in_floats(declared, sample)
    rng, inside = np.random.default_rng(12), 0
    for _ in range(SETS):
        given = {p: value * 10 ** rng.uniform(-0.3, 0.3) for p, value in sample.items()}
        words, _ = found_in_floats(declared, given)
        holds = all(evaluate_float(conditions, {symbol(p): value for p, value in given.items()}))
        assert holds == (words == at_sample), (given, words)
        inside += holds
    assert 10 < inside < SETS - 10
