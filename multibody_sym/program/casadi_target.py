"""The CasADi target: a Program as a `casadi.Function` of scalar symbols (SX), which CasADi differentiates."""

from __future__ import annotations

import operator
from itertools import product
from typing import Any

from multibody_sym.errors import InputError, MissingPackageError
from multibody_sym.program.replay import ToolFunction
from multibody_sym.program.target_layout import parameters
from multibody_sym.scalars.node import ZERO

_RESERVED = frozenset({"null", "jac", "hess"})


def casadi_function(function: ToolFunction) -> Any:
    """Return a `casadi.Function`: arguments as columns, results with their structural zeros left out.

    Raises InputError for a result of three axes, MissingPackageError without CasADi.
    """
    try:
        import casadi
    except ImportError:
        raise MissingPackageError("to_casadi needs CasADi: pip install 'multibody-sym[casadi]'") from None
    outputs = function.program.outputs
    for output in outputs:
        if len(output.shape) > 2:
            message = f"{output.name} has the shape {output.shape}, and CasADi has matrices only"
            raise InputError(f"{message}: differentiate in CasADi, by F.jacobian()")
    symbols = [casadi.SX.sym(each.name, len(each.places)) for each in function.arguments]
    found = function.replayed([symbol.elements() for symbol in symbols], _operations(casadi))
    results = []
    for output, values in zip(outputs, found, strict=True):
        rows, columns = (*output.shape, 1, 1)[:2]
        result = casadi.SX(rows, columns)
        for (i, j), node, value in zip(product(range(rows), range(columns)), output.values, values, strict=True):
            if node is not ZERO:
                result[i, j] = value
        results.append(result)
    taken = [each.name for each in function.arguments]
    _, named = parameters(function.program, _RESERVED | set(taken))
    return casadi.Function(function.name, symbols, results, taken, named)


def _operations(casadi: Any) -> dict[str, Any]:
    """Return CasADi's functions by operation."""
    names = "sin cos tan asin acos atan atan2 sinh cosh tanh exp log sqrt sign".split()
    return {name: getattr(casadi, name) for name in names} | {
        "neg": operator.neg,
        "add": operator.add,
        "mul": operator.mul,
        "div": operator.truediv,
        "pow": casadi.power,
        "abs": casadi.fabs,
        "min": casadi.fmin,
        "max": casadi.fmax,
        "less": operator.lt,
        "less_equal": operator.le,
        "where": casadi.if_else,
    }
