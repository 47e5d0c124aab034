"""Pieces of Markdown: tables, code, text that keeps its letters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def cell(text: str) -> str:
    """Return text as the cell of a table holds it."""
    return " ".join(str(text).split()).replace("|", "\\|")


def code(text: str) -> str:
    """Return text as code within a line."""
    return f"`{cell(text)}`" if text and "`" not in text else cell(text)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def block(text: str, language: str) -> str:
    """Return a block of code in a language."""
    fence = "```" if "```" not in text else "~~~~"
    return f"{fence}{language}\n{text.rstrip()}\n{fence}\n"


def plain(text: str) -> str:
    """Return text of people in which nothing is a tag or an emphasis."""
    return re.sub(r"([<>*_\[\]])", r"\\\1", text)


def paragraphs(docstring: str | None) -> str:
    """Return a docstring as Markdown: its own `code` stays, all else is plain text."""
    parts = re.split(r"(`[^`]*`)", docstring or "")
    return "".join(part if part.startswith("`") else plain(part) for part in parts)


def anchor(heading: str) -> str:
    """Return the name under which a page's heading is linked."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())
