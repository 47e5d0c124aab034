"""Problems as JSON values, but for what is compiled, and for what the run itself adds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from multibody_sym.integrators.methods.methods import METHODS
from multibody_sym.integrators.pairing import Pairing
from multibody_sym.runtime.loading import Compiled
from multibody_sym.runtime.problem import Begun, Problem

_PLAIN: Final = (
    *("t0", "t_end", "step", "rtol", "atol", "samples", "project", "max_steps", "contradiction", "closure"),
    *("independent", "whole", "crosses"),
)
_ARRAYS: Final = ("q0", "u0", "parameters", "modes")
_TUPLES: Final = ("terminal", "margins", "limiting", "moments")
TOLD: Final = frozenset({*_PLAIN, *_ARRAYS, *_TUPLES, "method", "pairs", "begun"})
"""The fields of a problem that are among its values."""


def values_of(problem: Problem) -> dict[str, Any]:
    """Return a problem as JSON values; `compiled`, `jump` and `course` are left out."""
    pairs, begun = problem.pairs, problem.begun
    return {
        **{name: getattr(problem, name) for name in _PLAIN},
        **{name: getattr(problem, name).tolist() for name in _ARRAYS},
        **{name: list(getattr(problem, name)) for name in _TUPLES},
        "method": problem.method.name,
        "pairs": None if pairs is None else [pairs.nq, pairs.plain, pairs.balls],
        "begun": None if begun is None else [begun.time, begun.written],
    }


def problem_of(values: Mapping[str, Any], compiled: Compiled) -> Problem:
    """Return the problem of `values_of`. Raises KeyError, TypeError or ValueError for anything else."""
    pairs, begun = values["pairs"], values["begun"]
    given: dict[str, Any] = {name: values[name] for name in _PLAIN}
    given |= {name: np.array(values[name], dtype=float) for name in _ARRAYS}
    given |= {name: tuple(values[name]) for name in _TUPLES}
    given["pairs"] = None if pairs is None else Pairing(pairs[0], *(_pairs(part) for part in pairs[1:]))
    given["begun"] = None if begun is None else Begun(*begun)
    return Problem(compiled=compiled, method=METHODS[values["method"]], **given)


def _pairs(part: Any) -> tuple[tuple[int, int], ...]:
    return tuple((a, b) for a, b in part)
