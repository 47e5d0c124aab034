"""Tokens of the expression language, its limits, and errors that show their column."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Final, NamedTuple

from multibody_sym.errors import ExpressionError

LONGEST_TEXT: Final = 100_000
MOST_TOKENS: Final = 50_000
LONGEST_NAME: Final = 100
MOST_DIGITS: Final = 400
LARGEST_EXPONENT: Final = 400
_NO_VALUE: Final = (
    "{} is no value: numbers are finite here; give a number, or leave the entry out where it may be absent, such as a "
    "limit that is not there"
)
_SHOWN_EACH_SIDE: Final = 36

_TOKEN: Final = re.compile(
    r"""(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
      | (?P<name>[A-Za-z][A-Za-z0-9_]*'{0,2})
      | (?P<quoted>'[^']*(?:''[^']*)*'|"[^"]*(?:""[^"]*)*")
      | (?P<operator>\*\*|<=|>=|[-+*/^(),<>.])
      | (?P<blank>[ \t\r\n]+)""",
    re.VERBOSE,
)
_NOT_FINITE: Final = re.compile(r"\.(?:inf|nan)(?![A-Za-z0-9_])", re.IGNORECASE)
"""YAML's words for infinite and undefined numbers; behind a name they are the point of a body."""
_PLAIN: Final = re.compile(r"-?[0-9]{1,30}(?:\.[0-9]{1,30})?")
_TURNED: Final = {"=>": ">=", "=<": "<="}
_ADVICE: Final = {
    "=": "comparisons are < <= > >=, and an equation is written as the difference of its sides",
    ":": "a quotient is written with /",
    "!": "comparisons are < <= > >=",
    "&": "conditions are joined by and",
    "|": "conditions are joined by or; the absolute value is abs(x)",
    "%": "write a percentage as a decimal",
    "_": "names start with a letter, and digits are written without _",
    "[": "this is one expression, not a list",
    "]": "this is one expression, not a list",
    "{": "this is one expression, not a map",
    "}": "this is one expression, not a map",
    "\\": "names and functions are written without a backslash",
    "'": "the quote is never closed",
    '"': "the quote is never closed",
    "°": "write deg", "²": "write ^2", "³": "write ^3", "µ": "write u", "μ": "write mu, or u in a unit",
    "·": "write *", "×": "write *", "÷": "write /", "−": "write -", "–": "write -", "π": "write pi",
    "√": "write sqrt(x)", "≤": "write <=", "≥": "write >=",
}


class Token(NamedTuple):
    """A piece of the text: its kind (number, name, quoted, end, or the operator itself), its text and its column."""

    kind: str
    text: str
    column: int


def failure(
    text: str, column: int, message: str, number: str | None = None, word: str | None = None, meant: str | None = None
) -> ExpressionError:
    """Return the error `message` about `text`; it shows the surroundings of `column` (from 1) with a caret."""
    excerpt = surroundings(text, column)
    error = ExpressionError(_printable(message), excerpt=excerpt, number=number, word=word, meant=meant)
    error.located(column=column)
    return error


def surroundings(text: str, column: int) -> str:
    """Return a line of text near `column` (from 1), and a caret below it."""
    start = max(0, column - 1 - _SHOWN_EACH_SIDE)
    stop = column - 1 + _SHOWN_EACH_SIDE
    head, tail = ("..." if start else ""), ("..." if stop < len(text) else "")
    return f"  {head}{_printable(text[start:stop])}{tail}\n  {' ' * (len(head) + column - 1 - start)}^"


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def tokens(text: str) -> list[Token]:
    """Return the tokens of `text`, the last of kind `end`.

    Raises ExpressionError where a character does not belong to the language or a limit is passed.
    """
    if len(text) > LONGEST_TEXT:
        message = f"an expression has at most {LONGEST_TEXT} characters, not {len(text)}"
        raise failure(text, LONGEST_TEXT + 1, message, "E104")
    found: list[Token] = []
    position = 0
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise _stray_error(text, position)
        if match[0] == "." and not (found and found[-1].kind == "name") and (word := _NOT_FINITE.match(text, position)):
            raise failure(text, position + 1, _NO_VALUE.format(word[0]), "E104")
        position = match.end()
        kind, size = match.lastgroup or "", match.end() - match.start()
        if kind == "blank":
            continue
        token = Token(match[0] if kind == "operator" else kind, match[0], match.start() + 1)
        if kind == "name" and size > LONGEST_NAME:
            message = f"a name has at most {LONGEST_NAME} characters, not {size}"
            raise failure(text, token.column, message, "E104")
        if kind == "number" and size > MOST_DIGITS:
            raise failure(text, token.column, f"a number has at most {MOST_DIGITS} digits, not {size}", "E104")
        found.append(token)
        if len(found) > MOST_TOKENS:
            message = f"an expression has at most {MOST_TOKENS} numbers, names and operators"
            raise failure(text, token.column, message, "E104")
    found.append(Token("end", "", max(len(text.rstrip()), 0) + 1))
    return found


def _stray_error(text: str, position: int) -> ExpressionError:
    turned = text[position : position + 2]
    if turned in _TURNED:
        return failure(text, position + 1, f"'{turned}' is no comparison; write {_TURNED[turned]}")
    character = text[position]
    if character == "'" and text[:position].endswith("''"):
        return failure(text, position + 1, "no name has more than two primes; d/dt is applied twice at most")
    printable = character.isprintable() and not character.isspace()
    shown = f"'{character}'" if printable else f"the character U+{ord(character):04X}"
    if printable and not character.isascii():
        shown += f" (U+{ord(character):04X})"
    advice = _ADVICE.get(character, "" if character.isascii() else "expressions are written in ASCII")
    return failure(text, position + 1, f"{shown} has no place in an expression" + (f"; {advice}" if advice else ""))


def exact_number(text: str, token: Token) -> Fraction:
    """Return the value of a number token, exactly; raise ExpressionError where no float can hold it."""
    mantissa, _, exponent = token.text.lower().partition("e")
    if len(exponent) > 5 or abs(int(exponent or 0)) > LARGEST_EXPONENT:
        message = f"the exponent of a number is at most {LARGEST_EXPONENT}, not {exponent[:20]}"
        raise failure(text, token.column, message, "E104")
    value = Fraction(mantissa) * Fraction(10) ** int(exponent or 0)
    try:
        too_small = value != 0 and float(value) == 0
    except OverflowError:
        raise failure(text, token.column, "the number is too large for a floating-point number", "E104") from None
    if too_small:
        raise failure(text, token.column, "the number is too small for a floating-point number", "E104")
    return value


def plain_number(text: str) -> Fraction | None:
    """Return the value of a decimal of few digits, as which large models hold most numbers; None for other texts."""
    if not _PLAIN.fullmatch(text):
        return None
    whole, _, decimals = text.partition(".")
    return Fraction(int(whole + decimals), 10 ** len(decimals))
