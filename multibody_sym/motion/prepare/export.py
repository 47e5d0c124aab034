"""A system's Programs as source code, with a table of names and a self-test in a folder of its own, or as an FMU."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Unpack, cast

import numpy as np

from multibody_sym.derivation.routes import FORMALISMS, formalism_name, verify_formalism
from multibody_sym.dynamics.programs.reactions import switchings
from multibody_sym.dynamics.programs.system import programs
from multibody_sym.dynamics.start.number_checks import check_numbers
from multibody_sym.dynamics.start.state import StartState, examined_state, with_numbers_as_data
from multibody_sym.errors import InputError, OutputError, Where, at, short_repr
from multibody_sym.mechanics.changes import with_overrides
from multibody_sym.mechanics.gears import reasons
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.units import MechanismUnits
from multibody_sym.model.argument_checks import flag, names
from multibody_sym.model.argument_checks import text as text_of
from multibody_sym.model.run_options import ModelOptions, spelled_out
from multibody_sym.model.system import System
from multibody_sym.motion.function import Function, function_named
from multibody_sym.motion.methods.table import COLLOCATION
from multibody_sym.program.backend import FMU, LANGUAGES, TARGETS
from multibody_sym.program.program import Program, interpret
from multibody_sym.program.target_layout import spread_samples, template_text
from multibody_sym.program.trace import fold_input
from multibody_sym.records import dataclass
from multibody_sym.text.files import is_special, path_name, write_whole

if TYPE_CHECKING:
    from multibody_sym.motion.prepare.fmu import ContactCode

# ----------------------------------------------------------------------------------------------------------------------
# The folder of an export: its files replace those of an earlier one, never what somebody else wrote or changed.
#
# `names.json` tells under `written` what the files were when they were written, itself included.


_TABLE: Final = "names.json"
_WRITTEN: Final = "written"
_DIGITS: Final = 24


def write_export(directory: Path, texts: Mapping[str, str], table: Mapping[str, Any]) -> list[Path]:
    """Write `texts` by file name and `table` as `names.json` into a folder made if need be; return the files.

    Raises InputError, and writes nothing, where one of them is there already and is not what an export wrote;
    OutputError.
    """
    if "\0" in str(directory):
        raise InputError("no folder has such a name", where=Where(file=repr(str(directory))), number="O101")
    contents = {name: text.encode("utf-8") for name, text in texts.items()}
    earlier = _written_before(directory)
    written = {**earlier, **{name: _digest(content) for name, content in contents.items()}}
    written.pop(_TABLE, None)
    contents[_TABLE] = _with_digest(table, written)
    for name, content in contents.items():
        _verify_replaceable(directory / name, content, earlier.get(name))
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as problem:
        message = f"the folder cannot be made: {getattr(problem, 'strerror', None) or problem}"
        raise OutputError(message, where=Where(file=str(directory)), number="O101") from None
    for name, content in contents.items():
        write_whole(directory / name, content)
    return [directory / name for name in contents]


def _with_digest(table: Mapping[str, Any], written: Mapping[str, str]) -> bytes:
    """Return the table as a file that tells what was written, and what it is itself."""
    own = _digest(_print_table({**table, _WRITTEN: written}))
    return _print_table({**table, _WRITTEN: {**written, _TABLE: own}})


def _print_table(table: Mapping[str, Any]) -> bytes:
    return (json.dumps(table, indent=2) + "\n").encode("utf-8")


def _written_before(directory: Path) -> dict[str, str]:
    """Return the digests of what earlier exports wrote into the folder, that of the table being that of the file."""
    place = directory / _TABLE
    if is_special(str(place)):
        return {}
    try:
        content = place.read_bytes()
        table = json.loads(content)
        written = {str(name): str(digest) for name, digest in table.pop(_WRITTEN).items()}
        del written[_TABLE]
        if content == _with_digest(table, written):
            written[_TABLE] = _digest(content)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}
    return written


def _verify_replaceable(path: Path, content: bytes, digest: str | None) -> None:
    try:
        there = None if is_special(str(path)) else path.read_bytes()
    except (FileNotFoundError, NotADirectoryError):
        return
    except OSError:
        there = None
    if there is None or (there != content and _digest(there) != digest):
        message = "this file is not as an export wrote it here; move it away, or choose another folder"
        raise InputError(message, where=Where(file=str(path)), number="O101")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


_SAMPLES: Final = 2
_FMI: Final = (2, 3)
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*", re.ASCII)


class Exported(NamedTuple):
    """The files of an export, and `notes` on what they leave out."""

    files: list[Path]
    notes: tuple[str, ...]


@spelled_out(ModelOptions)
def export(
    system: System,
    to: str,
    directory: str | os.PathLike[str],
    *,
    fold: bool = False,
    fmi: int = 2,
    functions: Mapping[str, Function[Any]] | Sequence[str] = (),
    **options: Unpack[ModelOptions],
) -> list[Path]:
    """Write a system's Programs as source code with a self-test and `names.json`, or as an FMU; return the files.

    The code needs nothing of this package; `integrate.py` beside Python code shows a loop that integrates it.
    `simulate.c` beside C goes from state to state of contacts, stops and ropes.

    `to` is "c", "javascript", "octave", "python" or "fmu". `directory` is made if missing; for an FMU it is the file.
    `parameters` to `project` change the system for this call. `formalism` None selects the cheapest one. `fold` writes
    the values of all parameters into the code, which then reads none. `fmi` is the version of an FMU, 2 or 3.
    `functions` stand in the code, too: Functions of this system by names of one's own, or names of some such as
    mass_matrix or state_derivative_by_q_u_inputs. They take the values of `inputs` as an array, as all others do.
    Raises InputError for values that contradict the model and for files that no export wrote, ModelError for what an
    FMU cannot hold, NoSolutionError without a start, OutputError, also without a C compiler for an FMU.
    """
    system = with_overrides(system, options)
    return exported(system, to, directory, fold, fmi, functions, options.get("formalism")).files


def exported(
    system: System,
    to: str,
    directory: str | os.PathLike[str],
    fold: bool,
    fmi: int,
    functions: Mapping[str, Function[Any]] | Sequence[str],
    formalism: str | None,
) -> Exported:
    """Write what `export` does of a system; return the files with notes."""
    fold, folder = flag("fold", fold), Path(path_name(directory, "a file" if to == FMU else "a folder"))
    if text_of("to", to) not in TARGETS:
        with at("to"):
            raise InputError(f"there is no language {short_repr(to)}", number="M104", word=to, known=TARGETS)
    if fmi not in _FMI or isinstance(fmi, bool):
        with at("fmi"):
            raise InputError(f"an FMU is of FMI 2 or 3, not {short_repr(fmi)}", number="M103")
    model = ExportedModel.of(system, formalism, implicit=to == FMU and system.simulation.method in COLLOCATION)
    first = ("of the first stage only; the stages of `then` are left out",) if system.then else ()
    if to != FMU:
        begins = system.impact is not None or model.placed.closing
        left = "the motion begins with an impact, which is left out; `impact` returns the speeds after it"
        simulated: ContactCode | str | None = None
        if to == "c" and model.mechanism.one_way:
            from multibody_sym.motion.prepare.fmu import contact_code  # which other exports do without

            simulated = "the parameters are folded" if fold else contact_code(system, model.placed, model.route)
        taken = {*model.programs, *(() if simulated is None or isinstance(simulated, str) else simulated.programs)}
        others = {name: each.program for name, each in _functions_of(system, functions, taken).items()}
        found = _sources(model.with_others(others), to, folder, fold, simulated)
        return found._replace(notes=(*first, *((left,) if begins else ()), *found.notes))
    for name, given in (("fold", fold), ("functions", functions)):
        if given:
            with at(name):
                raise InputError(f"an FMU has parameters and no other functions: leave out {name}", number="M110")
    from multibody_sym.motion.prepare.fmu import (
        contact_code,  # which other exports do without
        fmu_of,
        free_inputs,
        write_fmu,
    )

    contacts: ContactCode | str | None = None
    if model.mechanism.one_way:
        contacts = contact_code(system, model.placed, model.route, free=len(free_inputs(model.mechanism)))
    made_fmu = fmu_of(system, model.placed, model.programs, contacts)
    return Exported([write_fmu(made_fmu.fmu, folder, cast(Any, fmi))], (*first, *made_fmu.notes))


@dataclass(frozen=True, eq=False)
class ExportedModel:
    """A system as it leaves: the state at its start, its Programs by a formalism (`route`).

    Their self-test has `samples`, of others such as are computed from the start and at random.
    """

    placed: StartState
    programs: Mapping[str, Program]
    route: str
    samples: Mapping[str, list[Any]] = field(default_factory=dict)

    @classmethod
    def of(cls, system: System, formalism: str | None, *, implicit: bool = False) -> ExportedModel:
        """Return the model of a system; `implicit`: with what implicit methods take. Raises what `export` does."""
        verify_formalism(formalism)
        placed = with_numbers_as_data(examined_state(system))
        route = formalism_name(formalism, placed.mechanism)
        made = programs(placed.mechanism, FORMALISMS[route], "implicit" if implicit else "explicit").exported()
        return cls(placed, made, route)

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism in the state at the start."""
        return self.placed.mechanism

    @property
    def _state(self) -> tuple[Any, ...]:
        begin = self.placed.start
        return 0.0, begin.q, begin.u, begin.parameters

    def with_others(
        self, programs: Mapping[str, Program], samples: Mapping[str, list[Any]] = MappingProxyType({})
    ) -> ExportedModel:
        """Return it with further Programs, some of which have samples."""
        return replace(self, programs={**self.programs, **programs}, samples={**self.samples, **samples})

    def texts(self, language: str, *, fold: bool = False) -> Mapping[str, str]:
        """Return the source files by their names; `fold` writes the values of parameters into them."""
        made, state, parameters = dict(self.programs), self._state, self.placed.start.parameters
        values = (*state, interpret(made["inputs"], *state)[0], np.empty(0))
        own = {name: parameters[: program.input("parameters").size] for name, program in made.items()}
        unknown = {name: program for name, program in made.items() if name not in self.samples}
        samples = dict(spread_samples(unknown, _SAMPLES))
        for name, spread in samples.items():
            first = [*values[:3], own[name], *values[4:], *spread[0][len(values) :]]
            samples[name] = [first[: len(made[name].inputs)], *spread]
        samples |= self.samples
        if fold:
            made = {key: fold_input(program, "parameters", own[key]) for key, program in made.items()}
            samples = {key: [(*s[:3], own[key], *s[4:]) for s in listed] for key, listed in samples.items()}
        return LANGUAGES[language].files(made, {name: samples[name] for name in made})

    @property
    def notes(self) -> tuple[str, ...]:
        """What holds of the state at the start only."""
        if not self.mechanism.one_way:
            return ()
        words = ", ".join(f"{name}: {word}" for name, word in self.placed.words.items())
        end = "it ends where the last values of `events` become positive"
        return (f"of the state at the start only, {{{words}}}; {end}",)

    @property
    def table(self) -> dict[str, Any]:
        """What the entries of all arrays stand for, with the values at the start."""
        resolved = self.mechanism
        ends = [f"{one.part.name if one.part else one.element.name} {one.told}" for one in switchings(resolved)]
        mode = {"mode": self.placed.words, "mode_ends": ends} if resolved.one_way else {}
        signatures = {
            name: {
                "inputs": {array.name: array.shape for array in program.inputs},
                "outputs": {output.name: output.shape for output in program.outputs},
            }
            for name, program in self.programs.items()
        }
        names = _names(resolved, self._state)
        return {"formalism": self.route, "folded": False, **mode, **names, "programs": signatures}


def _functions_of(
    system: System, functions: Mapping[str, Function[Any]] | Sequence[str], taken: Collection[str]
) -> Mapping[str, Function[Any]]:
    """Return the functions that a caller asks for, by name. Raises InputError for those of other systems."""
    if not isinstance(functions, Mapping):
        mode: Any = "found" if check_numbers(system).one_way else None
        functions = {name: function_named(system, name, mode=mode) for name in names("functions", functions)}
    with at("functions"):
        for name, function in functions.items():
            if not isinstance(function, Function) or function.system != system:
                raise InputError(f"{short_repr(name)} is no Function of this system: mbs.function(system, ..)")
            if not isinstance(name, str) or not _NAME.fullmatch(name) or name in taken:
                rule = f"its name has letters, digits and _, and is none of {', '.join(sorted(taken))}"
                raise InputError(f"{short_repr(name)} cannot name another function: {rule}")
    return functions


def _sources(
    model: ExportedModel, to: str, folder: Path, fold: bool, simulated: ContactCode | str | None
) -> Exported:
    """Write source code into a folder."""
    notes, files = list(model.notes), dict[str, str]()
    if isinstance(simulated, str):
        notes.append(f"without simulate.c, which goes from state to state: {simulated}")
    elif simulated is not None:
        files = {**simulated.files, "simulate.c": template_text("c/simulate.c")}
        model = model.with_others(
            simulated.programs, {name: [list(sample)] for name, sample in simulated.samples.items()}
        )
        notes.append("simulate.c goes from state to state; its head says how it is compiled")
    texts = {**model.texts(to, fold=fold), **files}
    return Exported(write_export(folder, texts, {**model.table, "folded": fold}), tuple(notes))


def _names(resolved: Mechanism, state: tuple[Any, ...]) -> dict[str, Any]:
    """Return what the entries of the arrays stand for, with the values at the start."""
    _, q, u, parameters = state
    told = MechanismUnits(resolved)
    return {
        "system": resolved.name,
        "coordinates": [
            {"name": c.name, "unit": c.unit, "initial": x} for c, x in zip(resolved.coordinates, q, strict=True)
        ],
        "speeds": [{"name": s.name, "unit": s.unit, "initial": x} for s, x in zip(resolved.speeds, u, strict=True)],
        "parameters": [
            {"name": p.name, "unit": told.parameters[p.name], "value": x}
            for p, x in zip(resolved.parameters, parameters, strict=True)
        ],
        "inputs": list(resolved.inputs),
        "driving_inputs": list(resolved.driving_inputs),
        "outputs": list(resolved.outputs),
        "withheld_outputs": list(resolved.untold),
        "withheld_reasons": reasons(resolved.withheld),
        "constraints": [row.name for row in resolved.rows],
        "units": {"inputs": told.inputs, "outputs": told.outputs, "constraints": told.multipliers},
    }
