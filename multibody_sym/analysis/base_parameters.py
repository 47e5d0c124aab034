"""Base parameters: the combinations of masses and inertias that the forces of joints depend on.

In: a System. Out: BaseParameters, for identification by least squares on the regressor.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from multibody_sym.errors import ModelError
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.system import System
from multibody_sym.motion.function import Function, function
from multibody_sym.motion.function_results import Regressor
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.rank import first_columns

_OF_BODY: Final = ("m", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
"""The parameters of a body in the order of `theta`: mass, m times the centre, inertia about the origin."""
_DEPENDENT: Final = 1e-8
"""The part of a column by which it differs from a combination of those before it where it is one, by rounding."""
_SEED: Final = 1


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """Combinations K theta of the parameters of bodies that forces depend on: Y theta = Y[:, columns] (K theta).

    `names` (nb) of the base parameters, such as `Izz(upper) + 0.25*m(lower)`; their `columns` (nb) of the regressor Y;
    `combination` K (nb, 10 bodies); `parameters`: the names of theta.
    """

    names: tuple[str, ...]
    columns: npt.NDArray[np.intp]
    combination: Floats
    parameters: tuple[str, ...]


def base_parameters(system: System) -> BaseParameters:
    """Return the base parameters of the tree of a system, whose geometry counts and not its masses.

    Of parameters that forces cannot tell apart the first one in tree order stands in front, so that a link has those
    of the links that it carries. Constraints count for nothing.
    Raises ModelError for a system without speeds.
    Source: Gautier (1991), Numerical calculation of the base inertial parameters of robots.
    """
    regressor = function(system, "regressor")
    Y = _sampled(regressor)
    sizes = np.linalg.norm(Y, axis=0)
    seen = np.flatnonzero(sizes > _DEPENDENT * sizes.max(initial=0.0))
    first, of_seen = first_columns(Y[:, seen] / sizes[seen], _DEPENDENT)
    columns = seen[first]
    combination = np.zeros((len(columns), len(sizes)))
    of_seen *= sizes[seen] / sizes[columns][:, None]
    combination[:, seen] = np.where(np.abs(of_seen) > _DEPENDENT, of_seen, 0.0)
    declared = mechanism(system)
    bodies = (declared.relative or declared).bodies
    parameters = tuple(f"{word}({body.name})" for body in bodies for word in _OF_BODY)
    names = tuple(_in_words(row, column, parameters) for row, column in zip(combination, columns, strict=True))
    return BaseParameters(names, columns, combination, parameters)


def _sampled(regressor: Function[Regressor]) -> Floats:
    """Return the regressor at so many states that their rows are twice its columns. Raises ModelError."""
    rng = np.random.default_rng(_SEED)
    nu, width = regressor.shapes["regressor"]
    if not nu:
        raise ModelError("there are no speeds, so that no force tells of masses", number="M110")
    count = 2 * width // nu + 1
    nq = regressor.program.input("q").size
    q, (u, udot) = rng.uniform(-2.0, 2.0, (count, nq)), rng.uniform(-2.0, 2.0, (2, count, nu))
    found: Floats = regressor(0.0, q, u, udot).regressor.reshape(count * nu, width)
    return found


def _in_words(row: Floats, first: int, parameters: Sequence[str]) -> str:
    """Return a combination as text, its own parameter in front."""
    terms = [parameters[first]]
    for k in np.flatnonzero(row).tolist():
        if k != first:
            factor = "" if abs(abs(row[k]) - 1.0) < _DEPENDENT else f"{abs(row[k]):.6g}*"
            terms.append(f"{'-' if row[k] < 0 else '+'} {factor}{parameters[k]}")
    return " ".join(terms)
