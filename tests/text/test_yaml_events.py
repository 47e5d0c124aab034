"""libyaml against PyYAML's own parser: the same trees, places and refusals for every text, damaged ones too."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import pytest
from mutate import case

from multibody_sym.errors import InputError
from multibody_sym.text import yaml_tree
from multibody_sym.text.yaml_tree import CParser, is_plain, read_bytes, read_text

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").rglob("*.yaml"))
DATA = sorted((Path(__file__).parent / "data").glob("*.yaml"))
TOKENS = [
    "a", "b1", "m*l^2", "-1.5", "2 kg", "x - y", "atan2(y", "x)", "[", "]", "{", "}", ",", ", ", ":", ": ", " ", "  ",
    "\n", "\n  ", "\n    ", "- ", "'q, r'", '"s: t"', " # c", "\n# d", "\n\n", "a: ", "b: ", "key:", "-", "''", '""',
    "(", "<", "=", "*", "/", "&a", "*a", "!t", "|", ">", "\t", "\r", "?", "%", "@", "---", "...", "#", '"', "'", "\\n",
    "\u00e9", "~", "<<", "\nd: >-\n  ", "\nd: >-\n",
]  # fmt: skip
needs_libyaml = pytest.mark.skipif(CParser is None, reason="PyYAML without libyaml")


def outcome(content: bytes) -> Any:
    try:
        tree = read_bytes(content, "f")
    except InputError as error:
        return str(error), error.where
    return tree.data, tree.keys, tree.values


def compared(contents: list[bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    found = [outcome(content) for content in contents]
    monkeypatch.setattr(yaml_tree, "CParser", None)
    for content, seen in zip(contents, found, strict=True):
        assert outcome(content) == seen, content


def corpus(first: int, count: int) -> list[bytes]:
    """Return the damaged files that the test of hostile files reads."""
    models = [path.read_text(encoding="utf-8") for path in (*EXAMPLES, *DATA)]
    return [case(seed, models) for seed in range(first, first + count)]


def random_texts(first: int, count: int) -> list[bytes]:
    texts = []
    for seed in range(first, first + count):
        rng = random.Random(seed)
        likely = rng.randrange(20, len(TOKENS))
        words = [rng.choice(TOKENS[:likely]) for _ in range(rng.randrange(1, 14))]
        texts.append((rng.choice(["", "a: "]) + "".join(words) + rng.choice(["", "\n"])).encode())
    return texts


@needs_libyaml
def test_damaged_files_end_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    compared(corpus(1, 120), monkeypatch)


@needs_libyaml
@pytest.mark.long
def test_many_damaged_files_end_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    compared(corpus(1, 300) + corpus(10_000, 5_000), monkeypatch)


@needs_libyaml
def test_random_texts_end_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    compared(random_texts(0, 3_000), monkeypatch)


@needs_libyaml
@pytest.mark.long
def test_many_random_texts_end_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    compared(random_texts(100_000, 500_000), monkeypatch)


@needs_libyaml
def test_most_examples_are_plain_and_libyaml_reads_them(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = [path.read_text(encoding="utf-8") for path in EXAMPLES]
    assert sum(map(is_plain, texts)) >= 0.9 * len(texts)
    monkeypatch.setattr(yaml_tree, "_PythonEvents", None)
    for text in filter(is_plain, texts):
        assert read_text(text, "f").data


@pytest.mark.parametrize(
    "text", ["a:\tb", "a: b\r\n", "a: é", "a: &b c", "a: *b", "a: !b c", "a: |\n  b", "? a", "a: %b", "[a:\n]"]
)
def test_what_is_left_to_python(text: str) -> None:
    assert not is_plain(text)


def test_without_libyaml_all_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_tree, "CParser", None)
    assert read_text("a: [1, 2]\n", "f").data == {"a": ["1", "2"]}


def test_a_tab_behind_a_colon_belongs_to_the_text() -> None:
    """libyaml takes it as the blank behind a key."""
    with pytest.raises(InputError):
        read_text("x: 1\na:\tb: 2\n", "f")
