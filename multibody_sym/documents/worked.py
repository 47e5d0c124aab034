"""A solution step by step, as text, as a LaTeX document that compiles, and as a page of HTML."""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from html import escape
from textwrap import wrap
from typing import Any, ClassVar, Final

from multibody_sym.answers.records import Formula, Line, Quantity, Sentence, Words, Worked, WorkedStep
from multibody_sym.derivation.notation import Notation, escaped
from multibody_sym.documents.formulas import (
    PIECE,
    ROOM,
    MathmlScript,
    element,
    filled,
    html_document,
    latex_document,
    mathml_script,
)
from multibody_sym.records import dataclass
from multibody_sym.text.printer import latex_width
from multibody_sym.text.values import SI, Units

_WIDTH: Final = 110
_DEGREES: Final = 180 / math.pi


def worked_text(worked: Worked, units: Units = SI) -> str:
    """Return the steps as text, with numbers in chosen units; equations have their numbers in brackets."""
    return _Text(worked.notation, units).document(worked)


def worked_parts(worked: Worked, form: str, units: Units = SI) -> list[str]:
    """Return the steps one by one as parts of a larger document, in the form `latex` or `html`."""
    writer = {"latex": _Latex, "html": _Html}[form](worked.notation, units)
    return [writer.step(step) for step in worked.steps]


def worked_latex(worked: Worked, units: Units = SI) -> str:
    """Return the steps as a LaTeX document, with numbers in chosen units."""
    return _Latex(worked.notation, units).document(worked)


def worked_html(worked: Worked, units: Units = SI) -> str:
    """Return the steps as a page of HTML that needs nothing beside it, with numbers in chosen units."""
    return _Html(worked.notation, units).document(worked)


@dataclass(frozen=True)
class _Writer(ABC):
    """Writes steps; formats differ in how words, numbers and lines look."""

    notation: Notation
    units: Units
    signs: ClassVar[Mapping[str, str]]

    def document(self, worked: Worked) -> str:
        """Return the whole."""
        return self.whole(f"{worked.name}: step by step", [self.step(step) for step in worked.steps])

    def words(self, words: Words) -> str:
        """Return a sentence."""
        return "".join(self.word(word) for word in words)

    def word(self, word: Any) -> str:
        """Return a text, a quantity or an expression that stands in a sentence."""
        if isinstance(word, str):
            return self.plain(word)
        return self.quantity(*self.said(word)) if isinstance(word, Quantity) else self.inline(word)

    def said(self, quantity: Quantity) -> tuple[str, str]:
        """Return a number and its unit as they are told; angles in degrees where no unit was chosen."""
        number, unit = quantity
        if unit == "rad" and self.units.of(unit) == unit:
            return f"{number * _DEGREES:.10g}", "deg"
        told, _, told_unit = self.units.said(number, unit).partition(" ")
        return told, told_unit

    def terms(self, line: Formula) -> list[str]:
        """Return a line of mathematics in pieces between which it may be broken."""
        found: list[str] = []
        for k, side in enumerate(line.sides):
            first, *rest = self.parts(side)
            found += [f"{self.signs[line.relation]} {first}" if k else first, *rest]
        if line.value is not None:
            found.append(f"= {self.quantity(*self.said(line.value))}")
        return found

    @abstractmethod
    def parts(self, expression: Any) -> list[str]:
        """Return the terms of a sum, and parts of terms that are too wide for a line."""

    @abstractmethod
    def whole(self, title: str, steps: Sequence[str]) -> str:
        """Return the document of written steps."""

    @abstractmethod
    def step(self, step: WorkedStep) -> str:
        """Return one step."""

    @abstractmethod
    def plain(self, words: str) -> str:
        """Return text in which nothing is taken for a command."""

    @abstractmethod
    def inline(self, expression: Any) -> str:
        """Return an expression that stands in a sentence."""

    @abstractmethod
    def quantity(self, number: str, unit: str) -> str:
        """Return a number with its unit."""


class _Text(_Writer):
    signs: ClassVar = {"=": "=", ">=": ">=", "<=": "<=", ">": ">", "<": "<"}

    def parts(self, expression: Any) -> list[str]:
        return self.notation.parts(expression)

    def whole(self, title: str, steps: Sequence[str]) -> str:
        return "\n\n".join([title, *steps])

    def step(self, step: WorkedStep) -> str:
        return "\n".join([step.title, *(f"    {line}" for each in step.lines for line in self._written(each))])

    def _written(self, line: Line) -> Iterator[str]:
        if isinstance(line, Sentence):
            yield from _wrapped(self.words(line.words))
            return
        tag = "" if line.tag is None else f"({line.tag}) "
        head = f"{tag}{self.words(line.before)}{': ' if line.before else ''}"
        pieces = [(float(len(term)), term) for term in self.terms(line)]
        first, *others = filled(pieces, _WIDTH - len(head), gap=1.0)
        for written in (head + first, *(f"    {other}" for other in others)):
            yield from _wrapped(written)

    def plain(self, words: str) -> str:
        return words

    def inline(self, expression: Any) -> str:
        return self.notation.text(expression)

    def quantity(self, number: str, unit: str) -> str:
        return f"{number} {unit}".rstrip()


def _wrapped(line: str) -> list[str]:
    """Return a line in as many as it needs, broken between the terms of sums."""
    indent = line[: len(line) - len(line.lstrip())]
    lines = wrap(line.strip(), _WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
    return [indent + part for part in lines]


class _Latex(_Writer):
    signs: ClassVar = {"=": "=", ">=": r"\ge", "<=": r"\le", ">": ">", "<": "<"}

    def parts(self, expression: Any) -> list[str]:
        return [piece for _, piece in self.notation.latex_pieces(expression, ROOM)]

    def whole(self, title: str, steps: Sequence[str]) -> str:
        return latex_document(title, "\n".join(steps))

    def step(self, step: WorkedStep) -> str:
        return "\n".join([rf"\subsection{{{escaped(step.title)}}}", *map(self._written, step.lines)])

    def _written(self, line: Line) -> str:
        if isinstance(line, Sentence):
            return self.words(line.words) + r"\par"
        head = rf"\text{{{self.words(line.before)}: }}" if line.before else ""
        tag = "" if line.tag is None else rf" \tag{{{line.tag}}}"
        first, *others = self._lines(line, latex_width(head))
        body = " \\\\\n".join([rf"& \fit{{{head}{first}}}", *(rf"& \quad \fit{{{other}}}" for other in others)])
        return f"\\begin{{align*}}\n{body}{tag}\n\\end{{align*}}"

    def _lines(self, line: Formula, head: float) -> list[str]:
        terms = self.terms(line)
        widths = [latex_width(term) + (0.0 if k else head) for k, term in enumerate(terms)]
        return filled(zip(widths, terms, strict=True), ROOM)

    def plain(self, words: str) -> str:
        return escaped(words)

    def inline(self, expression: Any) -> str:
        return f"${self.notation.latex(expression)}$"

    def quantity(self, number: str, unit: str) -> str:
        mantissa, e, exponent = number.partition("e")
        power = rf" \cdot 10^{{{int(exponent)}}}" if e else ""
        return rf"\ensuremath{{{mantissa}{power}}}" + (rf"\ \text{{{self._unit(unit)}}}" if unit else "")

    def _unit(self, unit: str) -> str:
        return re.sub(r"\\textasciicircum\{\}(\d+)", r"$^{\1}$", escaped(unit)).replace("*", r"$\,$")


class _Html(_Writer):
    signs: ClassVar = {
        sign: f"<mo>{told}</mo>"
        for sign, told in {"=": "=", ">=": "&ge;", "<=": "&le;", ">": "&gt;", "<": "&lt;"}.items()
    }

    @cached_property
    def _script(self) -> MathmlScript:
        return mathml_script(self.notation)

    def parts(self, expression: Any) -> list[str]:
        return self._script.pieces(expression, PIECE)

    def whole(self, title: str, steps: Sequence[str]) -> str:
        return html_document(title, "\n".join(steps) + "\n")

    def step(self, step: WorkedStep) -> str:
        return "\n".join([f"<h2>{escape(step.title)}</h2>", *map(self._written, step.lines)])

    def _written(self, line: Line) -> str:
        if isinstance(line, Sentence):
            return f"<p>{self.words(line.words)}</p>"
        tag = "" if line.tag is None else f'<span class="n">({line.tag})</span>'
        told = [element(term) for term in self.terms(replace(line, value=None))]
        told += [] if line.value is None else [f"= {self.quantity(*self.said(line.value))}"]
        terms = " ".join(told)
        return f"<p class=\"formula\">{tag}{self.words(line.before)}{': ' if line.before else ''}{terms}</p>"

    def plain(self, words: str) -> str:
        return escape(words)

    def inline(self, expression: Any) -> str:
        return element(self._script.shown(expression))

    def quantity(self, number: str, unit: str) -> str:
        return f"{number}&nbsp;{escape(unit)}" if unit else number


FORMATS: Final = {"text": worked_text, "latex": worked_latex, "html": worked_html}
"""The writers by the format's name."""
