"""What a report tells: the answers of the package to all that can be asked of a system, each or why there is none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final, TypeVar

from multibody_sym.analysis.derivations import derive
from multibody_sym.answers.drawn import draw
from multibody_sym.answers.solution import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.checking.check import CheckReport, check
from multibody_sym.drawing.figure import Figure
from multibody_sym.errors import MultibodyError
from multibody_sym.expressions.printer import text
from multibody_sym.model.declaration.parameters import DimensionField
from multibody_sym.model.declaration.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.simulation.simulate import simulate
from multibody_sym.simulation.trajectory import Trajectory
from multibody_sym.writing.derivation import Equations
from multibody_sym.writing.report.free_bodies import free_bodies

_T = TypeVar("_T")
_MOST_BODIES: Final = 24


@dataclass(frozen=True)
class Missing:
    """A part that cannot be had, and why."""

    reason: str


@dataclass(frozen=True)
class ParameterTold:
    """A parameter: its name and letter, what the model says, its number and unit."""

    name: str
    label: str
    declared: str
    number: float | None
    unit: str


@dataclass(frozen=True, eq=False)
class Findings:
    """All that a report tells of a `system`; `command` makes it once more."""

    system: System
    command: str
    parameters: tuple[ParameterTold, ...]
    figure: Figure | Missing
    bodies: Mapping[str, Figure] | Missing
    equations: Equations | Missing
    solution: Solution | Missing
    check: CheckReport | Missing
    run: Trajectory | Missing


def findings(system: System, command: str, settings: Mapping[str, Any]) -> Findings:
    """Return what is found of a system; `settings` are those of the run."""
    return Findings(
        system=system,
        command=command,
        parameters=parameters_told(system),
        figure=_asked(lambda: draw(system)),
        bodies=_asked(lambda: free_bodies(system)),
        equations=_in_symbols(system, lambda: derive(system)),
        solution=_in_symbols(system, lambda: solve(system, steps=True)),
        check=_asked(lambda: check(system)),
        run=_asked(lambda: simulate(system, **settings)),
    )


def _in_symbols(system: System, question: Callable[[], _T]) -> _T | Missing:
    """Return an answer in symbols, none for systems whose equations nobody would read."""
    if len(system.bodies) > _MOST_BODIES:
        return Missing(f"{len(system.bodies)} bodies: formulas of so many are longer than a report")
    return _asked(question)


def _asked(question: Callable[[], _T]) -> _T | Missing:
    try:
        return question()
    except MultibodyError as error:
        return Missing(str(error).splitlines()[0])


def parameters_told(system: System) -> tuple[ParameterTold, ...]:
    """Return the parameters in the order of the model, with numbers of those that follow from others."""
    known: dict[Any, float] = {}
    pending, found = dict(system.parameters), {}
    for _ in range(len(pending)):
        for name, parameter in list(pending.items()):
            try:
                known[symbol(name)] = found[name] = float(evaluate_float([parameter.value], known)[0])
            except (KeyError, ArithmeticError, ValueError):
                continue
            del pending[name]
    return tuple(
        ParameterTold(
            name, parameter.label or name, text(parameter.value), found.get(name),
            "" if parameter.dimension is None else DimensionField().tree(parameter.dimension),
        )
        for name, parameter in system.parameters.items()
    )  # fmt: skip
