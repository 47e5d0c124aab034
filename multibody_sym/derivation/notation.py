"""The sympy symbols of a mechanism, the steps of a derivation as data, and how both are spelt for a person.

In: a Mechanism. Out: Symbols; Steps of Equations; a Notation that writes expressions as text and in LaTeX.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any, Final, NamedTuple

import sympy

from multibody_sym.algebra.simplify import needed_names
from multibody_sym.algebra.writers import LatexScript, TextScript, decimal
from multibody_sym.errors import ArgumentError, short_repr
from multibody_sym.mechanics.mechanism import TIME, Mechanism
from multibody_sym.model.argument_checks import door
from multibody_sym.model.fields import AXES
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import leaves
from multibody_sym.scalars.node import Node, slot
from multibody_sym.text.printer import COMPONENTS, GREEK, read_parts


@dataclass(frozen=True)
class Symbols:
    """The symbols of a mechanism, real, and positive where the model says so.

    `reactions` are six a joint, fx .. mz in tree order. `slots` gives the symbol of each slot; `free_prefix` and a
    number name no other symbol, so that names of sub-expressions can be made from them.
    """

    time: sympy.Symbol
    coordinates: tuple[sympy.Symbol, ...]
    speeds: tuple[sympy.Symbol, ...]
    accelerations: tuple[sympy.Symbol, ...]
    parameters: tuple[sympy.Symbol, ...]
    inputs: tuple[sympy.Symbol, ...]
    multipliers: tuple[sympy.Symbol, ...]
    reactions: tuple[sympy.Symbol, ...]
    slots: Mapping[Node, sympy.Symbol]
    free_prefix: str


def symbols_of(mechanism: Mechanism) -> Symbols:
    """Return the symbols of a mechanism; characters that cannot stand in expressions are spelt as `_`."""
    m = mechanism
    named = (m.coordinates, m.speeds, m.parameters, m.rows)
    names = [[each.name for each in group] for group in named]
    return _symbols(mechanism, *names, list(m.inputs), [body.joint_name for body in m.bodies])


def numbered_symbols(mechanism: Mechanism) -> Symbols:
    """Return symbols called by their places, so that what is derived for programs does not depend on any name."""
    m = mechanism
    groups = {"q": m.coordinates, "u": m.speeds, "p": m.parameters.entries, "r": m.rows, "w": m.inputs, "j": m.bodies}
    numbered = ([f"{letter}{i}" for i in range(len(group))] for letter, group in groups.items())
    return _symbols(mechanism, *numbered)


def _symbols(mechanism: Mechanism, *names: Sequence[str]) -> Symbols:
    coordinate_names, speed_names, parameter_names, row_names, input_names, joint_names = names
    taken = {"t"}
    time = sympy.Symbol("t", real=True)
    coordinates, speeds = _make_symbols(coordinate_names, taken), _make_symbols(speed_names, taken)
    inputs = _make_symbols(input_names, taken)
    parameters = _make_symbols(parameter_names, taken, [p.positive for p in mechanism.parameters])
    accelerations = _make_symbols([f"{name}_rate" for name in speed_names], taken)
    multipliers = _make_symbols([f"lambda_{name}" for name in row_names], taken)
    reactions = _make_symbols([f"{name}_{component}" for name in joint_names for component in COMPONENTS], taken)
    slots = {TIME: time}
    for array, group in (("q", coordinates), ("u", speeds), ("parameters", parameters), ("inputs", inputs)):
        slots.update((slot(array, i), x) for i, x in enumerate(group))
    prefix = _free("z", lambda word: any(re.fullmatch(rf"{word}\d+", name) for name in taken))
    return Symbols(time, coordinates, speeds, accelerations, parameters, inputs, multipliers, reactions, slots, prefix)


def _make_symbols(
    names: Sequence[str], taken: set[str], positive: Sequence[bool] | None = None
) -> tuple[sympy.Symbol, ...]:
    symbols = []
    for name, above_zero in zip(names, positive or [False] * len(names), strict=True):
        spelt = _free(re.sub(r"[^A-Za-z0-9_]+", "_", name), taken.__contains__)
        taken.add(spelt)
        symbols.append(sympy.Symbol(spelt, positive=True) if above_zero else sympy.Symbol(spelt, real=True))
    return tuple(symbols)


def _free(word: str, is_taken: Callable[[str], bool]) -> str:
    while is_taken(word):
        word += "_"
    return word


# --- how equations of motion came about, step by step ----------------------------------------------------------------


class Label(NamedTuple):
    """Something with a fixed spelling, such as a symbol or dT/dq: as text and as LaTeX."""

    text: str
    latex: str


@dataclass(frozen=True)
class Equation:
    """left = right; the left side is a label or an expression, the right side an expression or a matrix (sympy)."""

    left: Any
    right: Any


@dataclass(frozen=True)
class Step:
    """One step of a derivation: its title, its equations, and a note."""

    title: str
    equations: tuple[Equation, ...] = ()
    note: str = ""


Derivation = tuple[Step, ...]
_LETTERS: Final = ("T", "V", "D", "R", "H", "L", "M", "C", "f")
_FUNCTION: Final = re.compile(r"(d/dt )?(\(N\^T )?d?([A-Zf])(?=$|/d)")


def with_free_letters(steps: Derivation, mechanism: Mechanism) -> Derivation:
    """Return steps in which no letter of a function or matrix, such as T, V and H, is a name of the model.

    Such a letter is followed by _, and calligraphic in LaTeX; the p that stands for any momentum in notes is p_k.
    """
    taken = {str(name.data) for name in mechanism.symbols}
    for letter in (letter for letter in _LETTERS if letter in taken):
        free = _free(letter, taken.__contains__)
        steps = tuple(_with_letter(step, letter, free) for step in steps)
    if "p" in taken:
        steps = tuple(replace(step, note=_put(step.note, "p", "p_k")) for step in steps)
    return steps


def _with_letter(step: Step, letter: str, free: str) -> Step:
    """Return a step in which a function or matrix has another letter."""
    equations = []
    for x in step.equations:
        head = _FUNCTION.match(x.left.text) if isinstance(x.left, Label) else None
        if head is not None and head[3] == letter:
            latex = re.sub(rf"(\\partial |^){letter}(?![A-Za-z_])", rf"\g<1>\\mathcal{{{letter}}}", x.left.latex)
            x = replace(x, left=Label(_put(x.left.text, letter, free), latex))
        equations.append(x)
    title = re.sub(rf"(Gradient of ){letter}$", rf"\g<1>{free}", step.title)
    return replace(step, title=title, equations=tuple(equations), note=_put(step.note, letter, free))


def _put(text: str, letter: str, free: str) -> str:
    """Return a text with another letter where it stands by itself, or as a differential: dT/du."""
    return re.sub(rf"(?<![A-Za-z_^])(d?){letter}(?![A-Za-z_])", rf"\g<1>{free}", text)


# --- how expressions are spelt and ordered: the book's letters, masses first, accelerations last; primes and dots ----


MASS, GRAVITY, PARAMETER, COORDINATE, NAME, SPEED, ACCELERATION, MULTIPLIER = range(8)
"""Kinds of symbols in the order in which a product names them; functions of them come last."""
READABLE: Final = 2_000
"""Operations up to which a person reads equations."""


@dataclass(frozen=True)
class Notation:
    """The spelling of each symbol, and its place (kind, number), which orders sums and products."""

    spelling: Mapping[Any, Label]
    places: Mapping[Any, tuple[int, int]]

    def joined(self, other: Notation) -> Notation:
        """Return this notation with the symbols of another one that it has not."""
        return replace(self, spelling={**other.spelling, **self.spelling}, places={**other.places, **self.places})

    def text(self, expression: Any) -> str:
        """Return a label, an expression or a matrix as one line of text."""
        return expression.text if isinstance(expression, Label) else self._text.shown(expression)

    def latex(self, expression: Any) -> str:
        """Return a label, an expression or a matrix in LaTeX."""
        return expression.latex if isinstance(expression, Label) else self._latex.shown(expression)

    def parts(self, expression: Any) -> list[str]:
        """Return the terms of a sum one by one, with their signs, as text."""
        return self._text.parts(expression)

    def latex_pieces(self, expression: Any, room: float) -> list[tuple[float, str]]:
        """Return an expression in LaTeX in pieces between which a line may end, with their widths in points."""
        pieces = [expression.latex] if isinstance(expression, Label) else self._latex.pieces(expression, room)
        return [(self._latex.width(piece), piece) for piece in pieces]

    @cached_property
    def _text(self) -> TextScript:
        return TextScript({s: label.text for s, label in self.spelling.items()}, self.places)

    @cached_property
    def _latex(self) -> LatexScript:
        return LatexScript({s: label.latex for s, label in self.spelling.items()}, self.places)


def notation_of(
    mechanism: Mechanism,
    symbols: Symbols,
    names: Sequence[Any] = (),
    numbers: Mapping[Any, Node] | None = None,
    labels: Mapping[str, str] | None = None,
) -> Notation:
    """Return the notation of a mechanism's symbols, of named sub-expressions, and of symbols that stand for numbers.

    `labels` gives the book's letters of parameters where they differ from the model's names; text keeps the names.
    """
    book = labels or {}
    spelling: dict[Any, Label] = {}
    for s in (symbols.time, *symbols.coordinates, *symbols.parameters, *symbols.inputs, *names):
        spelling[s] = Label(s.name, latex_name(book.get(s.name, s.name)))
    spelling.update(_spell_balls(mechanism, symbols))
    # theta', theta'' where u is the rate of theta
    rates = {}
    coordinate_of = {u: q for body in mechanism.bodies for q, u in body.rate_pairs}
    for k, (u, a) in enumerate(zip(symbols.speeds, symbols.accelerations, strict=True)):
        if k in coordinate_of:
            text, latex = spelling[symbols.coordinates[coordinate_of[k]]]
            rates[u], rates[a] = Label(text + "'", dotted(latex, "dot")), Label(text + "''", dotted(latex, "ddot"))
        else:
            rates[a] = Label(u.name + "'", dotted(spelling[u].latex, "dot"))
    spelling.update(rates)
    for row, s in zip(mechanism.rows, symbols.multipliers, strict=True):
        spelling[s] = Label(s.name, rf"\lambda_{{{upright(row.name)}}}")
    components = [(body.joint_name, component) for body in mechanism.bodies for component in COMPONENTS]
    for s, (joint, component) in zip(symbols.reactions, components, strict=True):
        spelling[s] = Label(s.name, f"{component[0].upper()}_{{{upright(joint)},{component[1]}}}")
    for s, node in (numbers or {}).items():
        exact = decimal(sympy.Rational(node.data.numerator, node.data.denominator)) if node.op == "number" else None
        digits = exact or f"{node.shadow:.12g}"
        spelling[s] = Label(digits, digits)
    places = {s: (NAME, i) for i, s in enumerate((*names, *(numbers or ())))}
    return Notation(spelling, {**places, **_places(mechanism, symbols)})


def _spell_balls(mechanism: Mechanism, symbols: Symbols) -> dict[Any, Label]:
    """Return the spelling of quaternions and angular velocities: with the joint's name where there are several."""
    balls = [(body, free) for body in mechanism.bodies for free in body.free_steps if free.step.unit_quaternion]
    found = {}
    for body, free in balls:
        of_joint = rf"{upright(body.joint_name)}," if len(balls) > 1 else ""
        for letter, part, numbers in (("q", "wxyz", free.q), (r"\omega", "xyz", free.u)):
            for component, k in zip(part, numbers, strict=True):
                s = symbols.coordinates[k] if letter == "q" else symbols.speeds[k]
                default = s.name.endswith(("_q" if letter == "q" else "_w") + component)
                found[s] = Label(s.name, f"{letter}_{{{of_joint}{component}}}" if default else latex_name(s.name))
    return found


def rate_label(notation: Notation, symbol: Any) -> Label:
    """Return a quantity's rate: with a prime in text, a dot in LaTeX."""
    return Label(f"{notation.text(symbol)}'", dotted(notation.latex(symbol), "dot"))


def dotted(latex: str, accent: str) -> str:
    """Return a name in LaTeX with dots over its letter or words, not over the subscript."""
    end = _end_of_words(latex) if latex.startswith((r"\text{", r"\mathrm{")) else latex.find("_")
    head, below = (latex, "") if end < 0 else (latex[:end], latex[end:])
    return rf"\{accent}{{{head}}}{below}"


def _end_of_words(latex: str) -> int:
    """Return where the group of a command ends; braces that a backslash escapes are letters."""
    depth, escape = 0, False
    for k, c in enumerate(latex):
        depth += 0 if escape else (c == "{") - (c == "}")
        if c == "}" and depth == 0 and not escape:
            return k + 1
        escape = c == "\\" and not escape
    return len(latex)


def latex_name(name: str) -> str:
    r"""Return a name in LaTeX: theta_1 and theta1 as \theta_{1}, vB.x as v_{B,x}, words upright, all else harmless."""
    whole, _, axis = name.rpartition(".")
    parts = []
    for part in (*read_parts(whole), axis) if whole and axis in AXES else read_parts(name):
        plain = part.isdigit() or (len(part) == 1 and part.isalpha() and part.isascii())
        parts.append(f"\\{part}" if part in GREEK else part if plain else upright(part))
    head, *under = parts
    return f"{head}_{{{','.join(under)}}}" if under else head


_SPECIAL: Final = {
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    **{c: f"\\{c}" for c in "#$%&_{}"},
}
_LONGEST_WORD: Final = 24
_PARTS: Final = re.compile(r".{0,11}[_./-]|.{1,12}", re.DOTALL)


def upright(words: str) -> str:
    """Return words in upright letters, in mathematics."""
    return rf"\mathrm{{{words}}}" if words.isascii() and words.isalnum() else rf"\text{{{escaped(words)}}}"


def escaped(words: str) -> str:
    """Return text in which LaTeX finds no command."""
    return "".join(_SPECIAL.get(c, c) for c in words)


def breakable(words: str) -> str:
    """Return text for a paragraph in which LaTeX finds no command, and long words end a line somewhere."""
    return " ".join(
        escaped(word) if len(word) <= _LONGEST_WORD else r"\hspace{0pt}".join(map(escaped, _PARTS.findall(word)))
        for word in words.split(" ")
    )


def _places(mechanism: Mechanism, symbols: Symbols) -> dict[Any, tuple[int, int]]:
    masses = {leaf for body in mechanism.bodies for leaf in leaves([body.mass.mass], "slot")}
    gravity = set(leaves(mechanism.gravity, "slot"))
    places: dict[Any, tuple[int, int]] = {}
    for i, s in enumerate(symbols.parameters):
        node = next(node for node, known in symbols.slots.items() if known is s)
        places[s] = (MASS if node in masses else GRAVITY if node in gravity else PARAMETER, i)
    kinds = {
        COORDINATE: (*symbols.coordinates, symbols.time),
        SPEED: symbols.speeds,
        ACCELERATION: symbols.accelerations,
        MULTIPLIER: (*symbols.multipliers, *symbols.reactions),
        PARAMETER: symbols.inputs,
    }
    for kind, group in kinds.items():
        places.update((s, (kind, len(symbols.parameters) + i)) for i, s in enumerate(group))
    return places


@dataclass(frozen=True, repr=False)
class ReadableEquations:
    """The part that all kinds of derived equations share: how they are counted, resolved and shown."""

    method: str
    mechanism: Mechanism
    symbols: Symbols
    kinetic_energy: Any
    potential_energy: Any
    generalized_forces: tuple[Any, ...]
    equations: tuple[Equation, ...]
    definitions: tuple[tuple[Any, Any], ...]
    numbers: Mapping[Any, Any]
    steps: Derivation
    notation: Notation

    @property
    def operations(self) -> int:
        """The number of operations, each shared sub-expression counted once."""
        raise NotImplementedError

    def _counted(self, parts: Sequence[Any]) -> int:
        definitions = dict(self.definitions)
        return sum(int(e.count_ops()) for e in (*parts, *(definitions[s] for s in needed_names(definitions, parts))))

    def _ordered(self) -> list[tuple[Any, Any]]:
        return list(self.definitions)

    @door
    def explicit(self, expression: Any) -> Any:
        """Return an expression or matrix in which definitions and numbers take the place of their names.

        Of equations in momenta it is one in q, p and the speeds that are kept. Raises InputError for anything else.
        """
        if not isinstance(expression, (sympy.Basic, sympy.MatrixBase)):
            raise ArgumentError(f"expected an expression or matrix of sympy, got {short_repr(expression)}")
        known = dict(self.numbers)
        definitions = dict(self._ordered())
        for name in needed_names(definitions, [expression]):
            known[name] = definitions[name].xreplace(known)
        return expression.xreplace(known)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self.mechanism.name} by {self.method}: {self.operations} operations>"

    def __str__(self) -> str:
        """Return the equations as text, one a line; names first."""
        write = self.notation.text
        named = [f"{write(name)} = {write(e)}" for name, e in self.definitions]
        return "\n".join([*named, *(f"{write(e.left)} = {write(e.right)}" for e in self.equations)])

    def _repr_latex_(self) -> str:
        """Return what a notebook shows: the equations, or their size where nobody would read them."""
        if self.operations > READABLE:
            size = rf"\text{{{self.operations} operations in {len(self.definitions)} named sub-expressions}}"
            return rf"$\displaystyle {size}$"
        write = self.notation.latex
        lines = [rf"{write(name)} &= {write(e)}" for name, e in self.definitions]
        lines += [rf"{write(e.left)} &= {write(e.right)}" for e in self.equations]
        return r"$\displaystyle \begin{aligned}" + r" \\ ".join(lines) + r"\end{aligned}$"
