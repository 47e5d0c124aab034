"""Systems that are prepared once and run often: the bits of `simulate`, whatever was run before."""

from __future__ import annotations

from typing import Any

import pytest

import multibody_sym as mbs
from multibody_sym.errors import InputError, ModelError
from multibody_sym.motion import simulate as simulating
from multibody_sym.motion.switching import decision
from multibody_sym.program import loading

PENDULUM = """
multibody_sym: 1
name: pendulum
gravity: [0, -9.81, 0]
parameters: {m: 1, l: 0.5, k: 2}
bodies: {bob: {mass: m, com: [0, -l, 0]}}
joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: 0.5}}}
forces: {drive: {type: torque, joint: hinge, value: F}}
inputs: {F: sin(k*t)}
simulation: {t_end: 1, samples: 5}
"""
RUBBING = """
multibody_sym: 1
name: rubbing
gravity: [0, -9.81, 0]
parameters: {A: 0.06, mu: 0.3}
bodies:
  block: {mass: 1}
  belt: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
joints:
  slide: {type: point, parent: ground, child: block, q: [x, y]}
  shake: {type: prismatic, parent: ground, child: belt, axis: x, motion: A*cos(12*t)}
contacts:
  c: {between: [block, belt.top], static: mu, kinetic: mu}
simulation: {t_end: 2, samples: 5}
"""


def bits(run: Any) -> tuple[Any, ...]:
    return run.q.tobytes(), run.u.tobytes(), tuple(map(repr, run.events))


@pytest.mark.parametrize("text", [PENDULUM, RUBBING], ids=["pendulum", "rubbing"])
def test_a_prepared_run_has_the_bits_of_simulate_whatever_was_run_before(text: str) -> None:
    system = mbs.loads(text)
    name, other = ("l", 0.7) if text is PENDULUM else ("mu", 0.5)
    prepared = mbs.prepare(system, rtol=1e-6)
    alone, changed = mbs.simulate(system, rtol=1e-6), mbs.simulate(system, rtol=1e-6, parameters={name: other})
    assert bits(prepared.run()) == bits(alone)
    assert bits(prepared.run(parameters={name: other})) == bits(changed) != bits(alone)
    assert bits(prepared.run()) == bits(alone)


def test_a_run_may_have_other_starts_inputs_and_ends() -> None:
    prepared, system = mbs.prepare(mbs.loads(PENDULUM)), mbs.loads(PENDULUM)
    starts, ends = ({"initial": {"theta": 0.1}}, {"inputs": {"F": "2*t"}}), ({"t_end": 0.5}, {"t_end": "1/k"})
    for options in (*starts, *ends, {"samples": 2}):
        assert bits(prepared.run(**options)) == bits(mbs.simulate(system, **options))


@pytest.mark.parametrize("text", [PENDULUM, RUBBING], ids=["pendulum", "rubbing"])
def test_nothing_is_resolved_started_or_compiled_twice(monkeypatch: pytest.MonkeyPatch, text: str) -> None:
    prepared = mbs.prepare(mbs.loads(text))
    first = prepared.run()

    def never(*_: Any, **__: Any) -> Any:
        raise AssertionError("again")

    own = (simulating, "prepare_system"), (simulating, "problem_of")
    for module, name in (*own, (loading, "recall"), (loading, "load")):
        monkeypatch.setattr(module, name, never)
    assert bits(prepared.run()) == bits(first)


BOUNCING = """
multibody_sym: 1
name: bouncing
gravity: [0, -9.81, 0]
bodies:
  ground: {surfaces: {floor: {plane: [0, 0, 0], normal: y}}}
  ball: {mass: 1}
  block: {mass: 1}
  belt: {mass: 1, surfaces: {top: {plane: [0, 0, 0], normal: y}}}
joints:
  flies: {type: point, parent: ground, child: ball, q: [a, b], initial: {q: [0, 0.05], u: [0.3, 0]}}
  slide: {type: point, parent: ground, child: block, q: [x, y]}
  shake: {type: prismatic, parent: ground, child: belt, axis: x, motion: 0.06*cos(12*t)}
contacts:
  c: {between: [block, belt.top], static: 0.3, kinetic: 0.3}
  d: {between: [ball, ground.floor], static: 0.1, kinetic: 0.1, restitution: 0.7}
simulation: {t_end: 2, samples: 5}
"""


@pytest.mark.parametrize("text", [RUBBING, BOUNCING], ids=["rubbing", "bouncing"])
def test_decisions_of_one_run_are_verified_by_the_next_instead_of_made(
    monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    prepared, searches = mbs.prepare(mbs.loads(text)), list[object]()
    first, alone = prepared.run(), mbs.simulate(mbs.loads(text))
    found = decision._find_states

    def counted(*given: Any) -> Any:
        searches.append(given)
        return found(*given)

    monkeypatch.setattr(decision, "_find_states", counted)
    second = prepared.run()
    assert bits(second) == bits(first) == bits(alone)
    assert second.friction_work == first.friction_work
    assert len(first.changes) > 6
    assert not searches or text is BOUNCING  # impacts are decided each time


def test_errors_are_those_of_simulate() -> None:
    prepared = mbs.prepare(mbs.loads(PENDULUM))
    with pytest.raises(InputError, match="there is no parameter 'L'"):
        prepared.run(parameters={"L": 1})
    with pytest.raises(ModelError, match="t_end"):
        prepared.run(t_end=-1)
    with pytest.raises(InputError, match="backend"):
        mbs.prepare(mbs.loads(PENDULUM), backend="fortran")
