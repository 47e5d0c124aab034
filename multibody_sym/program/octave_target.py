"""Programs as functions of Octave and Matlab, each in a file of its own; vectors are columns.

In: Programs of straight-line code, as those of trees are. Out: the files of an export by name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.errors import InputError
from multibody_sym.program.program import Language, Program, Texts, expression, interpret
from multibody_sym.program.statements import Assign, Call
from multibody_sym.program.target_layout import (
    TITLE,
    TOLERANCE,
    Function,
    Functions,
    Samples,
    fill_template,
    functions,
    parameters,
)
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.tabulated import Tabulated

_RESERVED: Final = frozenset(
    "break case catch classdef continue else elseif end e for function global i if inf j nan otherwise parfor "
    "persistent pi return spmd switch try while abs acos acosh asin asinh atan atan2 atanh cos cosh exp log max min "
    "power reshape sign sin sinh sqrt tan tanh zeros mbs_choose".split()
)


def _no_table(function: Tabulated, _order: int, _x: str) -> str:
    raise InputError(f"Octave code has no tables, such as {function.name}")


_LANGUAGE: Final = Language(
    functions={"pow": "power"},
    choice="mbs_choose({condition}, {yes}, {no})",
    power="({x})^{n}",
    truth="({x}) ~= 0.0",
    table=_no_table,
)
_CHOOSE: Final = "function x = mbs_choose(condition, yes, no)\nif condition\n    x = yes;\nelse\n    x = no;\nend\n"


def octave_source(programs: Mapping[str, Program], samples: Samples) -> dict[str, str]:
    """Return files by name: a function `mbs_<name>.m` for each program, selftest.m, and integrate.m for those of a run.

    Raises InputError for constraints, contacts, many bodies and tables, ProgramError where a name is none.
    """
    every = functions(programs)
    files = {f"{function.name}.m": _text(function, every) for function in every.functions}
    checks = [_check(name, program, sample) for name, program in programs.items() for sample in samples.get(name, ())]
    test = fill_template("octave/selftest.m.in", tolerance=repr(TOLERANCE), checks="\n".join(checks))
    files |= {"mbs_choose.m": _CHOOSE, "selftest.m": test}
    if {"inputs", "state_derivative"} <= {*programs}:
        files["integrate.m"] = fill_template("octave/integrate.m.in")
    return files


def _text(function: Function, every: Functions) -> str:
    program, names, lines = function.program, Texts(), list[str]()
    inputs, outputs = parameters(program, _RESERVED)
    for name, array in zip(inputs, program.inputs, strict=True):
        _define(names, name, array.shape, array.slots)
    for k, statement in enumerate(program.statements):
        if isinstance(statement, Assign):
            lines.append(f"z{k} = {expression(statement.nodes, names, _LANGUAGE)};")
            names[statement.value] = f"z{k}"
        elif isinstance(statement, Call):
            callee = statement.program
            pairs = zip(callee.inputs, statement.arguments, strict=True)
            given = ", ".join(_value(array.shape, [names[x] for x in atoms]) for array, atoms in pairs)
            found = [f"r{k}_{n}" for n in range(len(callee.outputs))]
            lines.append(f"[{', '.join(found)}] = {every.names[id(callee)]}({given});")
            for name, output, leaves in zip(found, callee.outputs, statement.targets, strict=True):
                _define(names, name, output.shape, leaves)
        else:
            raise InputError("Octave code holds trees of few bodies, without constraints and contacts; --to c has them")
    for name, output in zip(outputs, program.outputs, strict=True):
        lines.append(f"{name} = {_value(output.shape, [names[x] for x in output.values])};")
    head = f"function [{', '.join(outputs)}] = {function.name}({', '.join(inputs)})"
    return "\n".join([head, f"% {TITLE}.", *lines, ""])


def _define(names: dict[Node, str], name: str, shape: tuple[int, ...], leaves: Sequence[Node]) -> None:
    """Let leaves be the elements of a scalar, a column or a matrix, which count from one."""
    for place, leaf in zip(np.ndindex(*shape), leaves, strict=True):
        names[leaf] = f"{name}({', '.join(str(k + 1) for k in place)})" if shape else name


def _value(shape: tuple[int, ...], texts: Iterable[str]) -> str:
    """Return the text of a scalar, of a column, or of a matrix, whose elements come row by row."""
    each = list(texts)
    if not shape:
        return each[0]
    if not each:
        return f"zeros({', '.join(map(str, (*shape, 1)[:max(2, len(shape))]))})"
    width = shape[1] if len(shape) > 1 else 1
    return f"[{'; '.join(', '.join(each[k : k + width]) for k in range(0, len(each), width))}]"


def _check(name: str, program: Program, sample: Sequence[object]) -> str:
    inputs = [np.asarray(values, dtype=float) for values in sample]
    both = inputs, interpret(program, *inputs)
    given, wanted = (", ".join(_value(x.shape, map(repr, x.ravel().tolist())) for x in part) for part in both)
    return f"worst = max(worst, check('{name}', {{{given}}}, {{{wanted}}}));"
