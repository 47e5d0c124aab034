"""Programs rolled up into loops over like values: the same numbers to the last bit, text that does not grow."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from random_programs import ARITHMETIC, SMOOTH, Maker

from multibody_sym.dynamics.formalisms.composite_body import composite_body
from multibody_sym.dynamics.programs import law_programs
from multibody_sym.dynamics.programs.law_programs import row_program
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.bodies import Body, Surface
from multibody_sym.model.contacts_and_impacts import Contact
from multibody_sym.model.joints import Planar, Revolute
from multibody_sym.model.system import System
from multibody_sym.program import loops as rolling
from multibody_sym.program.backend import Native
from multibody_sym.program.c_target import c_source
from multibody_sym.program.loading import load
from multibody_sym.program.loops import rolled_up, with_loops
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.programs import Programs
from multibody_sym.program.statements import Array, Call, Scan
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import maximum, sin, where
from multibody_sym.scalars.node import Node, as_node, less


def windows(count: int) -> System:
    """Return cranks in a row, whose tips are joined by couplers; rods have unlike masses."""
    rods = [Body(shape={"rod": 1, "mass": 1.037 + 0.1013 * k}, points={"end": [1, 0, 0]}) for k in range(count + 1)]
    bodies: dict[str, Any] = {"ground": Body(points={f"pivot{k}": [k, 0, 0] for k in range(count + 1)})}
    joints: dict[str, Any] = {}
    for k in range(count + 1):
        bodies[f"crank{k}"] = rods[k]
        joints[f"A{k}"] = Revolute(f"ground.pivot{k}", f"crank{k}", axis="z")
    for k in range(count):
        bodies[f"coupler{k}"] = rods[k]
        joints[f"B{k}"] = Revolute(f"crank{k}.end", f"coupler{k}", axis="z")
        joints[f"C{k}"] = Revolute(f"coupler{k}.end", f"crank{k + 1}.end", axis="z", cut=True)
    return System("windows", gravity=[0, -9.81, 0], bodies=bodies, joints=joints)


def unrolled(count: int, monkeypatch: pytest.MonkeyPatch) -> Programs:
    with monkeypatch.context() as patched:
        patched.setattr(rolling, "all_rolled", lambda every: every)
        return programs(mechanism(windows(count)), composite_body)


def arguments(program: Program, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.normal(size=array.shape) for array in program.inputs]


def assert_same(first: Program, second: Program, given: list[np.ndarray]) -> None:
    for found, wanted in zip(interpret(second, *given), interpret(first, *given), strict=True):
        assert np.array_equal(found, wanted, equal_nan=True), first.name


@pytest.mark.parametrize("seed", range(60))
def test_random_programs(seed: int) -> None:
    program = Maker(seed, (*SMOOTH, "min", "max", "abs", "where", "less")).program(depth=0, steps=80)
    assert_same(program, rolled_up(program)[0], arguments(program, seed))


OTHERS = {
    "square": lambda x: x**2,
    "powers": lambda x: x**2 * x ** as_node(2.5),
    "bound": lambda x: maximum(2, x),
    "condition": lambda x: where(less(as_node(2), x), x, 1),
}


@pytest.mark.parametrize("beside", OTHERS.values(), ids=OTHERS)
def test_factors_that_equal_other_numbers_of_their_value(beside: Callable[[Node], Node]) -> None:
    """The mass 2 of the first of like bodies is no exponent, nor a bound, of the others."""
    trace = Trace("masses", (Array("q", (40,)),))
    values = [(2 + k) * beside(sin(q)) + (2 + k) / (3 + q * q) for k, q in enumerate(trace["q"])]
    program = trace.finish({"values": ((40,), values)})
    shorter, size = rolled_up(program)
    assert size < 40
    assert_same(program, shorter, arguments(program, 1))


def test_rows_of_discs_whose_masses_are_small_integers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Their inertia is m (.. cos(q)^2 + .. sin(q)^2), and the mass of one of them 2."""
    bodies: dict[str, Any] = {"ground": Body()}
    for k in range(7):
        rim = {"rim": Surface(disc=0.2 + 0.03 * k)}
        bodies[f"b{k}"] = Body(mass=1 + k, com=[0.01 * k, 0, 0], inertia={"Izz": 0.016}, surfaces=rim)
    joints = {f"j{k}": Planar("ground", f"b{k}") for k in range(7)}
    law = {"static": 0.4, "kinetic": 0.3}
    pairs = combinations(range(7), 2)
    contacts = {f"c{i}{k}": Contact(between=[f"b{i}.rim", f"b{k}.rim"], open=True, **law) for i, k in pairs}
    resolved = mechanism(System("discs", bodies=bodies, joints=joints, contacts=contacts))
    shorter = row_program(resolved).program
    monkeypatch.setattr(law_programs, "with_loops", lambda program: program)
    plain = row_program(resolved).program
    assert any(isinstance(statement, Scan) for statement in shorter.statements)
    assert_same(plain, shorter, arguments(plain, 0))


def test_closed_loops_in_a_row_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = unrolled(9, monkeypatch).as_mapping()
    for name, program in programs(mechanism(windows(9)), composite_body).as_mapping().items():
        assert_same(plain[name], program, arguments(program, 1))
        assert_same(plain[name], rolled_up(plain[name])[0], arguments(program, 2))


def test_compiled_they_have_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = unrolled(9, monkeypatch).state_derivative
    made = rolled_up(plain)[0]
    given = arguments(plain, 3)
    pair = [load({"state_derivative": each}, Native(backend="c"))["state_derivative"](*given) for each in (plain, made)]
    for found, wanted in zip(*pair, strict=True):
        assert np.array_equal(found, wanted)


def test_the_number_of_loops_does_not_grow() -> None:
    counts = []
    for size in (12, 24):
        derivative = programs(mechanism(windows(size)), composite_body).state_derivative
        counts.append([len(s.loops) for s in derivative.statements if isinstance(s, Scan)])
    assert counts[0] == counts[1]


def test_text_is_a_fraction(monkeypatch: pytest.MonkeyPatch) -> None:
    plain = unrolled(24, monkeypatch).as_mapping()
    made = programs(mechanism(windows(24)), composite_body).as_mapping()
    assert 2 * len(c_source(made)["model.c"]) < len(c_source(plain)["model.c"])


def test_terms_of_a_negative_sum_are_like_each_other() -> None:
    sizes = []
    for sign in (1, -1):
        trace = Trace("total", [Array("x", (40,))])
        total = sum((sin(x) * (x + k) for k, x in enumerate(trace["x"])), start=trace["x"][0])
        program = trace.finish({"y": ((), [total * sign])})
        made, size = rolled_up(program)
        assert_same(program, made, arguments(program, 5))
        sizes.append(size)
    assert sizes[1] <= sizes[0] + 1


def test_what_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """No loops are made to find that: they would take most of the time."""
    short = unrolled(2, monkeypatch).state_derivative
    assert with_loops(short) is short
    trace = Trace("unlike", [Array("x", (2,))])
    value = trace["x"][0]
    for k in range(2000):
        value = sin(value * (k + 2)) if k % 3 else value * trace["x"][1] + k
    unlike = trace.finish({"y": ((), [value])})
    monkeypatch.setattr(rolling, "_Stage", None)
    assert with_loops(unlike) is unlike


def test_calls_are_left_alone() -> None:
    drawn = (Maker(seed, ARITHMETIC).program() for seed in range(50))
    called = next(program for program in drawn if any(isinstance(s, Call) for s in program.statements))
    assert with_loops(called) is called


def test_what_a_rolled_program_calls_is_rolled_up_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both corrections call what rows miss by: written out it was a third of the text of a row of four-bars."""
    monkeypatch.setattr(rolling, "_LONG", 400)
    plain, made = unrolled(9, monkeypatch), programs(mechanism(windows(9)), composite_body)
    assert made.missed is not None
    assert made.put_back is not None
    assert plain.put_back is not None
    assert any(isinstance(s, Scan) for s in made.missed.statements)
    assert [s.program for s in made.put_back.statements if isinstance(s, Call)] == [made.missed]
    assert_same(plain.put_back, made.put_back, arguments(made.put_back, 4))
