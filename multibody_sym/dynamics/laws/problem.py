"""The problem that one-way laws pose at an instant, and what is found: records only.

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

from collections.abc import Callable
from typing import Final, Literal

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass

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
class Friction:
    """Row number `component` (0; also 1, and 2, in space) of friction part number `part`."""

    part: int
    component: int = 0


Law = Equality | Unilateral | Friction


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
class Found:
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
