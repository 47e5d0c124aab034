"""A program: read COUNT mutated URDF files from SEED on; print what came of them as JSON.

    python mutate_urdf.py PROGRESS_FILE SEED COUNT URDF_FILE
"""

import json
import random
import re
import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent.parent))

from hostile import PAYLOADS, mutated, progress, watched

from multibody_sym.errors import InputError
from multibody_sym.mechanics.model_files import dumps, loads
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.model.urdf import load_urdf

VALUES = [
    "", "0", "-1", "1e400", "1e308", "1e-400", "1e-320", "nan", "inf", "0 0 0", "1 1 1", "1e300 1e300 1e300", "base",
    "hand", "ground", "upper.arm", "hand.tool", "tool", "t", "pi", "&#x202e;", "&#9;", "&#1;", "&a;", "&lt;", "a b",
    "revolute", "planar", "floating", "fixed", "continuous", "prismatic", "1.5707963", "${x}", "\u0661", "1_0", "+.5",
]
ELEMENTS = [
    "<link name='x'/>", "<axis xyz='0 0 1'/>", "<mimic joint='wheel' multiplier='2'/>", "<origin/>", "<a><b/></a>",
    "<!DOCTYPE a>", "<!-- -->", "<![CDATA[x]]>", "<?php x?>", "</robot>", "<inertial/>", "<mass value='1'/>",
]


def case(seed: int, text: str) -> bytes:
    """Return the bytes of one seed's file."""
    rng = random.Random(seed)
    for _ in range(rng.randint(1, 3)):
        kind = rng.randrange(4)
        values = list(re.finditer(r'="([^"]*)"', text))
        if kind == 0 and values:
            value = rng.choice(values)
            text = text[: value.start(1)] + rng.choice([*VALUES, rng.choice(values)[1]]) + text[value.end(1) :]
        elif kind == 1:
            elements = list(re.finditer(r"<[^>]*/>|<(\w+)[^>]*>.*?</\1>", text, re.DOTALL))
            if elements:
                element = rng.choice(elements)
                new = rng.choice(["", element[0] * 2, rng.choice(elements)[0], rng.choice(ELEMENTS)])
                text = text[: element.start()] + new + text[element.end() :]
        elif kind == 2:
            text = mutated(rng, text, [text, rng.choice(PAYLOADS)[:200]])
    return text.encode("utf-8", "surrogatepass")


def complaints(path: Path, content: bytes) -> tuple[int, list[str]]:
    """Return whether the file is a robot, and what was wrong with the way reading it ended."""
    path.write_bytes(content)
    shown = repr(content[:300])
    try:
        system = load_urdf(path, floating=len(content) % 2 == 0)
        mechanism(system)
        return 1, [] if loads(dumps(system)) == system else [f"written and read is not the same: {shown}"]
    except InputError as error:
        where, first = error.where, str(error).split("\n")[0]
        fine = (
            where.file == str(path) and where.line is not None and where.column is not None
            and first.startswith(f"{path}:{where.line}:{where.column}: ") and str(error).isprintable()
            and len(first) < 1000
        )
        return 0, [] if fine else [f"badly refused: {error!s}"[:500] + f" in {shown}"]
    except BaseException as error:
        return 0, [f"{type(error).__name__}: {error!s}"[:300] + f" in {shown}"]


def main(note_file: str, seed: int, count: int, file: str) -> None:
    warnings.simplefilter("ignore")
    text = Path(file).read_text(encoding="utf-8")
    path = Path(note_file).with_name("robot.urdf")
    for content in (text.encode(), b"<robot/>", b"<robot><link/></robot>", b"<robot>", b"<a>" * 200):
        complaints(path, content)  # what is imported on first use is imported now
    events: list[str] = []
    read, wrong = 0, []
    with progress(note_file) as note:
        watched(events)
        for content in (case(seed + i, text) for i in range(count)):
            note(content[:2000])
            found, bad = complaints(path, content)
            read, wrong = read + found, wrong + bad
    foreign = [event for event in events if str(path) not in event]
    json.dump({"read": read, "wrong": wrong[:20], "events": foreign[:20]}, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), *sys.argv[4:])
