"""What an impact does as a compiled function of the state, in the mode that it has at the start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.analysis.struck import PosedImpact, outcome, posed_impact
from multibody_sym.dynamics.impacts.impulsive import struck_rows
from multibody_sym.dynamics.impacts.problem import Struck
from multibody_sym.dynamics.impacts.program import StruckMode, impact_program
from multibody_sym.dynamics.laws.assemble import accelerations_of
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.errors import ModelError, NoSolutionError, Where
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.numerics.arrays import Floats
from multibody_sym.program.program import Program
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.arguments import Arguments, Values

_AGREE: Final = 1e-9
"""How near the Program comes at the start to what the laws find there, relative to the largest speed."""


@dataclass(frozen=True)
class ImpactQuestion:
    """What is to be compiled: the impact of a system, in the mode that it has at the start."""

    system: System


def impact(system: System) -> ImpactQuestion:
    """Return what an impact does, for `compile`: f(t, q, u) -> speeds after, impulses, impulses in joints.

    What strikes, and how it slides, is as at the start of the system, which has an `impact`.
    """
    verify_system(system)
    if system.impact is None:
        raise ModelError("nothing strikes: the system has no impact; declare one (impact=...)")
    return ImpactQuestion(system)


@dataclass(frozen=True)
class Strike:
    """What an impact did: `u` after (nu,), `impulses` by row, and of each joint fx .. mz on its child, by name.

    A contact's rows are `<contact>.normal` and, where it sticks, `<contact>.friction`. In N s and N m s.
    """

    u: Floats
    impulses: Mapping[str, float]
    joints: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class ImpactFunction:
    """An impact as a compiled function of the state."""

    arguments: Arguments
    rows: tuple[str, ...]

    def __call__(
        self, t: float, q: ArrayLike, u: ArrayLike, *, parameters: Values = None, inputs: Values = None
    ) -> Strike:
        """Return what the impact does; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name or a wrong length.
        """
        after, impulses, joints = self.arguments.compiled["impact"](
            *self.arguments.complete(t, q, u, parameters, inputs)
        )
        names = self.arguments.mechanism.joint_names
        told = (dict(zip(COMPONENTS, values, strict=True)) for values in joints.reshape(-1, 6).tolist())
        return Strike(after, dict(zip(self.rows, impulses.tolist(), strict=True)), dict(zip(names, told, strict=True)))


def impact_function(
    question: ImpactQuestion, *, native: bool = False, backend: Backend | None = None
) -> ImpactFunction:
    """Return an impact as a compiled function. Raises NoSolutionError where it has no single mode at the start."""
    posed = posed_impact(question.system)
    struck = outcome(posed)
    mode = StruckMode(posed.blow, struck_rows(posed.blow, struck))
    if struck.impacts > 1:
        raise NoSolutionError(
            f"{struck.impacts} impacts follow each other here, and a function has one mode; write sequence: "
            "simultaneous, or let solve tell each",
            where=Where(path=("impact", "sequence")),
        )
    compiled = _compiled(mode, impact_program(mode), native=native, backend=backend)
    arguments = Arguments(posed.blow.mechanism, compiled, np.array(posed.begin.parameters))
    function = ImpactFunction(arguments, mode.told)
    _verify(function, posed, struck)
    return function


def _compiled(mode: StruckMode, program: Program, *, native: bool, backend: Backend | None) -> Compiled:
    programs = {"inputs": inputs_program(mode.blow.mechanism), "impact": program}
    made = load(programs, native=native, backend=backend)
    return replace(made, remake=partial(_compiled, mode, program))


def _verify(function: ImpactFunction, posed: PosedImpact, struck: Struck) -> None:
    """Raise NoSolutionError where the impact has no one mode at the start, as where its slip stops on the way."""
    jumps = accelerations_of(posed.blow.dynamics, struck.x)
    found = function(0.0, posed.begin.q, posed.begin.u).u - np.array(posed.begin.u)
    if np.abs(found - jumps).max(initial=0.0) > _AGREE * max(np.abs(jumps).max(initial=0.0), 1e-300):
        raise NoSolutionError(
            "slip stops or turns round during this impact, which a function of one mode does not follow; solve tells "
            "it, and law: newton has one mode where it sticks in the end",
            where=Where(path=("impact",)),
        )
