"""Inputs that are held: they are parameters of the system that is compiled, so that C, events and impacts take them.

In: a system, the names of inputs, and functions that say what is held from one sample to the next. Out: the start of a
run, and what is held at each sample.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from inspect import signature
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

import numpy as np

from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.errors import ArgumentError, InputError, ModelError, at, short_repr
from multibody_sym.mechanics.declared_rows import expression_of
from multibody_sym.mechanics.spanning_tree import free_name, start_names
from multibody_sym.model.argument_checks import names as listed_names
from multibody_sym.model.fields import Names, scalar
from multibody_sym.model.parameters import Parameter
from multibody_sym.model.system import System
from multibody_sym.motion.loop.integrate import END, Leg, Switch, chain, from_part
from multibody_sym.motion.loop.problem import Hold, Holds, Loop
from multibody_sym.motion.results.samples import RunStart
from multibody_sym.program.program import interpret
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves, where
from multibody_sym.scalars.node import ZERO, as_node, less, symbol
from multibody_sym.scalars.numbers import LARGEST, floats

if TYPE_CHECKING:
    from multibody_sym.motion.switching.mode_run import ModeRun

# ----------------------------------------------------------------------------------------------------------------------
# Inputs as parameters.

def held_names(system: System, given: Any) -> tuple[str, ...]:
    """Return the inputs that are held: those that are named, or all but those that drive a motion or constraint.

    Raises InputError for a name of none, and for a driving one.
    """
    driving = check_numbers(system).driving_inputs if system.inputs else ()
    if given is None:
        return tuple(name for name in system.inputs if name not in driving)
    named = listed_names("inputs", given)
    for name in named:
        if name not in system.inputs:
            raise InputError(f"there is no input {name!r}", number="M106", word=name, known=system.inputs)
        if name in driving:
            message = f"{name} drives a motion or a constraint, whose speeds would jump where a held value does"
            raise InputError(f"{message}: let a force follow it", number="M110")
    return tuple(dict.fromkeys(named))


class HeldInputs(NamedTuple):
    """Inputs of a system that are held, by the names of the `parameters` that they become.

    `follows`: of those that follow their declared expressions until they are given, the parameter that is 1 until then.
    """

    parameters: Mapping[str, str]
    follows: Mapping[str, str]

    @classmethod
    def of(cls, system: System, names: Sequence[str], *, follow: bool = False) -> HeldInputs:
        """Return the inputs of a system by these names; those of time and state `follow` it until they are given."""
        taken = {*system.parameters, *system.inputs, *system.outputs, *start_names(system)}
        declared, found, follows = check_numbers(system).inputs if follow else {}, dict[str, str](), dict[str, str]()
        for name in names:
            found[name] = free_name(f"held_{name}", taken)
            taken.add(found[name])
            if any(leaf.data[0] != "parameters" for leaf in leaves([declared.get(name, ZERO)], "slot")):
                follows[name] = free_name(f"follows_{name}", taken)
                taken.add(follows[name])
        return cls(found, follows)

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters that change with what is held."""
        return (*self.parameters.values(), *self.follows.values())

    def in_system(self, system: System) -> System:
        """Return the system in which they are parameters, of the values at t = 0 where these need no state, else 0."""
        values = {**dict.fromkeys(self.names, 1.0), **self._declared(system, np.nan, np.nan)}
        known = {own: Parameter(value=as_node(0.0 if np.isnan(x) else x)) for own, x in values.items()}
        inputs = {**system.inputs, **{name: symbol(own) for name, own in self.parameters.items()}}
        for name, own in self.follows.items():
            declared = expression_of(name, system.inputs[name])
            inputs[name] = where(less(ZERO, symbol(own)), declared, symbol(self.parameters[name]))
        return replace(system, parameters=Names({**system.parameters, **known}), inputs=Names(inputs))

    def begun(self, begin: RunStart, values: Mapping[str, float], again: Callable[[], RunStart]) -> RunStart:
        """Return the start of a run with values (by parameter); where they decide what touches, it is made `again`."""
        problem, ready, places = begin.problem, begin.ready, begin.ready.mechanism.parameters.places
        if all(ready.parameters[places[name]] == value for name, value in values.items()):
            return begin
        if begin.modes is not None:
            return again()
        parameters = changed_parameters(problem.parameters, places, values)
        return begin._replace(problem=problem.with_numbers(parameters, problem.q0, problem.u0))

    def declared(self, system: System, begin: RunStart) -> Mapping[str, float]:
        """Return the values of their expressions at the start of a run."""
        return self._declared(system, begin.ready.q0, begin.ready.u0)

    def _declared(self, system: System, q: Floats | float, u: Floats | float) -> Mapping[str, float]:
        if not self.parameters:
            return {}
        mechanism = check_numbers(system)
        state = np.full(len(mechanism.coordinates), q), np.full(len(mechanism.speeds), u)
        found = interpret(inputs_program(mechanism), 0.0, *state, np.array(parameter_values(mechanism, {})))[0]
        values = dict(zip(mechanism.inputs, found.tolist(), strict=True))
        return {own: values[name] for name, own in self.parameters.items() if name not in self.follows}


def changed_parameters(parameters: Floats, places: Mapping[str, int], values: Mapping[str, float]) -> Floats:
    """Return parameters (np,) with other values of those that are named."""
    changed = parameters.copy()
    for name, value in values.items():
        changed[places[name]] = value
    return changed


def positive_time(name: str, value: Any) -> float:
    """Return a time in s, or text such as `1 ms`, as a number. Raises ModelError."""
    with at(name):
        node = scalar(value, "s")
    found = float("nan") if node.shadow is None else float(node.shadow)
    if not 0.0 < found < float("inf"):
        raise ModelError(f"{name} is a time in s, or text such as '1 ms', not {short_repr(value)}")
    return found


# ----------------------------------------------------------------------------------------------------------------------
# Inputs that functions give, sampled and held.


Law = Callable[[float, Floats, Floats], Any]
"""A controller: (t, q, u) -> the value of its input, or those of its inputs."""

_MOST_SAMPLES: Final = 10_000_000
_LEAST_REST: Final = 1e-9
"""The part of a sampling time that no last sample is shorter than."""


@dataclass(frozen=True, eq=False)
class SampledInputs:
    """The `laws` by the inputs that they give, called every so many seconds."""

    laws: Mapping[tuple[str, ...], Law]
    every: float

    @property
    def names(self) -> tuple[str, ...]:
        """The inputs."""
        return tuple(name for names in self.laws for name in names)

    def values(self, t: float, q: Floats, u: Floats) -> Iterator[tuple[str, float]]:
        """Yield the value of each input at a sample. Raises InputError for what is no number, or not finite."""
        for names, law in self.laws.items():
            found = floats(f"inputs[{_told(names)}]", law(t, q.copy(), u.copy()))
            if found.size != len(names) or found.ndim > 1:
                wanted = "a number" if len(names) == 1 else f"({len(names)},)"
                given = f"inputs[{_told(names)}] returned the shape {found.shape}"
                raise InputError(f"{given} at t = {t:g} s, not {wanted}")
            for name, value in zip(names, found.ravel().tolist(), strict=True):
                if not abs(value) <= LARGEST:
                    raise InputError(f"inputs[{_told(names)}] returned {value} for {name} at t = {t:g} s")
                yield name, value

    def ends(self, t: float, t_end: float) -> float:
        """Return the time of the sample after that at a time, or the end of the run."""
        following = (round(t / self.every) + 1) * self.every
        return following if following < t_end - _LEAST_REST * self.every else t_end


def sampled_inputs(inputs: Mapping[Any, Any]) -> tuple[Any, SampledInputs]:
    """Return `inputs` as given to a run in two parts: those for the model, and those that functions give.

    Raises ArgumentError where `every` is missing.
    """
    laws = dict[tuple[str, ...], Law]()
    for key, law in inputs.items():
        if callable(law):
            names = key if isinstance(key, tuple) else (key,)
            if not names or not all(isinstance(name, str) for name in names):
                wanted = "name its input, or its inputs in a tuple"
                raise ArgumentError(f"inputs has a function for {short_repr(key)}: {wanted}")
            _verify_law(key, law)
            laws[names] = law
    rest = {key: value for key, value in inputs.items() if not callable(value)}
    if "every" not in rest:
        raise ArgumentError('inputs has a function: "every" says how often it is called, such as {"every": "1 ms"}')
    with at("inputs"):
        every = positive_time("every", rest.pop("every"))
    named = [name for names in laws for name in names]
    for name in {*rest, *(name for name in named if named.count(name) > 1)} & set(named):
        raise InputError(f"inputs gives {name} twice")
    return rest, SampledInputs(laws, every)


def _verify_law(key: Any, law: Law) -> None:
    """Raise ArgumentError for a function that takes other arguments than a law."""
    try:
        signature(law).bind(0.0, np.zeros(0), np.zeros(0))
    except TypeError:
        raise ArgumentError(f"inputs[{key!r}] is called as (t, q, u), which it does not take") from None
    except ValueError:
        message = f"nothing tells what inputs[{key!r}] takes: write lambda t, q, u: .., which calls it"
        raise ArgumentError(message) from None


def _told(names: tuple[str, ...]) -> str:
    return repr(names[0]) if len(names) == 1 else repr(names)


def sampled_start(
    begin: RunStart, held: HeldInputs, sampled: SampledInputs, again: Callable[[Mapping[str, float]], RunStart]
) -> RunStart:
    """Return the start of a run whose inputs are sampled; `again` makes it with the parameters that are held first."""
    t0, t_end, nq = begin.problem.t0, begin.problem.t_end, len(begin.problem.q0)
    if (count := (t_end - t0) / sampled.every) > _MOST_SAMPLES:
        message = f"{count:.3g} calls of functions are too many, at most {_MOST_SAMPLES:,}: call them less often"
        raise InputError(message, number="M117").under("every").under("inputs")

    def values(t: float, x: Floats) -> dict[str, float]:
        return {held.parameters[name]: value for name, value in sampled.values(t, x[:nq], x[nq:])}

    first = values(t0, begin.problem.x0)

    def holds(t: float, x: Floats) -> Hold:
        return Hold(sampled.ends(t, t_end), first if t == t0 else values(t, x))

    begin = held.begun(begin, first, partial(again, first))
    if begin.modes is None:
        return begin._replace(holds=holds)
    modes = cast("ModeRun", begin.modes).copied()  # a run changes what it has prepared
    return begin._replace(modes=modes.begin(holds))


def held_loop(begin: RunStart, holds: Holds) -> tuple[Loop, list[Leg]]:
    """Return the loop of a run without modes whose inputs are held from time to time, and its legs, one a hold."""
    whole, places = begin.problem, begin.ready.mechanism.parameters.places
    first = whole.part(holds(whole.t0, whole.x0).until, whole.parameters, None, whole.x0)
    legs = [Leg(first)]

    def next_leg(leg: Leg, switch: Switch) -> Leg | None:
        if switch.index != END:
            return None
        hold = holds(switch.begun.time, switch.x)
        parameters = changed_parameters(leg.of.parameters, places, hold.values)
        return Leg(leg.of.part(hold.until, parameters, switch.begun, switch.x))

    return from_part(first, chain(next_leg, legs)), legs
