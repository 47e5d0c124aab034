"""Exported models that run by themselves: C that goes from state to state of contacts, and FMUs.

`contact_code` has the Programs of a model and its tables for `contacts.c`, or the reason why that does not hold it. An
FMU is what `program/fmu_target.py` prints: inputs that are declared by a number come from outside; those declared by
expressions are computed in the FMU.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.programs.every_mode import every_mode_programs
from multibody_sym.dynamics.programs.function_derivatives import state_jacobian
from multibody_sym.dynamics.programs.reactions import switchings
from multibody_sym.dynamics.start.parameters import evaluation_order
from multibody_sym.dynamics.start.state import StartState
from multibody_sym.errors import InputError, ModelError, OutputError, Where
from multibody_sym.mechanics.law_elements import ACTIVE, LawElement, Mode
from multibody_sym.mechanics.mechanism import INDEPENDENT, Mechanism, Source
from multibody_sym.mechanics.modes import (
    friction_parts,
    functions,
    has_end,
    has_rim,
    mode_words,
    number_places,
    own_numbers,
    usual_numbers,
)
from multibody_sym.mechanics.motion import arrays
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.motion.loop.problem import Problem
from multibody_sym.motion.methods.explicit import RungeKutta
from multibody_sym.motion.methods.table import AUTO, COLLOCATION, METHODS
from multibody_sym.motion.prepare.problem import knots_before, pairing_of, terminal_of
from multibody_sym.motion.prepare.settings import RunSettings, method_fields, run_settings
from multibody_sym.motion.switching.law_mechanism import LawMechanism
from multibody_sym.motion.switching.prepared import plain
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
from multibody_sym.program.target_layout import c_array, c_number, c_structure, template_text
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ZERO, Node, slot, symbol
from multibody_sym.text.files import is_special, write_whole
from multibody_sym.text.units import kind_of, rate_unit

T = TypeVar("T")
_PREFIX: Final = "contacts_"
_FILES: Final = ("contacts.h", "contacts.c", "contact_laws.h", "contact_laws.c", "contact_impacts.c")
_MATRICES: Final = ("jacobian", "matrix", "exerted", "inverse")
_OUTPUTS: Final = (
    *_MATRICES,
    *("phi", "phidot", "right", "driven", "coefficients", "reaches", "past_ends", "bounces", "free"),
)
_MOST_ELEMENTS: Final = 12


@dataclass(frozen=True, eq=False)
class ContactCode:
    """The Programs of a model in any state of its contacts, and the files of C that take it from state to state.

    `samples` are the inputs of these Programs at the start, all contacts open; `parameters` and `functions` name their
    parameters and switching functions.
    """

    programs: Mapping[str, Program]
    files: Mapping[str, str]
    samples: Mapping[str, Sequence[ArrayLike]]
    parameters: tuple[str, ...]
    functions: tuple[str, ...]


def contact_code(system: System, placed: StartState, formalism: str, *, free: int = 0) -> ContactCode | str:
    """Return what simulates a system with contacts in C, by a formalism, or why there is none.

    So many inputs are `free`: they stand behind the parameters.
    """
    placed = placed.before_a_run
    laws = LawMechanism.of(placed.declared, system.simulation)
    begin, settings = placed.start, _settings(system, placed)
    if reason := _why_not(laws, settings, placed, system):
        return reason
    if len(placed.modes) > 1:
        return "the laws leave several states at the start"
    if shared := _shared(placed):
        return f"the forces of {' and '.join(shared)} are not unique, and not all of them rub"
    assert laws.every is not None
    programs, places, _ = every_mode_programs(laws.declared, FORMALISMS[formalism])
    del programs["energy"]
    tables = _Tables(laws, laws.every, placed, settings, programs, places, free)
    files = {name: template_text(f"c/{name}") for name in _FILES}
    files["contacts_model.h"] = tables.text
    state = (0.0, begin.q, begin.u, tables.values)
    inputs, multipliers = interpret(programs["inputs"], *state)[0], np.zeros(len(laws.every.rows))
    given: list[ArrayLike] = [*state, inputs, tables.open, multipliers]
    samples: dict[str, list[ArrayLike]] = {}
    for name, program in programs.items():  # `laws` is of no mode: its array of these numbers is empty
        pairs = zip(program.inputs, given, strict=False)
        samples[name] = [x if array.size == np.size(x) else np.zeros(array.shape) for array, x in pairs]
    names = tuple("" if x.source is Source.CHOSEN else x.name for x in laws.every.parameters)
    return ContactCode(_named(programs), files, _named(samples), names, functions(laws.every))


def _settings(system: System, placed: StartState) -> RunSettings:
    """Return the settings of a system in numbers, by the parameters of its start."""
    entries = zip(placed.mechanism.parameters, placed.start.parameters, strict=True)
    values = {symbol(entry.name): x for entry, x in entries if entry.source is not Source.LITERAL}
    return run_settings(system.simulation, values)


def positive_parameters(mechanism: Mechanism, values: Sequence[float]) -> set[int]:
    """Return the places of parameters that stay positive whoever sets them: those declared so, and masses of bodies."""
    masses = {body.mass.mass for body in mechanism.bodies}
    entries = zip(mechanism.parameters, values, strict=True)
    return {k for k, (x, value) in enumerate(entries) if value > 0 and (x.positive or slot("parameters", k) in masses)}


def _named(known: Mapping[str, T]) -> dict[str, T]:
    return {f"{_PREFIX}{name}": x for name, x in known.items()}


def _why_not(laws: LawMechanism, settings: RunSettings, placed: StartState, system: System) -> str:
    """Return why `contacts.c` does not hold a model, empty where it does."""
    declared, every = laws.declared, laws.declared.one_way
    named = (f"{x.name} {reason}" for x in every if (reason := _why_not_element(x)))
    if reason := next(named, ""):
        return reason
    if len(every) > _MOST_ELEMENTS:
        return f"there are {len(every)} contacts, stops and ropes, more than {_MOST_ELEMENTS}"
    if laws.bars:
        return f"{laws.bars[0].sides[0].name} has two sides without thickness"
    if laws.every is None:
        return "its method, or masses that are zero, need Programs of each state"
    if pairing_of(declared).balls:
        return "a body turns freely in space"
    if not isinstance(settings.method, RungeKutta):
        return f"the method {settings.method.name} is not an explicit Runge-Kutta method"
    if declared.rows and not settings.project:
        return "its constraints are not kept by projection"
    if declared.rows and placed.declared.parameters.independent_rows(placed.begin.parameters) < len(declared.rows):
        return "its constraints depend on each other"
    return "its motion begins with `impact`" if system.impact is not None else ""


def _shared(placed: StartState) -> list[str]:
    """Return what shares forces as a rope and a rough floor on one line do at the start; empty for none.

    Friction is as large as the laws allow, and C has modes alone in which one of them carries all.
    """
    if placed.posed is None or placed.found is None or not placed.found.states:
        return []
    places, open_ones = placed.posed.places, placed.found.states[0].not_unique
    smooth = [row.name for row in placed.posed.mechanism.rows if places[row.name] in open_ones]
    rough = list[str]()
    for element in placed.posed.elements:
        if any(places.get(row.name) in open_ones for row in element.rows):
            (rough if any(part.rubs for part in element.frictions) else smooth).append(element.name)
    return [*smooth, *rough] if smooth and rough else []


def _why_not_element(element: LawElement) -> str:
    """Return why `contacts.c` does not hold an element, empty where it does."""
    parts = [part for part in element.frictions if part.rubs]
    if not element.unilateral:
        return "rubs in a joint"
    if len(parts) > 1 or any(part.name != element.name or part.wrap is not None for part in parts):
        return "rubs in several ways"
    if any(len(part.rows) > 1 for part in parts):
        return "slides in space"
    if has_end(element) or has_rim(element):
        return "ends at an edge, or meets a point"
    if not plain(element) or not all(row.restricts for row in element.rows):
        return "rubs without bound, or creeps"
    return "" if element.tangential_restitution is ZERO else "gives friction back in impacts"


@dataclass(frozen=True, eq=False)
class _Tables:
    """The sizes, names and numbers of a model that `contacts.c` reads."""

    laws: LawMechanism
    every: Mechanism
    placed: StartState
    settings: RunSettings
    programs: Mapping[str, Program]
    places: Mapping[str, Sequence[int]]
    free: int

    @property
    def text(self) -> str:
        """The header `contacts_model.h`."""
        head = "/* contacts_model.h: sizes, names and numbers of the model, written by multibody_sym. */"
        defined = [f"#define MBS_CONTACTS_{name} {c_number(x)}" for name, x in self._sizes().items()]
        method = c_structure("mbs_method", "mbs_contacts_method", method_fields(self.settings.method))
        arrays = [c_array(kind, f"mbs_contacts_{name}", x) for kind, name, x in self._arrays()]
        entries = [f"mbs_contacts_{name}_entries" for name in _MATRICES]
        pointers = f"static const int *const mbs_contacts_entries[] = {{{', '.join(entries)}}};"
        lines = [head, "#pragma once", '#include "runtime.h"', "", *defined, "", *arrays, pointers, *method, ""]
        return "\n".join(lines)

    def _sizes(self) -> dict[str, float | int]:
        declared, settings = self.laws.declared, self.settings
        outputs = [output.name for output in self.programs["laws"].outputs]
        assert self.placed.posed is not None  # what holds one way only poses its laws at the start
        scale = self.placed.posed.rows.scale
        return {
            "NQ": len(declared.coordinates), "NU": len(declared.speeds), "NP": len(self.every.parameters),
            "NW": len(declared.inputs), "FREE": self.free, "NG": len(self._terminal), "SWITCHES": self.laws.functions,
            "ROWS": len(self.every.rows), "CONSTRAINTS": len(declared.rows), "ELEMENTS": len(declared.one_way),
            "PARTS": len(friction_parts(declared)), "NUMBERS": len(self.every.mode_numbers),
            "SOME_ACT": number_places(self.every)["some row acts"],
            "INDEPENDENT": self.every.parameters.places.get(INDEPENDENT, -1),
            "OUTPUTS": len(outputs), "VALUES": sum(len(x.values) for x in self.programs["laws"].outputs),
            **{name.upper(): outputs.index(name) for name in _OUTPUTS},
            "STOPS": len(self._stops), "STATE_STOPS": len(declared.state_stops),
            "PLAINS": len(pairing_of(declared).plain), "MOMENTS": len(self._moments),
            "LENGTH": scale.length, "SPEED": scale.speed, "T_END": settings.t_end,
            "SAMPLES": settings.samples if isinstance(settings.samples, int) else len(settings.samples.times),
            "STEP": settings.step or 0.0, "RTOL": settings.rtol, "ATOL": settings.atol,
            "CONTRADICTION": Problem.contradiction, "CLOSURE": Problem.closure, "MOST_STEPS": Problem.max_steps,
        }  # fmt: skip

    def _arrays(self) -> list[tuple[str, str, Any]]:
        declared, begin, number = self.laws.declared, self.placed.start, number_places(self.every)
        row = {each.name: k for k, each in enumerate(self.every.rows)}
        pairs = friction_parts(declared)
        parts, elements = [part for _, part in pairs], declared.one_way
        names = [x.name for x in elements]
        numbers = {part.name: k for k, part in enumerate(parts)}
        places = {name: k for k, name in enumerate(functions(self.every))}
        tangents = [row[part.rows[0].name] for part in parts]
        owners = [elements.index(element) for element, _ in pairs]
        turned = self.placed.posed
        assert turned is not None
        angles = [int(x.name in turned.rows.laws.turning) for x in elements]
        slides = turned.rows.laws.slides.tolist()
        positive = positive_parameters(self.every, self.values.tolist())
        slip_words = [  # of each part: it slides backwards, sticks, slides forwards
            mode_words([element], Mode({element.name: ACTIVE}, {part.name: slip}))[part.name]
            for element, part in pairs
            for slip in (-1, 0, 1)
        ]
        conditions = list(declared.state_stops.values())
        ends = np.cumsum([0, *(len(condition.words) for condition in conditions)])
        return [
            ("double", "values", self.values.tolist()), ("double", "start_state", [*begin.q, *begin.u]),
            ("double", "open", self.open.tolist()), ("double", "moments", self._moments),
            ("double", "slides", slides), ("int", "angles", angles),
            ("int", "turned", [int(x.unit == "rad") for x in declared.coordinates]),
            ("int", "plain", [k for pair in pairing_of(declared).plain for k in pair]),
            ("int", "terminal", [int(x) for x in self._terminal]),
            ("int", "positive", [int(k in positive) for k in range(len(self.every.parameters))]),
            ("int", "acts", [number[f"acts {each.name}"] for each in self.every.rows]),
            ("int", "normals", [row[x.normals[0].name] for x in elements]),
            ("int", "parts", [next((numbers[p.name] for p in x.frictions if p.name in numbers), -1) for x in elements]),
            ("int", "functions", [places[f"normal {x.name}"] for x in elements]),
            ("int", "elements", owners), ("int", "tangents", tangents),
            ("int", "holds", [int(part.static is not ZERO) for part in parts]),
            ("int", "slip_functions", [places[f"slip {part.name}"] for part in parts]),
            ("int", "slip_numbers", [number[f"slip {part.name}"] for part in parts]),
            ("int", "limit_numbers", [number[f"at limit {part.name}"] for part in parts]),
            ("int", "watched", [number[f"watched slip {part.name}"] for part in parts]),
            ("int", "entry_counts", [len(self.places[name]) for name in _MATRICES]),
            *(("int", f"{name}_entries", self.places[name]) for name in _MATRICES),
            ("char *const", "names", names),
            ("char *const", "state_words", [word for x in elements for word in x.words]),
            ("char *const", "stops", self._stops),
            ("int", "stop_elements", [names.index(condition.element) for condition in conditions]),
            ("int", "stop_strikes", [int(condition.strikes) for condition in conditions]),
            ("int", "stop_begins", ends.tolist()),
            ("char *const", "stop_words", [word for condition in conditions for word in condition.words]),
            ("char *const", "slip_words", slip_words),
        ]  # fmt: skip

    @cached_property
    def values(self) -> Floats:
        """The parameters (np,)."""
        given = np.array(self.placed.start.parameters, dtype=float)
        values, *_ = self.laws.numbers(self.placed.mechanism, given)
        return values

    @property
    def open(self) -> Floats:
        """The numbers (nm,) of the mode in which all is open."""
        found = np.zeros(len(self.every.mode_numbers))
        free = replace(self.every, rows=(), held=(), mode=Mode({}))
        watched = {f"normal {element.name}": 1.0 for element in self.every.one_way}
        for place, x in (usual_numbers(self.every) | own_numbers(self.every, free, watched)).items():
            found[place] = x
        return found

    @property
    def _stops(self) -> list[str]:
        """The names of conditions at which a run stops: those by values, then those by states."""
        return [*self.laws.declared.stops, *self.laws.declared.state_stops]

    @property
    def _terminal(self) -> tuple[bool, ...]:
        return terminal_of(self.laws.declared, self.laws.functions)

    @property
    def _moments(self) -> tuple[float, ...]:
        return knots_before(self.laws.declared, self.settings.t_end)


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
    Raises ModelError where the motion begins with an impact or nothing moves, InputError where a name stands twice.
    """
    mechanism, begin = placed.mechanism, placed.start
    _verify(system, placed, isinstance(contacts, ContactCode))
    settings, switches, pairs = _settings(system, placed), switchings(mechanism), pairing_of(mechanism)
    own = isinstance(settings.method, RungeKutta) or settings.method.name in COLLOCATION
    method = settings.method if own else METHODS[AUTO]
    state = 0.0, begin.q, begin.u, begin.parameters
    given = interpret(made["inputs"], *state)[0]
    units, free = MechanismUnits(mechanism), free_inputs(mechanism)
    inputs = tuple(
        FmuInput(name, units.inputs[name], value, name in free)
        for name, value in zip(mechanism.inputs, given.tolist(), strict=True)
    )
    ending = interpret(made["events"], *state, given, np.empty(0))[0][-len(switches) :] if switches else ()
    names = [(x.name, x.unit) for x in mechanism.coordinates] + [(x.name, x.unit) for x in mechanism.speeds]
    states = tuple(FmuQuantity(*each, float(x)) for each, x in zip(names, (*begin.q, *begin.u), strict=True))
    programs = {name: x for name, x in made.items() if name != "energy"}
    programs |= _more_programs(mechanism, made, [w.name for w in inputs if w.free])
    found = Fmu(
        name=mechanism.name,
        description=" ".join((system.description or "").split()),
        coordinates=len(mechanism.coordinates),
        states=states,
        rates=tuple(rate_unit(x.unit) for x in states),
        inputs=inputs,
        outputs=tuple(FmuQuantity(name, units.outputs[name]) for name in mechanism.outputs),
        parameters=_parameters(mechanism, begin.parameters, made),
        programs=programs,
        units={},
        ends=_ends(mechanism),
        terminal=terminal_of(mechanism, len(switches)),
        margins=tuple(-_MARGIN if value > _MARGIN else _MARGIN for value in ending),
        moments=knots_before(mechanism, math.inf),
        plain=tuple(pairs.plain),
        balls=tuple(pairs.balls),
        method=method_fields(method),
        numbers={
            "RTOL": settings.rtol,
            "ATOL_BY_RTOL": settings.atol / settings.rtol,
            "FIXED_STEP": settings.step or 0.0 if own else 0.0,
            "INDEPENDENT": mechanism.parameters.independent_rows(begin.parameters),
            "CONTRADICTION": Problem.contradiction,
            "CLOSURE": Problem.closure,
            "MOST_STEPS": Problem.max_steps,
            "MOST_EVENTS": _MOST_EVENTS,
        },
        stop_time=settings.t_end,
        tolerance=settings.rtol,
    )
    _verify_names(found)
    if isinstance(contacts, ContactCode):
        found = _with_contacts(found, contacts)
    return MadeFmu(_with_units(found), tuple(_notes(system, placed, settings, found, contacts)))


def _verify_names(fmu: Fmu) -> None:
    twice = next((name for name, count in Counter(variable_names(fmu)).items() if count > 1), None)
    if twice is not None:
        message = f"two variables of the FMU would be called {twice!r}; rename what the model calls so"
        raise InputError(message, number="M110")


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
    whole = {
        unit: {base: int(e) for base, e in x.items()}
        for unit, x in found.items()
        if all(e == int(e) for e in x.values())
    }

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
