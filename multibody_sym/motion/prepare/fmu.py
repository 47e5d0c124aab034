"""A system as an FMU: what `program/fmu_target.py` prints, from a system at its start and its Programs.

Inputs that are declared by a number come from outside; those declared by expressions are computed in the FMU.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np

from multibody_sym.dynamics.programs.function_derivatives import state_jacobian
from multibody_sym.dynamics.programs.reactions import switchings
from multibody_sym.dynamics.start.parameters import evaluation_order
from multibody_sym.dynamics.start.state import StartState
from multibody_sym.errors import InputError, ModelError, OutputError, Where
from multibody_sym.mechanics.mechanism import Mechanism, Source
from multibody_sym.mechanics.motion import arrays
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.methods.explicit import RungeKutta
from multibody_sym.motion.methods.table import AUTO, COLLOCATION, METHODS
from multibody_sym.motion.prepare.contact_code import ContactCode, positive_parameters
from multibody_sym.motion.prepare.problem import knots_before, pairing_of, terminal_of
from multibody_sym.motion.prepare.settings import RunSettings, method_fields, run_settings
from multibody_sym.program.fmu_target import (
    Fmi,
    Fmu,
    FmuInput,
    FmuParameter,
    FmuQuantity,
    archive_files,
    c_texts,
    is_packed,
    packed,
    variable_names,
    with_token,
)
from multibody_sym.program.loading import build_library, find_compiler
from multibody_sym.program.program import Program, elements_read, interpret, operation_count
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, slot, symbol
from multibody_sym.text.files import is_special, write_whole
from multibody_sym.text.units import kind_of, rate_unit

Q = TypeVar("Q", bound=FmuQuantity)
_MOST_OPERATIONS: Final = 30_000
"""Operations times columns up to which derivatives are computed in the FMU: more take long to compile."""
_MOST_EVENTS: Final = 100_000
"""Kinks in one step of a co-simulation that are too many: a force jumps to and fro."""
_MARGIN: Final = 1e-9
"""By how much a switching function of the state at the start may exceed zero, as it does by rounding.

One that does so at the start, where forces are not unique, ends the motion once it has been below.
"""


@dataclass(frozen=True)
class MadeFmu:
    """An FMU, and `notes` on what of the system is not in it."""

    fmu: Fmu
    notes: tuple[str, ...]


def free_inputs(mechanism: Mechanism) -> list[str]:
    """Return the inputs that come from outside: those that a number declares, unless they drive a motion."""
    inputs, driving = mechanism.inputs.items(), mechanism.driving_inputs
    return [name for name, expression in inputs if expression.shadow is not None and name not in driving]


def fmu_of(
    system: System, placed: StartState, made: Mapping[str, Program], contacts: ContactCode | str | None = None
) -> MadeFmu:
    """Return a system at its start as an FMU, from the Programs of an exported model.

    `contacts` take a co-simulation from state to state; or they say why nothing does, None where there are none.

    Raises ModelError where the motion begins with an impact and where nothing moves, InputError where two variables
    have one name.
    """
    mechanism, begin = placed.mechanism, placed.start
    _verify(system, placed, isinstance(contacts, ContactCode))
    entries = zip(mechanism.parameters, begin.parameters, strict=True)
    values = {symbol(entry.name): x for entry, x in entries if entry.source is not Source.LITERAL}
    settings, switches, pairs = run_settings(system.simulation, values), switchings(mechanism), pairing_of(mechanism)
    own = isinstance(settings.method, RungeKutta) or settings.method.name in COLLOCATION
    method = settings.method if own else METHODS[AUTO]
    state = 0.0, begin.q, begin.u, begin.parameters
    given = interpret(made["inputs"], *state)[0]
    inputs = _inputs(mechanism, given.tolist())
    ending = interpret(made["events"], *state, given, np.empty(0))[0][-len(switches) :] if switches else ()
    units, states = MechanismUnits(mechanism), _states(mechanism, (*begin.q, *begin.u))
    found = Fmu(
        name=mechanism.name,
        description=" ".join((system.description or "").split()),
        coordinates=len(mechanism.coordinates),
        states=states,
        rates=tuple(rate_unit(x.unit) for x in states),
        inputs=inputs,
        outputs=tuple(FmuQuantity(name, units.outputs[name]) for name in mechanism.outputs),
        parameters=_parameters(mechanism, begin.parameters, made),
        programs={**_without_energy(made), **_more_programs(mechanism, made, [w.name for w in inputs if w.free])},
        units={},
        ends=_ends(mechanism),
        terminal=terminal_of(mechanism, len(switches)),
        margins=tuple(-_MARGIN if value > _MARGIN else _MARGIN for value in ending),
        moments=knots_before(mechanism, math.inf),
        plain=tuple(pairs.plain),
        balls=tuple(pairs.balls),
        method=method_fields(method),
        numbers=_numbers(mechanism, begin.parameters, settings, own),
        stop_time=settings.t_end,
        tolerance=settings.rtol,
    )
    _verify_names(found)
    if isinstance(contacts, ContactCode):
        found = _with_contacts(found, contacts)
    return MadeFmu(_with_units(found), tuple(_notes(system, placed, settings, found, contacts)))


def write_fmu(fmu: Fmu, path: Path, fmi: Fmi) -> Path:
    """Compile an FMU and write its file; return the path.

    Raises InputError where a file is there that no export wrote, CompilerError, OutputError.
    """
    _verify_replaceable(path)
    fmu = with_token(fmu, fmi)
    compiler = find_compiler()
    compiler = replace(compiler, flags=(*compiler.flags, "-fvisibility=hidden"), wide=())  # for other processors, too
    try:
        binary = build_library(compiler, c_texts(fmu, fmi)).read_bytes()
    except OSError as problem:
        raise OutputError(f"the code of an FMU cannot be compiled: {problem}", number="O102") from problem
    write_whole(path, packed(archive_files(fmu, fmi, binary)))
    return path


def _verify_replaceable(path: Path) -> None:
    """Raise InputError where a file stands at a path that is not as an export wrote it."""
    if is_special(str(path)):
        return
    try:
        ours = is_packed(path.read_bytes())
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError:
        ours = False
    if not ours:
        message = "this is not as an export wrote it; move it away, or choose another file"
        raise InputError(message, where=Where(file=str(path)), number="O101")


def _with_contacts(fmu: Fmu, contacts: ContactCode) -> Fmu:
    """Return an FMU whose contacts go from state to state in co-simulation."""
    names = [parameter.name for parameter in fmu.parameters]
    stops = len(fmu.terminal) - len(fmu.margins)
    count = len(contacts.functions)
    return replace(
        fmu,
        programs={"parameters": fmu.programs["parameters"], **contacts.programs},
        contacts=contacts.files,
        contact_parameters=tuple(names.index(name) if name in names else -1 for name in contacts.parameters),
        ends=(*fmu.ends[:stops], *contacts.functions),
        terminal=(*fmu.terminal[:stops], *[True] * count),
        margins=(0.0,) * count,
    )


# ----------------------------------------------------------------------------------------------------------------------
# Refusals and notes.


def _verify(system: System, placed: StartState, strikes: bool) -> None:
    mechanism = placed.mechanism
    if not mechanism.coordinates and not mechanism.drives:
        raise ModelError("nothing can move: no joint has freedom", number="M117").under("joints")
    if system.impact is not None or (placed.closing and not strikes):
        what = ", ".join(placed.closing) or "an impact"
        advice = "start with the speeds behind it, which `impact` returns, and leave out `impact`"
        raise ModelError(f"the motion begins with {what}, and an FMU has no impacts: {advice}", number="M110")


def _verify_names(fmu: Fmu) -> None:
    twice = next((name for name, count in Counter(variable_names(fmu)).items() if count > 1), None)
    if twice is not None:
        message = f"two variables of the FMU would be called {twice!r}; rename what the model calls so"
        raise InputError(message, number="M110")


def _notes(
    system: System, placed: StartState, settings: RunSettings, fmu: Fmu, contacts: ContactCode | str | None
) -> list[str]:
    mechanism, notes = placed.mechanism, []
    if mechanism.one_way:
        state = ", ".join(f"{name}: {word}" for name, word in placed.words.items())
        only = f"of the state at the start only, {{{state}}}; the FMU ends the simulation where that ends: {contacts}"
        notes.append("it goes from state to state of contacts, stops and ropes" if fmu.contacts else only)
    if kept := [w.name for w in fmu.inputs if not w.free]:
        notes.append(f"computed in the FMU: {', '.join(kept)}; --inputs {kept[0]}=0 makes it an input from outside")
    if left := [*mechanism.run_outputs, *mechanism.untold]:
        notes.append(f"left out: {', '.join(left)}, which no state determines")
    if mechanism.state_stops and not fmu.contacts:
        notes.append(f"left out: {', '.join(mechanism.state_stops)}, which stop a run where states change")
    if not isinstance(settings.method, RungeKutta) and settings.method.name not in COLLOCATION:
        notes.append(f"co-simulation integrates with {METHODS[AUTO].name}, not with {settings.method.name}")
    if mechanism.rows and not settings.project:
        notes.append("constraints are kept by projection, as elsewhere without `constraints`")
    if not fmu.has_slopes:
        notes.append("without directional derivatives, which are too long for this model")
    return notes


# ----------------------------------------------------------------------------------------------------------------------
# What an FMU has beside the Programs of an exported model.


def _without_energy(made: Mapping[str, Program]) -> dict[str, Program]:
    return {name: program for name, program in made.items() if name != "energy"}


def _more_programs(mechanism: Mechanism, made: Mapping[str, Program], free: Sequence[str]) -> dict[str, Program]:
    """Return the Program of all parameters, and those of derivatives where they are short."""
    trace = Trace("parameters", arrays(mechanism))
    values = _parameter_nodes(mechanism)
    found = {"parameters": trace.finish({"values": ((len(values),), values)})}
    columns = len(mechanism.coordinates) + len(mechanism.speeds) + len(free)
    wanted = {"rate_slopes": ("state_derivative", 2), "output_slopes": ("outputs", 1)}
    operations = sum(operation_count(made[name]).total for name, _ in wanted.values())
    if columns and operations * columns <= _MOST_OPERATIONS:
        for name, (whole, count) in wanted.items():
            found[name] = state_jacobian(mechanism, made[whole], free=free, count=count, name=name)
    return found


def _parameter_nodes(mechanism: Mechanism) -> list[Node]:
    """Return each parameter as an expression of those that follow from no others."""
    places = [slot("parameters", k) for k in range(len(mechanism.parameters))]
    found = dict(zip(places, places, strict=True))
    for k in evaluation_order(mechanism, {}):
        expression = mechanism.parameters[k].value
        if expression is not None and leaves([expression], "slot"):
            (found[places[k]],) = evaluate([expression], found)
    return [found[place] for place in places]


def _states(mechanism: Mechanism, values: Sequence[float]) -> tuple[FmuQuantity, ...]:
    names = [(c.name, c.unit) for c in mechanism.coordinates] + [(s.name, s.unit) for s in mechanism.speeds]
    return tuple(FmuQuantity(name, unit, float(x)) for (name, unit), x in zip(names, values, strict=True))


def _inputs(mechanism: Mechanism, values: Sequence[float]) -> tuple[FmuInput, ...]:
    """Return the inputs."""
    units, free = MechanismUnits(mechanism).inputs, free_inputs(mechanism)
    pairs = zip(mechanism.inputs, values, strict=True)
    return tuple(FmuInput(name, units[name], value, name in free) for name, value in pairs)


def _parameters(
    mechanism: Mechanism, values: Sequence[float], made: Mapping[str, Program]
) -> tuple[FmuParameter, ...]:
    """Return the entries of the parameter vector; those that constraints on positions read are fixed."""
    units, nodes, fixed = MechanismUnits(mechanism).parameters, _parameter_nodes(mechanism), set[Node]()
    positive = positive_parameters(mechanism, values)
    places = [slot("parameters", k) for k in range(len(nodes))]
    if "project_position" in made:
        read = [x for row in elements_read(made["project_position"])["phi"] for x in row if x in places]
        fixed = {*leaves([nodes[x.data[1]] for x in read], "slot")}

    def kind(k: int, declared: bool) -> Any:
        if not declared:
            return "hidden"
        return "follows" if nodes[k] is not places[k] else "fixed" if places[k] in fixed else "tunable"

    return tuple(
        FmuParameter(p.name, units[p.name], float(x), kind(k, p.source is Source.DECLARED), k in positive)
        for k, (p, x) in enumerate(zip(mechanism.parameters, values, strict=True))
    )


def _ends(mechanism: Mechanism) -> tuple[str, ...]:
    switches = (f"{one.part.name if one.part else one.element.name} {one.told}" for one in switchings(mechanism))
    kinks = len(mechanism.kinks) + len(mechanism.fades)
    return (*(f"{name} holds" for name in mechanism.stops), *(["a kink"] * kinks), *switches)


def _with_units(fmu: Fmu) -> Fmu:
    """Return an FMU with the exponents of base units of each of its units."""
    every = (*fmu.states, *fmu.inputs, *fmu.outputs, *fmu.parameters)
    found = {}
    for unit in dict.fromkeys(["s", *(x.unit for x in every), *fmu.rates]):
        if unit:
            (mass, length, time), angle, _ = kind_of(unit)
            found[unit] = {"kg": mass, "m": length, "s": time, "rad": angle or 0}
    whole = {unit: {base: int(e) for base, e in x.items()} for unit, x in found.items() if _are_whole(x.values())}

    def known(listed: tuple[Q, ...]) -> tuple[Q, ...]:
        return tuple(x if x.unit in whole else replace(x, unit="") for x in listed)

    return replace(
        fmu,
        units=whole,
        rates=tuple(unit if unit in whole else "" for unit in fmu.rates),
        states=known(fmu.states),
        inputs=known(fmu.inputs),
        outputs=known(fmu.outputs),
        parameters=known(fmu.parameters),
    )


def _are_whole(exponents: Iterable[Any]) -> bool:
    return all(e == int(e) for e in exponents)


def _numbers(
    mechanism: Mechanism, parameters: Sequence[float], settings: RunSettings, own_step: bool
) -> dict[str, float | int]:
    return {
        "RTOL": settings.rtol,
        "ATOL_BY_RTOL": settings.atol / settings.rtol,
        "FIXED_STEP": settings.step or 0.0 if own_step else 0.0,
        "INDEPENDENT": mechanism.parameters.independent_rows(parameters),
        "CONTRADICTION": Problem.contradiction,
        "CLOSURE": Problem.closure,
        "MOST_STEPS": Problem.max_steps,
        "MOST_EVENTS": _MOST_EVENTS,
    }
