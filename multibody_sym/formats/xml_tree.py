"""XML to a plain tree of elements with their places; nothing but the given bytes is ever read.

Document type declarations are refused, and with them entities, external files and every way to make a small text large.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, Final
from xml.parsers import expat

from multibody_sym.errors import InputError, Where
from multibody_sym.records import dataclass

LARGEST_FILE: Final = 1 << 24
DEEPEST: Final = 100
MOST_ELEMENTS: Final = 200_000


@dataclass(frozen=True)
class XmlElement:
    """An element: its tag, attributes and children in order, and where it begins (line and column from 1)."""

    tag: str
    attributes: Mapping[str, str]
    line: int
    column: int
    children: list[XmlElement] = field(default_factory=list)

    def named(self, tag: str) -> list[XmlElement]:
        """Return the children with a tag."""
        return [child for child in self.children if child.tag == tag]


def read_xml(content: bytes, name: str) -> XmlElement:
    """Return the root element of an XML file's bytes; `name` stands in the errors.

    Raises InputError (with line and column) for what is not XML, and for what is too large, too deep or has a DOCTYPE.
    """
    if len(content) > LARGEST_FILE:
        message = f"a file of this kind has at most {LARGEST_FILE} bytes"
        raise InputError(message, where=Where(file=name, line=1, column=1), number="F105")
    builder = _Builder()
    try:
        builder.parser.Parse(content, True)
    except expat.ExpatError as error:
        where = Where(file=name, line=error.lineno, column=error.offset + 1)
        raise InputError(f"this is not XML: {expat.ErrorString(error.code)}", where=where, number="F105") from None
    except (LookupError, ValueError) as error:
        raise InputError(
            f"the encoding cannot be read: {error}", where=Where(file=name, line=1, column=1), number="F105"
        ) from None
    except InputError as error:
        raise error.located(file=name) from None
    return builder.root[0]


class _Builder:
    """Expat's handlers, which build the tree."""

    def __init__(self) -> None:
        self.root: list[XmlElement] = []
        self.open: list[XmlElement] = []
        self.count = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.StartDoctypeDeclHandler = self.doctype

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if len(self.open) == DEEPEST or self.count > MOST_ELEMENTS:
            raise self.refused(f"more than {DEEPEST} elements inside each other, or {MOST_ELEMENTS} in all")
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        element = XmlElement(tag, attributes, line, column)
        (self.open[-1].children if self.open else self.root).append(element)
        self.open.append(element)

    def end(self, _tag: str) -> None:
        self.open.pop()

    def doctype(self, *_declared: Any) -> None:
        raise self.refused("a DOCTYPE, and with it entities, has no place here; remove it")

    def refused(self, message: str) -> InputError:
        line, column = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        return InputError(message, where=Where(line=line, column=column), number="F105")
