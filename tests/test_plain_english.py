"""Pages for users say one thing a sentence, in at most 25 words, subject first."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
FOLDERS = (DOCS, DOCS / "guide", DOCS / "tutorials")
PAGES = [ROOT / "README.md", *(page for folder in FOLDERS for page in sorted(folder.glob("*.md")))]
LONGEST = 25
MEASURED = DOCS / "guide" / "figures.md"
"""Its tables name what was measured, in no sentences."""
RIDDLES = re.compile(
    r"\b(?:is|are|was|were|be|not) told\b|\btells?\b|\bnobody\b|\bthat which\b|\bwhat is (?:no|not|given)\b"
    r"|(?:^|[.;:] )What (?!is\b|are\b|if\b)\w+(?![^.]*\?)",
    re.IGNORECASE | re.MULTILINE,
)


def sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a page: paragraphs, items of lists and cells of tables; a piece of code is one word."""
    prose = re.sub(r"\A---\n.*?\n---\n|^```.*?^```$|<[^>]+>", "\n\n", text, flags=re.MULTILINE | re.DOTALL)
    for paragraph in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) )|\n(?=\|)|^#+ .*$", prose, flags=re.MULTILINE):
        for piece in paragraph.split("|") if paragraph.startswith("|") else [paragraph]:
            plain = re.sub(r"`[^`]*`", "code", re.sub(r"\]\([^)]*\)", "]", piece))
            if plain.count("[") < 20:
                yield from re.split(r"(?<=[.!?])\s+(?=[A-Z`\[*c(])", " ".join(plain.split()))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_sentences_are_short(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    if page == MEASURED:
        text = re.sub(r"^\|.*$", "", text, flags=re.MULTILINE)
    long = [each for each in sentences(text) if len(re.findall(r"\w[\w'.,-]*", each)) > LONGEST]
    assert long == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_sentences_have_a_subject(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert [text[max(0, found.start() - 60) : found.end() + 40] for found in RIDDLES.finditer(text)] == []
