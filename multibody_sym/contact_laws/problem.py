"""The problem that one-way laws pose at an instant, and its states: records only.

For m rows over n weighted coordinates (M = G^T G, x = G (udot - udot_free), so that A = H G^-1):

    a = A x + D z - r        x = C^T z

z (m) are the multipliers, a (m) what is left of the rows; a row's law says which of them may differ from zero. For
accelerations r = gamma - H udot_free, so that a = H udot - gamma + D z.

The same problem for speeds: things that touch without bouncing (e = 0) obey M (u+ - u-) = C^T p, each row's speed
v+ = v- + H (u+ - u-). With x = G (u+ - u-), r = -v- and z = p the laws read 0 <= v+, 0 <= p, v+ p = 0 and
|p_t| <= mu p_n against v_t+: every friction part has the velocity 0 there, whatever it had before, for only what is
left afterwards decides. Rows of equalities have r = -v- as well (zero but for drift), rows that define a joint's
impulse D = -1 and no terms of velocity. Corrections of positions are the same with gaps in place of speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats, lengths
from multibody_sym.scalars.limits import Kind, most
from multibody_sym.scalars.rank import ROUNDING

INACTIVE: Final = 0
STICKS: Final = 0
IN_SPACE: Final = 2
"""The slip of a part with two rows or three, in the direction of its velocity or, from rest, of its acceleration."""
COLLIDE: Final = "declare a restitution, 0 as well, by which an impact stops what slips"
"""The cure where friction leaves no state of what does not collide."""


@dataclass(frozen=True)
class Equality:
    """a = 0: what holds both ways, and rows that define a multiplier (a joint's reaction) by their D."""


@dataclass(frozen=True)
class Unilateral:
    """0 <= a, 0 <= z, a z = 0: a contact's normal, a rope that may slacken, a stop."""


@dataclass(frozen=True)
class FrictionRow:
    """Row number `component` (0; also 1, and 2, in space) of friction part number `part`."""

    part: int
    component: int = 0


Law = Equality | Unilateral | FrictionRow


@dataclass(frozen=True)
class FrictionLaw:
    """Coulomb's law of one friction part.

    `rows` (1; 2 or 3 in space) are its tangents; N is the sum of |z| over the rows `normals`, or with `norm` the length
    of the vector of these z. It sticks with |z_t| <= static N and slides with z_t = -kinetic N v_t/|v_t|. `velocity`
    (one value a row) is v_t: zeros, exactly, where it is at rest, and a_t decides. With `enough` any normal force will
    do: from rest it slips only where nothing presses, and friction alone keeps a contact closed. What is `held` does
    not even then: it is pressed from both sides, or its slip is stopped in an impact.
    Coefficients have the unit z_t / z_n (m for moments against forces).
    """

    rows: tuple[int, ...]
    normals: tuple[int, ...]
    static: float
    kinetic: float
    velocity: tuple[float, ...] = (0.0,)
    norm: bool = False
    enough: bool = False
    held: bool = False

    @property
    def rests(self) -> bool:
        """Whether it has no velocity, so that its acceleration decides how it slips."""
        return not any(self.velocity)


@dataclass(frozen=True)
class LawProblem:
    """Rows and their laws, in numbers: A (m, n), C (m, n), D (m, m), r (m), and m laws.

    C is A for rows that exert their own force; rows of D are zero but for those that define a multiplier. Normals of
    friction parts are rows of law Unilateral (z >= 0) or Equality (either sign: N = |z|).
    """

    matrix: Floats
    exerted: Floats
    coupling: Floats
    right: Floats
    laws: tuple[Law, ...]
    parts: tuple[FrictionLaw, ...] = ()

    @cached_property
    def equalities(self) -> list[int]:
        """The rows that hold both ways."""
        return [k for k, law in enumerate(self.laws) if isinstance(law, Equality)]

    @cached_property
    def tangents(self) -> list[int]:
        """The rows of friction."""
        return [k for k, law in enumerate(self.laws) if isinstance(law, FrictionRow)]

    @cached_property
    def rough_parts(self) -> Mapping[int, list[int]]:
        """The friction parts that are not smooth, by each row that presses them."""
        found = dict[int, list[int]]()
        for k, part in enumerate(self.parts):
            for row in part.normals if part.enough or part.static or part.kinetic else ():
                found.setdefault(row, []).append(k)
        return found

    @cached_property
    def couples(self) -> bool:
        """Whether any row defines a multiplier."""
        return bool(self.coupling.any())


@dataclass(frozen=True)
class LawMode:
    """Which rows act and how parts slip.

    `sides` (m): of unilateral rows 0 (open, slack) or 1; of two-sided normals the sign of z, 0 where it is zero; 1 for
    other equalities; of friction rows 1 where they stick. `slips`, by part: 0 sticks (or does not touch), 1 or -1 the
    sign of v_t, or of a_t from rest, 2 in space. `directions`, by part: the unit vector in which slip in space goes,
    else None.
    """

    sides: tuple[int, ...]
    slips: tuple[int, ...]
    directions: tuple[tuple[float, ...] | None, ...]


@dataclass(frozen=True)
class Round:
    """A solution where the parts `kinetic` have that coefficient: its mode, and the rows whose z it is made of.

    It is a basic one: what carries nothing may be open in it, and what is at its limit may slide.
    """

    kinetic: frozenset[int]
    mode: LawMode
    carrying: tuple[int, ...]


@dataclass(frozen=True)
class LawState:
    """A mode that fulfils all laws, with x (n), z (m) and a (m).

    `kinetic` are the parts that have their kinetic coefficient: what slides, and what slips from rest under its static
    one. `not_unique` are the rows whose z may have other values beside the same x; `at_limit` the rows (of a part its
    first one) where two modes fit and rates do not tell them apart either, or were not asked for: there the mode says
    stick before slide, closed before open, taut before slack. `rounds` lead
    from static coefficients to the state, which is found again by them.
    """

    mode: LawMode
    x: Floats
    z: Floats
    a: Floats
    kinetic: frozenset[int] = frozenset()
    not_unique: tuple[int, ...] = ()
    at_limit: tuple[int, ...] = ()
    rounds: tuple[Round, ...] = ()


Verdict = Literal["one", "none", "several"]

Drift = Callable[[LawState], Floats]
"""Rates for ties: from a state the (m) rates at which its rows' a would change with all z as they are.

That is d/dt of (H udot - gamma + D z) along q' = N u, u' = udot with udot = M^-1 (f + C^T z) and z constant: forward
derivatives of a Program give it, or a difference quotient. With A, C and D it is all that the problem of rates needs.
"""


@dataclass(frozen=True)
class LawStates:
    """The states in which all laws hold.

    `verdict`: "one"; "none" (`states` is empty); "several" (distinct accelerations or unique forces; or one state
    with `free` rows). `searched` says in words what was looked at; `proved` whether there are no others. `free` are
    the rows whose forces are not unique and change the motion: the friction of what slides depends on them.
    """

    states: tuple[LawState, ...]
    verdict: Verdict
    searched: str
    proved: bool
    free: tuple[int, ...] = ()

    @property
    def why_none(self) -> str:
        """Why there is no state, in words."""
        laws = "that may act, stick or slide fulfils the laws of contact and friction together"
        if self.proved:
            return f"nothing {laws}: {self.searched}"
        unproved = "it is not proved that there is none"
        return f"no state was found in which all {laws}; tried were {self.searched}, and {unproved}"


def select(problem: LawProblem, rows: Sequence[int], parts: Sequence[int]) -> LawProblem:
    """Return the problem of some rows and friction parts, renumbered."""
    place = {row: k for k, row in enumerate(rows)}
    number = {part: k for k, part in enumerate(parts)}
    laws = (problem.laws[k] for k in rows)
    frictions = (problem.parts[k] for k in parts)
    return LawProblem(
        problem.matrix[rows],
        problem.exerted[rows],
        problem.coupling[np.ix_(rows, rows)],
        problem.right[rows],
        tuple(replace(law, part=number[law.part]) if isinstance(law, FrictionRow) else law for law in laws),
        tuple(
            replace(part, rows=tuple(place[k] for k in part.rows), normals=tuple(place[k] for k in part.normals))
            for part in frictions
        ),
    )


# ----------------------------------------------------------------------------------------------------------------------
# A LawProblem with rows and forces of unit length, so that units and masses have no say, as arrays.


Places = NDArray[np.intp]
Flags = NDArray[np.bool_]
Array = TypeVar("Array", Floats, Flags)


@dataclass(frozen=True)
class ScaledFriction:
    """A friction part: |z[rows]| <= mu N with N = sum |base z[normals]|, or with `norm` the length of that vector."""

    number: int
    rows: Places
    normals: Places
    base: Floats
    velocity: Floats
    static: float
    kinetic: float
    norm: bool
    enough: bool
    held: bool

    @cached_property
    def rests(self) -> bool:
        return not self.velocity.any()

    @cached_property
    def moving(self) -> Floats:
        """The direction of its velocity, zeros at rest."""
        return self.velocity / (float(np.linalg.norm(self.velocity)) or 1.0)

    @property
    def moving_slip(self) -> int:
        """The slip of a part that moves, as a number."""
        return IN_SPACE if self.in_space else int(np.sign(self.velocity[0]))

    @cached_property
    def in_space(self) -> bool:
        return len(self.rows) > 1

    def loads(self, z: Floats) -> Floats:
        """Return (.., k) the forces of its normals among z (.., m)."""
        return np.asarray(self.base * z[..., self.normals], dtype=float)

    def pressed(self, z: Floats) -> Floats:
        """Return N (..) of forces z (.., m)."""
        return _pressed(self.loads(z), np.zeros(1, dtype=np.intp), self.norm)[..., 0]

    def along(self, z: Floats, least: float = 0.0) -> Floats:
        """Return (.., k) the direction of these forces as a vector, zeros where it is no longer than `least`."""
        loads = self.loads(z)
        sizes = lengths(loads)[..., None]
        return np.asarray(loads / np.where(sizes > least, sizes, np.inf), dtype=float)

    def weights(self, sides: Floats | Places, pressing: Mapping[int, Floats]) -> Floats:
        """Return (.., k) the factors of z[normals] in N, by the signs of sides (.., m) or the directions `pressing`."""
        if self.norm:
            return np.asarray(self.base * pressing.get(self.number, np.zeros(len(self.normals))), dtype=float)
        return signed(self.base, sides[..., self.normals])

    def bound(self, mu: float, weights: Floats, count: int) -> Floats:
        """Return (m) by the forces how large its friction can be, mu N, for factors of its normals in N."""
        row = np.zeros(count)
        row[self.normals] = most(mu, weights)
        return row

    def cone(self, bound: Floats, ways: Floats) -> Floats:
        """Return (k, m) by the forces what a bound (m) leaves of friction in directions (k, number of its rows)."""
        rows = np.tile(bound, (len(ways), 1))
        rows[:, self.rows] -= ways
        return rows


@dataclass(frozen=True)
class FrictionTable:
    """Rows of all parts, `sizes` many from `first` on, and their normals with `base`, from `starts` on.

    `first` and `starts` are places in `rows` and `normals`, `owners` the numbers of the parts that these normals press;
    `senses` the signs of velocities in the first of their rows.
    """

    rows: Places
    first: Places
    sizes: Places
    normals: Places
    starts: Places
    owners: Places
    base: Floats
    senses: Floats
    rests: Flags
    held: Flags
    norm: Flags


@dataclass(frozen=True)
class Scaled:
    """a = A x + D z - r, x = C^T z for rows of length one; `lengths` (m) of rows of A and `sizes` (m) of those of C.

    z here is `sizes` times that of the problem, a is its a over `lengths`. `kinematic` equalities restrict motion,
    `defining` ones define their multiplier. `both` are the rows of equalities that are normals: of either sign.
    """

    A: Floats
    C: Floats
    D: Floats
    r: Floats
    lengths: Floats
    sizes: Floats
    unilateral: Places
    kinematic: Places
    defining: Places
    both: Places
    parts: tuple[ScaledFriction, ...]

    @property
    def count(self) -> int:
        return len(self.r)

    def flags(self, rows: Places | Sequence[int]) -> Flags:
        """Return (m) which rows are among some."""
        found = np.zeros(self.count, dtype=bool)
        found[list(rows)] = True
        return found

    @cached_property
    def two_sided(self) -> Flags:
        """(m): which rows are `both`."""
        return self.flags(self.both)

    @cached_property
    def table(self) -> FrictionTable:
        """All parts at once."""
        starts = np.cumsum([0, *(len(p.normals) for p in self.parts)])[:-1]
        first = np.cumsum([0, *(len(p.rows) for p in self.parts)])[:-1]
        return FrictionTable(
            np.concatenate([np.zeros(0, dtype=np.intp), *(p.rows for p in self.parts)]),
            first.astype(np.intp),
            np.array([len(p.rows) for p in self.parts], dtype=np.intp),
            np.concatenate([np.zeros(0, dtype=np.intp), *(p.normals for p in self.parts)]),
            starts.astype(np.intp),
            np.repeat(np.arange(len(self.parts)), [len(p.normals) for p in self.parts]).astype(np.intp),
            np.concatenate([np.zeros(0), *(p.base for p in self.parts)]),
            np.sign([p.velocity[0] for p in self.parts], dtype=float),
            np.array([p.rests for p in self.parts], dtype=bool),
            np.array([p.held for p in self.parts], dtype=bool),
            np.array([p.norm for p in self.parts], dtype=bool),
        )

    def pressed_parts(self, sides: Places) -> Flags:
        """Return (.., p) which parts anything presses, by sides (.., m): a closed contact, or a joint's reaction."""
        normals = self.table.normals
        return over_parts(np.logical_or, self.two_sided[normals] | (sides[..., normals] > 0), self.table.starts)

    def loads(self, z: Floats) -> Floats:
        """Return (.., k) the forces of the normals of all parts."""
        return np.asarray(self.table.base * z[..., self.table.normals], dtype=float)

    def pressed(self, z: Floats) -> Floats:
        """Return N (.., p) of all parts."""
        return _pressed(self.loads(z), self.table.starts, self.table.norm)

    def rubbing(self, z: Floats) -> Floats:
        """Return (.., p) how large the friction of all parts is."""
        return np.asarray(np.sqrt(over_parts(np.add, z[..., self.table.rows] ** 2, self.table.first)), dtype=float)

    def forward(self, mode: ModeArrays, a: Floats) -> Floats:
        """Return (.., p) how fast parts slip the way that they do in modes, of accelerations (.., m)."""
        rows, first, slips = self.table.rows, self.table.first, mode.slips
        if len(rows) > len(first):
            owners = np.repeat(np.arange(len(first)), self.table.sizes)
            ways = mode.directions[..., owners, np.arange(len(rows)) - first[owners]]
            slips = np.where(self.table.sizes[owners] > 1, ways, slips[..., owners])
        return over_parts(np.add, slips * a[..., rows], first)

    def of_all_rows(self, flags: Flags) -> Flags:
        """Return (p) for which parts flags (m) of all their rows are set."""
        return over_parts(np.logical_and, flags[self.table.rows], self.table.first)

    @cached_property
    def couplings(self) -> Floats:
        """Lengths (m) of rows of D."""
        return lengths(self.D)

    @cached_property
    def wanted(self) -> float:
        """The size of the largest right side."""
        return float(np.abs(self.r).max(initial=0.0))

    @cached_property
    def _sizes(self) -> tuple[Floats, Floats, Floats]:
        """The sizes of all numbers in A, D and r."""
        return np.abs(self.A), np.abs(self.D), np.abs(self.r)

    def terms(self, x: Floats, z: Floats) -> Floats:
        """Return (m) how large the terms of which a consists are."""
        A, D, r = self._sizes
        return np.asarray(A @ np.abs(x) + D @ np.abs(z) + r, dtype=float)


def scaled(problem: LawProblem) -> Scaled:
    """Return the problem with rows and forces of unit length; rows of a part in space share theirs.

    Rows that are rounding beside the longest one vanish: they are the tangents and reactions of bodies that are held.
    """
    laws, count = problem.laws, len(problem.laws)
    defines = np.any(problem.coupling != 0.0, axis=1)
    matrix, exerted = _without_rounding(problem.matrix), _without_rounding(problem.exerted)
    of_rows, sizes = _lengths(matrix, problem.parts), _lengths(exerted, problem.parts)
    for part in problem.parts:
        own = [k for k in part.normals if isinstance(laws[k], Equality) and not exerted[k].any()]
        sizes[own] = sizes[part.rows[0]]
    diagonal = np.abs(problem.coupling.diagonal()) / sizes
    of_rows = np.where(defines & (diagonal > 0.0), np.maximum(diagonal, 0.0), of_rows)
    equal = np.array([isinstance(law, Equality) for law in laws], dtype=bool).reshape(count)
    normal = np.zeros(count, dtype=bool)
    for part in problem.parts:
        normal[list(part.normals)] = True
    parts = list[ScaledFriction]()
    for number, part in enumerate(problem.parts):
        rows, normals = np.array(part.rows, dtype=np.intp), np.array(part.normals, dtype=np.intp)
        velocity = np.array([*part.velocity, *[0.0] * (len(rows) - len(part.velocity))], dtype=float)
        base, numbers = sizes[rows[0]] / sizes[normals], (part.static, part.kinetic)
        flags = part.norm, part.enough, part.held
        parts.append(ScaledFriction(number, rows, normals, base, velocity, *numbers, *flags))
    return Scaled(
        matrix / of_rows[:, None],
        exerted / sizes[:, None],
        problem.coupling / np.outer(of_rows, sizes),
        problem.right / of_rows,
        of_rows,
        sizes,
        np.flatnonzero([isinstance(law, Unilateral) for law in laws]),
        np.flatnonzero(equal & ~defines),
        np.flatnonzero(equal & defines),
        np.flatnonzero(equal & normal),
        tuple(parts),
    )


def signed(base: Floats, sides: Floats | Places) -> Floats:
    """Return the factors of forces in N by the sides on which they press."""
    return np.asarray(base * np.where(sides < 0, -1.0, 1.0), dtype=float)


def beyond(friction: Floats, pressing: Floats, mu: Floats) -> Floats:
    """Return by how much friction is beyond mu N, or for mu > 1 by how much N is too small for it.

    Either is exact to the rounding of forces: where a coefficient is large, that of N counts mu times in mu N.
    """
    return np.asarray((friction - most(mu, pressing)) / np.maximum(mu, 1.0), dtype=float)


def _without_rounding(rows: Floats) -> Floats:
    largest = np.abs(rows).max(axis=1, initial=0.0)
    return np.where((largest > ROUNDING * largest.max(initial=0.0))[:, None], rows, 0.0)


def _lengths(rows: Floats, parts: Sequence[FrictionLaw]) -> Floats:
    """Return the lengths of rows, 1 where they are zero, the largest one for all rows of a part in space."""
    found = lengths(rows)
    for part in parts:
        if len(part.rows) > 1:
            found[list(part.rows)] = found[list(part.rows)].max()
    found[found == 0.0] = 1.0
    return found


def _pressed(loads: Floats, starts: Places, norm: Flags | bool) -> Floats:
    """Return N (.., p) of parts whose forces of normals (.., k) begin at some places."""
    sums = over_parts(np.add, np.abs(loads), starts)
    return np.where(norm, np.sqrt(over_parts(np.add, loads * loads, starts)), sums) if np.any(norm) else sums


def over_parts(combine: np.ufunc, values: Array, starts: Places) -> Array:
    """Return (.., p) values (.., k) of parts combined, which begin at some places."""
    return combine.reduceat(values, starts, axis=-1) if len(starts) else values[..., :0]


@dataclass(frozen=True)
class ModeArrays:
    """A mode, or several, in arrays: `sides` (.., m), `slips` (.., p), `directions` (.., p, 3), zeros without one.

    A part has as many components as it has rows; the others are zero.
    """

    sides: Places
    slips: Places
    directions: Floats

    def copy(self) -> ModeArrays:
        return ModeArrays(self.sides.copy(), self.slips.copy(), self.directions.copy())

    def direction(self, part: ScaledFriction) -> Floats:
        """Return the direction of a part, with one component for each of its rows."""
        return self.directions[part.number, : len(part.rows)]

    def way(self, part: ScaledFriction) -> Floats:
        """Return the direction in which a part slides, with one component for each of its rows."""
        if not part.rests:
            return part.moving
        return self.direction(part) if part.in_space else np.array([float(self.slips[part.number])])


@dataclass(frozen=True)
class LawLimits:
    """The limits of one kind in modes: what must not be negative, `values` (.., k), where it is `asked` (.., k).

    A force that presses, a gap that opens, friction in its cone, slip that begins along its direction, and the side on
    which a reaction presses. `places` (k) are rows, of cones and slips the numbers of parts.
    """

    kind: Kind
    places: Places
    values: Floats
    asked: Flags


def limits_of(problem: Scaled, mode: ModeArrays, mu: Floats, z: Floats, a: Floats) -> Iterator[LawLimits]:
    """Yield the limits of modes by kinds, with coefficients mu (p), forces z and accelerations a (.., m)."""
    table, rows, sides = problem.table, problem.unilateral, mode.sides
    parts, normals, closed = np.arange(len(problem.parts)), table.normals, sides[..., rows] > 0
    yield LawLimits("force", rows, z[..., rows], closed)
    yield LawLimits("gap", rows, a[..., rows], ~closed)
    rubs = problem.pressed_parts(sides) & (mu != 0.0)
    sticks = rubs & table.rests & (mode.slips == STICKS)
    over = beyond(problem.rubbing(z), problem.pressed(z), mu)
    yield LawLimits("cone", parts, -over, sticks & ~table.held)
    yield LawLimits("slip", parts, problem.forward(mode, a), rubs & ~sticks & table.rests)
    sided = (rubs & ~sticks & ~table.norm)[..., table.owners] & problem.two_sided[normals]
    yield LawLimits("side", normals, signed(z[..., normals], sides[..., normals]), sided)
