"""An FMU of FMI 2.0 or 3.0: a model's description in XML, the C that makes its Programs one, and a zip of all.

In: a `Fmu`, numbers and names alone. Out: the files of the archive by name, or its bytes. The same model gives the same
bytes. `templates/c/fmu.c` is what both versions of the interface share.

Source: Modelica Association, Functional Mock-up Interface 2.0.5 and 3.0.2, https://fmi-standard.org.
"""

from __future__ import annotations

import hashlib
import io
import platform
import re
import sys
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Final, Literal

import numpy as np

from multibody_sym.program.c_target import c_source
from multibody_sym.program.program import Program, elements_read
from multibody_sym.program.target_layout import (
    c_array,
    c_number,
    c_string,
    c_structure,
    parts_of,
    runtime_sources,
    template_text,
)
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import Node

Fmi = Literal[2, 3]
ParameterKind = Literal["tunable", "fixed", "follows", "hidden"]
"""May be set at any event, or until the end of the initialization; follows from others; is no variable of the FMU."""

# ----------------------------------------------------------------------------------------------------------------------
# What an FMU has.


@dataclass(frozen=True)
class FmuQuantity:
    """A named number with its SI unit, empty where it has none, and its value at the start."""

    name: str
    unit: str = ""
    start: float = 0.0


@dataclass(frozen=True)
class FmuParameter(FmuQuantity):
    """An entry of the parameter vector."""

    kind: ParameterKind = "tunable"
    positive: bool = False


@dataclass(frozen=True)
class FmuInput(FmuQuantity):
    """An input: `free` ones come from outside, the others are computed in the FMU."""

    free: bool = False


@dataclass(frozen=True)
class Fmu:
    """A model, its Programs and what a run of it takes.

    `states` are (q, u), `rates` the units of their derivatives. `programs` are those of an exported model, and
    `parameters` (values of all), and perhaps `rate_slopes` and `output_slopes`: rows by states and free inputs.
    `ends` says for each switching function what happens there; `method` has the fields of `mbs_method`, `numbers` the
    other settings by their names in C. `units` gives each unit by exponents of base units. `contacts` are files that go
    from state to state of contacts, by Programs `contacts_..`; -1 among their parameters is none of the FMU.
    """

    name: str
    description: str
    coordinates: int
    states: tuple[FmuQuantity, ...]
    rates: tuple[str, ...]
    inputs: tuple[FmuInput, ...]
    outputs: tuple[FmuQuantity, ...]
    parameters: tuple[FmuParameter, ...]
    programs: Mapping[str, Program]
    units: Mapping[str, Mapping[str, int]]
    ends: tuple[str, ...]
    terminal: tuple[bool, ...]
    margins: tuple[float, ...]
    moments: tuple[float, ...]
    plain: tuple[tuple[int, int], ...]
    balls: tuple[tuple[int, int], ...]
    method: Mapping[str, Any]
    numbers: Mapping[str, float | int]
    stop_time: float
    tolerance: float
    token: str = ""
    contacts: Mapping[str, str] = field(default_factory=dict)
    contact_parameters: tuple[int, ...] = ()

    @property
    def identifier(self) -> str:
        """The name as an identifier of C, which also names the binary."""
        plain = re.sub(r"[^A-Za-z0-9_]", "_", self.name)[:60]
        return plain if plain[:1].isalpha() else f"model_{plain}"

    @property
    def of_contacts(self) -> str:
        """What the names of its Programs begin with."""
        return "contacts_" if self.contacts else ""

    def program(self, name: str) -> Program:
        """Return one of its Programs, in any state of contacts where it goes from state to state."""
        return self.programs[f"{self.of_contacts}{name}"]

    @property
    def has_slopes(self) -> bool:
        return "rate_slopes" in self.programs


# ----------------------------------------------------------------------------------------------------------------------
# Its variables, in the order of both descriptions; value references as in templates/c/fmu.h.


@dataclass(frozen=True)
class _Variable:
    reference: int
    name: str
    causality: str
    variability: str
    unit: str = ""
    initial: str | None = None
    start: float | None = None
    derivative_of: int | None = None
    """The value reference of the state whose rate this is."""
    least: float | None = None


def _variables(fmu: Fmu) -> Iterator[_Variable]:
    nx, rates = len(fmu.states), 1 + len(fmu.states)
    inputs = rates + nx
    outputs = inputs + len(fmu.inputs)
    parameters = outputs + len(fmu.outputs)
    yield _Variable(0, "time", "independent", "continuous", "s")
    for k, x in enumerate(fmu.states, 1):
        yield _Variable(k, x.name, "output", "continuous", x.unit, "exact", x.start)
    for k, (x, unit) in enumerate(zip(fmu.states, fmu.rates, strict=True)):
        name = f"der({x.name})"
        yield _Variable(rates + k, name, "local", "continuous", unit, "calculated", derivative_of=1 + k)
    for k, w in enumerate(fmu.inputs, inputs):
        if w.free:
            yield _Variable(k, w.name, "input", "continuous", w.unit, start=w.start)
        else:
            yield _Variable(k, w.name, "local", "continuous", w.unit, "calculated")
    for k, y in enumerate(fmu.outputs, outputs):
        yield _Variable(k, y.name, "output", "continuous", y.unit, "calculated")
    for k, p in enumerate(fmu.parameters, parameters):
        if p.kind == "follows":
            yield _Variable(k, p.name, "calculatedParameter", "tunable", p.unit, "calculated")
        elif p.kind != "hidden":
            least = 0.0 if p.positive else None
            yield _Variable(k, p.name, "parameter", p.kind, p.unit, "exact", p.start, least=least)


def variable_names(fmu: Fmu) -> list[str]:
    """Return the names of all variables of a model, of which each may be there once."""
    return [variable.name for variable in _variables(fmu)]


def _dependencies(fmu: Fmu) -> dict[int, list[int]]:
    """Return by value reference the states and inputs from outside that states, rates and outputs depend on."""
    first = {"q": 1, "u": 1 + fmu.coordinates}
    inputs = 1 + 2 * len(fmu.states)
    declared = elements_read(fmu.program("inputs"))["inputs"]

    def on(slots: Iterable[Node]) -> list[int]:
        found = set()
        for slot in slots:
            name, place = slot.data
            if name in first:
                found.add(first[name] + place)
            elif name == "inputs" and fmu.inputs[place].free:
                found.add(inputs + place)
            elif name == "inputs":
                found.update(on(declared[place]))
        return sorted(found)

    rates, outputs = (elements_read(fmu.program(name)) for name in ("state_derivative", "outputs"))
    return {
        **{k: [k] for k in range(1, 1 + len(fmu.states))},
        **{1 + len(fmu.states) + k: on(read) for k, read in enumerate((*rates["qdot"], *rates["udot"]))},
        **{inputs + len(fmu.inputs) + k: on(read) for k, read in enumerate(outputs["values"])},
    }


# ----------------------------------------------------------------------------------------------------------------------
# modelDescription.xml.

_TOLD: Final = (("logStatusError", "Errors"), ("logEvents", "Events of contacts, and what ends the motion"))
_DISPLAYED: Final = {"rad": "deg", "rad/s": "deg/s"}


def _xml(root: ET.Element) -> bytes:
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


def _given(**attributes: Any) -> dict[str, str]:
    """Return attributes as text, without those that are None."""
    return {name: str(x).lower() if isinstance(x, bool) else str(x) for name, x in attributes.items() if x is not None}


def _printable(text: str) -> str:
    """Return a text without the characters that XML cannot hold."""
    return re.sub(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "?", text)


def description(fmu: Fmu, fmi: Fmi) -> bytes:
    """Return modelDescription.xml."""
    two, state = fmi == 2, "state" if fmi == 2 else "State"
    root = ET.Element("fmiModelDescription", {"fmiVersion": f"{fmi}.0", "modelName": _printable(fmu.name)})
    root.set("guid" if two else "instantiationToken", fmu.token)
    if fmu.description:
        root.set("description", _printable(fmu.description))
    root.attrib |= {"generationTool": "multibody_sym", "variableNamingConvention": "flat"}
    if two:
        root.set("numberOfEventIndicators", str(len(fmu.terminal)))
    for kind in ("ModelExchange", "CoSimulation"):
        element = ET.SubElement(root, kind, {"modelIdentifier": fmu.identifier})
        element.attrib |= {f"canGetAndSetFMU{state}": "true", f"canSerializeFMU{state}": "true"}
        slopes = "Directional", "Adjoint"
        names = ["providesDirectionalDerivative"] if two else [f"provides{kind}Derivatives" for kind in slopes]
        element.attrib |= _given(**dict.fromkeys(names, fmu.has_slopes))
        if kind == "CoSimulation":
            element.set("canHandleVariableCommunicationStepSize", "true")
        if two:
            element.set("canNotUseMemoryManagementFunctions", "true")
            files = ET.SubElement(element, "SourceFiles")
            for name in c_files(fmu, fmi):
                ET.SubElement(files, "File", {"name": name})
    _describe_units(root, fmu)
    categories = ET.SubElement(root, "LogCategories")
    for name, meaning in _TOLD:
        ET.SubElement(categories, "Category", {"name": name, "description": meaning})
    ET.SubElement(root, "DefaultExperiment", _given(startTime=0.0, stopTime=fmu.stop_time, tolerance=fmu.tolerance))
    variables = [*_variables(fmu), *([] if two else _indicators(fmu))]
    _describe_variables(root, fmi, variables, _dependencies(fmu))
    return _xml(root)


def _describe_units(root: ET.Element, fmu: Fmu) -> None:
    used = dict.fromkeys(variable.unit for variable in _variables(fmu) if variable.unit)
    listed = ET.SubElement(root, "UnitDefinitions")
    for name in used:
        unit = ET.SubElement(listed, "Unit", {"name": name})
        ET.SubElement(unit, "BaseUnit", _given(**{base: e for base, e in fmu.units[name].items() if e}))
        if name in _DISPLAYED:
            ET.SubElement(unit, "DisplayUnit", {"name": _DISPLAYED[name], "factor": repr(float(np.degrees(1.0)))})


def _indicators(fmu: Fmu) -> list[_Variable]:
    """Return the event indicators, which are variables in FMI 3.0."""
    first = 1 + 2 * len(fmu.states) + len(fmu.inputs) + len(fmu.outputs) + len(fmu.parameters)
    return [
        _Variable(first + k, f"event_indicator[{k + 1}]", "local", "continuous", initial="calculated")
        for k in range(len(fmu.terminal))
    ]


_STRUCTURES: Final[dict[Fmi, tuple[str, ...]]] = {
    2: ("Outputs", "Derivatives", "InitialUnknowns"),
    3: ("Output", "ContinuousStateDerivative", "InitialUnknown", "EventIndicator"),
}


def _describe_variables(
    root: ET.Element, fmi: Fmi, variables: Sequence[_Variable], dependencies: Mapping[int, list[int]]
) -> None:
    """Describe variables, and what depends on what: by their places in FMI 2.0, by value references in FMI 3.0."""
    two = fmi == 2
    places = {v.reference: k if two else v.reference for k, v in enumerate(variables, 1)}
    listed, structure = (ET.SubElement(root, name) for name in ("ModelVariables", "ModelStructure"))
    for v in variables:
        told = _given(name=v.name, valueReference=v.reference, causality=v.causality, variability=v.variability)
        told |= _given(initial=v.initial)
        derivative = None if v.derivative_of is None else places[v.derivative_of]
        values = _given(unit=v.unit or None, min=v.least, start=v.start, derivative=derivative)
        if two:
            ET.SubElement(ET.SubElement(listed, "ScalarVariable", told), "Real", values)
        else:
            ET.SubElement(listed, "Float64", told | values)
    unknowns: tuple[tuple[list[_Variable], Mapping[int, list[int]]], ...] = (
        ([v for v in variables if v.causality == "output"], dependencies),
        ([v for v in variables if v.derivative_of is not None], dependencies),
        ([v for v in variables if _initially_unknown(v)], {}),
        ([v for v in variables if v.name.startswith("event_indicator[")], {}),
    )
    for kind, (chosen, known) in zip(_STRUCTURES[fmi], unknowns, strict=False):
        of_kind = ET.SubElement(structure, kind) if two and chosen else structure
        for v in chosen:
            on = known.get(v.reference)
            on_places = None if on is None else " ".join(str(places[k]) for k in on)
            place = {"index" if two else "valueReference": places[v.reference]}
            ET.SubElement(of_kind, "Unknown" if two else kind, _given(**place, dependencies=on_places))


def _initially_unknown(variable: _Variable) -> bool:
    computed = variable.causality in ("output", "calculatedParameter") or variable.derivative_of is not None
    return computed and variable.initial == "calculated"


# ----------------------------------------------------------------------------------------------------------------------
# The C sources.

_MODEL_HEADER: Final = "fmu_model.h"
_PROGRAMS: Final = {
    "INPUTS": "inputs",
    "DERIVATIVE": "state_derivative",
    "JACOBIAN": "jacobian",
    "OUTPUTS": "outputs",
    "EVENTS": "events",
    "NORMALIZE": "normalize",
    "POSITION": "project_position",
    "VELOCITY": "project_velocity",
    "PARAMETERS": "parameters",
    "RATE_SLOPES": "rate_slopes",
    "OUTPUT_SLOPES": "output_slopes",
    "MISSED": "missed",
    "PUT_BACK": "put_back",
}
_KINDS: Final = ("hidden", "follows", "fixed", "tunable")


def c_files(fmu: Fmu, fmi: Fmi) -> list[str]:
    """Return the names of the sources that are compiled."""
    contacts = [name for name in fmu.contacts if name.endswith(".c")]
    return ["model.c", "fmu.c", f"fmi{fmi}.c", *contacts, *runtime_sources(_parts(fmu))]


def c_texts(fmu: Fmu, fmi: Fmi) -> dict[str, str]:
    """Return the sources and headers by file name."""
    texts = c_source(fmu.programs, parts=_parts(fmu))
    own = {name: template_text(f"c/{name}") for name in ("fmu.h", "fmu.c", f"fmi{fmi}.c")}
    return {**texts, **own, **fmu.contacts, _MODEL_HEADER: _model_header(fmu, fmi)}


def _parts(fmu: Fmu) -> frozenset[str]:
    """Return the parts of the runtime that its Programs enter."""
    programs = {name.removeprefix(fmu.of_contacts): program for name, program in fmu.programs.items()}
    return parts_of(programs, multistep=False) - {"laws"}


def _model_header(fmu: Fmu, fmi: Fmi) -> str:
    free = [k for k, w in enumerate(fmu.inputs) if w.free]
    sizes = {
        "FMI": fmi, "NX": len(fmu.states), "NQ": fmu.coordinates, "NW": len(fmu.inputs), "FREE": len(free),
        "NO": len(fmu.outputs), "NP": len(fmu.parameters), "NG": len(fmu.terminal), "SWITCHES": len(fmu.margins),
        "NS": len(fmu.program("state_derivative").output("multipliers").values),
        "MOMENTS": len(fmu.moments), "PLAINS": len(fmu.plain), "BALLS": len(fmu.balls),
        "HAS_SLOPES": int(fmu.has_slopes), "CONTACTS": int(bool(fmu.contacts)),
        **{kind.upper(): k for k, kind in enumerate(_KINDS)},
    }  # fmt: skip
    order = list(fmu.programs)
    for key, name in _PROGRAMS.items():
        own = f"{fmu.of_contacts}{name}"
        sizes[f"{key}_PROGRAM"] = order.index(own if own in order else name) if {own, name} & {*order} else -1
    defined = [f"#define MBS_FMU_TOKEN {c_string(fmu.token)}"]
    defined += [f"#define MBS_FMU_{name} {c_number(x)}" for name, x in (sizes | {**fmu.numbers}).items()]
    starts = [x.start for x in fmu.states]
    values = [*(p.start for p in fmu.parameters), *(w.start for w in fmu.inputs if w.free)]
    kinds = [_KINDS.index(p.kind) for p in fmu.parameters]
    arrays = [
        _array("double", "start", starts), _array("double", "values", values),
        _array("int", "parameter_kinds", kinds), _array("int", "positive", [int(p.positive) for p in fmu.parameters]),
        _array("int", "contact_parameters", fmu.contact_parameters),
        _array("int", "free_inputs", free), _array("int", "terminal", [int(x) for x in fmu.terminal]),
        _array("double", "margins", fmu.margins), _array("double", "moments", fmu.moments),
        _array("int", "plain", [k for pair in fmu.plain for k in pair]),
        _array("int", "ball", [k for pair in fmu.balls for k in pair]),
        _array("char *const", "states", [x.name for x in fmu.states]),
        _array("char *const", "parameters", [p.name for p in fmu.parameters]),
        _array("char *const", "ends", fmu.ends),
    ]  # fmt: skip
    head = f"/* {_MODEL_HEADER}: sizes, names and numbers of the model, written by multibody_sym. */"
    method = c_structure("mbs_method", "mbs_fmu_method", fmu.method)
    return "\n".join([head, "#pragma once", '#include "runtime.h"', "", *defined, "", *arrays, *method, ""])


def _array(kind: str, name: str, values: Iterable[float | int | str]) -> str:
    return c_array(kind, f"mbs_fmu_{name}", values)


# ----------------------------------------------------------------------------------------------------------------------
# The archive.

_DATE: Final = (1980, 1, 1, 0, 0, 0)
_DIGITS: Final = 32
_SYSTEMS: Final = {"linux": ("linux", "so"), "darwin": ("darwin", "dylib"), "win32": ("windows", "dll")}
_MACHINES: Final = {"amd64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
_PLATFORMS_2: Final = {
    "x86_64-linux": "linux64", "x86-linux": "linux32", "x86_64-windows": "win64", "x86-windows": "win32",
    "x86_64-darwin": "darwin64", "aarch64-darwin": "darwin64",
}  # fmt: skip


def with_token(fmu: Fmu, fmi: Fmi) -> Fmu:
    """Return a model with its token, a hash of its description and sources: instances of another one are refused."""
    parts = [description(fmu, fmi), *(text.encode() for text in c_texts(fmu, fmi).values())]
    return replace(fmu, token="{" + hashlib.sha256(b"\0".join(parts)).hexdigest()[:_DIGITS] + "}")


def archive_files(fmu: Fmu, fmi: Fmi, binary: bytes) -> dict[str, bytes]:
    """Return the files of the archive by name, for a model with its token and its compiled library."""
    files = {"modelDescription.xml": description(fmu, fmi)}
    files[binary_name(fmu, fmi)] = binary
    files |= {f"sources/{name}": text.encode() for name, text in c_texts(fmu, fmi).items()}
    if fmi == 3:
        root = ET.Element("fmiBuildDescription", {"fmiVersion": "3.0"})
        configuration = ET.SubElement(root, "BuildConfiguration", {"modelIdentifier": fmu.identifier})
        sources = ET.SubElement(configuration, "SourceFileSet", {"language": "C99"})
        for name in c_files(fmu, fmi):
            ET.SubElement(sources, "SourceFile", {"name": name})
        files["sources/buildDescription.xml"] = _xml(root)
    return files


def binary_name(fmu: Fmu, fmi: Fmi) -> str:
    """Return the place in the archive of a library for this machine."""
    system, ending = _SYSTEMS.get(sys.platform, (sys.platform, "so"))
    machine = platform.machine().lower()
    place = f"{_MACHINES.get(machine, machine)}-{system}"
    return f"binaries/{_PLATFORMS_2.get(place, place) if fmi == 2 else place}/{fmu.identifier}.{ending}"


def packed(files: Mapping[str, bytes]) -> bytes:
    """Return an archive of files, in their order; its comment is a hash of it, by which `is_packed` knows it."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name, _DATE)
            info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(info, content)
        archive.comment = b"0" * _DIGITS
    body = buffer.getvalue()[:-_DIGITS]
    return body + _digest(body)


def is_packed(content: bytes) -> bool:
    """Return whether `packed` made an archive, and nobody has changed it since."""
    return content[-_DIGITS:] == _digest(content[:-_DIGITS])


def _digest(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest()[:_DIGITS].encode()
