"""YAML text to a tree of maps, lists and texts with the line and column of everything.

The events come from libyaml's parser where it exists and the text is plain, else from PyYAML's in Python. libyaml needs
a twentieth of the time, but takes a slightly different language (`a:<tab>b` is one text in Python) and puts its errors
elsewhere. So it reads plain texts only: lines of ASCII with names, numbers, expressions, lists, maps and folded texts,
on which both agree (tests/text/test_yaml_events.py). A text that it refuses is read again, for Python's errors.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import field
from typing import Any, Final, NamedTuple

import yaml
from yaml.error import MarkedYAMLError, YAMLError
from yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
    SequenceEndEvent,
    StreamEndEvent,
)
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.scanner import Scanner

from multibody_sym.errors import InputError, Where, join_errors
from multibody_sym.records import dataclass
from multibody_sym.text.tokens import surroundings

CParser: Any = getattr(getattr(yaml, "cyaml", None), "CParser", None)
"""libyaml's scanner and parser; None where PyYAML was built without it."""

_LONGEST_LINE: Final = 1000
"""Characters; a key may not be longer than 1024."""
_BEHIND: Final = r"(?<=[A-Za-z0-9_.)])"
_IN_TEXT: Final = (
    r"[A-Za-z0-9_./()+]|-(?=[A-Za-z0-9_.(])|(?<=[A-Za-z0-9_.)] )[-*<>](?= )"
    rf"|{_BEHIND}[-*^<>=]|(?<=[<>])=|(?<=[A-Za-z0-9_.)] )[<>](?==)| (?! {{0,99}}#)"
)
"""A character of a name, number or expression. Repeated parts never begin alike, so that matching takes linear time."""
_QUOTED: Final = r"\"[^\"\\]*\"|'[^']*'"
_IN_FLOW: Final = rf"{_IN_TEXT}|{_QUOTED}|(?<=[A-Za-z0-9_]):(?= {{1,99}}[^ #,\]}}])|,(?= |$)|[\[\]{{}}]"
_VALUE: Final = rf"(?=[-A-Za-z0-9_./(+])(?!-[- ]|-$)(?:{_IN_TEXT})+|{_QUOTED}|(?=[\[{{])(?:{_IN_FLOW})+"
_COMMENT: Final = r"(?: +#[ -~]*)?"
_OF_BLOCK: Final = re.compile(rf"(?:- +)?(?:[A-Za-z][A-Za-z0-9_.]*:(?: +|$))?(?:(?:{_VALUE}){_COMMENT}|#[ -~]*|)")
_OF_FLOW: Final = re.compile(rf"(?:{_IN_FLOW})+{_COMMENT}|#[ -~]*|")
"""Lines without the blanks at their ends: outside of brackets, and begun inside of some."""
_FOLDED: Final = re.compile(r"[A-Za-z_]+: >-")
_IN_FOLDED: Final = re.compile(r"  [!-~][ -~]*|")
"""The begin of a text of several lines at the top, such as a description, and its lines."""
_NO_BRACKETS: Final = re.compile(rf"{_QUOTED}| #.*|^#.*")


class _PythonEvents(Reader, Scanner, Parser):
    """PyYAML's reader, scanner and parser without composer, constructor and resolver."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)


class _Ready:
    """Events that have all been read."""

    def __init__(self, events: list[Any]) -> None:
        self._events = iter(events)

    def get_event(self) -> Any:
        return next(self._events)


def events_of(text: str) -> Any:
    """Return a source of the events of a text; its `get_event` returns the next one or raises YAMLError."""
    if CParser is None or not is_plain(text):
        return _PythonEvents(text)
    parser, events = CParser(text), list[Any]()
    try:
        while not (events and isinstance(events[-1], StreamEndEvent)):
            events.append(parser.get_event())
    except YAMLError:
        return _PythonEvents(text)
    finally:
        parser.dispose()
    return _Ready(events)


def is_plain(text: str) -> bool:
    """Return whether both parsers read a text alike if libyaml takes it."""
    if not text.isascii() or "\r" in text:
        return False
    depth, folded = 0, False
    for line in text.split("\n"):
        if folded and _IN_FOLDED.fullmatch(line):
            continue
        if folded and line.startswith(" "):
            return False
        folded = not depth and _FOLDED.fullmatch(line) is not None
        written = "" if folded else line.strip(" ")
        if len(line) > _LONGEST_LINE or not (_OF_FLOW if depth else _OF_BLOCK).fullmatch(written):
            return False
        if any(bracket in written for bracket in "[{]}"):
            bare = _NO_BRACKETS.sub("", written)
            depth += bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}")
    return True


# ----------------------------------------------------------------------------------------------------------------------
# The tree.
#
# Only the events of the parser are used, never its constructors: every scalar stays text, so that the field which reads
# it gives a meaning to `1e3`, `012`, `on`, `1:30` and `0x1F`.


LARGEST_FILE: Final = 1 << 20
DEEPEST: Final = 40
MOST_NODES: Final = 100_000

Path = tuple[str, ...]

_FORBIDDEN: Final = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069"
    "\ud800-\udfff\ufeff\ufffe\uffff]"
)
_LINE_END: Final = re.compile(r"\r\n|\r|\n")


class Place(NamedTuple):
    """Line and column (from 1) of a key or a value; `inner` is the column of the first character of a text.

    `inner` is None for texts that the file spells differently: block scalars, several lines, escapes.
    """

    line: int
    column: int
    inner: int | None = None
    is_text: bool = False


@dataclass(frozen=True)
class Tree:
    """The content of a file (maps, lists, text), and the places of keys and of values by their paths.

    A path is the keys, and the indices of list items as text, from the root: `("bodies", "crank", "com", "1")`.
    `mistakes` leave the tree readable: repeated keys, of which it holds the first.
    """

    data: Any
    text: str = field(default="", compare=False)
    keys: dict[Path, Place] = field(default_factory=dict, compare=False)
    values: dict[Path, Place] = field(default_factory=dict, compare=False)
    mistakes: tuple[InputError, ...] = field(default=(), compare=False)

    def line(self, number: int) -> str:
        """Return a line of the text, counted from 1."""
        return _LINE_END.split(self.text)[number - 1]

    def at(self, path: Path) -> Any:
        part = self.data
        for step in path:
            part = part[int(step)] if isinstance(part, list) else part[step]
        return part


def read_bytes(content: bytes, name: str, *, readable: bool = False) -> Tree:
    """Return the tree of a YAML file's bytes; `name` stands in the errors. Raises InputError with line and column.

    A tree that is `readable` is returned with its mistakes.
    """
    _require_size(len(content), name)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\x00" in content[:4]:
        raise _error(name, Place(1, 1), "the file is not in UTF-8 (it looks like UTF-16); save it as UTF-8")
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        before = content[: error.start].decode("utf-8")
        message = f"the byte 0x{content[error.start]:02X} is not valid UTF-8; save the file as UTF-8"
        raise _error(name, _place_at(before, len(before)), message) from None
    return read_text(text, name, readable=readable)


def read_text(text: str, name: str, *, readable: bool = False) -> Tree:
    """Return the tree of a YAML text, as `read_bytes`."""
    text = text.removeprefix("\ufeff")
    _require_size(len(text), name)
    forbidden = _FORBIDDEN.search(text)
    if forbidden:
        message = f"the character U+{ord(forbidden[0]):04X} has no place in a model file"
        raise _error(name, _place_at(text, forbidden.start()), message)
    tree = _TreeBuilder(text, name).whole()
    if tree.mistakes and not readable:
        raise join_errors(tree.mistakes)
    return tree


def _require_size(size: int, name: str) -> None:
    if size > LARGEST_FILE:
        raise _error(name, Place(1, 1), f"a model file has at most {LARGEST_FILE} bytes, not {size}")


def _error(name: str, place: Place, message: str) -> InputError:
    return InputError(message, where=Where(file=name, line=place.line, column=place.column), number="F102")


def _place_at(text: str, index: int) -> Place:
    ends = [match.end() for match in _LINE_END.finditer(text, 0, index)]
    return Place(len(ends) + 1, index - (ends[-1] if ends else 0) + 1)


_YAML_TREE_QUOTED: Final = re.compile(r""" "(?:\\.|[^"\\])*" | '(?:''|[^'])*' """, re.VERBOSE)
_COMMENT_LIKE_NAME: Final = re.compile(r"(?:^|(?<=[\s\[{,]))#(?=\S)")
_JOINED: Final = re.compile(r"([A-Za-z_]\w*)\s*[:=]\s*(\S.*)")
_YAML_TREE_COMMENT: Final = (
    'a # behind a blank or a bracket begins a comment, which hides the rest of the line: quote the name, "b #"'
)


class _TreeBuilder:
    """The state of one reading: the remaining events, the places so far."""

    def __init__(self, text: str, name: str) -> None:
        self.text, self.name = text, name
        self.events: Any = events_of(text)
        self.nodes = 0
        self.keys: dict[Path, Place] = {}
        self.values: dict[Path, Place] = {}
        self.mistakes: list[InputError] = []

    def whole(self) -> Tree:
        try:
            return self.tree()
        except InputError as error:
            raise join_errors([*self.mistakes, error]) from None

    def tree(self) -> Tree:
        self.next()
        start = self.next()
        if isinstance(start, StreamEndEvent):
            raise _error(self.name, Place(1, 1), "the file is empty")
        data = self.value(self.next(), (), False)
        self.next()
        after = self.next()
        if isinstance(after, DocumentStartEvent):
            raise self.error(after.start_mark, "a second document starts here; a model file holds one")
        return Tree(data, self.text, self.keys, self.values, tuple(self.mistakes))

    def error(self, mark: Any, message: str) -> InputError:
        return self.error_at(Place(mark.line + 1, mark.column + 1) if mark else Place(1, 1), message)

    def error_at(self, place: Place, message: str) -> InputError:
        error = _error(self.name, place, message)
        lines = _LINE_END.split(self.text)
        error.excerpt = surroundings(lines[min(place.line, len(lines)) - 1], place.column)
        return error

    def hidden_by_comment(self, error: MarkedYAMLError) -> Place | None:
        """Return the place of a # without a blank behind it that hides the bracket which an error misses."""
        begin, end = error.context_mark, error.problem_mark
        if begin is None or end is None or not str(error.context).startswith("while parsing a flow"):
            return None
        lines = self.text.splitlines()
        first = max(begin.line - 1, 0)
        for k, line in enumerate(lines[first : end.line + 1], first + 1):
            plain = _YAML_TREE_QUOTED.sub(lambda quoted: "q" * len(quoted[0]), line)
            for match in _COMMENT_LIKE_NAME.finditer(plain):
                before = plain[: match.start()]
                if sum(map(before.count, "[{")) > sum(map(before.count, "]}")):
                    return Place(k, match.start() + 1)
        return None

    def verify_apart(self, error: MarkedYAMLError) -> None:
        """Raise InputError where the line of an error joins a key to its value, without a blank between."""
        begin = error.context_mark
        line = "" if begin is None else self.text.splitlines()[begin.line :][:1]
        joined = _JOINED.fullmatch(line[0].strip()) if line else None
        if joined and str(error.problem).startswith("could not find expected ':'"):
            raise self.error(begin, _joined_message(joined)) from None

    def next(self) -> Any:
        try:
            event = self.events.get_event()
        except MarkedYAMLError as error:
            hidden = self.hidden_by_comment(error)
            if hidden is not None:
                raise self.error_at(hidden, _YAML_TREE_COMMENT) from None
            self.verify_apart(error)
            raise self.error(error.problem_mark or error.context_mark, _plain_problem(error)) from None
        except (ValueError, OverflowError):
            raise self.error(self.events.get_mark(), "a number in this escape or directive is out of range") from None
        if isinstance(event, NodeEvent):
            self.check(event)
        return event

    def check(self, event: Any) -> None:
        self.nodes += 1
        if self.nodes > MOST_NODES:
            raise self.error(event.start_mark, f"a model file has at most {MOST_NODES} keys and values")
        if isinstance(event, AliasEvent) or event.anchor is not None:
            message = "anchors (&name) and aliases (*name) are not allowed; quote text that starts with & or *"
            raise self.error(event.start_mark, message)
        if getattr(event, "tag", None) is not None:
            raise self.error(event.start_mark, "tags (!name) are not allowed; quote text that starts with !")

    def value(self, event: Any, path: Path, in_flow: bool) -> Any:
        if len(path) > DEEPEST:
            raise self.error(event.start_mark, f"the file is nested more than {DEEPEST} deep")
        if isinstance(event, ScalarEvent):
            self.values[path] = self.scalar_place(event)
            return self.scalar(event, in_flow)
        mark = event.start_mark
        self.values[path] = Place(mark.line + 1, mark.column + 1)
        if isinstance(event, MappingStartEvent):
            return self.mapping(path, bool(event.flow_style))
        return self.sequence(path, bool(event.flow_style))

    def sequence(self, path: Path, in_flow: bool) -> list[Any]:
        items: list[Any] = []
        while not isinstance(event := self.next(), SequenceEndEvent):
            items.append(self.value(event, (*path, str(len(items))), in_flow))
        return items

    def mapping(self, path: Path, in_flow: bool) -> dict[str, Any]:
        content: dict[str, Any] = {}
        while not isinstance(event := self.next(), MappingEndEvent):
            if not isinstance(event, ScalarEvent):
                raise self.error(event.start_mark, "a key must be a name, not a list or a map")
            key, place = self.scalar(event, in_flow), self.scalar_place(event)
            inside = (*path, key)
            if key in content:
                first = self.keys[inside]
                message = f"the key {key!r} stands here a second time; first in line {first.line}"
                self.mistakes.append(self.error(event.start_mark, message))
                self.again(content[key], inside, in_flow)
                continue
            if not key or "\n" in key:
                raise self.error(event.start_mark, "a key must be a name on one line")
            self.keys[inside] = place
            content[key] = self.value(self.next(), inside, in_flow)
            if content[key] == "" and not event.style and (joined := _JOINED.fullmatch(key)):
                raise self.error(event.start_mark, _joined_message(joined))
        return content

    def again(self, first: Any, path: Path, in_flow: bool) -> None:
        """Read the content of a repeated key; a section's elements with new names are added to the `first`."""
        keys, values, self.keys, self.values = self.keys, self.values, {}, {}
        second, more, places = self.value(self.next(), path, in_flow), self.keys, self.values
        self.keys, self.values = keys, values
        if len(path) == 1 and isinstance(first, dict) and isinstance(second, dict):
            new = {name: x for name, x in second.items() if name not in first}
            first.update(new)
            keys.update((at, place) for at, place in more.items() if at[1] in new)
            values.update((at, place) for at, place in places.items() if len(at) > 1 and at[1] in new)

    def scalar(self, event: Any, in_flow: bool) -> str:
        text: str = event.value
        forbidden = _FORBIDDEN.search(text)
        if forbidden:
            message = f"the character U+{ord(forbidden[0]):04X} has no place in a model file"
            raise self.error(event.start_mark, message)
        if in_flow and not event.style and text.count("(") > text.count(")"):
            message = (
                f"the comma ends this value before its ( is closed; inside [...] or {{...}} an expression that "
                f'contains a comma is quoted: "{self.whole_expression(event)}"'
            )
            raise self.error(event.start_mark, message)
        return text

    def whole_expression(self, event: Any) -> str:
        """Return the expression that a comma cut off, up to the comma or bracket behind it."""
        line = _LINE_END.split(self.text[event.start_mark.index :], maxsplit=1)[0]
        depth = 0
        for k, character in enumerate(line):
            if depth <= 0 and character in ",:]}":
                return _printable(line[:k].strip())
            depth += (character == "(") - (character == ")")
        return _printable(f"{event.value[:20]}, ...)")

    def scalar_place(self, event: Any) -> Place:
        start, end = event.start_mark, event.end_mark
        quote = 1 if event.style in ("'", '"') else 0
        verbatim = self.text[start.index + quote : end.index - quote] == event.value
        return Place(start.line + 1, start.column + 1, start.column + 1 + quote if verbatim else None, True)


def _joined_message(joined: re.Match[str]) -> str:
    key, value = joined[1], joined[2]
    return f"a colon and a blank stand between a key and its value: {key}: {_printable(value[:40])}"


def _plain_problem(error: MarkedYAMLError) -> str:
    problem = str(error.problem or error.context or "this is not YAML")
    for pattern, message in _PLAIN_WORDS.items():
        match = re.search(pattern, problem)
        if match:
            return message(match) if callable(message) else message
    return _printable(problem)


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def _special_character(match: re.Match[str]) -> str:
    character = match[1]
    if character == "\\t":
        return "a tab has no place here; indent with blanks"
    return f"text that starts with {_printable(character)} is quoted"


_PLAIN_WORDS: Final[dict[str, str | Callable[[re.Match[str]], str]]] = {
    r"^found character '(.*)' that cannot start any token": _special_character,
    r"^found duplicate anchor": "anchors are not allowed",
    r"^mapping values are not allowed here": "a ':' has no place here; is a quote, a line break or an indent missing?",
    r"^could not find expected ':'": "this line is neither 'key: value' nor the continuation of the one before",
    r"^expected <block end>, but found '(.*)'": lambda m: (
        f"{_spell(m[1])} has no place here; does the indent fit the lines above?"
    ),
    r"^expected ',' or '([\]}])', but got '(.*)'": lambda m: f"a ',' or '{m[1]}' is missing before {_spell(m[2])}",
    r"^expected the node content, but found '(.*)'": lambda m: f"a value is missing before {_spell(m[1])}",
    r"^found unexpected end of stream": "the quote that opens before is never closed",
    r"^found unexpected document separator": "the quote that opens before is never closed",
    r"^found undefined tag handle": "tags (!name) are not allowed; quote text that starts with !",
    r"^expected '<document start>', but found": "the document ends before this; is an indent or a bracket wrong?",
    r"^(sequence|block sequence) entries are not allowed here": "a '- ' has no place here; does the indent fit?",
    r"^mapping keys are not allowed here": "a key has no place here; does the indent fit?",
}


def _spell(token: str) -> str:
    return {
        "<stream end>": "the end of the file",
        "<block mapping start>": "this key",
        "<block sequence start>": "this list",
        "<block end>": "the end of the indented part",
        "<scalar>": "this text",
        "?": "this key",
        "<block mapping end>": "the end of the indented part",
    }.get(token, f"'{_printable(token)}'")
