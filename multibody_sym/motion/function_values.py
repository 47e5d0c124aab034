"""What compiled functions of a system take and return, and Functions as solvers and other tools take them.

In: what a user hands over, a Function's mechanism, Programs and parameters. Out: complete arguments, types of results,
x' = f(t, x), a ToolFunction.
"""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, cached_property
from typing import Any, Final, Literal, NamedTuple, TypedDict

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from multibody_sym.dynamics.programs.function_derivatives import state_jacobian
from multibody_sym.dynamics.programs.state_functions import Axes, with_declared_inputs
from multibody_sym.dynamics.start.number_checks import verify_bodies
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import InputError, at, short_repr
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import door
from multibody_sym.model.fields import scalar
from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.program import Program
from multibody_sym.program.replay import Argument, ToolFunction
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.numbers import floats, number, vector

Values = Mapping[str, float] | ArrayLike | None
"""Values by name in place of the system's, all of them as a vector, or None for the system's."""


@dataclass(frozen=True, eq=False)
class Replacements:
    """Parameters and inputs that a caller gives in place of declared ones; `parameters` (np,) are used by default."""

    mechanism: Mechanism
    parameters: Floats

    @cached_property
    def declared(self) -> list[int]:
        """The places of the parameters that the model declares."""
        return [k for k, entry in enumerate(self.mechanism.parameters) if entry.source is Source.DECLARED]

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs that may be given: those that drive no motion."""
        driving = self.mechanism.driving_inputs
        return tuple(name for name in self.mechanism.inputs if name not in driving)

    def parameter_vector(self, given: Values) -> Floats:
        """Return all parameters (np,): those that depend on given ones follow them.

        Raises InputError for an unknown name, a wrong length and what is no real number, ModelError for masses,
        inertias or radii that no body has.
        """
        if given is None:
            return self.parameters
        values = self._changed(given)
        self._judge(values)
        return values

    def parameter_rows(self, given: Any) -> Floats:
        """Return all parameters (np,) or (n, np) from the declared ones, by name or as vectors of them."""
        if given is None:
            return self.parameters
        if isinstance(given, Mapping):
            return self._named_parameters(given)
        values = array_of("parameters", given, len(self.declared))
        whole = np.broadcast_to(self.parameters, (*values.shape[:-1], len(self.parameters))).copy()
        whole[..., self.declared] = values
        for row in np.unique(whole.reshape(-1, whole.shape[-1]), axis=0):
            self._judge(row)
        return whole

    def _named_parameters(self, given: Mapping[str, ArrayLike]) -> Floats:
        """Return all parameters (np,), or (n, np) where a name has n values; others follow those that are given."""
        numbers = in_si_units(self.mechanism, "parameters", given)
        arrays = {name: array_of(f"parameters[{name!r}]", value, None) for name, value in numbers.items()}
        count = state_count(arrays)
        if count is None:
            return self.parameter_vector({name: float(array) for name, array in arrays.items()})
        columns = np.stack([np.broadcast_to(array, count) for array in arrays.values()], axis=-1)
        rows, places = np.unique(columns, axis=0, return_inverse=True)
        each = [self.parameter_vector(dict(zip(arrays, row, strict=True))) for row in rows.tolist()]
        different = np.array(each).reshape(len(rows), self.parameters.size)
        return different[places.reshape(-1)]

    def input_rows(self, given: Any) -> dict[str, Floats]:
        """Return the inputs that are given, each a number or n of them; with all of them as a vector it is `inputs`."""
        if given is None:
            return {}
        if not isinstance(given, Mapping):
            vector = array_of("inputs", given, len(self.inputs))
            every = len(self.inputs) == len(self.mechanism.inputs)
            return {"inputs": vector} if every else {name: vector[..., k] for k, name in enumerate(self.inputs)}
        self.verify_free(given)
        for name in given:
            if name not in self.inputs:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=self.inputs)
        numbers = in_si_units(self.mechanism, "inputs", given)
        return {name: array_of(f"inputs[{name!r}]", value, None) for name, value in numbers.items()}

    def verify_free(self, names: Iterable[str]) -> None:
        """Raise InputError for an input that drives a motion or constraint: these follow its rates too."""
        driving = next((name for name in names if name in self.mechanism.driving_inputs), None)
        if driving is not None:
            raise InputError(
                f"{driving} drives a motion or a constraint, whose rates a number does not give: change its expression"
            )

    def _judge(self, values: Floats) -> None:
        """Raise ModelError where no body has the masses or inertias; values are judged anew when they change."""
        key = values.tobytes()
        if key in self._judged or not np.isfinite(values).all():
            return
        base = self.mechanism.relative or self.mechanism
        by_name = {p.name: x for p, x in zip(self.mechanism.parameters, values.tolist(), strict=True)}
        verify_bodies(self.mechanism, [by_name.get(p.name, 0.0) for p in base.parameters])
        self._judged[:] = [key]

    @cached_property
    def _judged(self) -> list[bytes]:
        return []

    def _changed(self, given: Mapping[str, float] | ArrayLike) -> Floats:
        if not isinstance(given, Mapping):
            return self._whole_vector(given)
        given = in_si_units(self.mechanism, "parameters", given)
        real = {name: number(f"parameters[{name!r}]", value) for name, value in given.items()}
        values = np.array(parameter_values(self.mechanism, real))
        undeclared = self.mechanism.parameters.places_from(Source.MEASURED, Source.CHOSEN)
        values[undeclared] = self.parameters[undeclared]
        return values

    def _whole_vector(self, given: ArrayLike) -> Floats:
        """Return all parameters from those that have names, or from these with the constant part behind them."""
        entries = self.mechanism.parameters
        names = [p.name for p in entries if p.source is not Source.LITERAL]
        if len(names) == len(entries) or np.shape(given) == (len(entries),):
            return _whole("parameters", [p.name for p in entries], given)
        return np.concatenate([_whole("parameters", names, given), self.parameters[len(names) :]])


@dataclass(frozen=True, eq=False)
class Arguments(Replacements):
    """The same beside the compiled Programs of a mechanism, `inputs` among them."""

    compiled: Compiled

    def __repr__(self) -> str:
        return f"<Arguments of {self.mechanism.name}: {len(self.parameters)} parameters>"

    def complete(
        self, t: float, q: ArrayLike, u: ArrayLike, parameters: Values, inputs: Values
    ) -> tuple[float, Floats, Floats, Floats, Floats, Floats]:
        """Return t, q, u, parameters, inputs, modes; parameters that depend on given ones follow them.

        Raises InputError for an unknown name, a wrong length, what is no real number, and for masses, inertias or
        radii that no body has.
        """
        t, values = number("t", t), self.parameter_vector(parameters)
        state = vector("q", q, len(self.mechanism.coordinates)), vector("u", u, len(self.mechanism.speeds))
        return t, *state, values, self._input_vector(inputs, (t, *state, values)), np.empty(0)

    def _input_vector(self, given: Values, state: tuple[float, Floats, Floats, Floats]) -> Floats:
        names = list(self.mechanism.inputs)
        if given is not None and not isinstance(given, Mapping):
            self.verify_free(names)
            return _whole("inputs", names, given)
        self.verify_free(given or ())
        (values,) = self.compiled["inputs"](*state)
        for name, value in in_si_units(self.mechanism, "inputs", given or {}).items():
            if name not in names:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=names)
            values[names.index(name)] = number(f"inputs[{name!r}]", value)
        return values


def in_si_units(
    mechanism: Mechanism, kind: Literal["parameters", "inputs"], given: Mapping[str, Any]
) -> Mapping[str, Any]:
    """Return values by name with text such as `300 g` as a number in SI units.

    Raises InputError for another dimension, and for an expression of what has no value here.
    """
    if not any(isinstance(value, str) for value in given.values()):
        return given
    units, found = getattr(MechanismUnits(mechanism), kind), dict(given)
    for name, value in given.items():
        if isinstance(value, str) and name in units:
            with at(kind, name):
                node = scalar(value, units[name] or None)
                if node.shadow is None:
                    raise InputError(f"{short_repr(value)} is no number: an expression has no value here")
                found[name] = node.shadow
    return found


def _whole(kind: str, names: list[str], given: ArrayLike) -> Floats:
    values = floats(kind, given)
    if values.shape != (len(names),):
        raise InputError(f"there are {len(names)} {kind} ({', '.join(names)}), got the shape {values.shape}")
    return values


# ----------------------------------------------------------------------------------------------------------------------
# Arrays of one state, or of n.


def array_of(name: str, value: ArrayLike, size: int | None) -> Floats:
    """Return a vector of `size`, or n of them; a number, or n of them, where the size is None."""
    own = 0 if size is None else 1
    values = np.asarray(floats(name, value), order="C")
    if values.ndim not in (own, own + 1) or (size is not None and values.shape[-1] != size):
        wanted = "() or (n,)" if size is None else f"({size},) or (n, {size})"
        raise InputError(f"{name} has the shape {values.shape}, not {wanted}")
    return values


def share_memory(outputs: Sequence[Floats], given: Sequence[Floats]) -> bool:
    """Return whether an output shares memory with another one, or with an argument."""
    others = [*outputs, *given]
    return any(np.may_share_memory(x, y) for k, x in enumerate(outputs) for y in others[k + 1 :])


_VECTORS: Final = ("q", "u", "udot", "parameters", "inputs")


def state_count(arrays: Mapping[str, Floats]) -> int | None:
    """Return n, or None for one state. Raises InputError where arrays disagree."""
    lengths = {name: len(x) for name, x in arrays.items() if x.ndim == (2 if name in _VECTORS else 1)}
    if len(set(lengths.values())) > 1:
        raise InputError(f"arguments have different numbers of states: {lengths}")
    return next(iter(lengths.values()), None)


ArrayName = Literal[
    "mass_matrix",
    "inverse_dynamics",
    "bias",
    "gravity",
    "coriolis_matrix",
    "reactions",
    "generalized_momenta",
    "hamiltonian",
    "acceleration",
]
"""Functions with one result."""


class FunctionKeywords(TypedDict, total=False):
    """The options of `function`."""

    given: Any
    drives: Any
    mode: Literal["found"] | Mapping[str, str] | None
    frame: str | None
    axes: Axes
    formalism: str | None
    native: bool
    backend: Backend | None


class Rates(NamedTuple):
    """Of `state_derivative`: q' (nq,), u' (nu,) and the multipliers of constraints (ns,)."""

    qdot: Floats
    udot: Floats
    multipliers: Floats


class CanonicalRates(NamedTuple):
    """Of `canonical_equations`: q' (nq,), p' (nu,) and the multipliers of constraints (ns,)."""

    qdot: Floats
    pdot: Floats
    multipliers: Floats


class HybridForces(NamedTuple):
    """Of `hybrid_dynamics`: u' (nu,) and the forces of the joints whose accelerations are given (nu,)."""

    udot: Floats
    forces: Floats


class EnergyResults(NamedTuple):
    """Of `energies`: both in J."""

    kinetic: Floats
    potential: Floats


class MomentumResults(NamedTuple):
    """Of `momentum`: linear (3,), and angular (3,) about the world's origin."""

    linear: Floats
    angular: Floats


class CentroidalMomentum(NamedTuple):
    """Of `centroidal_momentum`: linear and angular about the centre of mass (6,), and this centre (3,)."""

    momentum: Floats
    centre_of_mass: Floats


class ConstraintTerms(NamedTuple):
    """Of `constraints`: phi, phidot and gamma (ns,), and H (ns, nu)."""

    phi: Floats
    phidot: Floats
    gamma: Floats
    jacobian: Floats


class FrameMotion(NamedTuple):
    """Of `frame`: position (3,), rotation (3, 3), velocity (6,), drift (6,): its rate at udot = 0; quaternion (4,)."""

    position: Floats
    rotation: Floats
    velocity: Floats
    drift: Floats
    quaternion: Floats


class FrameJacobian(NamedTuple):
    """Of `jacobian`: J (6, nu) and its rate (6, nu)."""

    jacobian: Floats
    rate: Floats


class OperationalSpace(NamedTuple):
    """Of `operational_space`: (J M^-1 J^T)^-1 and J M^-1 J^T (6, 6)."""

    inertia: Floats
    mobility: Floats


class Regressor(NamedTuple):
    """Of `regressor`: Y (nu, 10 bodies) and theta (10 bodies)."""

    regressor: Floats
    theta: Floats


class ImpactResults(NamedTuple):
    """Of `impact`: u after it (nu,), impulses by row, in joints (joints, 6), what is positive where its mode holds."""

    after: Floats
    impulses: Floats
    joints: Floats
    holds: Floats


RESULTS: Final[Mapping[str, type[tuple[Floats, ...]]]] = {
    "state_derivative": Rates,
    "canonical_equations": CanonicalRates,
    "hybrid_dynamics": HybridForces,
    "energies": EnergyResults,
    "momentum": MomentumResults,
    "centroidal_momentum": CentroidalMomentum,
    "constraints": ConstraintTerms,
    "frame": FrameMotion,
    "jacobian": FrameJacobian,
    "operational_space": OperationalSpace,
    "regressor": Regressor,
    "impact": ImpactResults,
}
"""The types of results by the names of functions; others return an array, or a tuple of outputs by their names."""


def result_type(of: str, name: str, names: tuple[str, ...]) -> Callable[..., Any]:
    """Return the type of results with these names, of a function and of its derivatives, which have others."""
    known = RESULTS.get(of)
    return known if known is not None and known._fields == names else _result_type(name, names)  # type: ignore[attr-defined]


@cache
def _result_type(name: str, names: tuple[str, ...]) -> Callable[..., Any]:
    """Return the type of results with these names, which pickles by them."""

    def reduced(self: Any) -> tuple[Any, ...]:
        return _result, (name, names, tuple(self))

    base: Any = namedtuple(name, names, rename=True)  # type: ignore[misc]
    return type(name, (base,), {"__slots__": (), "__reduce__": reduced})


def _result(name: str, names: tuple[str, ...], values: tuple[Floats, ...]) -> Any:
    return _result_type(name, names)(*values)


def described(name: str, shape: tuple[int, ...], units: Any) -> str:
    """Return a name with its shape and its units, each once."""
    flat: list[str] = []
    waiting = [units]
    while waiting:
        each = waiting.pop(0)
        waiting[:0] = each if isinstance(each, (tuple, list)) else ()
        flat += [each] if isinstance(each, str) and each else []
    of_units = f" [{', '.join(dict.fromkeys(flat))}]" if flat else ""
    return f"{name} {shape}{of_units}" if shape else f"{name}{of_units}"

# ----------------------------------------------------------------------------------------------------------------------
# x' = f(t, x) of a Function of accelerations, with its Jacobian, for solvers of ordinary differential equations.


@dataclass(frozen=True, eq=False)
class OrdinaryEquations:
    """`rhs(t, x)` -> x' (nq + nu,), `rhs.jac(t, x)` -> d x'/dx: `solve_ivp(rhs, span, x0, jac=rhs.jac)`.

    Quaternions count by their directions: x' is that of the state in which they have length one, so that what rounding
    does to their lengths does not grow. x may be (n, nq + nu). Inputs and parameters are as declared.
    """

    _rates: Callable[[Any, Floats, Floats], Rates]
    _program: Program
    _mechanism: Mechanism
    _parameters: Floats
    _code: Native

    @door
    def __call__(self, t: float, x: ArrayLike) -> Floats:
        """Return x' (nx,) at time t (s) and x (nx,), or (n, nx) of n states. Raises InputError for other shapes."""
        q, u = self._parts(x)
        for places in self._balls:
            q[..., places] /= np.linalg.norm(q[..., places], axis=-1, keepdims=True)
        found = self._rates(number("t", t), q, u)
        return np.concatenate([found.qdot, found.udot], axis=-1)

    @door
    def jac(self, t: float, x: ArrayLike) -> Floats:
        """Return d x'/dx (nx, nx) at time t (s) and one state x (nx,). Raises InputError for other shapes."""
        q, u = self._parts(x)
        if q.ndim != 1:
            raise InputError(f"x has the shape {np.shape(x)}, not (nx,): jac takes one state")
        sizes = [float(np.linalg.norm(q[places])) for places in self._balls]
        for places, size in zip(self._balls, sizes, strict=True):
            q[places] /= size
        given = number("t", t), q, u, self._parameters, np.zeros(len(self._mechanism.inputs)), np.empty(0)
        found: Floats = self._jacobian["jacobian"](*given)[0]
        for places, size in zip(self._balls, sizes, strict=True):
            way = q[places]
            found[:, places] = (found[:, places] - np.outer(found[:, places] @ way, way)) / size
        return found

    @property
    def _balls(self) -> list[list[int]]:
        return [list(places) for body in self._mechanism.bodies for places in body.quaternions]

    def _parts(self, x: ArrayLike) -> tuple[Floats, Floats]:
        """Return copies of q and u."""
        nq, nu = len(self._mechanism.coordinates), len(self._mechanism.speeds)
        values = array_of("x", x, nq + nu)
        return values[..., :nq].copy(), values[..., nq:].copy()

    @cached_property
    def _jacobian(self) -> Compiled:
        program = with_declared_inputs(self._mechanism, state_jacobian(self._mechanism, self._program))
        return load({"jacobian": program}, self._code)

# ----------------------------------------------------------------------------------------------------------------------
# A Function in other tools: the order of coordinates of Pinocchio, functions of CasADi and of JAX.


def pinocchio_order(mechanism: Mechanism) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
    """Return the places of our q and u in Pinocchio's order: depth-first, by names where joints part, w last."""
    bodies = mechanism.bodies
    carried: dict[int, list[int]] = {}
    for k, body in enumerate(bodies):
        carried.setdefault(body.parent, []).append(k)
    places_q, places_u, waiting = list[int](), list[int](), [-1]
    while waiting:
        k = waiting.pop()
        waiting += sorted(carried.get(k, ()), key=lambda child: bodies[child].joint_name, reverse=True)
        if k >= 0:
            own = list(bodies[k].q)
            for ball in bodies[k].quaternions:
                first = own.index(ball[0])
                own[first : first + 4] = [*ball[1:], ball[0]]
            places_q += own
            places_u += bodies[k].u
    return np.array(places_q, dtype=np.intp), np.array(places_u, dtype=np.intp)


def tool_function(
    name: str, program: Program, arguments: Sequence[str], free: Mapping[str, Sequence[int]], parameters: Floats
) -> ToolFunction:
    """Return a Program as a function of `arguments`, then of these places of its `inputs` and `parameters`.

    Other parameters have these values.
    """
    sizes = {array.name: array.size for array in program.inputs}
    third = program.inputs[2].name
    arrays = {each: third if k == 2 else each for k, each in enumerate(arguments)}
    taken = [Argument(each, array, tuple(range(sizes[array])), scalar=each == "t") for each, array in arrays.items()]
    taken += [Argument(each, each, tuple(places)) for each, places in free.items()]
    return ToolFunction(name, program, tuple(taken), {"parameters": tuple(parameters.tolist())})
