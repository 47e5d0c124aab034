"""The lengths of all formulas that `solve` and `derive` give for the examples, and the CPU seconds that they took.

    python benchmarks/formula_lengths.py written.json             # what this version writes; then, after a change,
    python benchmarks/formula_lengths.py new.json written.json    # the same, and what has become shorter or longer

Every formula that has changed is compared with its old text at 20 random points in 50 digits: both must be the same
number wherever both have one. Conditions are compared by their lengths alone, since what they say may be said anew.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from mpmath import MPContext

from multibody_sym.cli.main import main
from multibody_sym.errors import MultibodyError
from multibody_sym.scalars.elementary import leaves, postorder
from multibody_sym.scalars.node import PI, Node
from multibody_sym.text.parser import parse

EXAMPLES = Path(__file__).parent.parent / "examples"
COMMANDS = ("solve", "derive")
POINTS = 20
PRECISE = MPContext()
PRECISE.dps = 50


def formulas(value: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield (place, text) of each formula in what `--json` prints; `steps` and LaTeX tell the same once more."""
    if isinstance(value, dict):
        for key, part in value.items():
            if key not in ("steps", "latex", "units", "limits"):
                yield from formulas(part, f"{path}/{key}")
    elif isinstance(value, list):
        for k, part in enumerate(value):
            yield from formulas(part, f"{path}/{k}")
    elif isinstance(value, str) and _is_formula(path):
        yield path, value


def _is_formula(path: str) -> bool:
    words = path.split("/")
    names = {"expression", "text", "kinetic_energy", "potential_energy", "formula"}
    return words[-1] in names or bool({"mass_matrix", "forcing", "conditions", "definitions"} & set(words))


def written(examples: Path) -> dict[str, Any]:
    """Return for each command on each example its CPU seconds and its formulas."""
    found = {}
    for path in sorted(examples.rglob("*.yaml")):
        for command in COMMANDS:
            out = io.StringIO()
            begun = time.process_time()
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
                code = main([command, str(path), "--json"])
            seconds = time.process_time() - begun
            name = f"{command} {path.relative_to(examples).with_suffix('')}"
            answer = dict(formulas(json.loads(out.getvalue()))) if code == 0 else {}
            found[name] = {"seconds": seconds, "code": code, "formulas": answer}
            print(f"{name:45} {seconds:8.2f} s {sum(map(len, answer.values())):8} characters", flush=True)
    return found


# --- two versions --------------------------------------------------------------------------------------------------


def compared(old: dict[str, Any], new: dict[str, Any]) -> bool:
    """Print what is shorter, longer, gone or not equal; return whether nothing is worse."""
    worse = 0
    for name in sorted(old.keys() & new.keys()):
        before, after = old[name]["formulas"], new[name]["formulas"]
        for place in dict.fromkeys([*before, *after]):
            was, now = before.get(place), after.get(place)
            if was == now:
                continue
            verdict = _verdict(place, was, now)
            worse += verdict in ("LONGER", "GONE", "NOT EQUAL")
            print(f"{verdict:9} {name} {place}\n    {len(was or ''):4} {was}\n    {len(now or ''):4} {now}")
    for command in COMMANDS:
        seconds = [sum(x["seconds"] for name, x in all_.items() if name.startswith(command)) for all_ in (old, new)]
        lengths = [
            sum(len(text) for name, x in all_.items() if name.startswith(command) for text in x["formulas"].values())
            for all_ in (old, new)
        ]
        print(f"{command}: {lengths[0]} -> {lengths[1]} characters, {seconds[0]:.1f} -> {seconds[1]:.1f} s of CPU")
    print(f"{worse} places are worse")
    return worse == 0


def _verdict(place: str, was: str | None, now: str | None) -> str:
    if was is None or now is None:
        return "NEW" if was is None else "GONE"
    if "conditions" not in place and not equal(was, now):
        return "NOT EQUAL"
    return "shorter" if len(now) < len(was) else "LONGER" if len(now) > len(was) else "other"


def equal(first: str, second: str) -> bool:
    """Return whether two formulas have the same values at random points; equations are not looked into."""
    if "=" in first:
        return True
    try:
        pair = [parse(first), parse(second)]
    except MultibodyError:
        return True
    names = sorted(map(str, leaves(pair, "symbol")))
    rng = random.Random(0)
    for _ in range(POINTS):
        point = {name: PRECISE.mpf(rng.randint(1, 10**6)) / 10**6 + rng.randint(0, 3) for name in names}
        a, b = (_value(node, point) for node in pair)
        if a is not None and b is not None and abs(a - b) > PRECISE.mpf(10) ** -35 * (1 + abs(a)):
            return False
    return True


def _value(root: Node, point: dict[str, Any]) -> Any:
    known: dict[Node, Any] = {}
    try:
        for node in postorder([root]):
            args = [known[a] for a in node.args]
            known[node] = _of(node, args, point)
    except (ZeroDivisionError, ValueError):
        return None
    return known[root]


def _of(node: Node, args: list[Any], point: dict[str, Any]) -> Any:
    if node is PI:
        return +PRECISE.pi
    if node.op == "symbol":
        return point[str(node)]
    if node.op == "number":
        return PRECISE.mpf(node.data.numerator) / node.data.denominator
    if node.op == "real":
        return PRECISE.mpf(repr(node.data))
    plain = {"neg": lambda a: -a, "add": lambda a, b: a + b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b}
    return plain[node.op](*args) if node.op in plain else _FUNCTIONS.get(node.op, node.op)(*args)


_FUNCTIONS: dict[str, Any] = {
    "pow": PRECISE.power, "abs": abs, "sign": PRECISE.sign, "min": min, "max": max,
    **{op: getattr(PRECISE, op) for op in "sqrt sin cos tan asin acos atan atan2 sinh cosh tanh exp log".split()},
}  # fmt: skip


if __name__ == "__main__":
    found = written(EXAMPLES)
    Path(sys.argv[1]).write_text(json.dumps(found, indent=1))
    if len(sys.argv) > 2 and not compared(json.loads(Path(sys.argv[2]).read_text()), found):
        sys.exit(1)
