"""Modes: the small motions of a system as formulas with numbers, and the spectrum that they have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import reduce
from itertools import takewhile
from operator import mul
from typing import Any, Final, Literal

import sympy

from multibody_sym.algebra.inequalities import Condition
from multibody_sym.algebra.quotient_functions import book_node, sqrt
from multibody_sym.algebra.quotients import PRECISE, Field, Letter, NoClosedFormError, Poly, Quotient, factors_of
from multibody_sym.algebra.roots import Roots, shift_powers
from multibody_sym.algebra.writers import LatexScript
from multibody_sym.analysis.modes.matrices import Matrices
from multibody_sym.derivation.notation import dotted, latex_name
from multibody_sym.records import dataclass
from multibody_sym.scalars.elementary import BUILD
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import PI, Node, add, as_node, divide, multiply, negate, symbol
from multibody_sym.scalars.sympy_bridge import to_sympy
from multibody_sym.text.values import Value

Motion = Literal["oscillates", "free", "grows", "decays"]
Matrix = Sequence[Sequence[Value]]
_SHOWN: Final = 5
_DIGITS: Final = 6


@dataclass(frozen=True)
class Mode:
    """A normal mode: its `motion`, its `frequency` omega (rad/s) and `period` (s) where it `oscillates`.

    A mode that `grows` or `decays` does so like exp(rate t); one that swings may have a `rate` too, negative where it
    is damped. A `free` one moves off uniformly. `shape`: the amplitude of each independent deviation, the first that
    moves having 1; `quarter`: that of its part a quarter of a period ahead, where gyroscopic terms turn it.
    """

    motion: Motion
    frequency: Value | None = None
    period: Value | None = None
    rate: Value | None = None
    shape: Mapping[str, Value] = field(default_factory=dict)
    quarter: Mapping[str, Value] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `--json` prints."""
        pairs = {"frequency": self.frequency, "period": self.period, "rate": self.rate}
        return {
            "motion": self.motion,
            **{name: None if x is None else x.as_json() for name, x in pairs.items()},
            "shape": {name: x.as_json() for name, x in self.shape.items()},
            "quarter": {name: x.as_json() for name, x in self.quarter.items()},
        }


Rows = tuple[tuple[Value, ...], ...]


@dataclass(frozen=True, repr=False)
class Modes:
    """Small motions M x'' + C x' + K x = 0 of a system about a state, x the deviations of `coordinates` (n).

    `about`: "equilibrium" or "steady motion", `at` its coordinates and speeds, `found` beside the declared start or
    not; `held`: the cyclic coordinates whose momenta are held, so that they are not among x. `mass`, `rates`,
    `stiffness`: M, C and K (n x n), empty where there are numbers of the eigenvalues alone. `modes`: those that
    oscillate first, from the lowest frequency at the declared parameters on, then others. `characteristic`: the
    polynomial whose roots are omega^2. `stable`: None where a mode is free and the others oscillate; `conditions` under
    which motions stay small, or for `stable` False under which they do not; `period`: that of the motion from the
    start, of any size, where it was asked for. `eigenvalues`: those of `linearize`, dampers included, with
    their `eigenvalue_errors`.
    """

    name: str
    coordinates: tuple[str, ...]
    about: Literal["equilibrium", "steady motion"]
    at: Mapping[str, Value]
    found: bool
    mass: Rows
    rates: Rows
    stiffness: Rows
    modes: tuple[Mode, ...]
    stable: bool | None
    conditions: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    characteristic: str = ""
    notes: tuple[str, ...] = ()
    eigenvalues: tuple[complex, ...] = ()
    eigenvalue_errors: tuple[float, ...] = ()
    period: Value | None = None

    def __repr__(self) -> str:
        told = [str(mode.frequency) for mode in self.oscillating[:_SHOWN]]
        told += ["..."] if len(self.oscillating) > _SHOWN else []
        return f"<Modes of {self.name} about its {self.about}: {', '.join(told) or 'nothing oscillates'}>"

    def _repr_latex_(self) -> str:
        """Return what a notebook shows: the equations, and the oscillating modes."""
        return r"$\displaystyle \begin{aligned}" + r" \\ ".join(self.latex_lines()) + r"\end{aligned}$"

    def latex_lines(self) -> list[str]:
        """Return M x'' + C x' + K x = 0 and each frequency with its period as aligned lines of LaTeX."""
        names, terms, lines = [latex_name(name) for name in self.coordinates], [], []
        for rows, dots in ((self.mass, "ddot"), (self.rates, "dot"), (self.stiffness, "")):
            if any(x.value for row in rows for x in row):
                matrix = _in_brackets([" & ".join(value_latex(x) for x in row) for row in rows])
                terms.append(f"{matrix} {_in_brackets([dotted(name, dots) if dots else name for name in names])}")
        if self.mass:
            lines.append(f"{' + '.join(terms)} &= 0")
        pairs = list(zip(self.frequencies, self.periods, strict=True))
        for k, (omega, duration) in enumerate(pairs, 1):
            place = f"_{{{k}}}" if len(pairs) > 1 else ""
            frequency, period = value_latex(omega, r"\mathrm{rad/s}"), value_latex(duration, r"\mathrm{s}")
            lines.append(rf"\omega{place} &= {frequency}, \quad T{place} = {period}")
        return lines

    @property
    def oscillating(self) -> tuple[Mode, ...]:
        """The modes that oscillate, from the lowest frequency on: `frequency(1)` is that of the first."""
        return tuple(mode for mode in self.modes if mode.motion == "oscillates")

    @property
    def frequencies(self) -> tuple[Value, ...]:
        """The angular frequencies of the modes that oscillate."""
        return tuple(mode.frequency for mode in self.oscillating if mode.frequency is not None)

    @property
    def periods(self) -> tuple[Value, ...]:
        """The periods of the modes that oscillate, the longest first."""
        return tuple(mode.period for mode in self.oscillating if mode.period is not None)

    def as_json(self) -> dict[str, Any]:
        """Return the object that `modes --json` prints."""
        return {
            "about": self.about,
            "found": self.found,
            "at": {name: value.as_json() for name, value in self.at.items()},
            "coordinates": list(self.coordinates),
            "held": list(self.held),
            "M": _json(self.mass),
            "C": _json(self.rates),
            "K": _json(self.stiffness),
            "modes": [mode.as_json() for mode in self.modes],
            "frequencies": [value.as_json() for value in self.frequencies],
            "periods": [value.as_json() for value in self.periods],
            "characteristic": self.characteristic or None,
            "stable": self.stable,
            "conditions": list(self.conditions),
            "notes": list(self.notes),
            "eigenvalues": [[x.real, x.imag] for x in self.eigenvalues],
            "period": None if self.period is None else self.period.as_json(),
        }


def _json(rows: Sequence[Sequence[Value]]) -> list[list[dict[str, Any]]]:
    return [[value.as_json() for value in row] for row in rows]


def value_latex(value: Value, unit: str = "") -> str:
    """Return a formula, or where there is none the number with its unit."""
    if value.expression is not None:
        return node_latex(value.expression)
    return rf"{value.value:.{_DIGITS}g}\,{unit}" if unit else f"{value.value:.{_DIGITS}g}"


def node_latex(node: Node, labels: Mapping[str, str] | None = None) -> str:
    """Return an expression; `labels` are the letters of parameters that have one."""
    book = labels or {}
    expression = to_sympy(node, {})
    letters = sorted(expression.free_symbols, key=lambda s: str(s.name))
    spelling = {s: latex_name(book.get(s.name, s.name)) for s in letters}
    script = LatexScript(spelling, {s: (2, k) for k, s in enumerate(letters)})
    return script.shown(expression) if isinstance(expression, sympy.Basic) else str(expression)


def _in_brackets(lines: Sequence[str]) -> str:
    return r"\begin{bmatrix}" + r" \\ ".join(lines) + r"\end{bmatrix}"


# ----------------------------------------------------------------------------------------------------------------------
# The characteristic polynomial of small motions in x = omega^2, and its roots in closed form as far as it factors.
#
# In: matrices over quotients. Out: a Spectrum of roots, factors and conditions of stability.
#
#   det(K - x M) = 0,   with gyroscopic terms det(K + s G + s^2 M) = 0 of which only even powers of s = i omega are left


LARGEST: Final = 8
"""The most freedoms for which a characteristic polynomial is formed."""
_ASIDE: Final = PRECISE.mpf("0.7310585786300049")
_QUADRATIC, _CUBIC, _QUARTIC = 2, 3, 4
SQUARE: Final = symbol("omega^2")
_RATE: Final = symbol("lambda of small motions")


@dataclass(frozen=True, eq=False)
class Root:
    """One x = omega^2 of the polynomial, `times` over: its value at the sample, as a Node, as a quotient if it is one.

    `frequency`: omega without a root in a root, where there is such a form; `forms`: other forms of x.
    A `value` with an imaginary part (a complex number of mpmath) belongs to motions that grow while they swing.
    `rests`: it is zero, but for rounding of parameters.
    """

    value: Any
    node: Node | None
    quotient: Quotient | None
    times: int
    frequency: Quotient | None = None
    forms: tuple[Node, ...] = ()
    rests: bool = False


@dataclass(frozen=True, eq=False)
class Spectrum:
    """The roots, by size; `factors` of the polynomial in x with exponents; `signs`: the conditions of stability."""

    roots: tuple[Root, ...]
    factors: tuple[tuple[tuple[Quotient, ...], int], ...]
    signs: tuple[Condition, ...]


def spectrum(given: Matrices) -> Spectrum:
    """Return the roots of the characteristic polynomial; raises NoClosedFormError where it is too long.

    A factor that is not solved gives roots that are numbers alone.
    """
    if len(given.places) > LARGEST:
        raise NoClosedFormError(f"more than {LARGEST} freedoms")
    field = given.field
    polynomial, k = _polynomial(given)
    roots: list[Root] = []
    signs: list[Condition] = []
    kept: list[tuple[tuple[Quotient, ...], int]] = []
    definite, near = given.is_symmetric and not given.is_gyroscopic, Roots(field, SQUARE)
    for factor, times in factors_of(polynomial)[1]:
        powers = field.coefficients(factor, k)
        if len(powers) > 1:
            kept.append((tuple(powers), times))
            found = sorted(_roots(powers, times), key=lambda root: abs(root.value))
            # zero at the sample, to rounding of its terms
            still = takewhile(lambda x: x.is_zero or near.vanishes(field.in_ring(x.above)), powers)
            zeros = len(list(still))
            roots += [replace(root, rests=n < zeros) for n, root in enumerate(found)]
            if powers[0].is_zero:
                continue
            for e in range(1, len(powers)):  # all roots of the factor are positive
                ratio = powers[len(powers) - 1 - e] / powers[-1]
                signs.append(Condition(-ratio if e % 2 else ratio, strict=True))
            if not definite and len(powers) == _QUADRATIC + 1:  # and real, as they are anyway with a definite M
                c, b, a = powers
                signs.append(Condition(b * b - 4 * (a * c), strict=True, under_root=True))
    roots.sort(key=lambda root: (PRECISE.re(root.value), PRECISE.im(root.value)))
    return Spectrum(tuple(roots), tuple(kept), tuple(signs))


def _polynomial(given: Matrices) -> tuple[Poly, int]:
    """Return the polynomial and the position of the letter of x in it."""
    field, M, K = given.field, given.mass, given.stiffness
    # of the size of roots, where nothing vanishes by chance
    masses, stiff = (sum((abs(a[k].sample) for k, a in enumerate(rows)), PRECISE.mpf(0)) for rows in (M, K))
    x = field.letter(SQUARE, Letter(SQUARE, _ASIDE * (stiff / masses if masses and stiff else 1)))
    if not given.is_gyroscopic:
        found = determinant([[b - x * a for a, b in zip(*rows, strict=True)] for rows in zip(M, K, strict=True)])
        return found.above, _place(field, SQUARE)
    s = field.letter(_RATE, Letter(_RATE, PRECISE.sqrt(abs(x.sample)) * _ASIDE))
    triples = zip(M, given.gyroscopic, K, strict=True)
    entries = [[c + s * (b + s * a) for a, b, c in zip(*rows, strict=True)] for rows in triples]
    powers = field.coefficients(determinant(entries).above, _place(field, _RATE))
    if any(not powers[k].is_zero for k in range(1, len(powers), 2)):
        raise NoClosedFormError("forces without a potential act beside gyroscopic ones")
    total = field.constant(0)
    for k in range(0, len(powers), 2):
        total = total + powers[k] * (-x).power(k // 2)
    return total.above, _place(field, SQUARE)


def _place(field: Field, letter: Node) -> int:
    place = field.position(letter)
    assert place is not None
    return place


def determinant(matrix: Sequence[Sequence[Quotient]]) -> Quotient:
    """Return the determinant by its first columns, each minor once."""
    size = len(matrix)
    known: dict[frozenset[int], Quotient] = {}

    def minor(rows: frozenset[int]) -> Quotient:
        column = size - len(rows)
        if not rows:
            return matrix[0][0].field.constant(1)
        if rows not in known:
            total = matrix[0][0].field.constant(0)
            for k, row in enumerate(sorted(rows)):
                entry = matrix[row][column]
                if not entry.is_zero:
                    term = entry * minor(rows - {row})
                    total = total - term if k % 2 else total + term
            known[rows] = total
        return known[rows]

    return minor(frozenset(range(size)))


# --- roots -----------------------------------------------------------------------------------------------------------


def _roots(powers: Sequence[Quotient], times: int) -> Iterator[Root]:
    samples = [x.sample for x in reversed(powers)]
    values = [-samples[1] / samples[0]]
    if len(samples) > 2:
        values = list(PRECISE.polyroots(samples, maxsteps=400, extraprec=400))
    try:
        found: list[Quotient | Node] = list(_closed_roots(powers))
    except NoClosedFormError:
        found = []
    left = list(values)
    for each in found:
        if isinstance(each, Quotient):
            value, quotient = each.sample, each
        else:
            letters = (x for x in powers[0].field.letters if x.node is not None and not x.node.args)
            sample = {x.node: float(x.sample) for x in letters if x.node is not None}
            value, quotient = PRECISE.mpf(evaluate_float([each], sample)[0]), None
        nearest = min(left, key=lambda x: abs(x - value))
        left.remove(nearest)
        root = Root(value, _root_node(each), quotient, times)
        yield root if len(powers) != _QUADRATIC + 1 else replace(root, **_forms_of_two(powers, value))
    if not found:
        yield from (Root(value, None, None, times) for value in values)


def _closed_roots(powers: Sequence[Quotient]) -> Iterator[Quotient | Node]:
    """Yield the roots of a factor in closed form; nothing where there is none, or they are not real."""
    if len(powers) == 2:
        yield -(powers[0] / powers[1])
    elif len(powers) == _QUADRATIC + 1:
        yield from _quadratic(*powers)
    elif len(powers) == _CUBIC + 1:
        yield from _cubic(*powers)
    elif len(powers) == _QUARTIC + 1:
        yield from _biquadratic(powers)


def _quadratic(c: Quotient, b: Quotient, a: Quotient) -> Iterator[Quotient]:
    """Yield the roots of a x^2 + b x + c, none where they are not real."""
    inside = b * b - 4 * (a * c)
    if inside.sample >= 0:
        root = sqrt(inside)
        yield (-b - root) / (2 * a)
        yield (-b + root) / (2 * a)


def _forms_of_two(powers: Sequence[Quotient], value: Any) -> dict[str, Any]:
    """Return omega and further forms of x for one of the roots x1, x2 of a quadratic, by their sum and product.

    omega = (sqrt(s + 2 r) -+ sqrt(s - 2 r)) / 2 where r = sqrt(x1 x2) is rational; x = f (m -+ sqrt(m^2 - x1 x2/f^2))
    with m = s/(2 f) the sum without its letters.
    """
    c, b, a = powers
    mean, product = -(b / (2 * a)), c / a
    side = 1 if value > mean.sample else -1
    found: dict[str, Any] = {"forms": tuple(_about_mean(mean, product, side))}
    with suppress(NoClosedFormError):
        root = sqrt(product) if product.sample > 0 else None
        terms = () if root is None else (m for p in (root.above, root.below) for m in p)
        is_rational = not any(mean.field.letters[k].node is None for m in terms for k, e in enumerate(m) if e)
        if root is not None and is_rational and mean.sample > root.sample:
            both = sqrt(2 * (mean + root)), sqrt(2 * (mean - root))
            found["frequency"] = (both[0] + both[1] * side) / 2
    return found


def _about_mean(mean: Quotient, product: Quotient, side: int) -> Iterator[Node]:
    """Yield mean -+ sqrt(mean^2 - product), all of it and without the factors of the mean."""
    field = mean.field
    plain = [(p, e) for p, e in factors_of(field.in_ring(mean.above))[1] if len(p) > 1]
    sums = reduce(mul, (field.whole(field.in_ring(p)).power(e) for p, e in plain), field.constant(1))
    for middle in (mean, sums):
        with suppress(NoClosedFormError):
            outside = mean / middle
            inside = middle * middle - product / (outside * outside)
            root = BUILD["sqrt"](book_node(inside))
            total = add(book_node(middle), root if side > 0 else negate(root))
            above, below = (field.whole(field.in_ring(p)) for p in (outside.above, outside.below))
            yield divide(multiply(book_node(above), total), book_node(below))


def _cubic(d: Quotient, c: Quotient, b: Quotient, a: Quotient) -> Iterator[Node]:
    """Yield the three real roots of a x^3 + b x^2 + c x + d by the cosine of a third of an angle (Vieta).

    x = (2 sqrt(P) cos((acos(Q/sqrt(P)^3) - 2 pi k)/3) - b)/(3 a)
    P = b^2 - 3 a c,    Q = (9 a b c - 2 b^3 - 27 a^2 d)/2
    """
    if a.sample < 0:
        a, b, c, d = -a, -b, -c, -d
    P = b * b - 3 * (a * c)
    Q = (9 * (a * b * c) - 2 * (b * b * b) - 27 * (a * a * d)) / 2
    inside = P * P * P - Q * Q
    if inside.sample < 0 or P.sample <= 0:
        return
    root = sqrt(P)
    size, middle = (book_node(x) for x in (2 * root / (3 * a), -b / (3 * a)))
    angle = BUILD["acos"](book_node(Q / (P * root)))
    for k in (1, 2, 0):
        turned = angle if not k else add(angle, multiply(as_node(-2 * k), PI))
        yield add(middle, multiply(size, BUILD["cos"](divide(turned, as_node(3)))))


def _biquadratic(powers: Sequence[Quotient]) -> Iterator[Quotient]:
    """Yield the roots of a quartic that has even powers only beside the mean of its roots."""
    mean = -(powers[3] / (4 * powers[4]))
    shifted = shift_powers(powers, mean)
    if not (shifted[1].is_zero and shifted[3].is_zero):
        return
    for square in _quadratic(shifted[0], shifted[2], shifted[4]):
        if square.sample < 0:
            return
        root = sqrt(square)
        yield mean - root
        yield mean + root


def root_of(x: Quotient) -> Root:
    return Root(x.sample, _root_node(x), x, 1)


def _root_node(root: Quotient | Node) -> Node | None:
    if not isinstance(root, Quotient):
        return root
    try:
        return book_node(root)
    except NoClosedFormError:
        return None
