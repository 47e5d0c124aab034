"""Units of answers and multipliers: the same systems in other units of mass, length and time.

Values that are told in kg^a m^b s^c must be those of the same system in other units times that power of their ratios,
whatever the program thinks of dimensions.
"""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from problem_files import PROBLEMS, read_problem

import multibody_sym as mbs
from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.fields import Names
from multibody_sym.text.units import Dimension, parse_unit

MODELS = sorted(path.stem for path in PROBLEMS.glob("units/*.yaml") if path.stem != "tables")

SCALES = (1.7, 2.3, 1.3)
"""How many of the other units one kilogram, metre and second is."""


def loaded(name: str) -> mbs.System:
    model, _ = read_problem(PROBLEMS / "units" / f"{name}.yaml")
    return mbs.loads(model)


def scale(dimension: Dimension) -> float:
    return math.prod(size ** float(exponent) for size, exponent in zip(SCALES, dimension, strict=True))


def in_other_units(system: mbs.System) -> mbs.System:
    """Return the system with the numbers that its parameters have in the other units."""
    changed = {
        name: p if p.dimension is None else replace(p, value=p.value * scale(p.dimension))
        for name, p in system.parameters.items()
    }
    return replace(system, parameters=Names(changed))


def as_scaled(value: float | None, unit: str) -> float:
    assert value is not None
    return value * (scale(parse_unit(unit)[1]) if unit else 1.0)


@pytest.mark.parametrize("name", MODELS)
def test_answers_and_reactions_are_the_same_in_other_units(name: str) -> None:
    found, other = mbs.solve(loaded(name)), mbs.solve(in_other_units(loaded(name)))
    groups = [(found.accelerations, other.accelerations), (found.answers, other.answers)]
    groups += [(found.reactions[joint], other.reactions[joint]) for joint in found.reactions]
    for here, there in groups:
        for key, value in here.items():
            if value.unique and value.value is not None:
                expected = as_scaled(value.value, value.unit)
                assert there[key].value == pytest.approx(expected, rel=1e-7, abs=1e-9), (key, value)
                assert there[key].unit == value.unit


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
@pytest.mark.parametrize("name", MODELS)
def test_states_and_multipliers_are_the_same_in_other_units(name: str, coordinates: str) -> None:
    here, there = (_forces(system, coordinates) for system in (loaded(name), in_other_units(loaded(name))))
    assert len(here) > 2
    for key, (value, unit) in here.items():
        assert there[key] == (pytest.approx(as_scaled(value, unit), rel=1e-7, abs=1e-9), unit), key


def _forces(system: mbs.System, coordinates: str) -> dict[str, tuple[float, str]]:
    """Return coordinates, speeds, accelerations and multipliers (where they are unique) with their units."""
    resolved = mbs.mechanism(replace(system, simulation=replace(system.simulation, coordinates=coordinates)))
    begin, told = start(resolved), MechanismUnits(resolved)
    state = state_of(resolved, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(composite_body(resolved, state))
    names = [c.name for c in resolved.coordinates], [s.name for s in resolved.speeds]
    values = dict(zip([*names[0], *names[1]], [*begin.q, *begin.u], strict=True))
    result = {name: (value, told.state[name]) for name, value in values.items()}
    result |= {f"{s}'": (a, told.accelerations[s]) for s, a in zip(names[1], found.udot.tolist(), strict=True)}
    if found.report[0] == len(resolved.rows):
        rows = [row.name for row in resolved.rows]
        result |= {f"on {r}": (x, told.multipliers[r]) for r, x in zip(rows, found.multipliers.tolist(), strict=True)}
    return result


def test_absolute_coordinates_tell_joints_that_close_loops_too() -> None:
    system = loaded("loop")
    told = MechanismUnits(mbs.mechanism(replace(system, simulation=replace(system.simulation, coordinates="absolute"))))
    joints = dict.fromkeys(("p", "q", "s", "D"), "rad")
    assert told.outputs == {**joints, **{f"u_{name}": f"{unit}/s" for name, unit in joints.items()}}
    assert {told.state[name] for name in ("crank_x", "rod_y")} == {"m"}
    assert {told.state[name] for name in ("rocker_angle", "D")} == {"rad"}
