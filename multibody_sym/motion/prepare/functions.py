"""The equations of motion as a function x' = f(t, x) that any integrator takes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping
from dataclasses import field, replace
from functools import partial
from typing import Any, overload

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.contact_laws.impact_problem import ImpactResult
from multibody_sym.derivation.routes import verify_formalism
from multibody_sym.dynamics.contact.impact_problem import Blow, pose
from multibody_sym.dynamics.contact.impact_programs import (
    AGREE,
    StruckMode,
    impact_program,
    mode_found,
    verify_mode,
)
from multibody_sym.dynamics.programs.state_functions import Name, canonical_programs
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.start.declared_impact import (
    PosedImpact,
    coefficients_of,
    outcome,
    posed_impact,
    verify_declared,
)
from multibody_sym.dynamics.start.state import examined_state
from multibody_sym.errors import ArgumentError, InputError, brief, short_repr
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import state_of
from multibody_sym.model.argument_checks import door, flag
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.function import Function, function
from multibody_sym.motion.function_values import Arguments, Values
from multibody_sym.motion.prepare.problem import prepare_system
from multibody_sym.motion.prepare.records import PreparedSystem
from multibody_sym.motion.prepare.settings import run_settings
from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import Program
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import slot
from multibody_sym.scalars.numbers import vector
from multibody_sym.text.printer import COMPONENTS

# ----------------------------------------------------------------------------------------------------------------------
# Mass matrix, inverse and hybrid dynamics: Functions.


@dataclass(frozen=True)
class FunctionToCompile:
    """What is to be compiled: a Function of a system, by its name and options."""

    system: System
    what: Name
    options: Mapping[str, Any] = field(default_factory=dict)


def mass_matrix(system: System) -> FunctionToCompile:
    """Return the mass matrix of a system, for `compile`: M = f(t, q, u) (nu, nu). Raises InputError for no System."""
    verify_system(system)
    return FunctionToCompile(system, "mass_matrix")


def inverse_dynamics(system: System) -> FunctionToCompile:
    """Return the inverse dynamics of a tree, for `compile`: forces = f(t, q, u, udot) (nu).

    forces = M udot + c - Q: what the accelerations need on top of the declared forces and the weight, one component a
    speed. Raises InputError for what is no System; `compile` raises ModelError where constraints restrict the tree, or
    contacts or friction act on it.
    """
    verify_system(system)
    return FunctionToCompile(system, "inverse_dynamics")


def hybrid_dynamics(system: System, given: Iterable[str] | str) -> FunctionToCompile:
    """Return the hybrid dynamics of a tree, for `compile`: udot (nu), forces (nu) = f(t, q, u, udot).

    The joints named in `given` have the accelerations udot; the others move freely under the declared forces, and what
    stands in udot for them is not read. `forces` hold the given ones, zero elsewhere. Raises InputError for a name that
    is no joint's.
    """
    verify_system(system)
    names = listed_names("given", given)
    for name in names:
        if name not in system.joints:
            raise InputError(f"there is no joint {name!r}", number="M106", word=name, known=system.joints)
    return FunctionToCompile(system, "hybrid_dynamics", {"given": names})


# ----------------------------------------------------------------------------------------------------------------------
# Hamilton's equations of a system as compiled functions of coordinates and momenta.


@dataclass(frozen=True)
class CanonicalQuestion:
    """What is to be compiled: Hamilton's equations of a system."""

    system: System


def canonical_equations(system: System) -> CanonicalQuestion:
    """Return Hamilton's equations of a system, for `compile`: x' of x = (q, p), linear in the number of bodies.

    Raises InputError for what is no System.
    """
    verify_system(system)
    return CanonicalQuestion(system)


@dataclass(frozen=True, eq=False)
class CanonicalFunction:
    """`rhs(t, x)` -> x', both (nq + nu,), x = (q, p); `names` of its components, `x0` the system's start.

    `momenta` p of the speeds, `speeds` u of the momenta, `hamiltonian` H(q, p). Momenta of angular velocities in body
    axes are those along these axes. With constraints, Baumgarte's coefficients are zero.
    """

    arguments: Arguments
    q0: Floats
    u0: Floats

    def __repr__(self) -> str:
        name = self.arguments.mechanism.name
        return f"<CanonicalFunction of {name}: rhs(t, x) with x = ({', '.join(brief(self.names))})>"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates and momenta, in the order of x."""
        mechanism = self.arguments.mechanism
        of = {u: mechanism.coordinates[q].name for body in mechanism.bodies for q, u in body.rate_pairs}
        momenta = (f"p_{of.get(k, speed.name)}" for k, speed in enumerate(mechanism.speeds))
        return (*(c.name for c in mechanism.coordinates), *momenta)

    @property
    def x0(self) -> Floats:
        """The start (nq + nu,)."""
        return np.concatenate([self.q0, self.momenta(0.0, self.q0, self.u0)])

    @door
    def __call__(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> Floats:
        """Return x' at time t; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name, a wrong length, and what is no real number.
        """
        given, _ = self._given(t, *self._split(x), parameters, inputs)
        qdot, pdot, *_ = self.arguments.compiled["canonical"](*given)
        return np.concatenate([qdot, pdot])

    @door
    def momenta(
        self, t: float, q: ArrayLike, u: ArrayLike, parameters: Values = None, inputs: Values = None
    ) -> Floats:
        """Return the momenta p (nu,) of coordinates q (nq,) and speeds u (nu,). Raises InputError as a call does."""
        given = self.arguments.complete(t, q, u, parameters, inputs)
        return np.asarray(self.arguments.compiled["momenta"](*given)[0])

    @door
    def speeds(
        self, t: float, q: ArrayLike, p: ArrayLike, parameters: Values = None, inputs: Values = None
    ) -> Floats:
        """Return the speeds u (nu,) of coordinates q (nq,) and momenta p (nu,). Raises InputError as a call does."""
        _, u = self._given(t, q, p, parameters, inputs)
        return u

    @door
    def hamiltonian(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> float:
        """Return H(q, p, t) = p . u - T + V in J. Raises InputError as a call does."""
        given, _ = self._given(t, *self._split(x), parameters, inputs)
        return float(self.arguments.compiled["hamiltonian"](*given)[0])

    def _split(self, x: ArrayLike) -> tuple[Floats, Floats]:
        state, coordinates = vector("x", x, len(self.names)), len(self.arguments.mechanism.coordinates)
        return state[:coordinates], state[coordinates:]

    def _given(
        self, t: float, q: ArrayLike, p: ArrayLike, parameters: Values, inputs: Values
    ) -> tuple[tuple[float, Floats, Floats, Floats, Floats, Floats], Floats]:
        """Return what the Programs of p take, and the speeds, on which declared inputs may depend."""
        momenta = vector("p", p, len(self.arguments.mechanism.speeds))
        before = self.arguments.complete(t, q, np.zeros(len(momenta)), parameters, inputs)
        (u,) = self.arguments.compiled["speeds"](before[0], before[1], momenta, *before[3:])
        time, state, _, *rest = self.arguments.complete(t, q, u, parameters, inputs)
        return (time, state, momenta, rest[0], rest[1], rest[2]), np.asarray(u)


def _function_compiled(mechanism: Mechanism, code: Native) -> Compiled:
    made = load(canonical_programs(mechanism), code)
    return replace(made, remake=partial(_function_compiled, mechanism))


# ----------------------------------------------------------------------------------------------------------------------
# What an impact does as a compiled function of the state.
#
# What strikes is as at the start. One contact that rubs in a plane is followed through its slip by the Program itself.
# Of others a Program has one mode; where that of the start does not hold, the laws find the one that does, whose
# Program is compiled once, and kept.


@dataclass(frozen=True)
class ImpactQuestion:
    """What is to be compiled: the impact of a system, in the mode that it has at the start."""

    system: System


def impact(system: System) -> ImpactQuestion:
    """Return what an impact does, for `compile`: f(t, q, u) -> speeds after, impulses, impulses in joints.

    What may strike is as at the start of the system, which has an `impact`; where it touches is not judged again. Which
    of it is struck, and how it slips, is found for each state, by the law of restitution that the impact has.
    Raises InputError for what is no System.
    """
    verify_system(system)
    verify_declared(system)
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
    modes: ImpactModes | None = None

    @door
    def __call__(
        self, t: float, q: ArrayLike, u: ArrayLike, *, parameters: Values = None, inputs: Values = None
    ) -> Strike:
        """Return what the impact does; parameters and inputs as for a state derivative.

        Raises InputError for an unknown name or a wrong length, NoSolutionError where no single mode holds.
        """
        given = self.arguments.complete(t, q, u, parameters, inputs)
        after, impulses, joints, *holds = self.arguments.compiled["impact"](*given)
        if self.modes is not None and not self.modes.hold(after - given[2], impulses, holds):
            other = replace(self.modes.other(*given[:4]), modes=None)  # it agrees with the laws at this state
            return other(t, q, u, parameters=parameters, inputs=inputs)
        names = self.arguments.mechanism.joint_names
        told = (dict(zip(COMPONENTS, values, strict=True)) for values in joints.reshape(-1, 6).tolist())
        return Strike(after, dict(zip(self.rows, impulses.tolist(), strict=True)), dict(zip(names, told, strict=True)))


@dataclass(frozen=True, eq=False)
class ImpactModes:
    """The modes of an impact that were asked for, each as a function; `needed` is what is positive where one holds."""

    posed: PosedImpact
    code: Native
    needed: tuple[tuple[str, str], ...] = ()
    known: dict[Hashable, ImpactFunction] = field(default_factory=dict)

    def hold(self, jumps: Floats, impulses: Floats, holds: list[Floats]) -> bool:
        """Return whether the mode holds in which these jumps and impulses were found."""
        sizes = {"speed": float(np.abs(jumps).max(initial=0.0)), "impulse": float(np.abs(impulses).max(initial=0.0))}
        values = holds[0].tolist() if holds else []
        return all(x >= -AGREE * sizes[kind] for (kind, _), x in zip(self.needed, values, strict=False))

    def other(self, t: float, q: Floats, u: Floats, parameters: Floats) -> ImpactFunction:
        """Return the function of the mode that holds at a state; raises NoSolutionError where no single one does."""
        mechanism = self.posed.blow.mechanism
        state = state_of(mechanism, float, t, q.tolist(), u.tolist(), parameters.tolist())
        blow = replace(self.posed.blow, state=state)
        found = {x.name: coefficients_of(blow, x) for x in blow.elements}
        from multibody_sym.contact_laws.impact_sequence import strike  # which few systems need

        return self.function(blow, strike(pose(blow, self.posed.law, self.posed.order, found)), t, q, u)

    def function(self, blow: Blow, struck: ImpactResult, t: float, q: Floats, u: Floats) -> ImpactFunction:
        """Return the function of the mode in which an impact was found."""
        mode = mode_found(blow, struck, self.posed.law)
        if mode.key not in self.known:
            compiled = _impact_function_compiled(mode, impact_program(mode), self.code)
            arguments = Arguments(blow.mechanism, np.array(self.posed.begin.parameters), compiled)
            modes = replace(self, needed=mode.needed) if mode.needed else None
            self.known[mode.key] = ImpactFunction(arguments, mode.told, modes)
        function = self.known[mode.key]
        given = np.array([blow.state.slots[slot("parameters", k)] for k in range(len(self.posed.begin.parameters))])
        verify_mode(mode, replace(function, modes=None)(t, q, u, parameters=given).u, struck)
        return function


def _impact_function_compiled(mode: StruckMode, program: Program, code: Native) -> Compiled:
    programs = {"inputs": inputs_program(mode.blow.mechanism), "impact": program}
    made = load(programs, code)
    return replace(made, remake=partial(_impact_function_compiled, mode, program))


@dataclass(frozen=True)
class StateDerivative:
    """What is to be compiled: the rates of a system's coordinates and speeds by a formalism (None: the cheapest)."""

    system: System
    formalism: str | None = None


def state_derivative(system: System, *, formalism: str | None = None) -> StateDerivative:
    """Return the state derivative x' of a system, x = (q, u), for `compile`.

    Raises InputError for what is no System and an unknown formalism.
    """
    verify_system(system)
    verify_formalism(formalism)
    return StateDerivative(system, formalism)


@dataclass(frozen=True, eq=False)
class RightSide:
    """`rhs(t, x)` -> x', both (nq + nu,); `names` of the state's components, `x0` the system's start.

    With constraints, Baumgarte's coefficients are those that the system's settings state, or zero.
    """

    ready: PreparedSystem
    arguments: Arguments

    def __repr__(self) -> str:
        return f"<RightSide of {self.ready.mechanism.name}: rhs(t, x) with x = ({', '.join(brief(self.names))})>"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates and speeds, in the order of x."""
        mechanism = self.ready.mechanism
        return (*(c.name for c in mechanism.coordinates), *(s.name for s in mechanism.speeds))

    @property
    def x0(self) -> Floats:
        """The start (nq + nu,)."""
        return np.concatenate([self.ready.q0, self.ready.u0])

    @door
    def __call__(self, t: float, x: ArrayLike, parameters: Values = None, inputs: Values = None) -> Floats:
        """Return x' at time t.

        `parameters`: values by name in place of the system's, which other parameters that depend on them follow, or all
        of them as a vector; `inputs`: likewise, in place of what the system declares.
        Raises InputError for an unknown name, a wrong length, and what is no real number, complex ones too.
        """
        state, coordinates = vector("x", x, len(self.names)), len(self.ready.mechanism.coordinates)
        given = self.arguments.complete(t, state[:coordinates], state[coordinates:], parameters, inputs)
        qdot, udot, *_ = self.ready.compiled["state_derivative"](*given)
        return np.concatenate([qdot, udot])


@overload
def compile(wanted: StateDerivative, *, native: bool = False, backend: Backend | None = None) -> RightSide: ...


@overload
def compile(
    wanted: CanonicalQuestion, *, native: bool = False, backend: Backend | None = None
) -> CanonicalFunction: ...


@overload
def compile(wanted: ImpactQuestion, *, native: bool = False, backend: Backend | None = None) -> ImpactFunction: ...


@overload
def compile(wanted: FunctionToCompile, *, native: bool = False, backend: Backend | None = None) -> Function[Any]: ...


def compile(
    wanted: StateDerivative | CanonicalQuestion | FunctionToCompile | ImpactQuestion,
    *,
    native: bool = False,
    backend: Backend | None = None,
) -> RightSide | CanonicalFunction | Function[Any] | ImpactFunction:
    """Return a state derivative, Hamilton's equations, inverse or hybrid dynamics, M or an impact, as a function.

    `native` and `backend` as for `simulate`. Raises InputError for what the model contradicts, and NoSolutionError
    where no start satisfies the constraints of a state derivative.
    """
    if isinstance(wanted, System):
        raise InputError("a System is not compiled itself; compile(state_derivative(system)), mass_matrix(system) ...")
    code = Native(flag("native", native), backend)
    if isinstance(wanted, ImpactQuestion):
        posed = posed_impact(wanted.system)
        at_start = 0.0, np.array(posed.begin.q), np.array(posed.begin.u)
        return ImpactModes(posed, code).function(posed.blow, outcome(posed), *at_start)
    if isinstance(wanted, CanonicalQuestion):
        state = examined_state(wanted.system)
        q, u, values = (np.array(x, dtype=float) for x in (state.start.q, state.start.u, state.start.parameters))
        compiled = _function_compiled(state.mechanism, code)
        return CanonicalFunction(Arguments(state.mechanism, values, compiled), q, u)
    if isinstance(wanted, FunctionToCompile):
        return function(wanted.system, wanted.what, **wanted.options, native=native, backend=backend)
    if not isinstance(wanted, StateDerivative):
        got = short_repr(wanted)
        raise ArgumentError(f"expected state_derivative(system), mass_matrix(system) or the like, got {got}")
    ready = prepare_system(wanted.system, wanted.formalism, code)
    asked = run_settings(ready.system.simulation, ready.parameter_values).baumgarte
    values = ready.parameters
    if ready.mechanism.rows and asked is not None:
        values = ready.stabilised_by(asked.alpha or 0.0, asked.beta or 0.0)
    return RightSide(ready, Arguments(ready.mechanism, values, ready.compiled))
