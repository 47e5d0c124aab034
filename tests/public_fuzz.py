"""A program: hand payloads and wrong arguments to every public callable, and print what came of it as JSON.

    python public_fuzz.py PROGRESS_FILE SEED PAYLOADS WRONG

Of the payloads that many go to every parameter of every callable, each in one of many disguises, and WRONG random calls
have a value of the wrong kind. Told are events of the interpreter that only running text, or writing beside the folder,
can raise, and errors that are none of the toolkit's.
"""

from __future__ import annotations

import datetime
import decimal
import fractions
import json
import os
import random
import signal
import sys
import warnings
from collections import Counter
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))

import numpy as np
import sympy
from hostile import PAYLOADS, progress
from public_calls import Call, calls, not_called

import multibody_sym as mbs

CODE = [
    "__import__('os').system('touch canary')", "open('canary', 'w')", "exec(\"open('canary', 'w')\")",
    "__import__('subprocess').Popen(['touch', 'canary'])", "eval(\"__import__('os').mkdir('canary')\")",
    "(lambda: __import__('pathlib').Path('canary').touch())()", "__import__('canary')", "print('canary')",
    "[c for c in ().__class__.__base__.__subclasses__() if c.__name__ == 'Popen'][0](['touch', 'canary'])",
]
AROUND = [
    "{}", "1 + {}", "x*({})", "sin({})", "{} m", "({},)", "Symbol({})", "S({})", "Function('f')({})", "{} < 0", "{}\n",
    "t if {} else t",
]
EVERY = [*(around.format(code) for code in CODE for around in AROUND), *PAYLOADS]
PATIENCE = 60
FORBIDDEN = {
    "os.system", "os.exec", "os.fork", "os.forkpty", "os.posix_spawn", "os.spawn", "os.startfile", "pty.spawn",
    "subprocess.Popen", "socket.connect", "socket.bind", "ctypes.dlopen", "webbrowser.open", "os.kill", "shutil.rmtree",
    "ftplib.connect", "urllib.Request", "code.__new__", "pickle.find_class",
}
PLACED = {"os.remove": 0, "os.rename": 1, "os.mkdir": 0, "os.rmdir": 0, "os.link": 1, "os.symlink": 1, "os.truncate": 0}


class Told(str):
    """Text of a class of its own."""


class Spelt:
    """What says that it is a text, and hands it to sympy when that asks."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return self.text

    def _sympy_(self) -> str:
        return self.text


def disguised(rng: random.Random, text: str) -> Any:
    """Return a text, mostly as it is, else inside something else."""
    plain = text.encode("utf-8", "replace").decode()
    made = [
        lambda: Told(text), lambda: np.str_(plain), lambda: [text], lambda: (text, text, text), lambda: {"x": text},
        lambda: {text: 1}, lambda: np.array([plain]), lambda: np.array(text, dtype=object), lambda: Spelt(text),
        lambda: text.encode("utf-8", "replace"), lambda: sympy.Symbol(text),
        lambda: sympy.Function(plain.replace("\0", ""))(sympy.pi),
        lambda: [[text, text], [text, text]], lambda: {"type": text}, lambda: {"value": text}, lambda: iter([text]),
        lambda: sympy.Symbol(text) * mbs.pi.shadow, lambda: Path(text), lambda: {"m": text}, lambda: {"F": text},
    ]
    return text if rng.random() < 0.5 else rng.choice(made)()


def endless() -> list[Any]:
    """Return a list that holds itself."""
    found: list[Any] = []
    found.append(found)
    return found


WRONG: list[Any] = [
    None, True, False, 0, -1, 1, 2.5, float("nan"), float("inf"), -float("inf"), 1e308, -1e308, 1e-320, 10**400, 1j,
    complex("nan"), "", " ", "x", "1", "x y", "1 kg", "45 deg", "\x00", "\ud800", "x" * 300, b"", b"1",
    bytearray(b"x"), memoryview(b"x"), (), [], {}, set(), frozenset({1}), [1], [1, 2], [1, 2, 3], [[1, 2, 3]] * 3,
    [None], [[]], ["x"], ["x", "x"], ("x", 1), {1: 2}, {None: None}, {"x": 1}, {"type": "revolute"}, {"type": None},
    {"type": []}, {"value": 1}, {"value": None}, {("a", "b"): 1}, range(3), slice(1), Ellipsis, NotImplemented,
    object(), object, int, str, len, print, abs, lambda: 1, lambda x: x, np, os, np.array(1.0), np.array([1.0, 2.0]),
    np.zeros((2, 2)), np.array([]), np.array(["x"]), np.array([None]), np.array([1j]), np.array([True]),
    np.float32(1), np.int8(1), np.bool_(True), np.str_("x"), np.nan, np.datetime64("2020-01-01"), np.timedelta64(1),
    np.longdouble(1), np.dtype(float), fractions.Fraction(1, 3), decimal.Decimal("0.1"), decimal.Decimal("nan"),
    datetime.date(2020, 1, 1), Path("x"), Path(), ValueError("x"), ValueError, sympy.Symbol("x"), sympy.Symbol("x y"),
    sympy.pi, sympy.I, sympy.nan, sympy.oo, sympy.zoo, sympy.Matrix([1, 2]), sympy.ImmutableMatrix([1]),
    sympy.MatrixSymbol("M", 2, 2), sympy.true, sympy.Integer(3), sympy.S, sympy.Function("f"),
    sympy.Function("f")(sympy.pi), sympy.Symbol("x") < 1, sympy.Eq(sympy.Symbol("x"), 1), sympy.Interval(0, 1),
    sympy.Tuple(1, 2), sympy.Float("1e400"), sympy.gamma(sympy.Symbol("x")), sympy.EmptySet,
    sympy.Piecewise((1, sympy.Symbol("x") < 1)), sympy.Integral(sympy.Symbol("x")), mbs.t, mbs.pi, mbs.t < 1,
    mbs.t + 1, mbs.Body(mass=1), mbs.Body, mbs.Revolute("ground", "b"), mbs.Settings(), mbs.System("s"),
    mbs.Table([[0, 0], [1, 1]]), mbs.InputError("x"), mbs.Parameter(1), mbs.Initial(q=1), mbs.Direct(rotate="x"),
    mbs.Baumgarte(alpha=1), endless(), {"x": {"x": {"x": {}}}}, [[[[]]]], Counter("xx"), zip(), enumerate([]),
    iter([1]), (x for x in [1]), sys.stdout, warnings, type(None), property(), staticmethod(len), classmethod(len),
    super, random.Random(1), Told("x"), Spelt("x"),
]
PYTHON_S_OWN = (
    "unsupported operand type", "not supported between", "multiply sequence", "can only concatenate",
    "not allowed in this context", "can't concat Node",
)
"""What Python and sympy say where both sides of an operator refuse."""
LONG_RUNS = {
    *(("simulate", name) for name in ("t_end", "step", "rtol", "atol", "samples")), ("period_multipliers", "period"),
}
"""Where numbers of any size are right, and what they ask for may take longer than anyone waits."""


NUMBERS = (int, float, np.number, np.ndarray, str, fractions.Fraction, decimal.Decimal, sympy.Basic)


class Watch:
    """The audit hook: notes what a call does that reading arguments has no need of."""

    def __init__(self, folder: Path) -> None:
        self.events: list[str] = []
        self.doing = ""
        self.places = (str(folder), os.environ.get("XDG_CACHE_HOME", str(folder)), os.devnull)

    def __call__(self, event: str, args: tuple[Any, ...]) -> None:
        if not self.doing or not self._is_told(event, args):
            return
        self.events.append(f"{self.doing}: {event} {args!r}"[:300])

    def _is_told(self, event: str, args: tuple[Any, ...]) -> bool:
        if event in FORBIDDEN:
            return True
        if event == "compile":
            return b"canary" in args[0] if isinstance(args[0], bytes) else "canary" in str(args[0])
        if event == "import":
            return "canary" in str(args[0])
        if event == "exec":
            code = args[0]
            words = {*code.co_names, *map(str, code.co_consts)}
            return code.co_filename == "<string>" and bool({"canary", "system", "Popen", "eval"} & words)
        if event == "open":
            writes = isinstance(args[1], str) and bool(set(args[1]) & set("wax+"))
            return writes and not _is_unnamed(args[0]) and self._is_outside(args[0])
        return event in PLACED and self._is_outside(args[PLACED[event]])

    def _is_outside(self, path: Any) -> bool:
        try:
            text = os.path.abspath(os.fsdecode(path))
        except (TypeError, ValueError):
            return False
        return not text.startswith(self.places)


def _is_unnamed(path: Any) -> bool:
    """Return whether what is opened is a folder: a file without a name in it, which ends with the process."""
    return isinstance(path, (str, bytes)) and os.path.isdir(path)


class Fuzz:
    """What is tried, and what came of it."""

    def __init__(self, folder: Path, seed: int, note: Any) -> None:
        self.calls = calls(folder)
        self.rng = random.Random(seed)
        self.note = note
        self.watch = Watch(folder)
        self.count: Counter[str] = Counter()
        self.bare: dict[str, str] = {}

    def attempt(self, call: Call, name: str, value: Any) -> None:
        """Make a call with one argument replaced."""
        self.note((call.name, name, type(value).__name__, shown(value)))
        self.watch.doing = f"{call.name}({name}={shown(value)})"
        signal.alarm(PATIENCE)
        try:
            call({**call.given, name: value})
            self.count["taken"] += 1
        except mbs.MultibodyError as error:
            self.count["refused"] += 1
            self.complain(call, name, value, "an empty message" if not error.message.strip() else "")
        except TypeError as error:
            told = call.name.startswith("t ") and any(words in str(error) for words in PYTHON_S_OWN)
            self.complain(call, name, value, "" if told else repr(error))
        except BaseException as error:
            # sympy is asked first where its own object stands on the left
            sympy_s_own = call.name.startswith("t r") and type(error).__module__.startswith("sympy.")
            self.complain(call, name, value, "" if sympy_s_own else repr(error)[:200] or type(error).__name__)
        finally:
            signal.alarm(0)
            self.watch.doing = ""

    def complain(self, call: Call, name: str, value: Any, complaint: str) -> None:
        """Keep the first value for each parameter and kind of complaint."""
        if complaint:
            self.count["bare"] += 1
            self.bare.setdefault(f"{call.name}({name}): {complaint[:60]}", f"{shown(value)}: {complaint}")

    def payloads(self, number: int) -> None:
        """Hand payloads to every parameter; slow callables get a share of them."""
        for call in self.calls:
            for name in call.given:
                for text in self.rng.sample(EVERY, number if not call.slow else max(1, number // 10)):
                    self.attempt(call, name, disguised(self.rng, text))

    def wrong(self, number: int) -> None:
        """Make calls with a value of the wrong kind."""
        places = [(call, name) for call in self.calls for name in call.given]
        for _ in range(number):
            call, name = self.rng.choice(places)
            value = self.rng.choice(WRONG)
            if name == "backend" and value is None:  # that is C, which starts a compiler
                continue
            if name == "on_progress" and callable(value):  # whose own errors are its own
                continue
            if (call.name, name) not in LONG_RUNS or not isinstance(value, NUMBERS):
                self.attempt(call, name, value)


def shown(value: Any) -> str:
    """Return a value in a line."""
    try:
        return repr(value)[:80]
    except Exception:
        return f"<{type(value).__name__}>"


def too_long(_signal: int, _frame: Any) -> None:
    raise TimeoutError("no answer within a minute")


def main() -> None:
    tried, seed, payloads, wrong = sys.argv[1], *map(int, sys.argv[2:])
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGALRM, too_long)
    output = sys.stdout
    with progress(tried) as note, open(os.devnull, "w") as nowhere, redirect_stdout(nowhere):  # callbacks print
        fuzz = Fuzz(Path.cwd(), seed, note)
        for call in fuzz.calls:
            call(call.given)  # each is right as it stands, and imports what it needs
        sys.addaudithook(fuzz.watch)
        fuzz.payloads(payloads)
        fuzz.wrong(wrong)
    found = {
        "missing": not_called(fuzz.calls), "events": fuzz.watch.events[:50], "bare": fuzz.bare, "count": fuzz.count,
        "callables": len(fuzz.calls), "places": sum(len(call.given) for call in fuzz.calls),
        "canaries": [str(path) for path in Path.cwd().rglob("canary")],
    }
    json.dump(found, output)


if __name__ == "__main__":
    main()
