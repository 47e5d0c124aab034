"""A program: read YAML payloads and COUNT mutated model files from SEED on; print what came of them as JSON.

    python mutate.py PROGRESS_FILE SEED COUNT MODEL_FILES...
"""

import json
import random
import re
import sys
from dataclasses import fields
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from hostile import PAYLOADS, YAML_PAYLOADS, mutated, progress, watched

from multibody_sym.errors import InputError
from multibody_sym.mechanics.model_files import dumps, load_with_places
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.fields import Element

VALUES = [
    "", "0", "-1", "1e400", "nan", ".inf", "on", "null", "[]", "{}", "[0, 0, 0]", "{a: 1}", "ground", "x", "6 kg",
    "45 deg", "1/0", "2*m", "m l", '"reaction(A, fx)"', "reaction(A, fx)", "'", '"', "- a", "revolute", "t", "pi",
    "1e99", "0.5 m", "[x, y, z]", "position(bob, x)", "__import__('os')", "true", "1:30", "012", "0x1F", "*a", "&a",
    "!!int 1", "|", ">-", "@", "[[[]]]", "2.5", "3*pi", "-x",
]
KEYS = [
    "mass", "q", "type", "parent", "child", "axis", "name", "initial", "inertia", "points", "value", "<<", "x", "0", "",
]


def with_other_values(rng: random.Random, text: str) -> str:
    """Return the file with one to three keys or values replaced by others that are YAML, mostly."""
    for _ in range(rng.randint(1, 3)):
        entries = list(re.finditer(r"([\w ]+):( +)([^,{}\n]*)", text))
        if not entries:
            return text
        entry = rng.choice(entries)
        kind = rng.randrange(4)
        key = rng.choice(KEYS) if kind == 0 else entry[1]
        value = rng.choice([*VALUES, rng.choice(entries)[3]]) if kind else entry[3]
        text = text[: entry.start()] + f"{key}:{entry[2]}{value}" + text[entry.end() :]
    return text


def case(seed: int, models: list[str]) -> bytes:
    """Return the bytes of one seed's file."""
    rng = random.Random(seed)
    text, kind = rng.choice(models), rng.randrange(4)
    if kind == 0:
        text = with_other_values(rng, text)
    elif kind == 1:
        lines = text.splitlines(keepends=True)
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        stripped = lines[i].strip() + " "
        lines[i : i + 1] = rng.choice([[], [lines[j]], [lines[i], lines[j]], [" " + lines[i]], [stripped]])
        text = "".join(lines)
    elif kind == 2:
        text = mutated(rng, text, [*models, rng.choice(PAYLOADS)[:200], rng.choice(YAML_PAYLOADS)[:200]])
    content = text.encode("utf-8", "surrogatepass")
    if kind == 3:
        i = rng.randrange(len(content))
        other = rng.choice([rng.randbytes(1), bytes([content[i] ^ 1 << rng.randrange(7)]), content[i : i + 20]])
        content = content[:i] + other + content[i + rng.randint(0, 3) :]
    return content


def complaints(path: Path, content: bytes) -> tuple[int, list[str]]:
    """Return whether the file is a model, and what was wrong with the way reading it ended."""
    path.write_bytes(content)
    shown = repr(content[:300])
    try:
        system, places = load_with_places(path)
        dumps(system)
        with places.shown():
            mechanism(system)
    except InputError as error:
        where, first = error.where, str(error).split("\n")[0]
        text = content.decode("utf-8", "replace")
        lines = re.split(r"\r\n|\r|\n", text)
        fine = (
            where.file == str(path) and where.line is not None and where.column is not None
            and 1 <= where.line <= len(lines) and 1 <= where.column <= len(lines[where.line - 1]) + 2
            and first.startswith(f"{path}:{where.line}:{where.column}: ") and str(error).replace("\n", "").isprintable()
            and len(first) < 1000 and not (error.excerpt is None and "\n" in str(error))
        )
        return 0, [] if fine else [f"badly refused: {error!s}"[:500] + f" in {shown}"]
    except BaseException as error:
        return 0, [f"{type(error).__name__}: {error!s}"[:300] + f" in {shown}"]
    return 1, []


def completed(kind: type[Element]) -> None:
    """Complete every class of elements, which happens when it is first used: words that are mended may use any."""
    for cls in kind.__subclasses__():
        fields(cls)
        completed(cls)


def main(note_file: str, seed: int, count: int, *files: str) -> None:
    models = [Path(file).read_text(encoding="utf-8") for file in files]
    path = Path(note_file).with_name("model.yaml")
    for text in [*models, "multibody_sym: 1\nnam: x", "multibody_sym: 1\nname: x\nparameters: {a: sine(1)}"]:
        complaints(path, text.encode())  # what is imported on first use is imported now
    completed(Element)
    events: list[str] = []
    read, wrong, cases = 0, [], 0
    payloads = [text.encode("utf-8", "surrogatepass") for text in YAML_PAYLOADS]
    head = "multibody_sym: 1\nname: x\nparameters: {a: "
    payloads += [f"{head}{text[:5000]}}}".encode("utf-8", "surrogatepass") for text in PAYLOADS]
    payloads += [models[0].encode("utf-16"), models[0].encode("latin-1") + b"#\xfc", b"\x00" * 100, b"\xff" * 100]
    with progress(note_file) as note:
        watched(events)
        for content in [*payloads, *(case(seed + i, models) for i in range(count))]:
            note(content[:2000])
            found, bad = complaints(path, content)
            read, cases, wrong = read + found, cases + 1, wrong + bad
    foreign = [event for event in events if str(path) not in event]
    json.dump({"cases": cases, "read": read, "wrong": wrong[:20], "events": foreign[:20]}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:])
