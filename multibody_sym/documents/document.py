"""What does a document consist of, and how do text, LaTeX and HTML write it?

A Document has sections of blocks: sentences, chains of formulas, equations and notes. Each answer makes one; each
format has one writer. Reports add blocks and writers of their own (`report`). In: documents. Out: text, LaTeX, HTML.
"""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from html import escape
from itertools import groupby
from textwrap import wrap
from typing import Any, ClassVar, Final, NamedTuple

import sympy

from multibody_sym.answers.records import Formula, Sentence, Words, Worked
from multibody_sym.derivation.notation import Equation, Label, Notation, escaped
from multibody_sym.documents.formulas import (
    PIECE,
    ROOM,
    MathmlScript,
    equation_elements,
    equation_lines,
    fill_lines,
    fitted,
    html_document,
    latex_document,
    latex_in_mathml,
    math_element,
    shown_places,
)
from multibody_sym.records import dataclass
from multibody_sym.text.printer import latex_width
from multibody_sym.text.values import SI, Quantity, Units

_TEXT_WIDTH: Final = 110
_EQUATION_WIDTH: Final = 100
_WRITTEN: Final = {"=": "=", ">=": "&ge;", "<=": "&le;", ">": "&gt;", "<": "&lt;"}
_ALIGNED: Final = "\0"
"""Stands where equations are aligned; an ampersand may be one of a name."""
_MINUS: Final = "\u2212"
_POWER: Final = re.compile(r"\^\(?(-?[0-9/]+)\)?")
"""The exponent in the text of a unit."""


@dataclass(frozen=True)
class EquationRows:
    """Equations that stand below each other."""

    rows: tuple[Equation, ...]


@dataclass(frozen=True)
class PlainLines:
    """Lines of plain text."""

    lines: tuple[str, ...]


class Told(NamedTuple):
    """A number in digits with its unit, as it is to stand."""

    digits: str
    unit: str


Block = Any
"""A Sentence, Formula, EquationRows or PlainLines; in reports also a whole Document and what `report` declares."""


@dataclass(frozen=True)
class Section:
    """A title with blocks below it; `text_title` replaces the title in text."""

    title: str
    blocks: tuple[Block, ...]
    text_title: str = ""


@dataclass(frozen=True)
class Document:
    """Sections on a `subject` called `name`, in the letters of a `notation`.

    `advice` ends the text; without sections it is all there is. With `run_in` LaTeX sets titles into their paragraphs.
    """

    name: str
    subject: str
    sections: tuple[Section, ...]
    notation: Notation
    advice: str = ""
    run_in: bool = False

    @property
    def title(self) -> str:
        """The name with the subject."""
        return f"{self.name}: {self.subject}"


def worked_document(worked: Worked) -> Document:
    """Return the document of a solution step by step."""
    sections = tuple(Section(step.title, step.lines) for step in worked.steps)
    return Document(worked.name, "step by step", sections, worked.notation)


def write_document(document: Document, form: str, units: Units = SI) -> str:
    """Return a document in a form (text, latex, html), with numbers in chosen units; LaTeX compiles as it is."""
    return _WRITERS[form](document.notation, units).document(document)


@dataclass(frozen=True)
class Writer(ABC):
    """Writes blocks in one format."""

    notation: Notation
    units: Units = SI
    signs: ClassVar[Mapping[str, str]]

    def section(self, section: Section) -> str:
        """Return a title and the blocks below it."""
        head = self.heading(section.title) if section.title else ""
        return "\n".join(part for part in (head, *map(self.block, section.blocks)) if part)

    def block(self, block: Block) -> str:
        """Return a block by its kind."""
        match block:
            case Sentence():
                return self.sentence(block.words)
            case Formula():
                return self.formula(block)
            case EquationRows():
                return self.equations(block.rows)
            case PlainLines():
                return self.note(block.lines)
        raise TypeError(f"no block of a document: {type(block).__name__}")

    def words(self, words: Words) -> str:
        """Return texts, quantities and expressions as they stand in a sentence."""
        return "".join(map(self.word, words))

    def word(self, word: Any) -> str:
        """Return a text, a quantity or an expression that stands in a sentence."""
        if isinstance(word, str):
            return self.plain(word)
        if isinstance(word, Told):
            return self.number(*word)
        return self.quantity(word) if isinstance(word, Quantity) else self.inline(word)

    def quantity(self, quantity: Quantity) -> str:
        """Return a number with its unit; angles are in degrees where no unit was chosen, and nothing else is said."""
        number, unit, error = quantity
        units = self.units if self.units.angles else replace(self.units, angles="deg")
        digits, _, chosen = units.said(number, unit, error=error).partition(" ")
        plain, _, degrees = chosen.partition(" (")
        if not degrees:
            return self.number(digits, chosen)
        beside, _, unit = degrees.rstrip(")").partition(" ")
        return f"{self.number(digits, plain)} ({self.number(beside, unit)})"

    def terms(self, line: Formula) -> list[str]:
        """Return a chain of formulas in pieces between which a line may end."""
        terms: list[str] = []
        for k, side in enumerate(line.sides):
            first, *rest = self.pieces(side)
            terms += [f"{self.signs[line.relation]} {first}" if k else first, *rest]
        if line.value is not None:
            sign = self.signs[line.relation] if len(line.sides) == 1 else self.signs["="]
            terms.append(f"{sign} {self.quantity(line.value)}")
        return terms

    @abstractmethod
    def document(self, document: Document) -> str:
        """Return a whole document."""

    @abstractmethod
    def heading(self, title: str) -> str:
        """Return the title of a section."""

    @abstractmethod
    def sentence(self, words: Words) -> str:
        """Return a sentence as a paragraph."""

    @abstractmethod
    def formula(self, line: Formula) -> str:
        """Return a chain of formulas with its words and number."""

    @abstractmethod
    def equations(self, rows: Sequence[Equation]) -> str:
        """Return equations below each other."""

    @abstractmethod
    def note(self, lines: Sequence[str]) -> str:
        """Return lines of plain text."""

    @abstractmethod
    def pieces(self, expression: Any) -> list[str]:
        """Return the terms of a sum, and parts of terms that are too wide for a line."""

    @abstractmethod
    def plain(self, words: str) -> str:
        """Return text in which nothing is taken for a command."""

    @abstractmethod
    def inline(self, expression: Any) -> str:
        """Return an expression that stands in a sentence."""

    @abstractmethod
    def number(self, digits: str, unit: str) -> str:
        """Return a number with its unit, which may be empty."""


class TextWriter(Writer):
    """Lines of text: formulas in the model's language, blocks indented."""

    signs: ClassVar = {"=": "=", ">=": ">=", "<=": "<=", ">": ">", "<": "<"}

    def document(self, document: Document) -> str:
        if not document.sections:
            return f"{document.title}\n{document.advice}"
        sections = [replace(each, title=each.text_title or each.title) for each in document.sections]
        parts = [document.title, *map(self.section, sections), document.advice]
        return "\n\n".join(part for part in parts if part)

    def heading(self, title: str) -> str:
        return title

    def sentence(self, words: Words) -> str:
        return _indent(_wrap_line(self.words(words)))

    def formula(self, line: Formula) -> str:
        tag = "" if line.tag is None else f"({line.tag}) "
        head = f"{tag}{self.words(line.before)}{': ' if line.before else ''}"
        pieces = [(float(len(term)), term) for term in self.terms(line)]
        first, *others = fill_lines(pieces, _TEXT_WIDTH - len(head), gap=1.0)
        lines = [head + first, *(f"    {other}" for other in others)]
        lines[-1] += self.words(line.after)
        return _indent(part for each in lines for part in _wrap_line(each))

    def equations(self, rows: Sequence[Equation]) -> str:
        return _indent(line for row in rows for line in self._equation(row))

    def _equation(self, row: Equation) -> Iterator[str]:
        """Yield an equation in a line, one of a wide matrix by its elements."""
        left, right = self.notation.text(row.left), self.notation.text(row.right)
        if not isinstance(row.right, sympy.MatrixBase) or len(left) + len(right) <= _EQUATION_WIDTH:
            yield f"{left} = {right}"
            return
        vector = 1 in row.right.shape
        for i, j in shown_places(row.right):
            place = f"{max(i, j) + 1}" if vector else f"{i + 1},{j + 1}"
            index = f"[{place}]" if len(row.right) > 1 else ""
            yield f"{left}{index} = {self.notation.text(row.right[i, j])}"

    def note(self, lines: Sequence[str]) -> str:
        return _indent(lines)

    def pieces(self, expression: Any) -> list[str]:
        return self.notation.parts(expression)

    def plain(self, words: str) -> str:
        return words

    def inline(self, expression: Any) -> str:
        return self.notation.text(expression)

    def number(self, digits: str, unit: str) -> str:
        return f"{digits} {unit}".rstrip()


def _indent(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _wrap_line(line: str) -> list[str]:
    """Return a line in as many as it needs, broken between the terms of sums."""
    indent = line[: len(line) - len(line.lstrip())]
    lines = wrap(line.strip(), _TEXT_WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)
    return [indent + part for part in lines]


@dataclass(frozen=True)
class LatexWriter(Writer):
    r"""LaTeX that needs amsmath; `command` sets the title of a section, `prefix` begins the labels of equations."""

    command: str = r"\subsection{%s}"
    prefix: str = ""
    signs: ClassVar = {"=": "=", ">=": r"\ge", "<=": r"\le", ">": ">", "<": "<"}

    def document(self, document: Document) -> str:
        return latex_document(document.name if document.run_in else document.title, self.body(document))

    def body(self, document: Document) -> str:
        """Return the sections of a document without what stands around them."""
        if not document.sections:
            return rf"\paragraph{{{escaped(document.title)}}} {escaped(document.advice)}."
        if not document.run_in:
            return "\n".join(map(self.section, document.sections))
        writer = replace(self, command=r"\paragraph{%s}")
        return "\n".join([f"% {document.title}", *map(writer.section, document.sections)])

    def heading(self, title: str) -> str:
        return self.command % escaped(title)

    def sentence(self, words: Words) -> str:
        return self.words(words) + r"\par"

    def section(self, section: Section) -> str:
        """Return a title and the blocks below it; formulas that follow each other stand in one environment."""
        head = self.heading(section.title) if section.title else ""
        parts = [head]
        for alike, blocks in groupby(section.blocks, key=lambda block: isinstance(block, Formula)):
            if not alike:
                parts += map(self.block, blocks)
                continue
            parts[-1] = parts[-1].removesuffix(r"\par")  # a display after a paragraph has an empty line above it
            parts.append(self.formulas(list(blocks)))
        return "\n".join(part for part in parts if part)

    def formula(self, line: Formula) -> str:
        return self.formulas([line])

    def formulas(self, lines: Sequence[Formula]) -> str:
        """Return chains of formulas below each other."""
        return self._aligned([row for line in lines for row in self._rows(line)])

    def _rows(self, line: Formula) -> list[str]:
        """Return a chain of formulas in rows of an environment, with its number and, in a fragment, its label."""
        head = rf"\text{{{self.words(line.before)}: }}" if line.before else ""
        first, *others = self.terms(line)
        if line.after:
            others.append(rf"\text{{{self.words(line.after)}}}")
        widths = [latex_width(first) + latex_width(head), *map(latex_width, others)]
        first, *others = fill_lines(zip(widths, [first, *others], strict=True), ROOM)
        rows = [f"& {fitted(head + first)}", *(rf"& \quad {fitted(other)}" for other in others)]
        if line.tag is not None:
            label = rf"\label{{{self.prefix}:{line.tag}}}" if self.prefix else ""
            rows[-1] += rf" \tag{{{line.tag}}}{label}"
        return rows

    def _aligned(self, rows: Sequence[str]) -> str:
        return "\\begin{align*}\n" + " \\\\\n".join(rows) + "\n\\end{align*}"

    def equations(self, rows: Sequence[Equation]) -> str:
        """Return equations aligned at their signs where both sides find room, else at their beginnings."""
        whole = [equation_lines(self.notation, row.left, row.right, _ALIGNED) for row in rows]
        sides = [line.partition(_ALIGNED) for line, *_ in whole]
        left = max(latex_width(side) for side, _, _ in sides)
        right = max(map(latex_width, [*(side for _, _, side in sides), *(x for _, *more in whole for x in more)]))
        aligned = left + right <= ROOM and all(side for side, _, _ in sides)
        written = []
        for (before, _, after), (_, *others) in zip(sides, whole, strict=True):
            first = f"{before}&{after}" if aligned else f"& {fitted(before + after)}"
            written += [first, *(rf"& \quad {fitted(other)}" for other in others)]
        return self._aligned(written)

    def note(self, lines: Sequence[str]) -> str:
        return r" \\ ".join(map(escaped, lines))

    def pieces(self, expression: Any) -> list[str]:
        return [piece for _, piece in self.notation.latex_pieces(expression, ROOM)]

    def plain(self, words: str) -> str:
        return escaped(words)

    def inline(self, expression: Any) -> str:
        return f"${self.notation.latex(expression)}$"

    def number(self, digits: str, unit: str) -> str:
        mantissa, e, exponent = digits.partition("e")
        power = rf" \cdot 10^{{{int(exponent)}}}" if e else ""
        upright = re.sub(r"\\textasciicircum\{\}(\d+)", r"$^{\1}$", escaped(unit)).replace("*", r"$\,$")
        return rf"\ensuremath{{{mantissa}{power}}}" + (rf"\ \text{{{upright}}}" if unit else "")


@dataclass(frozen=True)
class HtmlWriter(Writer):
    """HTML with formulas in MathML; `level` is that of headings."""

    level: int = 2
    signs: ClassVar = {
        sign: f'<mo lspace="0">{entity}</mo>' for sign, entity in _WRITTEN.items()
    }

    @cached_property
    def _script(self) -> MathmlScript:
        return MathmlScript(
            {s: latex_in_mathml(label.latex) for s, label in self.notation.spelling.items()}, self.notation.places
        )

    def document(self, document: Document) -> str:
        return html_document(document.title, self.body(document))

    def body(self, document: Document) -> str:
        """Return the sections of a document without what stands around them."""
        if not document.sections:
            return f"<p>{escape(document.advice)}</p>\n"
        return "\n".join(map(self.section, document.sections)) + "\n"

    def heading(self, title: str) -> str:
        return f"<h{self.level}>{escape(title)}</h{self.level}>"

    def sentence(self, words: Words) -> str:
        return f"<p>{self.words(words)}</p>"

    def formula(self, line: Formula) -> str:
        tag = "" if line.tag is None else f'<span class="n">({line.tag})</span> '
        terms = [*map(math_element, self.terms(replace(line, value=None)))]
        sign = _WRITTEN[line.relation] if len(line.sides) == 1 else "="
        terms += [] if line.value is None else [f"{sign}&nbsp;{self.quantity(line.value)}"]
        before = f"{self.words(line.before)}: " if line.before else ""
        return f'<p class="formula">{tag}{before}{" ".join(terms)}{self.words(line.after)}</p>'

    def equations(self, rows: Sequence[Equation]) -> str:
        written = (equation_elements(self._script, row.left, row.right) for row in rows)
        return "\n".join(f'<p class="formula">{each}</p>' for each in written)

    def note(self, lines: Sequence[str]) -> str:
        return "\n".join(f"<p>{escape(line)}</p>" for line in lines)

    def pieces(self, expression: Any) -> list[str]:
        if isinstance(expression, Label):
            return [latex_in_mathml(expression.latex)]
        return self._script.pieces(expression, PIECE)

    def plain(self, words: str) -> str:
        return escape(words)

    def inline(self, expression: Any) -> str:
        if isinstance(expression, Label):
            return math_element(latex_in_mathml(expression.latex))
        return math_element(self._script.shown(expression))

    def number(self, digits: str, unit: str) -> str:
        mantissa, e, exponent = digits.partition("e")
        power = f"&#xB7;10<sup>{int(exponent)}</sup>" if e else ""
        written = f"{mantissa}{power}".replace("-", _MINUS)
        upright = _POWER.sub(r"<sup>\1</sup>", escape(unit)).replace("*", "&#x2009;")
        return f"{written}&nbsp;{upright}" if unit else written


_WRITERS: Final[Mapping[str, type[Writer]]] = {"text": TextWriter, "latex": LatexWriter, "html": HtmlWriter}
