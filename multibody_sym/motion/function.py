"""What a system answers at a state, as functions: called for one state or many, differentiated, handed to solvers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, Final, Generic, Literal, TypeVar, Unpack, cast, overload

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from multibody_sym.derivation.routes import verify_formalism
from multibody_sym.dynamics.programs.function_derivatives import (
    VARIABLES,
    Variable,
    derived,
    independent_parameters,
)
from multibody_sym.dynamics.programs.state_functions import OPTIONS, Axes, Name, with_declared_inputs
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.errors import ArgumentError, InputError, ModelError, at, short_repr
from multibody_sym.model.argument_checks import callback, door, flag, whole_number
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.function_question import FunctionQuestion, verify_options
from multibody_sym.motion.function_values import (
    ArrayName,
    CanonicalRates,
    CentroidalMomentum,
    ConstraintTerms,
    EnergyResults,
    FrameJacobian,
    FrameMotion,
    FunctionKeywords,
    HybridForces,
    ImpactResults,
    MomentumResults,
    OperationalSpace,
    OrdinaryEquations,
    Rates,
    Regressor,
    Replacements,
    Values,
    array_of,
    described,
    pinocchio_order,
    result_type,
    share_memory,
    state_count,
    tool_function,
)
from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.native import Door, NativeFunction, run_many
from multibody_sym.program.program import OperationCount, Program, operation_count, program_hash
from multibody_sym.program.replay import ToolFunction, casadi_function, jax_function
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.numbers import floats

_FLOAT: Final = np.dtype(np.float64)
_EXACT: Final = 2**53
"""Whole numbers below are floats, too."""
_REAL: Final = (float, np.float64)
_MOST_THREADS: Final = 1024
_ASKED: Final = ("what", "given", "drives", "mode", "frame", "axes", "formalism", "by")
"""What `functions` takes for each."""
ResultT_co = TypeVar("ResultT_co", covariant=True)
Free = Literal["free"]
"""Inputs that keep their values while a function is differentiated, though they are declared by expressions."""


@overload
def function(system: System, what: ArrayName | list[str], **options: Unpack[FunctionKeywords]) -> Function[Floats]: ...
@overload
def function(
    system: System, what: Literal["state_derivative"], **options: Unpack[FunctionKeywords]
) -> Function[Rates]: ...
@overload
def function(
    system: System, what: Literal["canonical_equations"], **options: Unpack[FunctionKeywords]
) -> Function[CanonicalRates]: ...
@overload
def function(
    system: System, what: Literal["hybrid_dynamics"], **options: Unpack[FunctionKeywords]
) -> Function[HybridForces]: ...
@overload
def function(
    system: System, what: Literal["energies"], **options: Unpack[FunctionKeywords]
) -> Function[EnergyResults]: ...
@overload
def function(
    system: System, what: Literal["momentum"], **options: Unpack[FunctionKeywords]
) -> Function[MomentumResults]: ...
@overload
def function(
    system: System, what: Literal["centroidal_momentum"], **options: Unpack[FunctionKeywords]
) -> Function[CentroidalMomentum]: ...
@overload
def function(
    system: System, what: Literal["constraints"], **options: Unpack[FunctionKeywords]
) -> Function[ConstraintTerms]: ...
@overload
def function(system: System, what: Literal["frame"], **options: Unpack[FunctionKeywords]) -> Function[FrameMotion]: ...
@overload
def function(
    system: System, what: Literal["jacobian"], **options: Unpack[FunctionKeywords]
) -> Function[FrameJacobian]: ...
@overload
def function(
    system: System, what: Literal["operational_space"], **options: Unpack[FunctionKeywords]
) -> Function[OperationalSpace]: ...
@overload
def function(
    system: System, what: Literal["regressor"], **options: Unpack[FunctionKeywords]
) -> Function[Regressor]: ...
@overload
def function(
    system: System, what: Literal["impact"], **options: Unpack[FunctionKeywords]
) -> Function[ImpactResults]: ...
@overload
def function(system: System, what: Name | Sequence[str], **options: Unpack[FunctionKeywords]) -> Function[Any]: ...


def function(
    system: System,
    what: Name | Sequence[str],
    *,
    given: Sequence[str] | str = (),
    drives: Sequence[str] | str = (),
    mode: Literal["found"] | Mapping[str, str] | None = None,
    frame: str | None = None,
    axes: Axes = "world",
    formalism: str | None = None,
    native: bool = False,
    backend: Backend | None = None,
) -> Function[Any]:
    """Return what a system answers at a state as a compiled Function f(t, q, u).

    `what`: state_derivative, mass_matrix, inverse_dynamics, hybrid_dynamics (of joints with `given` accelerations),
    bias, gravity, coriolis_matrix, energies, momentum, centroidal_momentum, constraints, reactions, regressor, outputs,
    generalized_momenta, canonical_equations, hamiltonian (both of momenta p in place of u), impact (speeds after it),
    frame, acceleration, jacobian or operational_space (of `frame`: a body, a point or a frame, in `axes`), or a list of
    expressions.
    `drives`: the joints whose forces inverse dynamics finds where constraints act; of more than need be those of least
    norm.
    `mode`: which contacts, stops and friction act in functions of forces: "found", as the laws have it at the start, or
    words by name such as {"floor": "stick"}; others are open. `native` and `backend` as for `simulate`.

    Raises InputError for unknown names, ModelError where the model has no such function, and NoSolutionError where
    fewer joints are driven than freedoms need, or no start or mode satisfies the constraints and laws.
    """
    code = Native(flag("native", native), backend)
    code.verify()
    chosen = {"given": given, "drives": drives, "mode": mode, "frame": frame, "axes": axes, "formalism": formalism}
    return _asked(system, what, code, **chosen)


def functions(
    system: System,
    asked: Mapping[str, Name | Sequence[str] | Mapping[str, Any]],
    *,
    native: bool = False,
    backend: Backend | None = None,
) -> dict[str, Function[Any]]:
    """Return several Functions of a system by names of one's own, which are compiled together, to one library.

    `asked`: for each what `function` takes for it: its `what`, or a map of `what`, options and `by`, the variables by
    which it is differentiated in turn: {"M": "mass_matrix", "tip": {"what": "frame", "frame": "tool0"}, "slopes":
    {"what": "state_derivative", "by": "q"}}. `native` and `backend` as for `simulate`. Raises InputError and
    NoSolutionError as `function` and `Function.derivative` do, with the name in its place.
    """
    verify_system(system)
    code = Native(flag("native", native), backend)
    code.verify()
    if not isinstance(asked, Mapping) or not asked or not all(isinstance(name, str) for name in asked):
        raise ArgumentError(f"asked is a map from names to what function takes, not {short_repr(asked)}")
    found: dict[str, Function[Any]] = {}
    for name, each in asked.items():
        with at(name):
            options = dict(each) if isinstance(each, Mapping) else {"what": each}
            wrong = next((key for key in options if key not in _ASKED), None)
            if wrong is not None:
                raise InputError(f"there is no option {wrong!r}", number="M106", word=str(wrong), known=_ASKED)
            by = listed_names("by", options.pop("by", ()))
            found[name] = _asked(system, options.pop("what", None), code, **options)
            for variable in by:
                found[name] = found[name].derivative(cast(Variable, variable))
    library = _Library(code)
    return {name: library.joined(name, each) for name, each in found.items()}


def function_named(system: System, name: str, *, mode: Literal["found"] | None = None) -> Function[Any]:
    """Return the Function that has a `name`, such as mass_matrix or state_derivative_by_q_u.

    `mode` where it has one. Raises InputError for an unknown name, and as `function` and `derivative` do.
    """
    what, *steps = name.split("_by_")
    options: FunctionKeywords = {"mode": mode} if "mode" in OPTIONS.get(what, ()) else {}
    found: Function[Any] = function(system, cast(Name, what), **options)
    for by in steps:
        found = found.derivative(*cast(tuple[Variable, ...], tuple(by.split("_"))))
    return found


def _asked(
    system: System,
    what: Any,
    code: Native,
    *,
    given: Any = (),
    drives: Any = (),
    mode: Any = None,
    frame: Any = None,
    axes: Any = "world",
    formalism: Any = None,
) -> Function[Any]:
    verify_system(system)
    verify_formalism(formalism)
    named = {"given": listed_names("given", given), "drives": listed_names("drives", drives)}
    chosen: dict[str, Any] = {**named, "frame": frame, "axes": axes, "mode": mode}
    verify_options(what, chosen)
    made = FunctionQuestion(system, what if isinstance(what, str) else tuple(what), formalism, chosen)
    program = made.program
    return Function(made, program, program, (), code)


@dataclass(frozen=True, eq=False)
class _Library:
    """Programs that are compiled together when the first of them is called."""

    code: Native
    programs: dict[tuple[str, str], Program] = field(default_factory=dict)

    def joined(self, name: str, function: Function[Any]) -> Function[Any]:
        """Return a function that is part of this library."""
        self.programs.update({(name, key): program for key, program in function._programs.items()})
        return replace(function, _library=(self, name), _derivatives={})

    @cached_property
    def compiled(self) -> Compiled:
        """All Programs."""
        return load({f"f{k}": program for k, program in enumerate(self.programs.values())}, self.code)

    def of(self, name: str) -> Compiled:
        """Return the compiled Programs of a function, by what they are for it."""
        own = {key: self.compiled[f"f{k}"] for k, (each, key) in enumerate(self.programs) if each == name}
        return replace(self.compiled, functions=own, remake=None)


@dataclass(frozen=True)
class _Step:
    """A differentiation by some variables; of the results of these names beside them, or of all in place of them."""

    by: tuple[Variable, ...]
    inputs: Free | None
    of: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Function(Generic[ResultT_co]):
    """A function of the state of a system: f(t, q, u), or f(t, q, u, udot), for one state or for n of them.

    `names` of its results, their `shapes` and `units`; `arguments` that it takes. A call returns an array, or a tuple
    with these names if there are several.
    """

    _question: FunctionQuestion
    _program: Program
    _total: Program
    _by: tuple[_Step, ...]
    _code: Native
    _derivatives: dict[Any, Function[Any]] = field(default_factory=dict, repr=False, compare=False)
    _partly: dict[frozenset[str], Any] = field(default_factory=dict, repr=False, compare=False)
    _library: tuple[_Library, str] | None = field(default=None, repr=False, compare=False)

    def __repr__(self) -> str:
        mechanism, (nq, nu) = self._question.mechanism, self._sizes
        speeds = [speed.unit for speed in mechanism.speeds]
        given = {"t": ((), "s"), "q": (nq, [c.unit for c in mechanism.coordinates]), "u": (nu, speeds)}
        given["p"] = nu, self._question.units("p")
        given["udot"] = nu, [f"{unit}^2" for unit in speeds]
        taken = ", ".join(described(name, *given[name]) for name in self.arguments)
        units = self.units
        returned = ", ".join(described(name, shape, units[name]) for name, shape in self.shapes.items())
        least = " of least norm" if self.least_norm else ""
        return f"<Function {self.name} of {mechanism.name}: ({taken}) -> {returned}{least}>"

    def __reduce__(self) -> tuple[Any, ...]:
        question = self._question
        made = {"formalism": question.formalism, "native": self._code.native, "backend": self._code.backend}
        return _unpickled, (question.system, question.what, {**question.options, **made}, self._by)

    def __eq__(self, other: object) -> bool:
        """Return whether another Function is made of an equal system by the same question."""
        return self.__reduce__() == other.__reduce__() if isinstance(other, Function) else NotImplemented

    def __hash__(self) -> int:
        return hash(program_hash(self._program))

    @property
    def system(self) -> System:
        """The system that is asked."""
        return self._question.system

    @property
    def program(self) -> Program:
        """Its Program, over t, q, u, parameters, inputs, modes and udot; derivatives are those with declared inputs."""
        return self._total

    @property
    def name(self) -> str:
        """What it returns, and by what it is differentiated."""
        steps = (f"_{'with' if step.of else 'by'}_{'_'.join(step.by)}" for step in self._by)
        return "".join((self._question.name, *steps))

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments that it takes, in their order."""
        return ("t", "q", self._third, *(["udot"] if self._takes_udot else []))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of what it returns."""
        return tuple(output.name for output in self._program.outputs)

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """The shape of each result for one state."""
        return {output.name: output.shape for output in self._program.outputs}

    @property
    def units(self) -> dict[str, Any]:
        """The units of each result, nested as its axes; None for derivatives and what depends on declared outputs."""
        return {name: None if self._by else self._question.units(name) for name in self.names}

    @property
    def mode(self) -> dict[str, str]:
        """The states of contacts, stops, ropes and friction, in words by name: `stick`, `slide+`, `open` .."""
        return self._question.mode

    @property
    def rows(self) -> tuple[str, ...]:
        """The names of constraints and contacts in the order of `multipliers`, `phi` or `impulses`."""
        return self._question.rows

    @property
    def conditions(self) -> tuple[str, ...]:
        """Of an impact what its mode needs, in words: the elements of `holds` are positive where it is so."""
        return self._question.conditions

    @property
    def least_norm(self) -> bool:
        """Whether more joints are driven than the freedoms need, so that forces are those of least norm."""
        return self._question.least_norm

    def to_pinocchio(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]:
        """Return the places of our q and u in Pinocchio's order: `q[.., places_q]`, `u[.., places_u]`.

        Pinocchio goes depth-first, and where joints part by their names; quaternions end with w. Its speeds of a free
        base are along the base's axes, ours along the world's: v = R^T u[:3]. `pin.JointModelFreeFlyer` is a free
        joint, and a continuous joint of a URDF has cos and sin there, which are no coordinates here.
        """
        return pinocchio_order(self._question.mechanism)

    @door
    def to_casadi(self, *, inputs: Free | None = None, parameters: Free | None = None) -> Any:
        """Return a `casadi.Function` of scalar symbols (SX) with these arguments and results, vectors as columns.

        Declared inputs and parameters are part of it; "free" ones are arguments `inputs` and `parameters` behind the
        others. Its derivatives by q are by the elements of q, not along the tangent. Raises MissingPackageError without
        CasADi, InputError for results with three axes, ModelError for constraints that depend on each other.
        """
        return casadi_function(self._for_tools(inputs, parameters))

    @door
    def to_jax(self, *, inputs: Free | None = None, parameters: Free | None = None) -> Callable[..., Any]:
        """Return a pure function of one state for `jax.jit`, `vmap` and `grad`; arguments as of `to_casadi`.

        Raises MissingPackageError without JAX, InputError unless its 64 bits are on, ModelError for constraints that
        depend on each other.
        """
        return jax_function(self._for_tools(inputs, parameters), self._tuple)

    def _for_tools(self, inputs: Any, parameters: Any) -> ToolFunction:
        question = self._question
        free = {"inputs": _free("inputs", inputs), "parameters": _free("parameters", parameters)}
        if free["inputs"] and not self.inputs:
            self._replaced.verify_free(question.mechanism.inputs)
        every = list(question.mechanism.inputs)
        places = {"inputs": [every.index(name) for name in self.inputs], "parameters": self._replaced.declared}
        taken = {name: places[name] for name, is_free in free.items() if is_free}
        program = self._program if free["inputs"] else self._declared
        return tool_function(self.name, program, self.arguments, taken, question.parameters)

    @property
    def sparsity(self) -> dict[str, tuple[np.ndarray[Any, np.dtype[np.intp]], ...]]:
        """The places of the elements that are not zero by construction, one array an axis."""
        flags = {x.name: np.array([v is not ZERO for v in x.values]).reshape(x.shape) for x in self._total.outputs}
        return {name: flag.nonzero() if flag.ndim else () for name, flag in flags.items()}

    @property
    def operations(self) -> OperationCount:
        """The operations of one call."""
        return operation_count(self._declared)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the declared parameters, in the order of a vector of them."""
        return tuple(self._question.mechanism.parameters[k].name for k in self._replaced.declared)

    @property
    def parameter_values(self) -> Floats:
        """The declared values of the parameters (np,), in this order."""
        return self._question.parameters[self._replaced.declared]

    @property
    def independent_parameters(self) -> tuple[str, ...]:
        """The names of the columns of a derivative by "parameters"."""
        mechanism = self._question.mechanism
        return tuple(mechanism.parameters[k].name for k in independent_parameters(mechanism))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs that may be given, in the order of a vector of them: those that drive no motion."""
        return self._replaced.inputs

    # --- calls --------------------------------------------------------------------------------------------------------

    @door
    def __call__(
        self,
        t: ArrayLike,
        q: ArrayLike,
        u: ArrayLike,
        udot: ArrayLike | None = None,
        *,
        inputs: Values | Mapping[str, ArrayLike] = None,
        parameters: Values | Mapping[str, ArrayLike] = None,
        out: Any = None,
        threads: int = 1,
        sparse: bool = False,
        on_progress: Callable[[float], None] | None = None,
    ) -> ResultT_co:
        """Return the results at one state, or at n: q is (nq,) or (n, nq), and all others alike.

        A function of momenta, whose `arguments` are t, q, p, takes p (nu,) in the place of u.
        `inputs` and `parameters` in place of declared ones, by name (numbers, or text such as `300 g`) or as vectors;
        `out`: arrays for the results, as they are returned; `threads`: so many run a batch; `sparse`: of each result
        the elements at its places of `sparsity` alone, in a row; `on_progress`: called in long batches in C about ten
        times a second with the part of the states that is done. Raises InputError for wrong names and shapes.
        """
        if type(inputs) is dict:
            inputs = self._in_order(inputs)
        if (
            parameters is None
            and sparse is False
            and type(threads) is int
            and threads == 1
            and (type(t) is float or (type(t) is int and abs(t) < _EXACT))
            and type(q) is type(u) is np.ndarray
            and (q.shape, u.shape) == self._sizes
            and q.dtype is u.dtype is _FLOAT
            and (_is_array(udot, u.shape) if self._takes_udot else udot is None)
            and (inputs is None or _is_array(inputs, self._shape_of_inputs))
            and self._in_c
            and (out is None or self._is_apart(out, (q, u, udot, inputs)))
        ):
            return self._at_once(t, q, u, udot, inputs, out)
        told = callback("on_progress", on_progress)
        results = self._call(t, q, u, udot, inputs, parameters, out, threads, told)
        found: ResultT_co = self._at_places(results, out) if flag("sparse", sparse) else results
        return found

    def _at_places(self, results: Any, out: Any) -> Any:
        """Return the elements of results that are not zero by construction, in a row."""
        if out is not None:
            raise InputError("out= takes whole results: leave out sparse")
        found = []
        for part, places in zip(self._parts(results), self.sparsity.values(), strict=True):
            of_all: Any = (..., *places)
            found.append(part[of_all])
        return found[0] if len(found) == 1 else self._tuple(*found)

    @door
    def failed(self, results: Any) -> npt.NDArray[np.bool_]:
        """Return at which of n states results have no number, as where M is singular: (n,), or () of one state.

        Raises InputError for what are no results of this function.
        """
        given = self._parts(results)
        if len(given) != len(self.names):
            raise InputError(f"these are no results of {self.name}, which has {', '.join(self.names)}")
        parts = list(zip(given, self.shapes.values(), strict=True))
        lead = np.shape(parts[0][0])[: np.ndim(parts[0][0]) - len(parts[0][1])]
        found = np.zeros(lead, dtype=bool)
        for part, shape in parts:
            array = floats("results", part)
            if array.shape != (*lead, *shape):
                raise InputError(f"these are no results of {self.name}: {array.shape} in place of {(*lead, *shape)}")
            found |= ~np.isfinite(array).all(axis=tuple(range(len(lead), array.ndim)))
        return found

    @door
    def residual(self, t: ArrayLike, q: ArrayLike, u: ArrayLike, **options: Any) -> Floats:
        """Return phi (ns,), or (n, ns), of the constraints at states that need not satisfy them, as results are there.

        Rows are those of the function in its `mode`, without a mode those that always act; of a row without phi it is
        0. `options` as of a call. Raises InputError as that does.
        """
        found: Floats = self._constraints(t, q, u, **options).phi
        return found

    @cached_property
    def _constraints(self) -> Function[Any]:
        question, mode = self._question, self._question.options["mode"]
        if mode is None and question.mechanism.one_way:  # a function without forces, whatever acts
            mode = {}
        return _asked(question.system, "constraints", self._code, mode=mode, formalism=question.formalism)

    def _at_once(self, t: float, q: Floats, u: Floats, udot: Any, inputs: Any, out: Any) -> Any:
        """Return the results at a state whose arrays are as C reads them."""
        doors = self._doors if inputs is None else self._doors_of_inputs
        try:
            door = doors.pop()
        except IndexError:  # the first call, or one beside another in a thread
            function = self._function if inputs is None else self._compiled["given"]
            door = Door.of(cast(NativeFunction, function), self._question.parameters)
        arrays = door.arrays
        arrays["t"][0], arrays["q"][:], arrays[self._third_array][:] = t, q, u
        if udot is not None:
            arrays["udot"][:] = udot
        if inputs is not None:
            arrays["inputs"][:] = inputs
        door.run(door.given, door.results)
        if out is not None:
            every = out if isinstance(out, (tuple, list)) else (out,)
            for array, (first, last, shape) in zip(every, self._pieces, strict=True):
                array[...] = door.outputs[first:last].reshape(shape)
            doors.append(door)
            return out
        whole = door.outputs.copy()
        doors.append(door)
        if len(self._pieces) == 1:
            return whole if self._flat else whole.reshape(self._pieces[0][2])
        if self._flat:
            return self._tuple(*[whole[first:last] for first, last, _ in self._pieces])
        return self._tuple(*[whole[first:last].reshape(shape) for first, last, shape in self._pieces])

    def _in_order(self, given: dict[str, Any]) -> Any:
        """Return inputs by name as a vector of all of them, or as they are where C needs more than numbers for that."""
        places, rest, follow = self._input_places
        if rest is None or not follow <= given.keys() or not places.keys() >= given.keys():
            return given
        values = rest.copy()
        for name, value in given.items():
            if type(value) not in _REAL and not (type(value) is int and abs(value) < _EXACT):
                return given
            values[places[name]] = value
        return values

    def _is_apart(self, out: Any, given: Sequence[Any]) -> bool:
        """Return whether results of one state find their places in `out`, and no argument has these too."""
        arrays = out if isinstance(out, (tuple, list)) else (out,)
        if len(arrays) != len(self._pieces):
            return False
        fits = (_is_array(x, shape) and x.flags.carray for x, (_, _, shape) in zip(arrays, self._pieces, strict=True))
        return all(fits) and not share_memory(arrays, [x for x in given if x is not None])

    def _call(
        self, t: Any, q: Any, u: Any, udot: Any, inputs: Any, parameters: Any, out: Any, threads: int, told: Any
    ) -> Any:
        if self._takes_udot != (udot is not None):
            raise InputError(f"{self.name} {'needs' if self._takes_udot else 'takes no'} udot")
        (nq,), (nu,) = self._sizes
        arrays = {
            "t": array_of("t", t, None),
            "q": array_of("q", q, nq),
            "u": array_of(self._third, u, nu),
            "parameters": self._replaced.parameter_rows(parameters),
        }
        if udot is not None:
            arrays["udot"] = array_of("udot", udot, nu)
        threads = whole_number("threads", threads, _MOST_THREADS)
        own = self._replaced.input_rows(inputs)
        count = state_count({**arrays, **own})
        given = [arrays[name] for name in ("t", "q", "u", "parameters")]
        values = self._input_values(own, given, count)
        given += [values, np.empty(0), *([arrays["udot"]] if udot is not None else [])]
        function = self._with_given(own) if own else self._function
        outputs = self._space(out, count)
        if out is not None and share_memory(outputs, given):
            raise InputError("arrays of out= share memory with each other or with arguments: copy these first")
        run_many(function, given, outputs, count, threads, told)
        if out is not None:
            return out
        return outputs[0] if len(outputs) == 1 else self._tuple(*outputs)

    def _input_values(self, own: Mapping[str, Floats], given: Sequence[Floats], count: int | None) -> Floats:
        """Return all inputs, (nw,) or (n, nw), those that are not given by their declared expressions."""
        every = list(self._question.mechanism.inputs)
        if not own or "inputs" in own:
            return own.get("inputs", np.zeros(len(every)))
        declared = self._compiled["inputs"]
        lead = () if count is None else (count,)
        values = np.empty((*lead, len(every)))
        run_many(declared, list(given), [values], count)
        for name, value in own.items():
            values[..., every.index(name)] = value
        return values

    def _with_given(self, own: Mapping[str, Floats]) -> Any:
        """Return the compiled function in which inputs of these names, or all of them, do not follow the state."""
        mechanism = self._question.mechanism
        follow = {name for name, x in mechanism.inputs.items() if name not in own and leaves([x], "slot")}
        if "inputs" in own or not follow or all(step.inputs == "free" or step.by == ("inputs",) for step in self._by):
            return self._compiled["given"]
        names = frozenset(follow)
        if names not in self._partly:
            program = self._question.program
            for k, step in enumerate(self._by):
                name = self._question.name if k == 0 else ""
                program = derived(mechanism, name, program, step.by, step.of, names if step.inputs is None else ())
            self._partly[names] = load({"given": program}, self._code)["given"]
        return self._partly[names]

    def _space(self, out: Any, count: int | None) -> list[Floats]:
        lead = () if count is None else (count,)
        shapes = [(*lead, *shape) for shape in self.shapes.values()]
        if out is None:
            return [np.empty(shape) for shape in shapes]
        arrays = list(out) if isinstance(out, (tuple, list)) else [out]
        fits = len(arrays) == len(shapes) and all(
            isinstance(x, np.ndarray) and x.shape == shape and x.dtype == float and x.flags.carray
            for x, shape in zip(arrays, shapes, strict=True)
        )
        if not fits:
            wanted = ", ".join(f"{name} {shape}" for name, shape in zip(self.names, shapes, strict=True))
            raise InputError(f"out= takes contiguous arrays of floats that may be written to: {wanted}")
        return arrays

    # --- what is made once --------------------------------------------------------------------------------------------

    @cached_property
    def _variables(self) -> tuple[Variable, ...]:
        """By what it can be differentiated."""
        momenta = self._question.takes_momenta
        without = {"udot": not self._takes_udot, "s": not self._question.mechanism.rates}
        without |= {"u": momenta, "p": not momenta}
        return tuple(name for name in VARIABLES if not without.get(name))

    @property
    def _third(self) -> str:
        """The name of the argument behind q."""
        return "p" if self._question.takes_momenta else "u"

    @cached_property
    def _third_array(self) -> str:
        """The array of the Program that this argument is."""
        return self._program.inputs[2].name

    @cached_property
    def _takes_udot(self) -> bool:
        return any(array.name == "udot" for array in self._program.inputs)

    @cached_property
    def _sizes(self) -> tuple[tuple[int], tuple[int]]:
        """The shapes of q and u."""
        mechanism = self._question.mechanism
        return (len(mechanism.coordinates),), (len(mechanism.speeds),)

    @cached_property
    def _pieces(self) -> list[tuple[int, int, tuple[int, ...]]]:
        ends = accumulate((len(output.values) for output in self._program.outputs), initial=0)
        return [(a, b, shape) for (a, b), shape in zip(pairwise(ends), self.shapes.values(), strict=True)]

    @cached_property
    def _flat(self) -> bool:
        """Whether all results are vectors."""
        return all(len(shape) == 1 for shape in self.shapes.values())

    @cached_property
    def _tuple(self) -> Callable[..., Any]:
        return result_type(self._question.name, self.name, self.names)

    @cached_property
    def _doors(self) -> list[Door]:
        return []

    @cached_property
    def _doors_of_inputs(self) -> list[Door]:
        """The same of calls that give all inputs as a vector."""
        return []

    @cached_property
    def _shape_of_inputs(self) -> tuple[int, ...] | None:
        """The shape of a vector of all inputs, None where there are none or some drive motions."""
        count = len(self.inputs)
        return (count,) if 0 < count == len(self._question.mechanism.inputs) else None

    @cached_property
    def _input_places(self) -> tuple[dict[str, int], Floats | None, frozenset[str]]:
        """Of calls in C the places of inputs by name, the values of those that follow no state, and which others do.

        No values where some inputs drive motions, or where there are none.
        """
        declared, places = self._question.mechanism.inputs, {name: k for k, name in enumerate(self.inputs)}
        if self._shape_of_inputs is None or not self._in_c:
            return places, None, frozenset()
        q, u = map(np.zeros, self._sizes)
        (values,) = self._compiled["inputs"](0.0, q, u, self._question.parameters)
        return places, values, frozenset(name for name, x in declared.items() if leaves([x], "slot"))

    @cached_property
    def _compiled(self) -> Compiled:
        if self._library is not None:
            library, name = self._library
            return library.of(name)
        return load(self._programs, self._code)

    @property
    def _programs(self) -> dict[str, Program]:
        """What is compiled: the inputs, the function with declared inputs, and with given ones."""
        inputs = inputs_program(self._question.mechanism, self._program.inputs)
        return {"inputs": inputs, "function": self._declared, "given": self._program}

    @cached_property
    def _declared(self) -> Program:
        return with_declared_inputs(self._question.mechanism, self._total)

    @cached_property
    def _function(self) -> Any:
        return self._compiled["function"]

    @cached_property
    def _in_c(self) -> bool:
        return isinstance(self._function, NativeFunction)

    @cached_property
    def _replaced(self) -> Replacements:
        return Replacements(self._question.mechanism, self._question.parameters)

    # --- derivatives --------------------------------------------------------------------------------------------------

    @door
    def derivative(self, by: Variable, *more: Variable, inputs: Free | None = None) -> Function[ResultT_co]:
        """Return the derivative by t, q, u, p, s, udot, inputs or parameters: a Function with one axis more, the last.

        Its columns by q are those of the tangent, one a speed; by s those of the declared states. By several variables
        they stand side by side: of d/d(q, u, inputs) by derivative("q", "u", "inputs"). Declared inputs are
        functions of the state, but for the derivative by inputs, and where `inputs` are "free": then they keep their
        values. Raises InputError for a variable that the function does not have.
        """
        every = by, *more
        if any(every.count(name) > 1 for name in every):
            raise InputError(f"{self.name} is differentiated by variables, each once: {', '.join(self._variables)}")
        return self._differentiated(_Step(every, inputs))

    @door
    def with_derivatives(
        self, *by: Variable, of: Sequence[str] | str = (), inputs: Free | None = None
    ) -> Function[Any]:
        """Return a Function of results and of their derivatives by some variables, all computed together.

        `of`: names of results, or all; their derivatives have one axis more, and names such as udot_by_q:
        f.with_derivatives("q", "u", "inputs", of="udot"). `inputs` as in `derivative`. Raises InputError for what the
        function does not have, or would have twice.
        """
        names = listed_names("of", of) or self.names
        for name in names:
            if name not in self.names:
                raise InputError(f"{self.name} returns no {name}", number="M106", word=name, known=self.names)
        every = [*names, *(f"{name}_by_{variable}" for name in names for variable in by)]
        if not by or len(set(every)) < len(every):
            raise InputError(f"{self.name} with derivatives needs variables and has each result once: {every}")
        return self._differentiated(_Step(by, inputs, names))

    def _differentiated(self, step: _Step) -> Function[Any]:
        _free("inputs", step.inputs)
        for by in step.by:
            if not isinstance(by, str) or by not in self._variables:
                known = ", ".join(self._variables)
                raise InputError(f"{self.name} is no function of {short_repr(by)}; known: {known}")
            if by == "inputs" and not self.inputs:
                self._replaced.verify_free(self._question.mechanism.inputs)
        if step not in self._derivatives:
            self._derivatives[step] = self._made(step)
        return self._derivatives[step]

    def _made(self, step: _Step) -> Function[Any]:
        mechanism, name = self._question.mechanism, self.name
        every = tuple(mechanism.inputs)
        try:
            program = derived(mechanism, name, self._program, step.by, step.of)
            total = program
            if every:
                total = derived(mechanism, name, self._total, step.by, step.of, every if step.inputs is None else ())
        except TypeError as error:
            raise ModelError(f"{self.name} has no derivative: {error}", number="M110") from error
        by = *self._by, step
        return replace(self, _program=program, _total=total, _by=by, _derivatives={}, _partly={}, _library=None)

    # --- for optimisers and solvers -----------------------------------------------------------------------------------

    @door
    def jvp(self, *state: ArrayLike, rates: Mapping[Variable, ArrayLike], **options: Any) -> Any:
        """Return the rates of the results while variables move: f.jvp(t, q, u, rates={"q": dq, "parameters": dp}).

        A rate of q has one element a speed; rates have n rows, too, where there are n states. `options` as of a call.
        Raises InputError as `derivative` does, and for wrong shapes.
        """
        if not isinstance(rates, Mapping) or not rates:
            raise ArgumentError(f"rates is a map from what moves to its rate: {', '.join(self._variables)}")
        sums: list[Any] = [0.0] * len(self.names)
        for by, given in rates.items():
            slopes = self._parts(self.derivative(by)(*state, **_whole_results(options)))
            rate = array_of(f"rates[{by!r}]", np.atleast_1d(floats(str(by), given)), slopes[0].shape[-1])
            for k, (slope, shape) in enumerate(zip(slopes, self.shapes.values(), strict=True)):
                along = rate.reshape(len(rate), *(1 for _ in shape), -1) if rate.ndim == 2 else rate
                sums[k] = sums[k] + (slope * along).sum(axis=-1)
        return sums[0] if len(sums) == 1 else self._tuple(*sums)

    @door
    def vjp(
        self, *state: ArrayLike, by: Variable, weights: Mapping[str, ArrayLike] | ArrayLike, **options: Any
    ) -> Floats:
        """Return the derivative by a variable of the sum of results times weights, one element a column.

        `weights`: of the only result, or by the names of results: f.vjp(t, q, u, by="q", weights={"udot": w}). They
        have n in front, too, where there are n states. Raises InputError as `derivative` does, and for wrong shapes.
        """
        named = weights if isinstance(weights, Mapping) else {self.names[0]: weights}
        if not named or (len(self.names) > 1 and named is not weights):
            raise ArgumentError(f"weights is a map from names to arrays: {', '.join(self.names)}")
        slopes = dict(zip(self.names, self._parts(self.derivative(by)(*state, **_whole_results(options))), strict=True))
        found: Any = 0.0
        for name, given in named.items():
            if name not in slopes:
                raise InputError(f"{self.name} returns no {name}", number="M106", word=name, known=self.names)
            weight, shape = np.asarray(floats(name, given)), self.shapes[name]
            lead = slopes[name].shape[: slopes[name].ndim - len(shape) - 1]
            if weight.shape not in (shape, (*lead, *shape)):
                raise InputError(f"weights[{name!r}] has the shape {weight.shape}, not {shape}")
            axes = tuple(range(len(lead), len(lead) + len(shape)))
            found = found + (slopes[name] * weight[..., None]).sum(axis=axes)
        return np.asarray(found)

    def _parts(self, result: Any) -> Sequence[Floats]:
        return result if isinstance(result, tuple) else (result,)

    def ode(self) -> OrdinaryEquations:
        """Return the state derivative as x' = f(t, x) with x = (q, u), and its Jacobian `jac`, as solvers take them."""
        if self.name != "state_derivative":
            raise InputError(f"{self.name} is no state derivative; function(system, 'state_derivative').ode()")
        question, rates = self._question, cast(Callable[[Any, Floats, Floats], Rates], self)
        return OrdinaryEquations(rates, self.program, question.mechanism, question.parameters, self._code)


def _is_array(value: Any, shape: tuple[int, ...] | None) -> bool:
    """Return whether a value is an array of floats of a shape."""
    return type(value) is np.ndarray and value.shape == shape and value.dtype is _FLOAT


def _unpickled(system: System, what: Any, options: Mapping[str, Any], by: Sequence[_Step]) -> Function[Any]:
    """Return a Function as it comes out of a pickle."""
    found = function(system, what, **options)
    for step in by:
        found = found._differentiated(step)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Arguments as arrays.


def _free(name: str, value: Any) -> bool:
    """Return whether a value is "free"; raises InputError for any other word."""
    if value is not None and not (isinstance(value, str) and value == "free"):
        raise InputError(f'{name} is "free" or left out, not {short_repr(value)}')
    return value is not None


def _whole_results(options: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return options of a call; raises InputError for one that leaves elements out."""
    if options.get("sparse"):
        raise InputError("products with vectors are of whole results: leave out sparse")
    return options
