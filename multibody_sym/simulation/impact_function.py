"""What an impact does as a compiled function of the state.

What strikes is as at the start. One contact that rubs in a plane is followed through its slip by the Program itself. Of
others a Program has one mode; where that of the start does not hold, the laws find the one that does, whose Program is
compiled once, and kept.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.analysis.struck import PosedImpact, coefficients_of, outcome, posed_impact
from multibody_sym.dynamics.impacts.impulsive import Blow, pose, struck_rows
from multibody_sym.dynamics.impacts.problem import Struck
from multibody_sym.dynamics.impacts.program import StruckMode, impact_program
from multibody_sym.dynamics.laws.assemble import accelerations_of
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.errors import ModelError, NoSolutionError, Where
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.declaration.system import System, verify_system
from multibody_sym.numerics.arrays import Floats
from multibody_sym.program.program import Program
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.scalars.node import slot
from multibody_sym.simulation.arguments import Arguments, Values

_AGREE: Final = 1e-9
"""How near the Program comes at the start to what the laws find there, relative to the largest speed."""


@dataclass(frozen=True)
class ImpactQuestion:
    """What is to be compiled: the impact of a system, in the mode that it has at the start."""

    system: System


def impact(system: System) -> ImpactQuestion:
    """Return what an impact does, for `compile`: f(t, q, u) -> speeds after, impulses, impulses in joints.

    What may strike is as at the start of the system, which has an `impact`; where it touches is not judged again. Which
    of it is struck, and how it slips, is found for each state, by the law of restitution that the impact has.
    """
    verify_system(system)
    if system.impact is None:
        raise ModelError("nothing strikes: the system has no impact; declare one (impact=...)", number="M121")
    return ImpactQuestion(system)


@dataclass(frozen=True)
class Strike:
    """What an impact did: `u` after (nu,), `impulses` by row, and of each joint fx .. mz on its child, by name.

    A contact's rows are `<contact>.normal` and, where it sticks or is alone, `<contact>.friction`. In N s and N m s.
    """

    u: Floats
    impulses: Mapping[str, float]
    joints: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True, eq=False)
class ImpactFunction:
    """An impact as a compiled function of the state."""

    arguments: Arguments
    rows: tuple[str, ...]
    modes: Modes | None = None

    def __call__(
        self, t: float, q: ArrayLike, u: ArrayLike, *, parameters: Values = None, inputs: Values = None
    ) -> Strike:
        """Return what the impact does; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name or a wrong length, NoSolutionError where no single mode holds.
        """
        given = self.arguments.complete(t, q, u, parameters, inputs)
        after, impulses, joints, *holds = self.arguments.compiled["impact"](*given)
        if self.modes is not None and not self.modes.hold(after - given[2], impulses, holds):
            return self.modes.other(*given[:4])(t, q, u, parameters=parameters, inputs=inputs)
        names = self.arguments.mechanism.joint_names
        told = (dict(zip(COMPONENTS, values, strict=True)) for values in joints.reshape(-1, 6).tolist())
        return Strike(after, dict(zip(self.rows, impulses.tolist(), strict=True)), dict(zip(names, told, strict=True)))


def impact_function(
    question: ImpactQuestion, *, native: bool = False, backend: Backend | None = None
) -> ImpactFunction:
    """Return an impact as a compiled function. Raises NoSolutionError where it has no single mode at the start."""
    posed = posed_impact(question.system)
    at_start = 0.0, np.array(posed.begin.q), np.array(posed.begin.u)
    return Modes(posed, native, backend).function(posed.blow, outcome(posed), *at_start)


@dataclass(frozen=True, eq=False)
class Modes:
    """The modes of an impact that were asked for, each as a function; `needed` is what is positive where one holds."""

    posed: PosedImpact
    native: bool
    backend: Backend | None
    needed: tuple[tuple[str, str], ...] = ()
    known: dict[Hashable, ImpactFunction] = field(default_factory=dict)

    def hold(self, jumps: Floats, impulses: Floats, holds: list[Floats]) -> bool:
        """Return whether the mode holds in which these jumps and impulses were found."""
        sizes = {"speed": float(np.abs(jumps).max(initial=0.0)), "impulse": float(np.abs(impulses).max(initial=0.0))}
        values = holds[0].tolist() if holds else []
        return all(x >= -_AGREE * sizes[kind] for (kind, _), x in zip(self.needed, values, strict=False))

    def other(self, t: float, q: Floats, u: Floats, parameters: Floats) -> ImpactFunction:
        """Return the function of the mode that holds at a state; raises NoSolutionError where no single one does."""
        mechanism = self.posed.blow.mechanism
        state = state_of(mechanism, float, t, q.tolist(), u.tolist(), parameters.tolist())
        blow = replace(self.posed.blow, state=state)
        found = {x.name: coefficients_of(blow, x) for x in blow.elements}
        from multibody_sym.dynamics.impacts.strike import strike  # brings scipy

        return self.function(blow, strike(pose(blow, self.posed.law, self.posed.order, found)), t, q, u)

    def function(self, blow: Blow, struck: Struck, t: float, q: Floats, u: Floats) -> ImpactFunction:
        """Return the function of the mode in which an impact was found."""
        mode = StruckMode(blow, struck_rows(blow, struck), self.posed.law)
        if struck.impacts > 1:
            raise NoSolutionError(
                f"{struck.impacts} impacts follow each other here, and a function has one mode; write sequence: "
                "simultaneous, or let solve tell each",
                where=Where(path=("impact", "sequence")),
                number="N108",
            )
        names = tuple(x.name for x in mode.rows.acting)
        key = (names, tuple(sorted(mode.rows.mode.slips.items())), mode.acting)
        if key not in self.known:
            compiled = _compiled(mode, impact_program(mode), native=self.native, backend=self.backend)
            arguments = Arguments(blow.mechanism, compiled, np.array(self.posed.begin.parameters))
            modes = replace(self, needed=mode.needed) if mode.needed else None
            self.known[key] = ImpactFunction(arguments, mode.told, modes)
        function = self.known[key]
        given = np.array([blow.state.slots[slot("parameters", k)] for k in range(len(self.posed.begin.parameters))])
        _verify(replace(function, modes=None), blow, struck, (t, q, u, given))
        return function


def _compiled(mode: StruckMode, program: Program, *, native: bool, backend: Backend | None) -> Compiled:
    programs = {"inputs": inputs_program(mode.blow.mechanism), "impact": program}
    made = load(programs, native=native, backend=backend)
    return replace(made, remake=partial(_compiled, mode, program))


def _verify(
    function: ImpactFunction, blow: Blow, struck: Struck, at: tuple[float, Floats, Floats, Floats]
) -> None:
    """Raise NoSolutionError where the impact has no one mode at a state, as where its slip stops on the way."""
    jumps = accelerations_of(blow.dynamics, struck.x)
    found = function(*at[:3], parameters=at[3]).u - at[2]
    if np.abs(found - jumps).max(initial=0.0) > _AGREE * max(np.abs(jumps).max(initial=0.0), 1e-300):
        raise NoSolutionError(
            "slip stops or turns round during this impact of several contacts, in joints or in space, which a function "
            "of one mode does not follow; solve tells it, and law: newton has one mode where it sticks in the end",
            where=Where(path=("impact",)),
            number="N108",
        )
