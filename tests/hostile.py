"""Hostile input: payloads that are known to run code or to hang elsewhere, and a watch over what a process does."""

import importlib.util
import json
import os
import random
import string
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from multibody_sym.errors import nearest

PAYLOADS = [
    "__import__('os').system('touch pwned')", "eval('1')", "exec('x=1')", "open('/etc/passwd')",
    "compile('1','','eval')", "globals()", "breakpoint()", "().__class__.__bases__[0].__subclasses__()",
    "().__class__.__mro__[1].__subclasses__()[140]('id')",
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0]('id')",
    "(lambda f: f(f))(lambda f: f(f))", "x.__class__", "x.free_symbols", "S.sympify('1')", "Symbol('x')",
    "sympify('1')", "parse_expr('1')", "Integer(2).__class__", "E.func.__globals__", "Function('f')(x)",
    "lambdify(x, x)", "factorial(10**8)", "9**9**9**9", "2**(2**(2**(2**(2**2))))", "10**10**10",
    "exp(exp(exp(exp(9))))", "1e400*x", "1" * 5000, "9" * 400 + "^" + "9" * 400, "1e308*1e308", "0^-1",
    "((((1e300)^2)^2)^2)^2", "0/0", "tan(pi/2)", "sqrt(sqrt((t/10)^3.5)/sqrt(1e3))", "(x+1)^1000000", "x^1e308",
    "x^(1/3)^(1/7)^(1/11)", "2^-1e300", "1/1e-308/1e-308", "(" * 50_000, "(" * 50_000 + "x" + ")" * 50_000,
    "[" * 100_000, "-" * 50_000 + "x", "sin(" * 50_000, "x^" * 40_000 + "x", "x" * 100_000, "x " * 50_000,
    "1+" * 49_000, "'" * 99_999, '"' + "'" * 99_998, "." * 100_000, "," * 50_000, "1e" * 50_000,
    "min(" + "x," * 20_000 + "x)", "where(x<" * 20_000, "position(" + "a." * 20_000 + "a, x)", "9." * 40_000,
    " " * 100_001, "\x00", "x\x00y", "\ud800", "\u202ex", "x\u2028y", "\u0661+\u0662", "\uff11", "\ufeffx", "x\u200by",
    "\U0001d7d9", "\x1b[2J", "nan", "inf", "-inf", "1e-400", "0x1F", "0b1", "0o7", "1_000", "1j", "2e", "1e+", "True",
    "None", "...", "@", "`id`", "$(id)", "${x}", "{{7*7}}", "{%x%}", "#{x}", "%s", "%n", "\\x41", "x;y", "x\ny",
    "x\r\ny", "!ruby/object:X {}", "x=y:=1",
]
"""Texts for expressions: published escapes from sympify, parse_expr and eval, bombs, strange characters."""

YAML_PAYLOADS = [
    "!!python/object/apply:os.system ['touch pwned']", "!!python/object/new:os.system [id]",
    "a: !!python/name:os.system", "!!python/module:os", "a: !!python/tuple [1, 2]", "!!python/object:__main__.X {}",
    "!!python/object/apply:subprocess.Popen\n- [id]",
    "!!python/object/new:type\n  args: ['z', !!python/tuple [], {'extend': !!python/name:exec }]",
    "a: !include /etc/passwd", "a: !!binary |\n  aaaa", "a: !!timestamp 2001-01-01",
    "%TAG ! tag:yaml.org,2002:python/\n---\na: 1",
    "a: &a [x, x, x]\nb: &b [*a, *a, *a]\nc: &c [*b, *b, *b]\nd: [*c, *c, *c]", "a: &a {x: 1}\nb: {<<: *a, <<: *a}",
    "a: &a\n  <<: *a", "&a [*a]", "*a", "<<: {a: 1}", "? [a]\n: 1", "? {a: b}\n: 1", "[" * 100_000, "{" * 100_000,
    "{a: " * 50_000, "- " * 50_000, "? " * 50_000, "a:\n" + "".join(" " * i + "a:\n" for i in range(600)),
    "a: [" + "x, " * 120_000 + "x]", "\n".join(f"k{i}: 1" for i in range(110_000)), "a" * (1 << 20),
    "a: '" + "x\n" * 100_000, "", " ", "\n\n", "# only a comment", "---", "--- a\n--- b", "a: 1\n...\nb: 2",
    "%YAML 9.9\n--- a", "%YAML 1." + "9" * 9000 + "\n--- a", "a: 1\na: 2", "a: {b: 1, b: 2}", "a: 1\n\tb: 2", "\ta: 1",
    "a:\n\t- b", "a: @x", "a: `x`", "a: %x", "a: *x", "a: &x", "a: !x y", "a: b: c", "a: 'x", 'a: "x', 'a: "\\q"',
    'a: "\\UFFFFFFFF"', 'a: "\\u202e"', 'a: "\\0"', 'a: "\\ud800"', "a: [1, 2", "a: {b: 1", "a: ]", "}: a", "a\nb",
    "a: |\n  x\n y", "a: >9\n x", "a: |x\n  y", "- a\nb: 1", "a: 1\n- b", ": a", "? ", "'': a", "a: \x00",
    "\x1b[2J: a", "a: \u202eb", "\ufeff\ufeffa: b", "a: \ud800", "a: x\u2028b", "[[[[[]]]]]", "null", "~", "42",
    "multibody_sym: 2", "multibody_sym: 1", "multibody_sym: 1\nname: [a]", "multibody_sym: 1\nname: a\nbodies: []",
    "multibody_sym: 1\nname: a\nbodies: {b: {mass: [1]}}", "multibody_sym: 1\nname: a\nbodies: {b: x}",
    "multibody_sym: 1\nname: a\nrepeat: {count: 1e9, body: {}, joint: {}}",
    "multibody_sym: 1\nname: a\nparameters: {a: b, b: a}", "multibody_sym: 1\nname: a\nparameters: {t: 1, pi: 2}",
]
"""Texts for model files: published PyYAML payloads, bombs, broken YAML, and maps that are no model."""

ALPHABET = string.printable + "²°µπ−\u0661\u202e\ud800\x00\x7f\u2028ß\U0001d7d9"
FRAGMENTS = [
    "1e308", "9**9", "^", "**", "((", "))", "'", '"', "''", "..", ",", "<", "<=", ">", "sin(", "atan2(", "where(",
    "min(", "position(", "reaction(C, fx)", "total_energy()", " kg", " m/s^2", "deg", "1/0", "-", "1e-320", "pi",
    "real(", "__class__", "\x00", "#", ": ", "[", "]", "{", "}", "- ", "\n", "\t", "&a ", "*a", "!!x ", "|", "%", "0",
    "", "   ",
]


def watched(events: list[str]) -> None:
    """Note from now on whatever this process does that reading text has no need of (it cannot be undone)."""
    nearest("wort", ["word"])  # loads what messages need
    harmless = {"open", "os.scandir", "os.listdir", "object.__getattr__", "sys._getframe"}

    def hook(event: str, args: tuple[object, ...]) -> None:
        written = event == "open" and len(args) > 1 and isinstance(args[1], str) and set(args[1]) & set("wax+")
        if event not in harmless or written:
            events.append(f"{event} {args!r}"[:200])

    sys.addaudithook(hook)


def mutated(rng: random.Random, text: str, others: Sequence[str]) -> str:
    """Return `text` with one to five random changes of characters, fragments and parts of other texts."""
    for _ in range(rng.randint(1, 5)):
        text = changed(rng, text, rng.choice(others))
    return text


def changed(rng: random.Random, text: str, other: str) -> str:
    """Return `text` with one part taken out, replaced, repeated, or put in."""
    i, k = rng.randint(0, len(text)), rng.randint(0, len(other))
    j = min(len(text), i + rng.choice([0, 1, 1, 2, 8, 40]))
    return rng.choice([
        text[:i] + text[j:],
        text[:i] + rng.choice(ALPHABET) + text[j:],
        text[:i] + rng.choice(FRAGMENTS) + text[i:],
        text[:j] + text[i:j] * rng.choice([1, 2, 30]) + text[j:],
        text[:i] + other[k : k + rng.choice([3, 30])] + text[j:],
    ])


@contextmanager
def progress(path: str) -> Iterator[Callable[[object], None]]:
    """Give a function that notes in a file what is being tried, so that a hang can be told."""
    with open(path, "w", encoding="utf-8", errors="backslashreplace") as file:

        def note(what: object) -> None:
            file.seek(0)
            file.truncate()
            file.write(repr(what))
            file.flush()

        yield note


def verdict(program: Path, folder: Path, arguments: list[object], patience: float = 600) -> dict[str, Any]:
    """Return what a fuzzing program printed, run on its own in `folder`; fail where it hangs or breaks down."""
    note = folder / "tried"
    package = Path(importlib.util.find_spec("multibody_sym").origin).parents[1]
    command = [sys.executable, str(program), str(note), *map(str, arguments)]
    environment = {**os.environ, "PYTHONPATH": str(package)}
    try:
        run = subprocess.run(
            command, capture_output=True, text=True, cwd=folder, env=environment, timeout=patience, check=False
        )
    except subprocess.TimeoutExpired:
        raise AssertionError(f"hangs on {note.read_text(encoding='utf-8')[:1000]}") from None
    assert run.returncode == 0, run.stderr + note.read_text(encoding="utf-8")[:1000]
    result: dict[str, Any] = json.loads(run.stdout)
    return result
