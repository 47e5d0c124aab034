"""The events of a YAML text: of libyaml's parser where it is there and the text is plain, else of PyYAML's in Python.

libyaml needs a twentieth of the time, but takes a slightly different language (`a:<tab>b` is one text in Python) and
puts its errors elsewhere. So it reads plain texts only: lines of ASCII with names, numbers, expressions, lists, maps
and folded texts, of which both say the same (tests/formats/test_yaml_events.py). What it refuses is read again, to be
refused in Python's words.
"""

from __future__ import annotations

import re
from typing import Any, Final

import yaml
from yaml.error import YAMLError
from yaml.events import StreamEndEvent
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.scanner import Scanner

CParser: Any = getattr(getattr(yaml, "cyaml", None), "CParser", None)
"""libyaml's scanner and parser; None where PyYAML was built without it."""

_LONGEST_LINE: Final = 1000
"""Characters; a key may not be longer than 1024."""
_BEHIND: Final = r"(?<=[A-Za-z0-9_.)])"
_IN_TEXT: Final = (
    r"[A-Za-z0-9_./()+]|-(?=[A-Za-z0-9_.(])|(?<=[A-Za-z0-9_.)] )[-*<>](?= )"
    rf"|{_BEHIND}[-*^<>=]|(?<=[<>])=|(?<=[A-Za-z0-9_.)] )[<>](?==)| (?! {{0,99}}#)"
)
"""A character of a name, number or expression. Parts that repeat never begin alike: a line is matched in one go."""
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
    """Events that are all known."""

    def __init__(self, events: list[Any]) -> None:
        self._events = iter(events)

    def get_event(self) -> Any:
        """Return the next event."""
        return next(self._events)


def events_of(text: str) -> Any:
    """Return what yields the events of a text, one by one, by `get_event`, or raises YAMLError there."""
    ready = _of_libyaml(text) if CParser is not None and is_plain(text) else None
    return _PythonEvents(text) if ready is None else _Ready(ready)


def is_plain(text: str) -> bool:
    """Return whether both parsers say the same of a text that libyaml takes."""
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
        depth += _opened(written)
    return True


def _opened(line: str) -> int:
    """Return how many brackets a line leaves open."""
    if "[" not in line and "{" not in line and "]" not in line and "}" not in line:
        return 0
    bare = _NO_BRACKETS.sub("", line)
    return bare.count("[") + bare.count("{") - bare.count("]") - bare.count("}")


def _of_libyaml(text: str) -> list[Any] | None:
    """Return all events of a text, None where libyaml refuses it."""
    parser, found = CParser(text), list[Any]()
    try:
        while not (found and isinstance(found[-1], StreamEndEvent)):
            found.append(parser.get_event())
    except YAMLError:
        return None
    finally:
        parser.dispose()
    return found
