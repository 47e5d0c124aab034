"""What is asked of a system at a state: the function by its name and options, its mechanism in a mode, its units.

In: a System, a name or expressions, options. Out: a FunctionQuestion with its Program; errors for wrong options.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import cached_property
from typing import Any, Final, cast, get_args

import numpy as np

from multibody_sym.derivation.routes import FORMALISMS, formalism_name
from multibody_sym.dynamics.contact.impact_problem import rows_in_words
from multibody_sym.dynamics.contact.impact_programs import StruckMode, impact_program, mode_found, verify_mode
from multibody_sym.dynamics.formalisms.equations import massless_speeds
from multibody_sym.dynamics.programs.state_functions import (
    IMPACT,
    OPTIONS,
    STATE_FUNCTIONS,
    Axes,
    FunctionOptions,
    Name,
    outputs_of_function,
    verify_drives,
    with_inputs_of_momenta,
)
from multibody_sym.dynamics.programs.system import inputs_program
from multibody_sym.dynamics.start.declared_impact import PosedImpact, outcome, posed_impact
from multibody_sym.dynamics.start.number_checks import check_numbers, numbers_of
from multibody_sym.dynamics.start.parameters import parameter_values
from multibody_sym.dynamics.start.start import Start
from multibody_sym.dynamics.start.state import given_mode, state_at, with_numbers_as_data
from multibody_sym.errors import ArgumentError, InputError, ModelError, Where, short_repr
from multibody_sym.mechanics.law_elements import LawElement
from multibody_sym.mechanics.mechanism import ALPHA, BETA, Mechanism, Source
from multibody_sym.mechanics.modes import mode_words
from multibody_sym.mechanics.motion import state_of
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.system import System
from multibody_sym.motion.prepare.settings import run_settings
from multibody_sym.program.program import Program, interpret
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.node import symbol
from multibody_sym.text.units import rate_unit

_BY_FORCES: Final = frozenset(
    [
        "state_derivative",
        "canonical_equations",
        "inverse_dynamics",
        "hybrid_dynamics",
        "constraints",
        "reactions",
        "outputs",
    ]
)
"""Functions that depend on what acts in contacts, stops and the like."""
_OF_ACCELERATIONS: Final = frozenset(["inverse_dynamics", "hybrid_dynamics"])
"""Functions of given accelerations, in which a freedom may be massless."""
_OF_MOMENTA: Final = frozenset(["canonical_equations", "hamiltonian"])
"""Functions of momenta in place of speeds."""
_EXPRESSION: Final = "expression"


def verify_options(what: object, chosen: Mapping[str, Any]) -> None:
    if isinstance(what, str) and what not in get_args(Name):
        raise InputError(f"there is no function {what!r}", number="M106", word=what, known=get_args(Name))
    texts = isinstance(what, (list, tuple)) and what and all(isinstance(x, str) for x in what)
    if not isinstance(what, str) and not texts:
        raise ArgumentError(f"what is a name or a list of expressions, not {short_repr(what)}")
    if not isinstance(chosen["axes"], str) or chosen["axes"] not in get_args(Axes):
        known = ", ".join(get_args(Axes))
        raise InputError(f"there are no axes {short_repr(chosen['axes'])}; known: {known}")
    if chosen["frame"] is not None and not isinstance(chosen["frame"], str):
        raise ArgumentError(f"frame is a name, not {short_repr(chosen['frame'])}")
    mode = chosen["mode"]
    words = isinstance(mode, Mapping) and all(isinstance(x, str) for pair in mode.items() for x in pair)
    if not (mode is None or words or (isinstance(mode, str) and mode == "found")):
        raise ArgumentError(f'mode is "found" or a map from names to words, not {short_repr(mode)}')
    has = OPTIONS.get(what, ()) if isinstance(what, str) else ("mode",)
    usual = {"mode": None, **{option.name: option.default for option in fields(FunctionOptions)}}
    for name, value in chosen.items():
        if value != usual[name] and name not in has:
            raise InputError(f"{what if isinstance(what, str) else 'an expression'} has no option {name}")


@dataclass(frozen=True, eq=False)
class FunctionQuestion:
    """What is asked of a system."""

    system: System
    what: str | tuple[str, ...]
    formalism: str | None
    options: Mapping[str, Any]

    @cached_property
    def _numbers(self) -> tuple[Mechanism, Floats, Start | None]:
        """The mechanism in its mode, its parameters, and its start where the function needs one."""
        if self.what == IMPACT:
            return self._impact.blow.mechanism, np.array(self._impact.begin.parameters, dtype=float), None
        mechanism, parameters, begin = self._resolved()
        if self.name in _OF_MOMENTA:
            mechanism = with_inputs_of_momenta(mechanism)
        return mechanism, parameters, begin

    def _resolved(self) -> tuple[Mechanism, Floats, Start | None]:
        system = self.system
        if not isinstance(self.what, str):
            with self._expression_errors():
                asked = {f"{_EXPRESSION} {k}": cast(Any, text) for k, text in enumerate(self.what, 1)}
                system = replace(system, outputs=asked)
        with self._expression_errors(), numbers_of(system):
            declared = check_numbers(system)
            mode, by_forces = self.options["mode"], self.name in _BY_FORCES
            if by_forces and declared.one_way and mode is None:
                raise _without_mode(self.name, declared.one_way)
            measured = any(entry.source is Source.MEASURED for entry in declared.parameters)
            massless = self.name not in _OF_ACCELERATIONS and massless_speeds(declared)
            if not measured and not (by_forces and (declared.rows or massless or declared.one_way)):
                return declared, np.array(parameter_values(declared, {})), None
            state = with_numbers_as_data(state_at(declared, project=system.simulation.project))
            if isinstance(mode, Mapping):
                state = replace(state, modes=(given_mode(state.declared, state.begin, mode),))
            if not by_forces:
                return state.declared, np.array(state.begin.parameters, dtype=float), state.begin
            entries = zip(state.mechanism.parameters, state.start.parameters, strict=True)
            known = {symbol(entry.name): x for entry, x in entries if entry.source is not Source.LITERAL}
            values, stated = list(state.start.parameters), run_settings(system.simulation, known).baumgarte
            if stated is not None:
                coefficients = {ALPHA: stated.alpha or 0.0, BETA: stated.beta or 0.0}
                values = state.mechanism.parameters.changed(values, coefficients)
            return state.mechanism, np.array(values, dtype=float), state.start

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

    @cached_property
    def _impact(self) -> PosedImpact:
        with numbers_of(self.system):
            return posed_impact(self.system)

    @cached_property
    def _struck(self) -> StruckMode:
        """The mode of an impact: as its laws have it at the start, or in words."""
        blow, law, mode = self._impact.blow, self._impact.law, self.options["mode"]
        if isinstance(mode, Mapping):
            return StruckMode(blow, rows_in_words(blow, mode), law)
        struck = outcome(self._impact)
        found = mode_found(blow, struck, law)
        if mode is None and not found.is_only_one:
            raise _without_mode(self.name, (*blow.elements, *blow.rough))
        begin, inputs = self._impact.begin, inputs_program(blow.mechanism)
        state = 0.0, begin.q, begin.u, begin.parameters
        after = interpret(impact_program(found), *state, *interpret(inputs, *state), [])[0]
        verify_mode(found, after, struck)
        return found

    @property
    def mode(self) -> dict[str, str]:
        """The states of contacts, stops, ropes and friction, in words by name."""
        if self.what == IMPACT:
            return self._struck.words
        mechanism = self.mechanism
        return {} if mechanism.mode is None else mode_words(mechanism.one_way, mechanism.mode)

    @property
    def rows(self) -> tuple[str, ...]:
        """The names of the rows that have multipliers, or impulses."""
        return self._struck.told if self.what == IMPACT else tuple(row.name for row in self.mechanism.rows)

    @property
    def conditions(self) -> tuple[str, ...]:
        """What holds in words where the mode of an impact does."""
        return tuple(words for _, words in self._struck.needed) if self.what == IMPACT else ()

    @property
    def takes_momenta(self) -> bool:
        """Whether it is a function of momenta in place of speeds."""
        return self.name in _OF_MOMENTA

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
        if self.what == IMPACT:
            return impact_program(self._struck)
        formalism = FORMALISMS[formalism_name(self.formalism, self.mechanism)]
        options = FunctionOptions(formalism, **{name: x for name, x in self.options.items() if name != "mode"})
        for name in options.given:
            if name not in self.system.joints:
                raise InputError(f"there is no joint {name!r}", number="M106", word=name, known=self.system.joints)
            if not any(body.joint_name == name and body.u for body in self.mechanism.bodies):
                raise InputError(f"joint {name!r} has no speed whose rate could be given")
        if not isinstance(self.what, str):
            with self._expression_errors():
                return outputs_of_function(self.mechanism, options, together=True)
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
            "after": tuple(speeds),
            "joints": ((*("N*s",) * 3, *("N*m*s",) * 3),) * len(self.mechanism.joint_names),
            "p": tuple("kg*m^2/s" if turn else "kg*m/s" for turn in turns),
            **dict.fromkeys(("forces", "pdot", "bias", "gravity"), tuple("N*m" if turn else "N" for turn in turns)),
            "mass_matrix": tuple(tuple(("kg", "kg*m", "kg*m^2")[a + b] for a in turns) for b in turns),
            **dict.fromkeys(("kinetic", "potential", "H"), "J"),
            "linear": ("kg*m/s",) * 3,
            "angular": ("kg*m^2/s",) * 3,
            "momentum": (*("kg*m/s",) * 3, *("kg*m^2/s",) * 3),
            "position": ("m",) * 3,
            "centre_of_mass": ("m",) * 3,
            "velocity": (*("m/s",) * 3, *("rad/s",) * 3),
            **dict.fromkeys(("drift", "acceleration"), (*("m/s^2",) * 3, *("rad/s^2",) * 3)),
        }
        return found.get(output)


def _without_mode(name: str, elements: Sequence[LawElement]) -> ModelError:
    """Return the error that elements may hold or let go, and the function has no mode."""
    names = ", ".join(element.name for element in elements[:3])
    advice = "leave them out"
    if name != "hybrid_dynamics":
        advice = f'say mode="found" for that of the start, mode={{"{elements[0].name}": ..}}, or {advice}'
    message = f"{names} may hold or let go, and a function of forces has one state of them; {advice}"
    return ModelError(message, number="M110")
