"""What is varied: a parameter, or a coordinate or speed at the start, with the values or the range that it takes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from multibody_sym.errors import ArgumentError, InputError, ModelError, Where, at, short_repr
from multibody_sym.mechanics.changes import Overrides
from multibody_sym.mechanics.spanning_tree import start_names
from multibody_sym.model.fields import list_items, scalar
from multibody_sym.model.system import System
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.text.parser import parse_scalar

_HOW: Final = "write low:high:count, values such as .5,1,2, or low:high to draw samples from"
_NUMBER: Final = re.compile(r"([-+]?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-z].*)?")
_TOLD: Final = 10
"""Values that are told one by one."""
MOST_VALUES: Final = 100_000_000


@dataclass(frozen=True)
class VariedAxis:
    """What is called `name` among `parameters` or `initial` values, in SI units: its `values`, or the range of them.

    A range has a `count` of values, evenly spaced with both ends among them; without it samples are drawn from it.
    """

    name: str
    kind: str
    values: tuple[float, ...] = ()
    low: float = 0.0
    high: float = 0.0
    count: int = 0

    def __str__(self) -> str:
        if not self.values:
            return f"{self.name}={self.low!r}:{self.high!r}" + (f":{self.count}" if self.count else "")
        told = [repr(x) for x in self.values[:_TOLD]] + ["..."] * (len(self.values) > _TOLD)
        return f"{self.name}={','.join(told)}"

    @property
    def size(self) -> int:
        """How many values there are, 0 where any in the range may be drawn."""
        return len(self.values) or self.count

    def value(self, number: NDArray[Any]) -> Floats:
        """Return the values of some numbers (n,) from 0."""
        whole = np.asarray(number).astype(int)
        if self.values:
            found: Floats = np.array(self.values, dtype=float)[whole]
            return found
        return _point_between(self.low, self.high, whole / max(self.count - 1, 1))

    def drawn(self, part: Floats) -> Floats:
        """Return the values that parts (n,) of 1 stand for: in the range, or the one of the values that holds it."""
        if self.size:
            return self.value((part * self.size).clip(0, self.size - 1))
        return _point_between(self.low, self.high, part)


def _point_between(low: float, high: float, part: Floats) -> Floats:
    """Return the place between both ends, which are met exactly."""
    found: Floats = low * (1.0 - part) + high * part
    return found


def axes_of(system: System, vary: Mapping[str, Any]) -> tuple[VariedAxis, ...]:
    """Return what is varied. Raises InputError for unknown names and for what is no range and no values."""
    if not isinstance(vary, Mapping) or not all(isinstance(name, str) for name in vary):
        got = short_repr(vary)
        raise ArgumentError(f"vary is to be a map from names to values, such as {{'m': [1, 2]}}; got {got}")
    if not vary:
        raise InputError("nothing is varied: name a parameter, or a coordinate or speed at the start")
    return tuple(_axis(system, name, given) for name, given in vary.items())


def axes_of_rows(system: System, rows: Sequence[Mapping[str, Any]]) -> tuple[VariedAxis, ...]:
    """Return what is varied by rows, which all have the same names: each axis has the values of all rows in order.

    Raises InputError for unknown names, for names that a row lacks, and for what is no number.
    """
    items = list_items(rows)
    if not items or not all(isinstance(row, Mapping) for row in items):
        wanted = "a list of maps from names to values, such as [{'m': 1}, {'m': 2}]"
        raise ArgumentError(f"rows is to be {wanted}; got {short_repr(rows)}")
    names = tuple(items[0])
    if not names:
        raise InputError("nothing is varied: each row names parameters, or coordinates or speeds at the start")
    for k, row in enumerate(items):
        if set(row) != set(names):
            odd = short_repr(next(iter(set(names) ^ set(row))))
            with at("rows", k):
                raise InputError(f"all rows name the same values; {odd} is not in this one and the first alike")
    kinds = {name: _kind(system, name, "rows") for name in names}
    readers = {name: _reader(system, name, kind) for name, kind in kinds.items()}
    values: dict[str, list[float]] = {name: [] for name in names}
    for k, row in enumerate(items):
        for name in names:
            with at("rows", k, name):
                values[name] += _values([row[name]], readers[name])
    return tuple(VariedAxis(name, kinds[name], tuple(values[name])) for name in names)


def _kind(system: System, name: Any, argument: str) -> str:
    """Return whether a name is one of `parameters` or `initial` values. Raises ModelError for one of neither."""
    if name not in (known := [*system.parameters, *start_names(system)]):
        with at(argument):
            message = f"no parameter, coordinate or speed is called {short_repr(name)}"
            raise ModelError(message, word=str(name), known=known)
    return "parameters" if name in system.parameters else "initial"


def _axis(system: System, name: str, given: Any) -> VariedAxis:
    kind = _kind(system, name, "vary")
    with at("vary", name):
        if isinstance(given, str):
            parts = _parts(given, ":")
            if len(parts) > 1:
                return _range(name, kind, parts[:2], parts[2:], _reader(system, name, kind))
            return VariedAxis(name, kind, tuple(map(_reader(system, name, kind), _parts(given, ","))))
        if isinstance(given, tuple):
            return _range(name, kind, given[:2], given[2:], _reader(system, name, kind))
        return VariedAxis(name, kind, tuple(_values(given, _reader(system, name, kind))))


def _reader(system: System, name: str, kind: str) -> Any:
    """Return the function that reads a value: a number in SI units, or text such as `30 deg`."""

    def read(given: Any) -> float:
        node = scalar(given, None)
        if node.shadow is None:
            raise ModelError(f"{short_repr(given)} is no number, and a study varies numbers")
        if isinstance(given, str) and parse_scalar(given)[1] is not None:
            changed = {name: given}
            changes = Overrides(parameters=changed) if kind == "parameters" else Overrides(initial=changed)
            changes.of(system)  # which says if it is of another dimension
        return float(node.shadow)

    return read


def _values(given: Any, read: Any) -> Iterator[float]:
    try:
        items = list(given)
    except TypeError:
        raise ArgumentError(f"expected values or a range, got {short_repr(given)}: {_HOW}") from None
    if not items:
        raise InputError(f"there are no values: {_HOW}")
    for item in items:
        is_number = type(item).__module__ == "numpy" and getattr(item, "size", 0) == 1
        plain = item.item() if is_number else item
        if isinstance(plain, float) and not math.isfinite(plain):
            raise InputError(f"{short_repr(plain)} is not finite")
        # a float is the number that its digits are read as, -0.0 too: thousands of them make no expression each
        yield plain + 0.0 if type(plain) is float else read(plain)


def _range(name: str, kind: str, ends: Sequence[Any], rest: Sequence[Any], read: Any) -> VariedAxis:
    if len(ends) != 2 or len(rest) > 1:
        raise InputError(f"a range has two ends and a count: {_HOW}")
    low, high = _values(ends, read)
    count = 0
    if rest:
        whole = digits(rest[0])
        if not whole or not 1 <= int(whole) <= MOST_VALUES:
            message = f"{short_repr(rest[0])} is no count of values, at least 1 and at most {MOST_VALUES}: {_HOW}"
            raise InputError(message)
        count = int(whole)
    return VariedAxis(name, kind, low=low, high=high, count=count)


def digits(given: Any) -> str:
    """Return the digits of a whole number that is not negative, or of text; empty where it is none, or beyond use."""
    try:
        text = str(given).strip()
    except ValueError:  # an int of thousands of digits
        return ""
    return text if re.fullmatch(r"[0-9]{1,99}", text) else ""


def _parts(text: str, separator: str) -> list[str]:
    """Return the parts of a text; bare numbers before the last have its unit, also behind the count: `10:60:6 deg`."""
    parts = [part.strip() for part in text.split(separator)]
    if not all(parts):
        raise InputError(f"{short_repr(text)} is no range and no list of values: {_HOW}")
    found = [_NUMBER.fullmatch(part) for part in parts]
    bare = [match is not None and not match[2] for match in found]
    last = found[-1]
    unit = last[2] if last is not None and last[2] else ""
    if last is not None and separator == ":" and len(parts) == 3:
        parts[-1] = last[1]
    if not unit and len(parts) > 1 and any(match is not None and match[2] for match in found) and any(bare):
        raise InputError(f"{short_repr(text)}: write a unit with the last value, or with each")
    return [f"{part} {unit}" if unit and is_bare else part for part, is_bare in zip(parts, bare, strict=True)]


# ----------------------------------------------------------------------------------------------------------------------
# The plan of a study: which values each run has, by its number alone.


_BLOCK: Final = 256
"""Random samples are drawn in blocks, each from a generator of its own: a block costs about as much as one number."""
_LARGEST: Final = 2**63 - 1
_MOST: Final = 2**30
"""Points of a Sobol sequence as scipy makes them; of no study so many runs are ever done."""


@dataclass(frozen=True)
class Plan:
    """All combinations of the values of the `axes` (grid: the last varies fastest), or a number of `samples` of them.

    With the method `rows` run k has value k of each axis.
    Samples are drawn from a `seed`: `random` ones independently, those of Sobol's scrambled sequence evenly.
    """

    axes: tuple[VariedAxis, ...]
    method: str = "grid"
    samples: int = 0
    seed: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """What is varied."""
        return tuple(axis.name for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """How many values each axis has, of a grid; the number of rows or samples."""
        if self.method == "rows":
            return (self.axes[0].size,)
        return tuple(axis.size for axis in self.axes) if self.method == "grid" else (self.samples,)

    def __len__(self) -> int:
        total = 1
        for size in self.shape:
            total *= size
        return total

    def values(self, first: int, count: int) -> Floats:
        """Return the values (count, axes) of the runs from number `first` on."""
        numbers = np.arange(first, first + count)
        if self.method in ("grid", "rows"):
            places = np.unravel_index(numbers, self.shape) * (1 if self.method == "grid" else len(self.axes))
            columns = [axis.value(place) for axis, place in zip(self.axes, places, strict=True)]
        else:
            parts = self._random(first, count) if self.method == "random" else self._sobol(first, count)
            columns = [axis.drawn(part) for axis, part in zip(self.axes, parts.T, strict=True)]
        return np.column_stack(columns)

    def _random(self, first: int, count: int) -> Floats:
        blocks = range(first // _BLOCK, (first + count - 1) // _BLOCK + 1)
        width = len(self.axes)
        drawn = [np.random.Generator(np.random.Philox(key=[self.seed, k])).random((_BLOCK, width)) for k in blocks]
        begin = first - blocks.start * _BLOCK
        return np.concatenate(drawn)[begin : begin + count]

    def _sobol(self, first: int, count: int) -> Floats:
        import warnings

        from scipy.stats import qmc

        engine = qmc.Sobol(len(self.axes), scramble=True, seed=self.seed)
        if first:
            engine.fast_forward(first)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it wants powers of two, and a part of the sequence is none
            found: Floats = engine.random(count)
        return found

    @property
    def text(self) -> str:
        """The plan as one line that differs from that of every other."""
        axes = [
            [axis.name, axis.kind, [x.hex() for x in axis.values], axis.low.hex(), axis.high.hex(), axis.count]
            for axis in self.axes
        ]
        return json.dumps([axes, self.method, self.samples, self.seed])

    @property
    def words(self) -> list[str]:
        """What draws the samples, as words of a command; that the values are rows."""
        if self.method in ("grid", "rows"):
            return ["--rows"] if self.method == "rows" else []
        return [f"--sample {self.samples}", f"--seed {self.seed}", *(["--sobol"] if self.method == "sobol" else [])]


def plan_of_rows(system: System, rows: Sequence[Mapping[str, Any]], **others: Any) -> Plan:
    """Return the plan of a study of given rows. Raises InputError for `others` that plan a study in another way."""
    for name, given in others.items():
        if given is not None and given is not False:
            raise InputError(f"rows say all values of each run: leave {name} out", where=_at(name))
    return Plan(axes_of_rows(system, rows), "rows")


def plan_of(axes: tuple[VariedAxis, ...], sample: Any = None, seed: Any = None, sobol: bool = False) -> Plan:
    """Return the plan of a study. Raises InputError for what does not go together."""
    if sample is None:
        for name, given in (("seed", seed is not None), ("sobol", sobol)):
            if given:
                raise InputError(f"{name} is for samples: say how many (sample)", where=_at(name))
        for axis in axes:
            if not axis.size:
                message = f"how many values are there from {axis.low:g} to {axis.high:g}? Give a count, or draw samples"
                raise InputError(message, where=Where(path=("vary", axis.name)))
        plan = Plan(axes)
        if len(plan) > _MOST:
            raise InputError(f"{len(plan)} runs are too many; draw samples instead", where=_at("vary"))
        return plan
    samples = _whole("sample", sample, least=1, most=_MOST)
    return Plan(axes, "sobol" if sobol else "random", samples, _whole("seed", 0 if seed is None else seed, least=0))


def _whole(name: str, given: Any, least: int, most: int = _LARGEST) -> int:
    text = digits(given)
    if not text or not least <= int(text) <= most:
        message = f"expected a whole number, at least {least} and at most {most}, got {short_repr(given)}"
        raise InputError(message, where=_at(name))
    return int(text)


def _at(name: str) -> Where:
    return Where(path=(name,))
