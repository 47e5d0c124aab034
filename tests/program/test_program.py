"""The verifier refuses every Program that contradicts itself, and says where."""

from __future__ import annotations

import pytest

from multibody_sym.program.program import Program
from multibody_sym.program.statements import (
    Array,
    Assign,
    Call,
    DefinedTwiceError,
    Output,
    ProgramError,
    Rows,
    ShapeError,
    Solve,
    Statement,
    UndefinedError,
)
from multibody_sym.scalars.functions import sin
from multibody_sym.scalars.node import ONE, Node, slot, symbol

Q = Array("q", (2,))
A, B = Q.slots
Z = tuple(slot("z", k) for k in range(9))
SUM, SINE = A + B, sin(A + B)
rows = Rows.of


def program(*statements: Statement, values: tuple[Node, ...] = (), inputs: tuple[Array, ...] = (Q,)) -> Program:
    return Program("f", inputs, statements, (Output("x", (len(values),), values),))


CALLEE = program(Assign((SUM,)), values=(SUM, A))
CALL = Call(CALLEE, ((A, B),), (Z[:2],))
SOLVE = Solve(rows(((A, B),)), (ONE,), ONE, Z[:2], Z[2:3], Z[3:6])


def test_what_fits_together_is_accepted() -> None:
    assert program(Assign((SUM, SINE)), values=(SINE, A, ONE)).statements[0] == Assign((SUM, SINE))
    assert program(Assign((SUM,)), Assign((SINE,)), values=(SUM, SINE)).output("x").values == (SUM, SINE)
    assert program(CALL, Assign((Z[0] * A,)), values=(Z[1], Z[0] * A)).input("q") is Q
    assert program(SOLVE, values=Z[:6]).name == "f"


@pytest.mark.parametrize(
    ("error", "make", "says"),
    [
        (UndefinedError, lambda: program(values=(SUM,)), "a add is used"),
        (UndefinedError, lambda: program(Assign((SINE,)), values=(SINE,)), "a add is used"),
        (UndefinedError, lambda: program(Assign((SUM, SINE)), values=(SUM,)), "a add is used"),
        (UndefinedError, lambda: program(Assign((symbol("m") * A,))), "m is used"),
        (UndefinedError, lambda: program(Assign((slot("q", 2) * A,))), r"q\[2\] is used"),
        (UndefinedError, lambda: program(Assign((Z[0] * A,)), CALL), r"z\[0\] is used"),
        (UndefinedError, lambda: program(Solve(rows(((Z[0],),)), (A,), ONE, Z[:1], Z[1:2], Z[2:5])), r"z\[0\] is used"),
        (UndefinedError, lambda: program().output("y"), "no output is called 'y'; there are x"),
        (UndefinedError, lambda: program(inputs=()).input("q"), "there are none"),
        (DefinedTwiceError, lambda: program(Assign((SUM,)), Assign((SUM,))), "a second time"),
        (DefinedTwiceError, lambda: program(Assign((SUM,)), Assign((SUM, SINE))), "a second time"),
        (DefinedTwiceError, lambda: program(CALL, CALL), r"z\[0\] is defined a second time"),
        (DefinedTwiceError, lambda: program(Solve(rows(((A,),)), (A,), ONE, Z[:1], Z[:1], Z[2:5])), r"z\[0\] is def"),
        (DefinedTwiceError, lambda: program(inputs=(Q, Q)), "the same name"),
        (ShapeError, lambda: program(Call(CALLEE, ((A,),), (Z[:2],))), "arguments of f have the sizes"),
        (ShapeError, lambda: program(Call(CALLEE, ((A, B), (A,)), (Z[:2],))), "arguments of f have the sizes"),
        (ShapeError, lambda: program(Call(CALLEE, ((A, B),), (Z[:1],))), "targets of f have the sizes"),
        (ShapeError, lambda: program(Solve(rows([(A,), (A, B)]), (A, A), ONE, Z[:1], Z[1:3], Z[3:6])), "rows of a"),
        (ShapeError, lambda: program(Solve(rows(((A,),)), (A,), ONE, Z[:1], Z[1:3], Z[3:6])), "multipliers and report"),
        (ShapeError, lambda: program(Solve(rows(((A,),)), (A,), ONE, Z[:1], Z[1:2], Z[3:5])), "multipliers and report"),
        (ShapeError, lambda: Program("f", (Q,), (), (Output("x", (2, 2), (A, B)),)), "got 2 values"),
        (ProgramError, lambda: program(Assign((A,))), "an atom is not assigned"),
        (ProgramError, lambda: program(Assign((sin(ONE),))), "an atom is not assigned"),
        (ProgramError, lambda: program(Call(CALLEE, ((A, B),), ((A, B),))), "a target is a slot of 'z'"),
        (ProgramError, lambda: program(inputs=(Array("z"),)), "no name of an input"),
        (ProgramError, lambda: program(inputs=(Array("x; system()"),)), "no name of an input"),
        (ProgramError, lambda: Program("f__1", (), (), ()), "no name of a program"),
    ],
)
def test_what_contradicts_itself_is_refused(error: type[ProgramError], make, says: str) -> None:
    with pytest.raises(error, match=says) as caught:
        make()
    assert type(caught.value) is error


def test_the_error_names_the_program() -> None:
    with pytest.raises(UndefinedError, match="program f"):
        program(values=(SUM,))


def test_a_program_shows_itself_in_a_line_even_where_its_tree_is_endless() -> None:
    value = A
    statements = []
    for _ in range(300):
        value = value * sin(value)
        statements.append(Assign((value.args[0] if value.args[0].op == "sin" else value.args[1], value)))
    long = program(*statements, values=(value,))
    assert repr(long) == "<Program f: 300 statements>"
    assert len(repr(long.statements[-1])) < 100
    assert long == program(*statements, values=(value,))
