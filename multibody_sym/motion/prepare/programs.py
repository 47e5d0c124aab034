"""Programs of a mechanism, compiled: recalled from the cache by its structure, or derived once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass, replace
from enum import Enum
from functools import partial
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.mechanics.law_elements import Mode
from multibody_sym.mechanics.mechanism import Coordinate, JointLimit, Mechanism, ParameterEntry, Speed
from multibody_sym.program import loading
from multibody_sym.program.backend import PORTABLE, Native
from multibody_sym.program.cache import digest
from multibody_sym.program.loading import Compiled
from multibody_sym.scalars.node import Node, without_collection
from multibody_sym.stages import stage

if TYPE_CHECKING:
    from multibody_sym.program.programs import Form

_NUMBERS: Final[Mapping[type, frozenset[str]]] = {
    Mechanism: frozenset({"name"}),
    ParameterEntry: frozenset({"value", "dimension"}),
    Coordinate: frozenset({"initial", "given", "known"}),
    Speed: frozenset({"initial", "given", "known"}),
    JointLimit: frozenset({"lower", "upper", "velocity"}),
    Mode: frozenset({"directions", "shares"}),
}
"""What no Program follows from: a title, what is handed over as numbers and its unit, what is looked at after a run."""


def compile_mechanism(
    mechanism: Mechanism,
    formalism: str,
    form: Form = "explicit",
    code: Native = PORTABLE,
) -> Compiled:
    """Return a mechanism's Programs by a formalism, ready to be called, with those that a method needs for its `form`.

    What was derived for a mechanism of the same structure is recalled, whatever its parameters' values and start. Those
    are among them from which the start values of its loops are found.
    """
    recalled = recall_programs(mechanism, formalism, form, code)
    if recalled is not None:
        return recalled
    loading.begin(_parts(mechanism, form), code)
    from multibody_sym.dynamics.programs.system import (
        closing_programs,
        programs,  # a run that recalls needs none of it
    )

    with without_collection():
        with stage("derive"):
            derived, closing = programs(mechanism, FORMALISMS[formalism], form).of_runs(), closing_programs(mechanism)
        made = loading.load(derived, code, rare=closing, multistep=form == "multistep")
    loading.remember(structure_key(mechanism, formalism, form), made, {})
    return replace(made, remake=partial(compile_mechanism, mechanism, formalism, form))


def recall_programs(
    mechanism: Mechanism,
    formalism: str,
    form: Form = "explicit",
    code: Native = PORTABLE,
) -> Compiled | None:
    """Return what `compiled` does where it is in the cache, else None."""
    recalled = loading.recall(structure_key(mechanism, formalism, form), code)
    if recalled is None:
        return None
    again = partial(compile_mechanism, mechanism, formalism, form)
    return replace(recalled.compiled, wanted=code, remake=again)


def recall_laws(
    mechanism: Mechanism,
    served: tuple[str, Form] | None = None,
    code: Native = PORTABLE,
) -> loading.Recalled:
    """Return the Programs `inputs` and `laws` of a mechanism in no mode, recalled likewise, ready to be called.

    With them are the places of the entries of each of its matrices (see `law_program`), and if all its modes are to be
    `served`, by a formalism and for the form of a method, the Programs of these (see `every_mode_programs`).
    """
    formalism, form = served or ("", "explicit")
    key = structure_key(mechanism, f"laws {formalism}", form)
    recalled = loading.recall(key, code)
    again = partial(_compiled_laws, mechanism, served)
    if recalled is not None:
        return replace(recalled, compiled=replace(recalled.compiled, wanted=code, remake=again))
    loading.begin(_parts(mechanism, form) | {"rows", "events"}, code)
    from multibody_sym.dynamics.programs.every_mode import every_mode_programs
    from multibody_sym.dynamics.programs.law_programs import law_program, row_program
    from multibody_sym.dynamics.programs.system import inputs_program

    with without_collection():
        with stage("derive"):
            if not formalism:
                program, places = law_program(mechanism, row_program(mechanism))
                derived = {"inputs": inputs_program(mechanism), "laws": program}
            else:
                derived, places = every_mode_programs(mechanism, FORMALISMS[formalism])
        made = loading.load(derived, code, multistep=form == "multistep")
    loading.remember(key, made, places)
    return loading.Recalled(replace(made, remake=again), places)


def _parts(mechanism: Mechanism, form: Form) -> set[str]:
    """Return the parts of the runtime that Programs of a mechanism enter for sure (see `program.target_layout`)."""
    events = bool(mechanism.stops or mechanism.kinks or mechanism.fades or mechanism.mode is not None)
    implicit = form in ("implicit", "index_2")
    entered = {"rows": bool(mechanism.rows) or events or implicit, "events": events, "implicit": implicit}
    return {part for part, enters in entered.items() if enters} | ({"multistep"} & {form})


def _compiled_laws(
    mechanism: Mechanism, served: tuple[str, Form] | None, code: Native
) -> Compiled:
    return recall_laws(mechanism, served, code).compiled


def structure_key(mechanism: Mechanism, formalism: str, form: Form = "explicit") -> str:
    """Return a hash of what Programs follow from: the mechanism but for its numbers, the formalism and the form.

    A declaration will not do: which joint a loop is cut at depends on starts, questions and whatever else names joints.
    """
    written = _Written()
    written.add(mechanism)
    return digest("mechanism", formalism, form, "\n".join(written.lines))


_WORDS: Final = frozenset({str, int, bool, type(None)})


class _Written:
    """Parts of a mechanism as lines that tell it from every other; a Node is written once, then by its number."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._numbers: dict[Node, int] = {}
        self._fields: dict[type, Callable[[Any], tuple[Any, ...]]] = {}

    def add(self, *parts: Any) -> None:
        """Write parts, with the sizes of what they hold, so that nothing moves from one part to the next unseen."""
        for part in parts:  # most are of the first kinds: to ask what others are takes longer than to write them
            kind = type(part)
            if kind is Node:
                number = self._numbers.get(part)
                self.lines.append(f"node {self._number(part) if number is None else number}")
            elif kind in _WORDS:
                self.lines.append(repr(part))
            elif kind is tuple:
                self.lines.append(f"tuple {len(part)}")
                self.add(*part)
            elif kind in self._fields or is_dataclass(part):
                self.lines.append(kind.__name__)
                self.add(*self._contents_of(part))
            elif isinstance(part, Mapping):
                self.lines.append(f"map {len(part)}")
                self.add(*part.items())
            elif isinstance(part, tuple):
                self.lines.append(f"tuple {len(part)}")
                self.add(*part)
            else:
                assert part is None or isinstance(part, (str, int, range, Enum)), part
                self.lines.append(repr(part))

    def _contents_of(self, part: Any) -> tuple[Any, ...]:
        kind = type(part)
        if kind not in self._fields:
            left_out = _NUMBERS.get(kind, frozenset())
            names = [f.name for f in fields(part) if f.name not in left_out]
            self._fields[kind] = attrgetter("__class__", "__class__", *names)  # of two at least it is a tuple
        return self._fields[kind](part)[2:]

    def _number(self, root: Node) -> int:
        """Return the Node's number after those of its operands, writing what has none yet (no recursion)."""
        stack = [root]
        while stack:
            node = stack[-1]
            missing = [a for a in node.args if a not in self._numbers]
            if not missing or node in self._numbers:
                stack.pop()
            stack.extend(missing)
            if not missing and node not in self._numbers:
                self.lines.append(f"{node.op} {node.data!r} {[self._numbers[a] for a in node.args]}")
                self._numbers[node] = len(self._numbers)
        return self._numbers[root]
