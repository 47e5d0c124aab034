"""What a system answers at a state, as functions: called for one state or many, differentiated, handed to solvers."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field, fields, replace
from functools import cache, cached_property
from itertools import accumulate, pairwise
from typing import Any, Final, Literal, cast, get_args

import numpy as np
import numpy.typing as npt
from numpy.typing import ArrayLike

from multibody_sym.derivation.routes import FORMALISMS, formalism_name, verify_formalism
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.state_functions import (
    OPTIONS,
    STATE_FUNCTIONS,
    VARIABLES,
    Axes,
    FunctionOptions,
    Name,
    Variable,
    acceleration_derivative,
    derivative_program,
    expressions_program,
    independent_parameters,
    state_jacobian,
    with_declared_inputs,
)
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.programs.tree_functions import verify_drives
from multibody_sym.dynamics.start.given_mode import given_mode
from multibody_sym.dynamics.start.number_checks import check_numbers, numbers_of
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import state_at, with_numbers_as_data
from multibody_sym.errors import ArgumentError, InputError, ModelError, Where, short_repr
from multibody_sym.mechanics.mechanism import ALPHA, BETA, Mechanism, Source
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.state import state_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import flag, whole_number
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.system import System, verify_system
from multibody_sym.motion.prepare.arguments import Arguments, Values
from multibody_sym.motion.prepare.settings import run_settings
from multibody_sym.program.backend import Backend, Native
from multibody_sym.program.batches import Door, run_many
from multibody_sym.program.loading import Compiled, load
from multibody_sym.program.native import NativeFunction
from multibody_sym.program.program import OperationCount, Program, operation_count, program_hash
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import ZERO, symbol
from multibody_sym.scalars.numbers import floats, number
from multibody_sym.text.units import rate_unit

_BY_FORCES: Final = frozenset(
    ["state_derivative", "inverse_dynamics", "hybrid_dynamics", "constraints", "reactions", "outputs"]
)
"""Functions that depend on what acts in contacts, stops and the like."""
_OF_ACCELERATIONS: Final = frozenset(["inverse_dynamics", "hybrid_dynamics"])
"""Functions of given accelerations, in which a freedom may be massless."""
_FLOAT: Final = np.dtype(np.float64)
_EXPRESSION: Final = "expression"
_MOST_THREADS: Final = 1024


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
) -> Function:
    """Return what a system answers at a state as a compiled Function f(t, q, u).

    `what`: state_derivative, mass_matrix, inverse_dynamics, hybrid_dynamics (of joints with `given` accelerations),
    bias, gravity, coriolis_matrix, energies, momentum, centroidal_momentum, constraints, reactions, regressor, outputs,
    frame, jacobian or operational_space (of `frame`: a body, a point or a frame, in `axes`), or a list of expressions.
    `drives`: the joints whose forces inverse dynamics finds where constraints act; of more than need be those of least
    norm.
    `mode`: which contacts, stops and friction act in functions of forces: "found", as the laws have it at the start, or
    words by name such as {"floor": "stick"}; others are open. `native` and `backend` as for `simulate`.

    Raises InputError for unknown names, ModelError where the model has no such function, and NoSolutionError where
    fewer joints are driven than freedoms need, or no start or mode satisfies the constraints and laws.
    """
    verify_system(system)
    verify_formalism(formalism)
    named = {"given": listed_names("given", given), "drives": listed_names("drives", drives)}
    chosen: dict[str, Any] = {**named, "frame": frame, "axes": axes, "mode": mode}
    _verify_options(what, chosen)
    made = _Question(system, what if isinstance(what, str) else tuple(what), formalism, chosen)
    program = made.program
    code = Native(flag("native", native), backend)
    code.verify()
    return Function(made, program, program, (), code)


def _verify_options(what: object, chosen: Mapping[str, Any]) -> None:
    if isinstance(what, str) and what not in STATE_FUNCTIONS:
        raise InputError(f"there is no function {what!r}", number="M106", word=what, known=STATE_FUNCTIONS)
    texts = isinstance(what, (list, tuple)) and what and all(isinstance(x, str) for x in what)
    if not isinstance(what, str) and not texts:
        raise ArgumentError(f"what is a name or a list of expressions, not {short_repr(what)}")
    if chosen["axes"] not in get_args(Axes):
        known = ", ".join(get_args(Axes))
        raise InputError(f"there are no axes {short_repr(chosen['axes'])}; known: {known}")
    if chosen["frame"] is not None and not isinstance(chosen["frame"], str):
        raise ArgumentError(f"frame is a name, not {short_repr(chosen['frame'])}")
    mode = chosen["mode"]
    words = isinstance(mode, Mapping) and all(isinstance(x, str) for pair in mode.items() for x in pair)
    if not (mode is None or mode == "found" or words):
        raise ArgumentError(f'mode is "found" or a map from names to words, not {short_repr(mode)}')
    has = OPTIONS.get(what, ()) if isinstance(what, str) else ("mode",)
    usual = {"mode": None, **{option.name: option.default for option in fields(FunctionOptions)}}
    for name, value in chosen.items():
        if value != usual[name] and name not in has:
            raise InputError(f"{what if isinstance(what, str) else 'an expression'} has no option {name}")


@dataclass(frozen=True, eq=False)
class _Question:
    """What is asked of a system."""

    system: System
    what: str | tuple[str, ...]
    formalism: str | None
    options: Mapping[str, Any]

    @cached_property
    def _numbers(self) -> tuple[Mechanism, Floats, Start | None]:
        """The mechanism in its mode, its parameters, and its start where the function needs one."""
        system = self.system
        if not isinstance(self.what, str):
            with self._expression_errors():
                asked = {f"{_EXPRESSION} {k}": cast(Any, text) for k, text in enumerate(self.what, 1)}
                system = replace(system, outputs=asked)
        with self._expression_errors(), numbers_of(system):
            declared = check_numbers(system)
            mode, by_forces = self.options["mode"], self.name in _BY_FORCES
            if by_forces and declared.one_way and mode is None:
                raise _without_mode(self.name, declared)
            measured = any(entry.source is Source.MEASURED for entry in declared.parameters)
            massless = self.name not in _OF_ACCELERATIONS and massless_speeds(declared)
            if not measured and not (by_forces and (declared.rows or massless or declared.one_way)):
                return declared, np.array(parameter_values(declared, {})), None
            state = with_numbers_as_data(state_at(declared, project=system.simulation.project))
            if isinstance(mode, Mapping):
                state = replace(state, modes=(given_mode(state.declared, state.begin, mode),))
            if not by_forces:
                return state.declared, np.array(state.begin.parameters, dtype=float), state.begin
            return state.mechanism, _stabilised(system, state.mechanism, state.start.parameters), state.start

    @contextmanager
    def _expression_errors(self) -> Iterator[None]:
        """Let errors in a list of expressions say which one is wrong."""
        try:
            yield
        except InputError as error:
            head, *path = error.where.path or ("",)
            if not isinstance(self.what, str) and head == "outputs" and path:
                text = self.what[int(path[0].removeprefix(_EXPRESSION)) - 1]
                error.where = Where(path=(f"{path[0]}, {short_repr(text)}",))
            raise

    @property
    def mechanism(self) -> Mechanism:
        """The resolved mechanism."""
        return self._numbers[0]

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np)."""
        return self._numbers[1]

    @cached_property
    def least_norm(self) -> bool:
        """Whether more joints are driven than need be."""
        return bool(self.options["drives"]) and self._drives_exceed()

    def _drives_exceed(self) -> bool:
        """Return whether more joints are driven than need be. Raises NoSolutionError where fewer are."""
        begin, drives = self._numbers[2], self.options["drives"]
        mechanism, count = self.mechanism, len(self.mechanism.speeds)
        q, u = (begin.q, begin.u) if begin is not None else ([0.0] * len(mechanism.coordinates), [0.0] * count)
        return verify_drives(mechanism, state_of(mechanism, float, 0.0, q, u, self.parameters.tolist()), drives)

    @property
    def name(self) -> str:
        """The name of the function."""
        return self.what if isinstance(self.what, str) else "outputs"

    @property
    def program(self) -> Program:
        """The Program whose inputs are given."""
        formalism = FORMALISMS[formalism_name(self.formalism, self.mechanism)]
        options = FunctionOptions(formalism, **{name: x for name, x in self.options.items() if name != "mode"})
        for name in options.given:
            if name not in self.system.joints:
                raise InputError(f"there is no joint {name!r}", number="M106", word=name, known=self.system.joints)
            if not any(body.joint_name == name and body.u for body in self.mechanism.bodies):
                raise InputError(f"joint {name!r} has no speed whose rate could be given")
        if not isinstance(self.what, str):
            with self._expression_errors():
                return expressions_program(self.mechanism, options)
        if options.drives:
            self._drives_exceed()  # raises before anything is derived
        if self.what == "outputs" and not self.mechanism.outputs:
            raise ModelError("the system declares no outputs; ask for a list of expressions", number="M110")
        return STATE_FUNCTIONS[self.what](self.mechanism, options)

    def units(self, output: str) -> Any:
        """Return the units of the elements of an output, nested as its axes are; None where nothing tells them."""
        if self.name == "outputs":
            return MechanismUnits(self.mechanism).outputs[output] if isinstance(self.what, str) else None
        coordinates, speeds = self.mechanism.coordinates, [x.unit for x in self.mechanism.speeds]
        turns = [unit.startswith("rad") for unit in speeds]
        found = {
            "qdot": tuple(rate_unit(x.unit) or "1/s" for x in coordinates),
            "udot": tuple(f"{unit}^2" for unit in speeds),
            **dict.fromkeys(("forces", "bias", "gravity"), tuple("N*m" if turn else "N" for turn in turns)),
            "mass_matrix": tuple(tuple(("kg", "kg*m", "kg*m^2")[a + b] for a in turns) for b in turns),
            **dict.fromkeys(("kinetic", "potential"), "J"),
            "linear": ("kg*m/s",) * 3,
            "angular": ("kg*m^2/s",) * 3,
            "momentum": (*("kg*m/s",) * 3, *("kg*m^2/s",) * 3),
            "position": ("m",) * 3,
            "centre_of_mass": ("m",) * 3,
            "velocity": (*("m/s",) * 3, *("rad/s",) * 3),
            "drift": (*("m/s^2",) * 3, *("rad/s^2",) * 3),
        }
        return found.get(output)


def _stabilised(system: System, resolved: Mechanism, values: Sequence[float]) -> Floats:
    """Return the parameters with Baumgarte's coefficients, where the settings of a system state them."""
    entries = zip(resolved.parameters, values, strict=True)
    known = {symbol(entry.name): x for entry, x in entries if entry.source is not Source.LITERAL}
    asked = run_settings(system.simulation, known).baumgarte
    if asked is not None:
        values = resolved.parameters.changed(values, {ALPHA: asked.alpha or 0.0, BETA: asked.beta or 0.0})
    return np.array(values, dtype=float)


def _without_mode(name: str, declared: Mechanism) -> ModelError:
    """Return the error that elements of a mechanism may hold or let go, and the function has no mode."""
    names = ", ".join(element.name for element in declared.one_way[:3])
    advice = "leave them out"
    if name != "hybrid_dynamics":
        advice = f'say mode="found" for that of the start, mode={{"{declared.one_way[0].name}": ..}}, or {advice}'
    message = f"{names} may hold or let go, and a function of forces has one state of them; {advice}"
    return ModelError(message, number="M110")


@dataclass(frozen=True, eq=False)
class Function:
    """A function of the state of a system: f(t, q, u), or f(t, q, u, udot), for one state or for n of them.

    `names` of its results, their `shapes` and `units`; `arguments` that it takes. A call returns an array, or a tuple
    with these names if there are several.
    """

    _question: _Question
    _program: Program
    _total: Program
    _by: tuple[Variable, ...]
    _code: Native
    _derivatives: dict[Any, Function] = field(default_factory=dict, repr=False, compare=False)

    def __repr__(self) -> str:
        shapes = ", ".join(f"{name} {shape}" for name, shape in self.shapes.items())
        least = " of least norm" if self.least_norm else ""
        name = self._question.mechanism.name
        return f"<Function {self.name} of {name}: ({', '.join(self.arguments)}) -> {shapes}{least}>"

    def __reduce__(self) -> tuple[Any, ...]:
        question = self._question
        made = {"formalism": question.formalism, "native": self._code.native, "backend": self._code.backend}
        return _again, (question.system, question.what, {**question.options, **made}, self._by)

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
        return "_by_".join((self._question.name, *self._by))

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments that it takes, in their order."""
        return ("t", "q", "u", *(["udot"] if self._takes_udot else []))

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
        mechanism = self._question.mechanism
        return {} if mechanism.mode is None else mode_words(mechanism.one_way, mechanism.mode)

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
        bodies = self._question.mechanism.bodies
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

    @property
    def sparsity(self) -> dict[str, tuple[np.ndarray[Any, np.dtype[np.intp]], ...]]:
        """The places of the elements that are not zero by construction, one array an axis."""
        flags = {x.name: np.array([v is not ZERO for v in x.values]).reshape(x.shape) for x in self._total.outputs}
        return {name: flag.nonzero() for name, flag in flags.items()}

    @property
    def operations(self) -> OperationCount:
        """The operations of one call."""
        return operation_count(self._declared)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of the declared parameters, in the order of a vector of them."""
        return tuple(self._question.mechanism.parameters[k].name for k in self._declared_places)

    @property
    def parameter_values(self) -> Floats:
        """The declared values of the parameters (np,), in this order."""
        return self._question.parameters[self._declared_places]

    @cached_property
    def _declared_places(self) -> list[int]:
        entries = enumerate(self._question.mechanism.parameters)
        return [k for k, entry in entries if entry.source is Source.DECLARED]

    @property
    def independent_parameters(self) -> tuple[str, ...]:
        """The names of the columns of a derivative by "parameters"."""
        mechanism = self._question.mechanism
        return tuple(mechanism.parameters[k].name for k in independent_parameters(mechanism))

    @property
    def inputs(self) -> tuple[str, ...]:
        """The names of the inputs, in the order of a vector of them."""
        return tuple(self._question.mechanism.inputs)

    # --- calls --------------------------------------------------------------------------------------------------------

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
    ) -> Any:
        """Return the results at one state, or at n: q is (nq,) or (n, nq), and all others alike.

        `inputs` and `parameters` in place of declared ones, by name or as vectors; `out`: arrays for the results, as
        they are returned; `threads`: so many run a batch. Raises InputError for wrong names and shapes.
        """
        if (
            inputs is None
            and parameters is None
            and out is None
            and type(t) is float
            and type(q) is type(u) is np.ndarray
            and (q.shape, u.shape) == self._sizes
            and q.dtype is u.dtype is _FLOAT
            and (udot is None) is not self._takes_udot
            and self._in_c
        ):
            if udot is None:
                return self._at_once(t, q, u)
            if type(udot) is np.ndarray and udot.shape == u.shape and udot.dtype is _FLOAT:
                return self._at_once(t, q, u, udot)
        return self._call(t, q, u, udot, inputs, parameters, out, threads)

    def failed(self, results: Any) -> npt.NDArray[np.bool_]:
        """Return at which of n states results have no number, as where M is singular: (n,), or () of one state."""
        parts = list(zip(self._parts(results), self.shapes.values(), strict=True))
        lead = np.shape(parts[0][0])[: np.ndim(parts[0][0]) - len(parts[0][1])]
        found = np.zeros(lead, dtype=bool)
        for part, shape in parts:
            array = floats("results", part)
            if array.shape != (*lead, *shape):
                raise InputError(f"these are no results of {self.name}: {array.shape} in place of {(*lead, *shape)}")
            found |= ~np.isfinite(array).all(axis=tuple(range(len(lead), array.ndim)))
        return found

    def _at_once(self, t: float, q: Floats, u: Floats, udot: Floats | None = None) -> Any:
        """Return the results at a state whose arrays are as C reads them."""
        try:
            door = self._doors.pop()
        except IndexError:  # the first call, or one beside another in a thread
            door = Door.of(cast(NativeFunction, self._function), self._question.parameters)
        arrays = door.arrays
        arrays["t"][0], arrays["q"][:], arrays["u"][:] = t, q, u
        if udot is not None:
            arrays["udot"][:] = udot
        door.run(door.given, door.results)
        whole = door.outputs.copy()
        self._doors.append(door)
        if len(self._pieces) == 1:
            return whole if self._flat else whole.reshape(self._pieces[0][2])
        if self._flat:
            return self._tuple(*[whole[first:last] for first, last, _ in self._pieces])
        return self._tuple(*[whole[first:last].reshape(shape) for first, last, shape in self._pieces])

    def _call(
        self, t: Any, q: Any, u: Any, udot: Any, inputs: Any, parameters: Any, out: Any, threads: int
    ) -> Any:
        if self._takes_udot != (udot is not None):
            raise InputError(f"{self.name} {'needs' if self._takes_udot else 'takes no'} udot")
        (nq,), (nu,) = self._sizes
        arrays = {
            "t": _array("t", t, None),
            "q": _array("q", q, nq),
            "u": _array("u", u, nu),
            "parameters": self._parameters(parameters),
        }
        if udot is not None:
            arrays["udot"] = _array("udot", udot, nu)
        threads = whole_number("threads", threads, _MOST_THREADS)
        own = self._own_inputs(inputs)
        count = _count({**arrays, **own})
        given = [arrays[name] for name in ("t", "q", "u", "parameters")]
        values = self._input_values(own, given, count)
        given += [values, np.empty(0), *([arrays["udot"]] if udot is not None else [])]
        function = self._compiled["given"] if own else self._function
        outputs = self._space(out, count)
        if out is not None and _overlap(outputs, given):
            raise InputError("arrays of out= share memory with each other or with arguments: copy these first")
        run_many(function, given, outputs, count, threads)
        if out is not None:
            return out
        return outputs[0] if len(outputs) == 1 else self._tuple(*outputs)

    def _parameters(self, given: Any) -> Floats:
        """Return all parameters (np,) or (n, np), those that are not declared as they are."""
        if given is None:
            return self._question.parameters
        if isinstance(given, Mapping):
            return self._named_parameters(given)
        declared = _array("parameters", given, len(self.parameters))
        every = self._question.parameters
        whole = np.broadcast_to(every, (*declared.shape[:-1], len(every))).copy()
        whole[..., self._declared_places] = declared
        for row in np.unique(whole.reshape(-1, whole.shape[-1]), axis=0):
            self._arguments._judge(row)
        return whole

    def _named_parameters(self, given: Mapping[str, ArrayLike]) -> Floats:
        """Return all parameters (np,), or (n, np) where a name has n values; others follow those that are given."""
        arrays = {name: _array(f"parameters[{name!r}]", value, None) for name, value in given.items()}
        count = _count(arrays)
        if count is None:
            return self._arguments._parameter_vector({name: float(array) for name, array in arrays.items()})
        columns = np.stack([np.broadcast_to(array, count) for array in arrays.values()], axis=-1)
        rows, places = np.unique(columns, axis=0, return_inverse=True)
        each = [self._arguments._parameter_vector(dict(zip(arrays, row, strict=True))) for row in rows.tolist()]
        different = np.array(each).reshape(len(rows), self._question.parameters.size)
        return different[places.reshape(-1)]

    def _own_inputs(self, given: Any) -> dict[str, Floats]:
        """Return the inputs that are given, each a number or n of them; with all of them as a vector it is `inputs`."""
        if given is None:
            return {}
        self._arguments._verify_free(given if isinstance(given, Mapping) else self.inputs)
        if not isinstance(given, Mapping):
            return {"inputs": _array("inputs", given, len(self.inputs))}
        for name in given:
            if name not in self.inputs:
                raise InputError(f"there is no input {name!r}", number="M106", word=name, known=self.inputs)
        return {name: _array(f"inputs[{name!r}]", value, None) for name, value in given.items()}

    def _input_values(self, own: Mapping[str, Floats], given: Sequence[Floats], count: int | None) -> Floats:
        """Return all inputs, (nw,) or (n, nw), those that are not given by their declared expressions."""
        if not own or "inputs" in own:
            return own.get("inputs", np.zeros(len(self.inputs)))
        declared = self._arguments.compiled["inputs"]
        lead = () if count is None else (count,)
        values = np.empty((*lead, len(self.inputs)))
        run_many(declared, list(given), [values], count, 1)
        for name, value in own.items():
            values[..., self.inputs.index(name)] = value
        return values

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
        without = {"udot": not self._takes_udot, "s": not self._question.mechanism.rates}
        return tuple(name for name in VARIABLES if not without.get(name))

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
        return _result_type(self.name, self.names)

    @cached_property
    def _doors(self) -> list[Door]:
        return []

    @cached_property
    def _compiled(self) -> Compiled:
        mechanism = self._question.mechanism
        programs = {"inputs": inputs_program(mechanism), "function": self._declared, "given": self._program}
        return load(programs, self._code)

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
    def _arguments(self) -> Arguments:
        return Arguments(self._question.mechanism, self._compiled, self._question.parameters)

    # --- derivatives --------------------------------------------------------------------------------------------------

    def derivative(self, by: Variable) -> Function:
        """Return the derivative by t, q, u, s, udot, inputs or parameters: a Function with one axis more, the last.

        Its columns by q are those of the tangent, one a speed; by s those of the declared states. Declared inputs are
        functions of the state, but for the derivative by inputs. Raises InputError for a variable that the function
        does not have.
        """
        if by not in self._variables:
            known = ", ".join(self._variables)
            raise InputError(f"{self.name} is no function of {short_repr(by)}; known: {known}")
        if by == "inputs":
            self._arguments._verify_free(self.inputs)
        if by not in self._derivatives:
            self._derivatives[by] = self._differentiated(by)
        return self._derivatives[by]

    def _differentiated(self, by: Variable) -> Function:
        of_tree = self.name == "state_derivative" and not self._question.mechanism.rows
        differentiated = acceleration_derivative if of_tree else derivative_program
        try:
            program = differentiated(self._question.mechanism, self._program, by, declared=False)
            total = program
            if self.inputs:
                total = differentiated(self._question.mechanism, self._total, by, declared=True)
        except TypeError as error:
            raise ModelError(f"{self.name} has no derivative: {error}", number="M110") from error
        return replace(self, _program=program, _total=total, _by=(*self._by, by), _derivatives={})

    # --- for optimisers and solvers -----------------------------------------------------------------------------------

    def jvp(self, *state: ArrayLike, rates: Mapping[Variable, ArrayLike], **options: Any) -> Any:
        """Return the rates of the results while variables move: f.jvp(t, q, u, rates={"q": dq, "parameters": dp}).

        A rate of q has one element a speed; rates have n rows, too, where there are n states. `options` as of a call.
        Raises InputError as `derivative` does, and for wrong shapes.
        """
        if not isinstance(rates, Mapping) or not rates:
            raise ArgumentError(f"rates is a map from what moves to its rate: {', '.join(self._variables)}")
        sums: list[Any] = [0.0] * len(self.names)
        for by, given in rates.items():
            slopes = self._parts(self.derivative(by)(*state, **options))
            rate = _array(f"rates[{by!r}]", np.atleast_1d(floats(str(by), given)), slopes[0].shape[-1])
            for k, (slope, shape) in enumerate(zip(slopes, self.shapes.values(), strict=True)):
                along = rate.reshape(len(rate), *(1 for _ in shape), -1) if rate.ndim == 2 else rate
                sums[k] = sums[k] + (slope * along).sum(axis=-1)
        return sums[0] if len(sums) == 1 else self._tuple(*sums)

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
        slopes = dict(zip(self.names, self._parts(self.derivative(by)(*state, **options)), strict=True))
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
        return OrdinaryEquations(self)


@dataclass(frozen=True, eq=False)
class OrdinaryEquations:
    """`rhs(t, x)` -> x' (nq + nu,), `rhs.jac(t, x)` -> d x'/dx: `solve_ivp(rhs, span, x0, jac=rhs.jac)`.

    Quaternions count by their directions: x' is that of the state in which they have length one, so that what rounding
    does to their lengths does not grow. x may be (n, nq + nu). Inputs and parameters are as declared.
    """

    _function: Function

    def __call__(self, t: float, x: ArrayLike) -> Floats:
        """Return x' at time t."""
        q, u = self._parts(x)
        for places in self._balls:
            q[..., places] /= np.linalg.norm(q[..., places], axis=-1, keepdims=True)
        found = self._function(number("t", t), q, u)
        return np.concatenate([found.qdot, found.udot], axis=-1)

    def jac(self, t: float, x: ArrayLike) -> Floats:
        """Return d x'/dx (nx, nx) at one state."""
        q, u = self._parts(x)
        if q.ndim != 1:
            raise InputError(f"x has the shape {np.shape(x)}, not (nx,): jac takes one state")
        sizes = [float(np.linalg.norm(q[places])) for places in self._balls]
        for places, size in zip(self._balls, sizes, strict=True):
            q[places] /= size
        function = self._function
        given = number("t", t), q, u, function._question.parameters, np.zeros(len(function.inputs)), np.empty(0)
        found: Floats = self._jacobian["jacobian"](*given)[0]
        for places, size in zip(self._balls, sizes, strict=True):
            way = q[places]
            found[:, places] = (found[:, places] - np.outer(found[:, places] @ way, way)) / size
        return found

    @property
    def _balls(self) -> list[list[int]]:
        bodies = self._function._question.mechanism.bodies
        return [list(places) for body in bodies for places in body.quaternions]

    def _parts(self, x: ArrayLike) -> tuple[Floats, Floats]:
        """Return copies of q and u."""
        nq, nu = (shape[0] for shape in self._function._sizes)
        values = _array("x", x, nq + nu)
        return values[..., :nq].copy(), values[..., nq:].copy()

    @cached_property
    def _jacobian(self) -> Compiled:
        function, mechanism = self._function, self._function._question.mechanism
        program = with_declared_inputs(mechanism, state_jacobian(mechanism, function.program))
        return load({"jacobian": program}, function._code)


@cache
def _result_type(name: str, names: tuple[str, ...]) -> Callable[..., Any]:
    """Return the type of results with these names, which pickles by them."""

    def reduced(self: Any) -> tuple[Any, ...]:
        return _result, (name, names, tuple(self))

    base: Any = namedtuple(name, names, rename=True)  # type: ignore[misc]
    return type(name, (base,), {"__slots__": (), "__reduce__": reduced})


def _result(name: str, names: tuple[str, ...], values: tuple[Floats, ...]) -> Any:
    return _result_type(name, names)(*values)


def _again(system: System, what: Any, options: Mapping[str, Any], by: Sequence[Variable]) -> Function:
    """Return a Function as it comes out of a pickle."""
    found = function(system, what, **options)
    for variable in by:
        found = found.derivative(variable)
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Arguments as arrays.


def _array(name: str, value: ArrayLike, size: int | None) -> Floats:
    """Return a vector of `size`, or n of them; a number, or n of them, where the size is None."""
    own = 0 if size is None else 1
    values = np.asarray(floats(name, value), order="C")
    if values.ndim not in (own, own + 1) or (size is not None and values.shape[-1] != size):
        wanted = "() or (n,)" if size is None else f"({size},) or (n, {size})"
        raise InputError(f"{name} has the shape {values.shape}, not {wanted}")
    return values


def _overlap(outputs: Sequence[Floats], given: Sequence[Floats]) -> bool:
    """Return whether an output shares memory with another one, or with an argument."""
    others = [*outputs, *given]
    return any(np.may_share_memory(x, y) for k, x in enumerate(outputs) for y in others[k + 1 :])


_VECTORS: Final = ("q", "u", "udot", "parameters", "inputs")


def _count(arrays: Mapping[str, Floats]) -> int | None:
    """Return n, or None for one state. Raises InputError where arrays disagree."""
    lengths = {name: len(x) for name, x in arrays.items() if x.ndim == (2 if name in _VECTORS else 1)}
    if len(set(lengths.values())) > 1:
        raise InputError(f"arguments have different numbers of states: {lengths}")
    return next(iter(lengths.values()), None)
