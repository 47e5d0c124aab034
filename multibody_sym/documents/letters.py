"""Names, expressions and sentences of a model in the letters of a book, to be typeset.

In: names, Nodes and lines of text as the commands print them. Out: Labels and sympy expressions with one Notation.
"""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace
from typing import Any, Final

import sympy

from multibody_sym.answers.records import Formula, Line, Sentence, Words
from multibody_sym.derivation.free_bodies import component_label
from multibody_sym.derivation.notation import NAME, PARAMETER, Label, Notation, dotted, latex_name, upright
from multibody_sym.errors import ExpressionError
from multibody_sym.mechanics.spanning_tree import letters_of
from multibody_sym.model.system import System
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.parser import parse
from multibody_sym.text.printer import COMPONENTS, FORCE_NAMES, text
from multibody_sym.text.values import Quantity, Value

_CALL: Final = re.compile(r"([A-Za-z_]\w*)\(([^()]*)\)")
_FORCES: Final = {"tension": "T", "normal": "N", "friction": "F", "force": "F", "multiplier": r"\lambda"}
_PLACES: Final = {"position": "", "velocity": "dot", "acceleration": "ddot"}
_DOTS: Final = ("", "dot", "ddot")
_SIGNS: Final = {"<=": r"\le", ">=": r"\ge", "!=": r"\neq", "+-": r"\pm"}
_TYPED: Final = re.compile(
    r"(?P<size>\|\w+\|)|(?P<call>[A-Za-z_]\w*\([\w., ]*\)(?:'{1,2})?)|(?P<power>\d+(?:\.\d+)?e[+-]?\d+)"
    r"|(?P<sign><=|>=|!=|\+-)|(?P<name>[A-Za-z]\w*'{0,2})(?!\w|\.\w)"
)
_MINUS: Final = re.compile(r"(?<![\w)\]-])-(?=\d)")
_COMPARISON: Final = re.compile(r"(?P<left>[^<>=]+) (?P<sign><=|>=|<|>) (?P<right>[^<>=]+)")


class SystemLetters:
    """The letters of a system: parameters by their labels, `theta'` and `u_theta` with a dot, forces by T, N, F."""

    def __init__(self, system: System, coordinates: Collection[str] = ()) -> None:
        self._book = letters_of(system)
        self._declared = tuple(system.parameters)
        self._coordinates = frozenset(coordinates)
        self._known = frozenset((*system.parameters, *coordinates, *(f"u_{q}" for q in coordinates)))
        self._spelling: dict[Any, Label] = {}

    @property
    def notation(self) -> Notation:
        """The spelling of all symbols so far, parameters first, in the order of the model."""
        declared = {name: k for k, name in enumerate(self._declared)}
        own = len(declared)
        places = {s: (PARAMETER, declared[s.name]) if s.name in declared else (NAME, own + k)
                  for k, s in enumerate(self._spelling)}  # fmt: skip
        return Notation(dict(self._spelling), places)

    def label(self, name: str) -> Label:
        """Return a name as expressions write it with its letter."""
        return Label(name, self._latex(name))

    def expression(self, node: Node) -> Any:
        """Return an expression (sympy) whose letters the notation knows."""
        known = {n: sympy.Symbol(text(n), real=True) for op in ("symbol", "quantity") for n in leaves([node], op)}
        for s in known.values():
            self._spelling.setdefault(s, self.label(s.name))
        return to_sympy(node, known)

    def value(self, name: str, value: Value, *, formula: bool = True) -> Formula:
        """Return `name = formula = number unit`; no formula where it is that number, or is not asked for."""
        sides: tuple[Any, ...] = (self.label(name),)
        found = value.expression if formula and value.unique else None
        if found is not None and leaves([found], "symbol", "quantity"):
            sides = (*sides, self.expression(found))
        number = None if value.value is None else Quantity(value.value, value.unit, value.error)
        return Formula(sides, value=number)

    def condition(self, line: str) -> Words:
        """Return an inequality as words; a line that is none as its `words`."""
        match = _COMPARISON.fullmatch(line)
        try:
            if match is not None:
                left, right = (self.expression(parse(match[side])) for side in ("left", "right"))
                return left, f" {_WRITTEN[match['sign']]} ", right
        except ExpressionError:
            pass
        return self.words(line)

    def words(self, line: str) -> Words:
        """Return a line of text with names, powers of ten and signs typeset, as far as they are no English words."""
        found: list[Any] = []
        end = 0
        line = _MINUS.sub("\u2212", line)
        for match in _TYPED.finditer(line):
            label = self._typed(match, line)
            if label is not None:
                found += [line[end : match.start()], label]
                end = match.end()
        return tuple(x for x in (*found, line[end:]) if x != "")

    def line(self, line: Line) -> Line:
        """Return a line of a worked solution whose texts are typeset too."""
        if isinstance(line, Sentence):
            return Sentence(self._words(line.words))
        return replace(line, before=self._words(line.before), after=self._words(line.after))

    def _words(self, words: Words) -> Words:
        return tuple(x for word in words for x in (self.words(word) if isinstance(word, str) else (word,)))

    def _typed(self, match: re.Match[str], line: str) -> Label | None:
        told = match[0]
        if match["sign"]:
            return Label(told, _SIGNS[told])
        if match["power"]:
            mantissa, _, exponent = told.partition("e")
            return Label(told, rf"{mantissa} \cdot 10^{{{int(exponent)}}}")
        if match["size"]:
            return Label(told, f"|{_RESIDUALS.get(told[1:-1], self._latex(told[1:-1]))}|")
        if match["call"]:
            return self.label(told) if _CALL.match(told)[1] in _FUNCTIONS else None  # type: ignore[index]
        stem = told.rstrip("'")
        if told in _RESIDUALS and line[match.end() :].startswith(" = 0;"):
            return Label(told, _RESIDUALS[told])
        if "_" in stem and stem not in self._known:
            return Label(told, upright(told.replace("_", " ")))
        if stem not in self._known and not (stem == "t" and line[match.end() :].startswith(" = ")):
            return None
        is_name = not stem.isalpha() or told != stem or line[match.end() :].startswith(" = ") or len(stem) > 1
        return self.label(told) if is_name and not (stem.isalpha() and stem in _ENGLISH) else None

    def _latex(self, name: str) -> str:
        stem = name.rstrip("'")
        dots = len(name) - len(stem)
        if stem[:2] in ("u_", "a_") and stem[2:] in self._coordinates and stem not in self._book:
            stem, dots = stem[2:], dots + 1 + (stem[0] == "a")
        call = _CALL.fullmatch(stem)
        letter = latex_name(self._book.get(stem, stem)) if call is None else self._called(call[1], call[2])
        return dotted(letter, _DOTS[min(dots, 2)]) if dots else letter

    def _called(self, function: str, arguments: str) -> str:
        """Return the letter of a quantity such as tension(string) or position(bob, x)."""
        names = [name.strip() for name in arguments.split(",")]
        word, _, number = function.partition("_")
        if function in COMPONENTS:
            return component_label(names[0], function).latex
        if word in _FORCES:
            under = ",".join([*map(upright, names), *([number] if number else [])])
            return f"{_FORCES[word]}_{{{under}}}"
        if function in _PLACES and len(names) == 2 and names[1] in ("x", "y", "z"):
            letter = dotted(names[1], _PLACES[function]) if _PLACES[function] else names[1]
            return rf"{letter}_{{{upright(names[0])}}}"
        inside = rf"\left({','.join(map(self._latex, names))}\right)" if arguments else ""
        return f"{upright(function.replace('_', ' '))}{inside}"


_CONSERVED: Final = ("total_energy", "momentum", "angular_momentum", "generalized_momentum")
_FUNCTIONS: Final = frozenset((*_FORCES, *_PLACES, *COMPONENTS, *FORCE_NAMES, *_CONSERVED))
_RESIDUALS: Final = {"phi": r"\varphi", "phidot": r"\dot{\varphi}", "phiddot": r"\ddot{\varphi}"}
"""The letters of constraints, as derivations have them."""
_WRITTEN: Final = {"<": "<", ">": ">", "<=": "\u2264", ">=": "\u2265"}
_ENGLISH: Final = frozenset("a at by force in is load of on rod spring mass torque work".split())
"""Names that may be words of a sentence."""
