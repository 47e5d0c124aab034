"""Small models with other literal numbers: nothing is compiled, and each run has its own."""

from __future__ import annotations

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.program import loading

CRANK = """
multibody_sym: 1
name: small
gravity: [0, {g}, 0]
bodies:
  crank: {{mass: {m}, com: [{a}, 0, 0], inertia: {{Izz: 0.03}}, points: {{pin: [{l}, 0, 0]}}}}
  rod: {{mass: 1.3, com: [0.45, 0, 0], inertia: {{Izz: 0.07}}, points: {{pin: [0.9, 0, 0]}}}}
  slider: {{mass: 0.7}}
joints:
  A: {{type: revolute, parent: ground, child: crank, axis: z, initial: {{q: 0.4, u: 1.7, known: true}}}}
  B: {{type: revolute, parent: crank.pin, child: rod, axis: z}}
  D: {{type: prismatic, parent: ground, child: slider, axis: x, initial: {{q: 1.2}}}}
  C: {{type: revolute, parent: rod.pin, child: slider, axis: z, cut: true}}
simulation: {{t_end: 0.3, samples: 4}}
"""
BLOCK = """
multibody_sym: 1
name: small
gravity: [0, {g}, 0]
bodies:
  ground: {{surfaces: {{plane: {{plane: [0, 0, 0], normal: y}}}}}}
  block: {{mass: {m}}}
joints: {{s: {{type: point, parent: ground, child: block, q: [x, y], initial: {{u: [{l}, 0]}}}}}}
contacts: {{rub: {{between: [block, ground.plane], kinetic: {a}, static: 0.62}}}}
simulation: {{t_end: 0.8, samples: 4}}
"""
NUMBERS = ({"m": 2.1, "a": 0.15, "l": 0.33, "g": -9.81}, {"m": 2.3, "a": 0.17, "l": 0.31, "g": -1.62})


@pytest.fixture
def compilations(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Return the commands that compile or link, as they are given."""
    given: list[object] = []
    run = loading._running

    def counted(commands, *arguments):
        given.extend(command for command in commands if "-o" in command)
        return run(commands, *arguments)

    monkeypatch.setattr(loading, "_running", counted)
    return given


@pytest.mark.parametrize("text", [CRANK, BLOCK], ids=["loop", "friction"])
def test_other_numbers_compile_nothing(text: str, compilations: list[object]) -> None:
    """Against the same as generated Python, in which the numbers are written out; both libraries are in use."""
    systems = [mbs.loads(text.format(**numbers)) for numbers in NUMBERS]
    first = mbs.prepare(systems[0], backend="c")
    begun = first.run()
    compilations.clear()
    second = mbs.simulate(systems[1], backend="c")
    assert not compilations
    assert second.ready.compiled.path != begun.ready.compiled.path
    wanted_of = [mbs.simulate(system, backend="python") for system in systems]
    for found, wanted in zip((begun, second, first.run()), (*wanted_of, wanted_of[0]), strict=True):
        assert np.abs(found.q - wanted.q).max() <= 1e-9
        assert np.abs(found.u - wanted.u).max() <= 1e-9
    assert np.abs(begun.q[-1] - second.q[-1]).max() > 1e-3


def test_a_recalled_library_has_its_numbers(compilations: list[object]) -> None:
    system = mbs.loads(CRANK.format(**NUMBERS[0]))
    begun = mbs.simulate(system, backend="c")
    mbs.simulate(mbs.loads(CRANK.format(**NUMBERS[1])), backend="c")
    compilations.clear()
    again = mbs.simulate(mbs.loads(CRANK.format(**NUMBERS[0])), backend="c")
    assert not compilations
    assert np.array_equal(again.q, begun.q)
