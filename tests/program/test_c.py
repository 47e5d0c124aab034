"""The C target against the interpreter, to the last bit; its layout, its self-test, its independence of hash seeds."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from c_library import Library, compiler
from random_programs import ARITHMETIC, FUNCTIONS, Maker

from multibody_sym.program import c_target
from multibody_sym.program.c_target import c_source
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.statements import Array, ProgramError
from multibody_sym.program.target_layout import spread_samples
from multibody_sym.program.trace import Trace
from multibody_sym.scalars.functions import absolute, cos, maximum, minimum, sign, sin, where
from multibody_sym.scalars.node import Node, number, power, real

BATCH = 16


def batch(first: int, operations: tuple[str, ...], count: int = BATCH) -> tuple[dict[str, Program], dict[str, Maker]]:
    makers = {f"p{seed}": Maker(seed, operations) for seed in range(first, first + count)}
    return {name: maker.program() for name, maker in makers.items()}, makers


def assert_same_bits(library: Library, programs: dict[str, Program], makers: dict[str, Maker]) -> None:
    for name, program in programs.items():
        for _ in range(4):
            arrays = makers[name].arguments(program)
            for found, wanted in zip(library.run(name, program, arrays), interpret(program, *arrays), strict=True):
                assert np.array_equal(found, wanted, equal_nan=True), name
                assert np.array_equal(np.signbit(found[found == 0]), np.signbit(wanted[wanted == 0])), name


@pytest.mark.parametrize("level", ["-O0", pytest.param("-O1", marks=pytest.mark.long), "-O2", "-O3"])
def test_arithmetic_has_the_bits_of_the_interpreter_at_every_level(tmp_path, level) -> None:
    programs, makers = batch(1000, ARITHMETIC, count=6)
    library = Library(c_source(programs), tmp_path, level)
    assert_same_bits(library, programs, makers)


@pytest.mark.parametrize("longest", [400, 7])
def test_all_operations_have_the_bits_of_the_interpreter(tmp_path, monkeypatch, longest) -> None:
    """-fno-builtin: both sides call the same functions; else the compiler evaluates those of constants by itself."""
    monkeypatch.setattr(c_target, "_LONGEST", longest)
    programs, makers = batch(2000, ARITHMETIC + FUNCTIONS, count=5)
    library = Library(c_source(programs), tmp_path, "-O2", "-fno-builtin")
    assert_same_bits(library, programs, makers)


@pytest.mark.long
@pytest.mark.parametrize("first", range(10_000, 10_000 + 40 * BATCH, BATCH))
def test_many_more_have_the_bits_of_the_interpreter(tmp_path, first) -> None:
    programs, makers = batch(first, ARITHMETIC + FUNCTIONS)
    library = Library(c_source(programs), tmp_path, "-O2", "-fno-builtin")
    assert_same_bits(library, programs, makers)


# --- what is printed ----------------------------------------------------------------------------------------------


q, (t,) = Array("q", (3,)).slots, Array("t").slots


def printed(expression: Node) -> list[str]:
    program = Trace("f", [Array("q", (3,)), Array("t")]).finish({"x": ((), [expression])})
    body = c_source({"f": program})["model.c"].split("void mbs_f(")[1].split("\n}")[0]
    return [line.strip() for line in body.splitlines() if "const double z" in line]


def test_expressions_have_no_parenthesis_too_many() -> None:
    assert printed(q[0] * q[1] + sin(t) * q[2]) == ["const double z0 = q[0]*q[1] + sin(t)*q[2];"]
    assert printed((q[0] + q[1]) * q[2]) == ["const double z0 = q[2]*(q[0] + q[1]);"]
    assert printed(q[0] - (q[1] + q[2])) == ["const double z0 = q[0] - (q[1] + q[2]);"]
    assert printed((q[0] * q[1]) / (q[2] * t)) == ["const double z0 = q[0]*q[1]/(t*q[2]);"]
    assert printed(q[0] + 7 * (q[1] * q[2])) in (
        ["const double z0 = q[0] + 7.0*(q[1]*q[2]);"],
        ["const double z0 = 7.0*(q[1]*q[2]) + q[0];"],
    )
    assert printed(-(q[0] + q[1])) == ["const double z0 = -(q[0] + q[1]);"]


def test_integer_powers_are_products_of_an_atom() -> None:
    assert printed(t**2) == ["const double z0 = t*t;"]
    assert printed((q[0] + q[1]) ** 3) == [
        "const double z0 = q[0] + q[1];",
        "const double z1 = z0*z0*z0;",
    ]
    assert printed(1 / t**2) == ["const double z0 = 1.0/(t*t);"]
    assert printed(power(t, number(5))) == ["const double z0 = mbs__power(t, 5);"]
    assert printed(t**0.25) == ["const double z0 = pow(t, 0.25);"]


def test_choices_and_comparisons() -> None:
    assert printed(where(q[0] < t, q[1], -q[2])) == ["const double z0 = (q[0] < t ? q[1] : -q[2]);"]
    assert printed((q[0] <= t) + q[1]) == ["const double z0 = q[1] + (q[0] <= t ? 1.0 : 0.0);"]
    assert printed(where(t, absolute(q[0]), sign(t))) == ["const double z0 = (t != 0.0 ? fabs(q[0]) : mbs__sign(t));"]
    assert printed(minimum(q[0], 1)) in (
        ["const double z0 = mbs__minimum(q[0], 1.0);"],
        ["const double z0 = mbs__minimum(1.0, q[0]);"],
    )


def test_every_number_is_a_double() -> None:
    source = c_source({"f": wide_program(30)})["model.c"]
    body = source.split("void mbs_f(")[1].split("\n}")[0]
    numbers = re.findall(r"(?<![\w\[.])\d[\d.e+-]*(?![\w\]])", body)
    assert numbers
    assert all("." in text or "e" in text for text in numbers)
    assert "M_PI" not in source


def wide_program(count: int) -> Program:
    """Return a Program in which every value is used by others nearby and far away."""
    trace = Trace("f", [Array("q", (5,)), Array("t")])
    values = [*trace["q"], *trace["t"]]
    for k in range(count):
        near, far = values[-1 - k % 4], values[k // 2]
        values.append((near + number(k) * far) / 7 if k % 3 else maximum(near, cos(far)))
    return trace.finish({"x": ((2, 2), values[-4:]), "early": ((3,), values[6:9])})


def test_long_programs_are_cut_into_functions_that_share_values(tmp_path) -> None:
    program = wide_program(5000)
    sources = c_source({"f": program})
    pieces = sources["model.c"].split("static void mbs_f__")[1:]
    assert len(pieces) > 10
    assert max(piece.split("\n}")[0].count(";") for piece in pieces) < 1300
    library = Library(sources, tmp_path, "-O1", "-fno-builtin")
    arrays = [np.linspace(0.3, 0.9, 5), np.array(1.5)]
    for found, wanted in zip(library.run("f", program, arrays), interpret(program, *arrays), strict=True):
        assert np.array_equal(found, wanted)


def test_deep_expressions_do_not_exhaust_the_stack() -> None:
    trace = Trace("deep", [Array("t")])
    (t,) = trace["t"]
    value = t
    for _ in range(30_000):
        value = sin(value) + t
    program = trace.finish({"x": ((), [value])})
    assert max(map(len, c_source({"deep": program})["model.c"].splitlines())) < 300
    assert np.isfinite(interpret(program, 0.1)[0])


def test_awkward_names_and_sizes(tmp_path) -> None:
    """Names that C reserves or that inputs and outputs share; nothing in, nothing out; outputs that are inputs."""
    trace = Trace("solve", [Array("double"), Array("sin", (2,)), Array("w", (0,)), Array("q", (2,))])
    (a,), s, _, q = (trace[array.name] for array in trace.inputs)
    sums = ((), [sin(s[0]) + s[1] + a])
    first = trace.finish({"q": ((2,), [q[0], a]), "none": ((0,), []), "w": sums, "c": ((), [number(1)])})
    nothing = Trace("energy", []).finish({})
    unused = Trace("unused", [Array("t"), Array("q", (3,))]).finish({"x": ((), [number(2)])})
    programs = {"solve": first, "energy": nothing, "unused": unused}
    library = Library(c_source(programs), tmp_path)
    assert library.names == list(programs)
    arrays = [np.array(0.5), np.array([0.25, 2.0]), np.zeros(0), np.array([3.0, 4.0])]
    found = library.run("solve", first, arrays)
    assert [x.tolist() for x in found] == [[3.0, 0.5], [], np.sin(0.25) + 2.0 + 0.5, 1.0]
    assert library.run("energy", nothing, []) == []
    assert library.run("unused", unused, [np.array(0.0), np.zeros(3)])[0] == 2.0


def test_programs_that_compute_the_same_are_printed_once() -> None:
    def callee(name: str, shift: int) -> Program:
        trace = Trace(name, [Array("x")])
        return trace.finish({"y": ((), [sin(trace["x"][0]) + shift])})

    trace = Trace("caller", [Array("t")])
    values = [trace.call(callee(f"name_{k}", k % 2), [trace["t"]])[0][0] for k in range(4)]
    source = c_source({"caller": trace.finish({"x": ((4,), values)})})["model.c"]
    assert len(re.findall(r"^static void mbs__\d+\(double x", source, re.M)) == 2


def test_a_program_that_is_exported_is_called_by_its_name() -> None:
    callee = wide_program(3)
    trace = Trace("caller", callee.inputs)
    early = trace.call(callee, [trace["q"], trace["t"]])[1]
    caller = trace.finish({"x": ((3,), early)})
    source = c_source({"caller": caller, "f": callee})["model.c"]
    assert source.count("mbs_f(t, q") + source.count("mbs_f(q, t") == 1
    assert "static void mbs__1" not in source


def test_names_that_are_none_are_refused() -> None:
    program = wide_program(3)
    with pytest.raises(ProgramError, match="no program"):
        c_source({})
    with pytest.raises(ProgramError, match="no name"):
        c_source({"f; system()": program})


# --- self-test ----------------------------------------------------------------------------------------------------


def run_self_test(sources: dict[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the two commands that the head of model.c prints."""
    for name, text in sources.items():
        (folder / name).write_text(text, encoding="ascii")
    (line,) = re.findall(r"Self-test: (.*)", sources["model.c"])
    build, run = (shlex.split(command) for command in line.split("&&"))
    subprocess.run([compiler(), *build[1:]], cwd=folder, check=True, timeout=300)
    return subprocess.run([folder / run[0]], cwd=folder, capture_output=True, text=True, timeout=60, check=False)


def test_self_test_passes_and_finds_a_wrong_constant(tmp_path) -> None:
    programs, _ = batch(3000, ARITHMETIC, count=4)
    programs["f"] = wide_program(50)
    sources = c_source(programs, samples=spread_samples(programs))
    good = run_self_test(sources, tmp_path)
    assert good.returncode == 0, good.stdout
    assert good.stdout.count(": ok") == len(programs)
    sources["model.c"] = re.sub(r"(void mbs_f\((?s:.*?)= )", r"\g<1>1e-3 + ", sources["model.c"], count=1)
    bad = run_self_test(sources, tmp_path)
    assert bad.returncode == 1
    assert "f: WRONG" in bad.stdout


def test_a_program_with_a_name_that_is_taken(tmp_path) -> None:
    programs = {"programs": wide_program(20), "f": wide_program(700)}
    sources = c_source(programs, samples=spread_samples(programs))
    assert re.search(r"void mbs_programs_\(", sources["model.h"])
    run = run_self_test(sources, tmp_path)
    assert run.returncode == 0, run.stdout


# --- determinism --------------------------------------------------------------------------------------------------

_PRINT_DIGEST = """
import hashlib, sys
sys.path.insert(0, {folder!r})
from random_programs import ARITHMETIC, FUNCTIONS, Maker
from multibody_sym.program.c_target import c_source
from multibody_sym.program.list_target import python_source
from multibody_sym.program.program import program_hash
from multibody_sym.scalars.node import symbol
from multibody_sym.scalars.functions import sin
kept = [sin(symbol(f"name{{k}}") + hash(str(k)) % 7) for k in range(int(sys.argv[1]))]
programs = {{f"p{{seed}}": Maker(seed, ARITHMETIC + FUNCTIONS).program() for seed in range(15)}}
texts = [*c_source(programs).values(), python_source(programs), *map(str, programs.values())]
print(hashlib.sha256("".join(texts + [program_hash(p) for p in programs.values()]).encode()).hexdigest())
"""


def test_the_same_bytes_under_every_hash_seed_and_history() -> None:
    code = _PRINT_DIGEST.format(folder=str(Path(__file__).parents[1]))
    digests = set()
    for seed, history in (("0", 0), ("1", 50), ("4242", 0), ("random", 1000)):
        environment = os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": os.pathsep.join(sys.path)}
        run = subprocess.run(
            [sys.executable, "-c", code, str(history)], env=environment, capture_output=True, text=True, check=True
        )
        digests.add(run.stdout)
    assert len(digests) == 1


# --- matrices -----------------------------------------------------------------------------------------------------


def matrix_by_columns(size: int) -> Program:
    """Return a matrix whose columns are found by calls of one Program, above zeros, and below one of its elements."""
    (x,), weights = Array("x").slots, Array("weights", (size,))
    column = Trace("column", [Array("x"), weights]).finish(
        {"column": ((size,), [x * weight for weight in weights.slots])}
    )
    trace = Trace("matrix", [Array("x")])
    found = [trace.call(column, [trace["x"], [number(k == j) for k in range(size)]])[0] for j in range(size)]
    above = [found[j][k] for k in range(size) for j in range(size)]
    zeros = [number(0)] * (size * size)
    return trace.finish({"matrix": ((2 * size + 1, size), [*above, *zeros, *[found[1][1]] * size])})


def test_matrices_found_by_columns_are_written_by_loops(tmp_path: Path) -> None:
    """The statements of their code grow with their columns, not with their elements."""
    count = {size: c_source({"f": matrix_by_columns(size)})["model.c"].count(";") for size in (20, 40, 80)}
    assert count[80] - count[40] < 3 * (count[40] - count[20])
    program = matrix_by_columns(30)
    (found,) = Library(c_source({"f": program}), tmp_path).run("f", program, [np.array(3.0)])
    wanted = np.vstack([3.0 * np.eye(30), np.zeros((30, 30)), np.full((1, 30), 3.0)])
    assert np.array_equal(np.reshape(found, wanted.shape), wanted)


def shuffled(count: int) -> Program:
    """Return a Program whose output has elements of two arrays in an odd order, numbers, and a sum."""
    trace = Trace("shuffled", [Array("x", (count,)), Array("y", (count,))])
    x, y = trace["x"], trace["y"]
    order = np.random.default_rng(1).permutation(count).tolist()
    parts = [(x[k], y[-1 - k], real(0.5 * k), real(-0.0), number(0)) for k in order]
    values = [x[0] + y[1], *(value for part in parts for value in part)]
    return trace.finish({"whole": ((len(values),), values), "small": ((3,), [y[2], x[1], y[0]])})


def test_outputs_that_stand_elsewhere_are_written_by_loops(tmp_path: Path) -> None:
    """A line for each took compilers as long as what it was computed by."""
    lengths = []
    for count in (80, 160):
        program = shuffled(count)
        sources = c_source({"shuffled": program})
        lengths.append(sources["model.c"].count(";"))
        assert sources["model.c"].count("small[") == 3
        given = list(np.random.default_rng(2).normal(size=(2, count)))
        for found, wanted in zip(
            Library(sources, tmp_path / str(count), "-O2" if count == 80 else "-O0").run("shuffled", program, given),
            interpret(program, *given),
            strict=True,
        ):
            assert np.array_equal(found, wanted)
            assert np.array_equal(np.signbit(found), np.signbit(wanted))
    assert lengths[0] == lengths[1]


def called_before_much(count: int) -> Program:
    """Return a Program that hands on what another one fills an array with, and computes in several pieces behind it."""
    trace = Trace("whole", [Array("x", (count,))])
    doubled = Trace("doubled", [Array("x", (count,))])
    called = doubled.finish({"all": ((count,), [2 * doubled["x"][min(k, 3)] for k in range(count)])})
    (found,) = trace.call(called, [trace["x"]])
    long = found[0]
    for k in range(1500):
        long = sin(long + 0.001 * k) if k % 3 else long * found[k % 3]
    return trace.finish({"first": ((count,), found), "long": ((), [long])})


def test_what_calls_fill_is_handed_on_whole(tmp_path: Path) -> None:
    """Pieces of a long function were handed each element, which took a compiler half a minute for 100 contacts."""
    lengths = []
    for count in (100, 300):
        program = called_before_much(count)
        sources = c_source({"whole": program})
        inside = sources["model.c"].partition("__2(")[2]
        assert inside, "the function has pieces"
        lengths.append(inside.count(";"))
        given = np.random.default_rng(3).normal(size=count)
        found = Library(sources, tmp_path / str(count)).run("whole", program, [given])
        for mine, wanted in zip(found, interpret(program, given), strict=True):
            assert np.array_equal(mine, wanted)
    assert lengths[0] == lengths[1]
