"""A program: read PAYLOADS and COUNT fuzzed expressions from SEED on; print what came of them as JSON.

    python fuzz.py PROGRESS_FILE SEED COUNT
"""

import json
import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from hostile import PAYLOADS, mutated, progress, watched

from multibody_sym.errors import ExpressionError
from multibody_sym.text.parser import FUNCTIONS, QUANTITIES, parse, parse_scalar
from multibody_sym.text.printer import text as printed
from multibody_sym.text.units import UNITS

NUMBERS = ["0", "1", "2", "-1", "9.81", ".5", "1e3", "1e308", "1e-308", "12345678901234567890123", "0.1", "1/3", "7"]
NAMES = ["a", "x", "m1", "t", "pi", "E", "phi", "sin", "__x", "'my rod'", "rod.pin"]


def expression(rng: random.Random, depth: int) -> str:
    """Return a text from the grammar, mostly well formed."""
    if depth <= 0:
        return rng.choice(NUMBERS if rng.random() < 0.5 else NAMES)
    a, b = expression(rng, depth - rng.randint(1, 3)), expression(rng, depth - rng.randint(1, 3))
    kind = rng.randrange(8)
    if kind == 0:
        name, arguments = rng.choice(list(FUNCTIONS.items()))
        return f"{name}({', '.join([a, b, a][: len(arguments)])})"
    if kind == 1:
        name, quantity = rng.choice(list(QUANTITIES.items()))
        return f"{name}({', '.join(rng.choice(NAMES) for _ in quantity.arguments)})"
    if kind == 2:
        return f"({a})"
    if kind == 3:
        return f"-{a}"
    return a + rng.choice(["+", " - ", "*", "/", "^", "**", " < ", ">=", " "]) + b


def case(seed: int) -> str:
    """Return the fuzzed text of one seed."""
    rng = random.Random(seed)
    text = expression(rng, rng.randint(1, 12))
    if rng.random() < 0.2:
        text = f"{rng.choice(NUMBERS)} {rng.choice(list(UNITS))}" + rng.choice(["", "^2", "/s", "*m", " + 1"])
    return mutated(rng, text, [expression(rng, 3), rng.choice(PAYLOADS)[:200]]) if rng.random() < 0.6 else text


def complaints(text: str) -> tuple[int, list[str]]:
    """Return how many of the two readings succeeded, and what was wrong with the way they ended."""
    read, wrong = 0, []
    for reading in (parse, parse_scalar):
        try:
            result = reading(text)
        except ExpressionError as error:
            wrong += refused_badly(text, error)
        except BaseException as error:
            wrong.append(f"{type(error).__name__} from {reading.__name__}: {text[:200]!r}")
        else:
            read += 1
            wrong += [] if reading is parse_scalar else printed_badly(result)
    return read, wrong


def refused_badly(text: str, error: ExpressionError) -> list[str]:
    column, excerpt = error.where.column, error.excerpt or ""
    lines = str(error).split("\n")
    fine = (
        column is not None and 1 <= column <= len(text) + 1 and excerpt.count("\n") == 1 and excerpt.endswith("^")
        and len(lines) == 3 and all(line.isprintable() and len(line) < 400 for line in lines)
    )
    return [] if fine else [f"badly refused: {text[:200]!r}: {error!s}"[:600]]


def printed_badly(node: object) -> list[str]:
    try:
        shown = printed(node)
        same = parse(shown) is node
    except ExpressionError as error:  # a constant that overflows in the order of the text
        overflow = "finite" in error.message or "too large" in error.message
        return [] if overflow else [f"not read back: {shown[:200]}: {error}"]
    return [] if same else [f"another Node came back from {shown[:200]}"]


def main(note_file: str, seed: int, count: int) -> None:
    complaints("a + sine(x")  # what is imported for a suggestion is imported now
    events: list[str] = []
    read, wrong, cases = 0, [], 0
    with progress(note_file) as note:
        watched(events)
        for text in [*PAYLOADS, *(case(seed + i) for i in range(count))]:
            note(text)
            found, bad = complaints(text)
            read, cases, wrong = read + found, cases + 1, wrong + bad
    json.dump({"cases": cases, "read": read, "wrong": wrong[:20], "events": events[:20]}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
