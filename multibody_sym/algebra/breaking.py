"""Values of parameters that break one inequality and keep the others: what an inequality must have to be worth saying.

Values lie between a thousandth and a thousand times those of the sample, with their sign or, where they may turn,
with either; what is zero there may be anything of such a size. At first they are drawn, then those that come nearest
are varied.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final

import numpy as np

from multibody_sym.algebra.factors import Poly
from multibody_sym.algebra.quotients import Field
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scalars.node import PI, Node
from multibody_sym.scalars.traversal import leaves, postorder

Factors = Sequence[Poly]
"""An inequality: the product of these polynomials is positive."""

_DECADES: Final = 3.0
_DRAWN: Final = 1500
_BEST: Final = 100
_VARIED: Final = 8
_WIDTHS: Final = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003)
_CLEARLY: Final = 1e-9


class Breaking:
    """Inequalities over one field, and values of their parameters, at which they are looked at."""

    def __init__(self, field: Field, inequalities: Sequence[Factors]) -> None:
        self._field = field
        self._inequalities = inequalities
        used = {s for factors in inequalities for p in factors for s in field.whole(field.in_ring(p)).symbols}
        self._symbols = sorted(used, key=str)
        self._sample = np.array([float(_sample(field, s)) for s in self._symbols])
        self._turns = np.array([_turns(field, s) for s in self._symbols], dtype=bool)
        self._rng = np.random.default_rng(0)
        self._drawn = self._scales()
        self._margins = self._looked_at(self._drawn, range(len(inequalities)))

    def broken_alone(self, k: int, kept: Collection[int]) -> bool:
        """Return whether values were found that break inequality k and none of the others in `kept`."""
        others = [j for j in kept if j != k]
        scales, found = self._drawn, self._alone(self._margins, k, others)
        for width in _WIDTHS:
            if found.max(initial=-np.inf) > _CLEARLY:
                return True
            best = scales[np.argsort(found)[-_BEST:]]
            changes = self._rng.normal(size=(_VARIED, *best.shape)) * (self._rng.random((_VARIED, *best.shape)) < 0.5)
            varied = np.concatenate([best, (best + width * changes).reshape(-1, best.shape[1])])
            scales = np.clip(varied, -_DECADES, _DECADES)
            found = self._alone(self._looked_at(scales, [k, *others]), k, others)
        return bool(found.max(initial=-np.inf) > _CLEARLY)

    @staticmethod
    def _alone(margins: Mapping[int, Floats], k: int, others: Sequence[int]) -> Floats:
        """Return by how much k is broken and the others are kept, the least of both; -inf where there is no value."""
        found = np.min([-margins[k], *(margins[j] for j in others)], axis=0)
        return np.where(np.isnan(found), -np.inf, found)

    def _scales(self) -> Floats:
        """Return decimal logarithms of factors (n, symbols): of all, of some, near and far."""
        shape = (_DRAWN, len(self._symbols))
        far = self._rng.uniform(-_DECADES, _DECADES, size=shape)
        some = self._rng.uniform(-_DECADES, _DECADES, size=shape) * (self._rng.random(shape) < 0.4)
        return np.concatenate([far, some, far / 3, far / 10, some / 3])

    def _looked_at(self, scales: Floats, which: Collection[int]) -> dict[int, Floats]:
        """Return for inequalities their values (n,), each divided by the size of its terms."""
        signs = np.where(self._rng.random(scales.shape) < 0.5, -1.0, 1.0)
        around = np.where(self._sample == 0.0, signs, np.where(self._turns, signs, 1.0) * self._sample)
        points = dict(zip(self._symbols, (around * 10.0**scales).T, strict=True))
        with np.errstate(all="ignore"):
            letters = _letters(self._field, points, len(scales))
            return {k: _margin(self._field, self._inequalities[k], letters) for k in which}


def _sample(field: Field, symbol: Node) -> Any:
    place = field.position(symbol)
    return field.letters[place].sample if place is not None else 0.0


def _turns(field: Field, symbol: Node) -> bool:
    place = field.position(symbol)
    return place is not None and not field.letters[place].positive


def _margin(field: Field, factors: Factors, letters: Sequence[Any]) -> Any:
    total: Any = 1.0
    for p in factors:
        value, size = _value(field.in_ring(p), letters)
        total = total * value / size
    return total


def _value(p: Poly, letters: Sequence[Any]) -> tuple[Any, Any]:
    """Return the values of a polynomial, and the sums of the sizes of its terms."""
    value, size = 0.0 * letters[0], 0.0 * letters[0]
    for m, c in p.items():
        term = float(c)
        for k, e in enumerate(m):
            term = term * letters[k] ** e if e else term
        value, size = value + term, size + abs(term)
    return value, size


def _letters(field: Field, points: Mapping[Node, Floats], n: int) -> list[Any]:
    """Return the values of all letters; not a number for those that hang on other symbols."""
    found: list[Any] = []
    for letter in field.letters:
        if letter.node is None:
            found.append(np.sqrt(_value(letter.square, found)[0]))
        elif all(leaf in points for leaf in leaves([letter.node], "symbol")):
            found.append(_of_node(letter.node, points, n))
        else:
            found.append(np.full(n, np.nan))
    return found


def _of_node(root: Node, points: Mapping[Node, Floats], n: int) -> Floats:
    known: dict[Node, Any] = dict(points)
    for node in postorder([root]):
        if node is PI:
            known[node] = np.pi
        elif node.op in ("number", "real"):
            known[node] = float(node.data)
        elif node not in known:
            known[node] = _OPERATIONS[node.op](*node.own, *(known[a] for a in node.args))
    return np.broadcast_to(np.asarray(known[root], dtype=float), (n,))


_OPERATIONS: Final[dict[str, Callable[..., Any]]] = {
    "neg": np.negative, "add": np.add, "mul": np.multiply, "div": np.true_divide, "pow": np.float_power,
    "sqrt": np.sqrt, "abs": np.abs, "sign": np.sign, "min": np.minimum, "max": np.maximum,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "atan2": np.arctan2, "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "exp": np.exp, "log": np.log,
    "table": lambda function, order, a: np.asarray(function.values(order, np.ravel(a))),
}  # fmt: skip
