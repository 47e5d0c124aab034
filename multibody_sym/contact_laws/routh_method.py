"""One contact through compression and restitution: Routh's integration over its normal impulse.

While it slips one way, or sticks, all impulses and speeds are linear in p_n: exact, and changed where slip stops. In
space the direction of slip turns (`follow_turning_slip`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import cache, cached_property
from operator import add, mul
from typing import Final, Literal, NamedTuple

import numpy as np

from multibody_sym.contact_laws.impact_problem import (
    Chosen,
    ImpactProgress,
    ImpulseResponse,
    Push,
    PushPhase,
    Stage,
    impulse_response,
    select_rows,
    verify_moves,
)
from multibody_sym.contact_laws.problem import IN_SPACE, STICKS, Equality, FrictionLaw, Places
from multibody_sym.contact_laws.search import find
from multibody_sym.errors import NoSolutionError
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats
from multibody_sym.scalars.limits import most, pressing, room, sliding
from multibody_sym.scalars.rank import least_squares, scaled_rows

# ----------------------------------------------------------------------------------------------------------------------
# At what rates impulses and speeds of one contact change with its normal impulse, while it slips or sticks.
#
#     v' = K f',   f' = (1, p_t'),   p_t' = -mu v_t/|v_t|;  at rest v_t' = 0 with |p_t'| <= mu, else along v_t'
#
# In several places (a joint that rubs, rolling resistance) the rates themselves obey the laws of an instant: p_n' = 1
# is a row that defines its multiplier.


AT_REST = 1e-12
"""Part of the largest speed below which v_t is rounding."""


class ImpulseRates(NamedTuple):
    """Rates by the normal impulse, over the rows (k) that a course follows: of impulses f, of speeds v; slips by parts.

    `x` (n) where other parts rub than that of the contact, or several: then the rows are those of a chosen problem.
    """

    f: list[float]
    v: list[float]
    slips: tuple[int, ...]
    x: Floats | None = None


Table = Sequence[Sequence[float]]


def rates_of_contact(K: Table, part: FrictionLaw | None, v: list[float], small: float) -> ImpulseRates:
    """Return the rates of a contact with one friction part, or none, at speeds v (k); below `small` v_t is at rest.

    K (k, k) is how speeds along the normal and the tangents change with impulses.
    """
    f, slip = [1.0], STICKS
    if part is not None:
        along = v[1:]
        speed = math.hypot(*along)
        sticks, held = False, list[float]()
        if not speed > small:
            held = _holding(K)
            sticks = part.enough or math.hypot(*held) <= most(part.static, 1.0 + AT_REST)
            if not sticks:
                line = [math.copysign(1.0, K[1][0])]
                along = line if len(along) == 1 else departing_direction(np.array(K), part.kinetic).tolist()
                speed = 1.0
        f += held if sticks else sliding(part.kinetic, along, speed)
        if not sticks:
            slip = IN_SPACE if len(along) > 1 else 1 if along[0] > 0.0 else -1
    rates = [sum(map(mul, row, f)) for row in K]
    if part is not None and slip == STICKS:
        rates[1:] = [0.0] * len(held)
    return ImpulseRates(f, rates, () if part is None else (slip,))


def _holding(K: Table) -> list[float]:
    """Return the impulses along the tangents beside which one along the normal changes no v_t, the least of them."""
    if len(K) == 2:
        return [-K[1][0] / K[1][1] if K[1][1] else 0.0]
    matrix = np.array(K)
    return [float(x) for x in least_squares(matrix[1:, 1:], -matrix[1:, 0])]


def departing_direction(K: Floats, mu: float) -> Floats:
    """Return the unit vector e in which slip starts from rest: K_tn - mu K_tt e = c e with c > 0.

    |(mu K_tt + c)^-1 K_tn| falls with c, from more than 1 at c = 0 since it does not stick.
    """
    sizes, axes = np.linalg.eigh((K[1:, 1:] + K[1:, 1:].T) / 2.0)
    along = axes.T @ K[1:, 0]
    low, high = 0.0, float(np.linalg.norm(along))
    for _ in range(200):
        c = (low + high) / 2.0
        if not low < c < high:
            break
        longer = float(np.linalg.norm(along / (mu * sizes + c))) > 1.0
        low, high = (c, high) if longer else (low, c)
    e = axes @ (along / (mu * sizes + high))
    return np.asarray(e / np.linalg.norm(e), dtype=float)


def rates_with_joints(
    account: ImpactProgress, some: Chosen, row: int, v: Sequence[float], small: Sequence[float]
) -> ImpulseRates:
    """Return the rates where several parts rub, for the contact at `row` of a chosen problem at speeds v (m).

    A part whose speeds are below `small` (m) is at rest.
    """
    problem = some.problem
    matrix, coupling, right = problem.matrix.copy(), problem.coupling.copy(), np.zeros(len(v))
    matrix[row], coupling[row] = 0.0, 0.0
    coupling[row, row] = right[row] = 1.0
    laws = tuple(Equality() if k == row else law for k, law in enumerate(problem.laws))
    parts = list[FrictionLaw]()
    for part in problem.parts:
        slip = [v[k] for k in part.rows]
        rests = math.hypot(*slip) <= max(small[k] for k in part.rows)
        parts.append(replace(part, velocity=(0.0,) * len(slip) if rests else tuple(slip)))
    posed = replace(problem, matrix=matrix, coupling=coupling, right=right, laws=laws, parts=tuple(parts))
    found = find(posed, every=False)
    if not found.states:
        name = account.problem.name(some.rows[row])
        jams = f"the impact at {name} cannot go on: friction in several places jams there"
        unknown = f"no way was found in which the impact at {name} goes on past friction in several places"
        raise NoSolutionError(jams if found.proved else f"{unknown}; tried were {found.searched}", number="N108")
    state = found.states[0]
    changes = problem.matrix @ state.x + problem.coupling @ state.z
    return ImpulseRates(state.z.tolist(), changes.tolist(), state.mode.slips, state.x)


# ----------------------------------------------------------------------------------------------------------------------
# When one contact has been compressed, and when it lets go: by speeds, by impulses or by works.


class Normal(NamedTuple):
    """The normal state on the way: the speed v, the impulse p so far, and its work W."""

    v: float
    p: float = 0.0
    W: float = 0.0

    def on(self, dp: float, rate: float) -> Normal:
        """Return the state dp later, while v' = rate."""
        return Normal(self.v + rate * dp, self.p + dp, self.W + self.v * dp + rate * dp * dp / 2.0)


@dataclass(frozen=True)
class Goal:
    """Where a stage ends: at a value of v, p or W."""

    what: Literal["v", "p", "W"]
    value: float

    def missing(self, at: Normal) -> float:
        """Return what is missing: the stage has ended where nothing is."""
        reached: float = getattr(at, self.what)
        return self.value - reached

    def slope(self, at: Normal, rate: float) -> float:
        """Return by how much it changes with p."""
        return rate if self.what == "v" else 1.0 if self.what == "p" else at.v

    def ahead(self, at: Normal, rate: float) -> float:
        """Return the dp after which the stage ends while v' = rate; inf if it never does."""
        missing = self.missing(at)
        if self.what == "W":
            square = at.v * at.v + 2.0 * rate * missing
            root = math.sqrt(square) if square > 0.0 else 0.0
            if missing <= 0.0:
                return 0.0
            return 2.0 * missing / (at.v + root) if square > 0.0 and at.v + root > 0.0 else math.inf
        slope = self.slope(at, rate)
        return max(missing, 0.0) / slope if slope > 0.0 else 0.0 if missing <= 0.0 else math.inf

    def met(self, at: Normal) -> Normal:
        """Return the state at the end, without the rounding on the way."""
        return at._replace(**{self.what: self.value})


COMPRESSED = Goal("v", 0.0)


# ----------------------------------------------------------------------------------------------------------------------
# Slip in space, whose direction turns on the way, by quadrature: to 1e-13.
#
# With v_t = exp(l) (cos phi, sin phi), e its direction, and dp = |v_t| ds nothing is singular where slip stops:
#
#     phi' = e_x (K_tn - mu K_tt e),  l' = e (K_tn - mu K_tt e),  v_n' = |v_t| (K_nn - mu K_nt e),  p_t' = -mu |v_t| e
#
# phi' depends on phi alone and has its zeros where a quartic has them: phi comes to the next one, from where all is
# straight. On the way there, phi = phi* - d exp(-tau), everything else is an integral over tau. (Battle, J. Appl.
# Mech. 63 (1996), Stronge, Impact Mechanics, 4.)


DEGREE: Final = 28
"""Of the polynomials by which integrands are integrated over a panel, ..."""
EXACT: Final = 1e-14
"""... whose last coefficients are no more than this part of the largest."""
STOPPED: Final = -34.0
"""The logarithm of 2e-15: what is left of v_t then is rounding of what there was."""
SETTLED: Final = 1e-14
"""A direction that turns at less than this part of its terms stays: the rest is straight."""
MOST: Final = 1000
"""Panels of one slip: some twenty are usual."""
PASSES: Final = 30
LONGEST: Final = 4.0
"""The largest panel in tau, ..."""
NARROWEST: Final = 1e-12
"""... and the smallest at whose first node an end is sought."""


@dataclass(frozen=True)
class TurnedSlip:
    """What slip has done: p_t (2) it added, v_t (2) at its end, the energy it took, and whether its stage has ended."""

    at: Normal
    impulse: Floats
    velocity: Floats
    lost: float
    ended: bool


def turns(K: Floats, mu: float, v: Floats) -> bool:
    """Return whether slip along v (2) turns."""
    e = v / np.linalg.norm(v)
    terms = np.linalg.norm(K[1:, 0]) + mu * np.linalg.norm(K[1:, 1:])
    a = K[1:, 0] - mu * (K[1:, 1:] @ e)
    return bool(abs(e[0] * a[1] - e[1] * a[0]) > SETTLED * terms)


def follow_turning_slip(K: Floats, mu: float, v: Floats, at: Normal, goal: Goal) -> TurnedSlip:
    """Return what slip at v (2) with K (3, 3) does until its stage ends, it stops, or its direction stays."""
    size, speed = float(np.trace(K)), float(np.linalg.norm(v))
    slip = _Slip(K / size, mu, size / speed, speed, at, goal, _Direction.of(K / size, mu, v))
    y = np.zeros(7)
    y[VN] = at.v / speed
    tau, width = 0.0, 1.0
    for _ in range(MOST):
        panel = slip.panel(tau, width, y)
        if panel is None:
            width /= 2.0
            continue
        ended = np.asarray(slip.goal.missing(slip.normal(panel.y)))[1:] <= 0.0
        if ended[0] and width > NARROWEST:  # rounding of the whole panel is much beside so small a part of it
            width *= 1.0 + float(_rules()[0][1])  # twice as far as that node
            continue
        if ended.any():
            return slip.told(*slip.end_in(panel, 1 + int(np.argmax(ended))), ended=True)
        tau, y = tau + width, panel.y[:, -1]
        width = min(LONGEST, 2.0 * width)
        if y[LOG] < STOPPED or not turns(K, mu, slip.way.along(tau)):
            return slip.told(y, slip.way.along(tau), ended=False)
    raise NoSolutionError(
        f"the end of slip that turns in space was not found in {MOST} parts of its way: a mass or a moment of inertia "
        "may be nearly zero",
        number="N108",
    )


# Places in the integrals.
LOG, VN, P, W, Q, L = 0, 1, 2, 3, slice(4, 6), 6


@dataclass(frozen=True)
class _Direction:
    """phi' = Re(p z + q z^2), z = exp(i phi), from `first` up or down (`sense`) to its next zero `last`."""

    p: complex
    q: complex
    first: float
    last: float
    sense: float

    @classmethod
    def of(cls, K: Floats, mu: float, v: Floats) -> _Direction:
        p, q = complex(K[2, 0], K[1, 0]), -mu * complex(K[1, 2], -(K[2, 2] - K[1, 1]) / 2.0)
        first = float(np.arctan2(v[1], v[0]))
        begun = cls(p, q, first, first, 1.0)
        sense = float(np.sign(begun.pace(np.array(first))))
        ahead = min(sense * (zero - first) % (2.0 * np.pi) for zero in begun.zeros())
        return replace(begun, last=first + sense * ahead, sense=sense)

    def pace(self, phi: Floats) -> Floats:
        z = np.exp(1j * phi)
        return np.asarray((self.p * z + self.q * z * z).real)

    def zeros(self) -> list[float]:
        """Return where phi' is zero: at two angles at least, for its mean is zero."""
        quartic = [self.q, self.p, 0.0, self.p.conjugate(), self.q.conjugate()]
        phi: Floats = np.asarray(np.angle(np.roots(quartic)), dtype=float)
        terms = abs(self.p) + abs(self.q)
        for _ in range(8):
            z = np.exp(1j * phi)
            slope = (1j * self.p * z + 2j * self.q * z * z).real
            phi = phi - np.divide(self.pace(phi), slope, out=np.zeros_like(phi), where=np.abs(slope) > 1e-9 * terms)
        return [float(x) for x in phi[np.abs(self.pace(phi)) <= 1e-13 * terms]]

    @cached_property
    def _far(self) -> float:
        return abs(self.last - self.first)

    def at(self, tau: float, ahead: Floats) -> tuple[Floats, Floats]:
        """Return e (2, n) at tau + ahead, and ds/dtau = -(phi* - phi)/phi', which has a limit at phi*.

        phi' is a difference from phi*, and its change from tau on where that is the smaller one: each is rounded by its
        own size, so that slip that leaves a direction in which it would stay is smooth.
        """
        begun, left = self._far * np.exp(-tau), self._far * np.exp(-(tau + ahead))
        gone = -begun * np.expm1(-ahead)
        pace = self._change(self.last, -self.sense * left)
        first = self._change(self.last, np.array(-self.sense * begun))
        near = first + self._change(self.last - self.sense * begun, self.sense * gone)
        x = self.last - self.sense * left
        return np.array([np.cos(x), np.sin(x)]), left / (self.sense * np.where(gone < left, near, pace))

    def _change(self, phi: float, x: Floats) -> Floats:
        """Return phi' at phi + x minus that at phi."""
        z = np.exp(1j * phi)
        once, twice = (-2.0 * np.sin(k * x / 2.0) ** 2 + 1j * np.sin(k * x) for k in (1.0, 2.0))  # exp(i k x) - 1
        return np.asarray((self.p * z * once + self.q * z * z * twice).real)

    def along(self, tau: float) -> Floats:
        return self.at(tau, np.zeros(1))[0][:, 0]


@dataclass(frozen=True)
class _Panel:
    """A part of the way: from tau on, so wide, with what is integrated (7, n) at its nodes."""

    tau: float
    width: float
    y: Floats

    def inside(self, x: float) -> Floats:
        """Return what is integrated at x from -1 to 1."""
        nodes, weights, *_ = _rules()
        apart = x - nodes
        if not apart.all():
            return np.asarray(self.y[:, int(np.argmin(np.abs(apart)))])
        parts = weights / apart
        return np.asarray(self.y @ parts / parts.sum())


@dataclass(frozen=True)
class _Slip:
    """Slip in numbers without units: speeds by `speed`, impulses times `mass`."""

    K: Floats
    mu: float
    mass: float
    speed: float
    begun: Normal
    goal: Goal
    way: _Direction

    def panel(self, tau: float, width: float, y: Floats) -> _Panel | None:
        """Return a panel from where y (7) is; None where polynomials do not reach over it."""
        nodes, _, integral, coefficients = _rules()
        e, pace = self.way.at(tau, width * (nodes + 1.0) / 2.0)
        a = self.K[1:, :1] - self.mu * (self.K[1:, 1:] @ e)
        half = width / 2.0
        growing = (e * a).sum(axis=0) * pace
        log = y[LOG] + half * (integral @ growing)
        if not (np.isfinite(log).all() and log.max() < 300.0):
            return None
        speed = np.exp(log)
        dp = speed * pace
        closing = (self.K[0, 0] - self.mu * (self.K[0, 1:] @ e)) * dp
        first = np.array([dp, closing, -self.mu * e[0] * dp, -self.mu * e[1] * dp, self.mu * speed * dp])
        terms, most = self.mu + float(np.abs(self.K).max()), float(np.abs(dp).max())  # what rounding falsifies
        sizes = terms * np.array([float(np.abs(pace).max()), most, most, most, most, most * float(speed.max())])
        tails = np.abs(np.vstack([growing, first]) @ coefficients.T)[:, -2:].max(axis=1)
        if (tails > EXACT * sizes).any():
            return None
        p, vn, qx, qy, lost = half * (first @ integral.T)
        vn = y[VN] + vn
        found = [log, vn, y[P] + p, y[W] + half * (integral @ (vn * dp)), y[Q][0] + qx, y[Q][1] + qy, y[L] + lost]
        return _Panel(tau, width, np.array(found))

    def end_in(self, panel: _Panel, node: int) -> tuple[Floats, Floats]:
        """Return what is integrated, and the direction, where the stage ends, before a node of a panel."""
        nodes, *_ = _rules()
        low, high = float(nodes[node - 1]), float(nodes[node])
        here = high
        for _ in range(PASSES):
            there, ahead = panel.inside(here), panel.width * (here + 1.0) / 2.0
            at = self.normal(there)
            missing = self.goal.missing(at)
            low, high = (here, high) if missing > 0.0 else (low, here)
            e, pace = self.way.at(panel.tau, np.array([ahead]))
            fast = float(np.exp(there[LOG]) * pace[0]) / self.mass * panel.width / 2.0  # dp/dx
            rate = float(self.K[0, 0] - self.mu * (self.K[0, 1:] @ e[:, 0])) * self.mass * self.speed
            slope = fast * self.goal.slope(at, rate)
            wanted = here + missing / slope if slope > 0.0 else (low + high) / 2.0
            if abs(wanted - here) <= 4e-16 or high - low <= 4e-16:
                break
            here = wanted if low < wanted < high else (low + high) / 2.0
        return there, e[:, 0]

    def normal(self, y: Floats) -> Normal:
        """Return the normal state at one node or several, in the units of the problem."""
        begun, speed = self.begun, self.speed
        return Normal(y[VN] * speed, begun.p + y[P] / self.mass, begun.W + y[W] * speed / self.mass)

    def told(self, y: Floats, e: Floats, *, ended: bool) -> TurnedSlip:
        at = self.normal(y)
        velocity = np.zeros(2) if y[LOG] < STOPPED else self.speed * np.exp(y[LOG]) * e
        impulse, lost = y[Q] / self.mass, y[L] * self.speed / self.mass
        return TurnedSlip(self.goal.met(at) if ended else at, impulse, velocity, float(lost), ended)


@cache
def _rules() -> tuple[Floats, Floats, Floats, Floats]:
    """Return Chebyshev's nodes on (-1, 1), barycentric weights, integrals from -1 to each node, coefficients."""
    from numpy.polynomial import chebyshev

    k = np.arange(DEGREE + 1)
    nodes = -np.cos(np.pi * k / DEGREE)
    weights = (-1.0) ** k
    weights[[0, -1]] /= 2.0
    coefficients = np.linalg.inv(chebyshev.chebvander(nodes, DEGREE))
    integrals = np.array([chebyshev.chebint(row, lbnd=-1.0) for row in np.eye(DEGREE + 1)])
    integral = chebyshev.chebvander(nodes, DEGREE + 1) @ integrals.T @ coefficients
    return np.asarray(nodes), np.asarray(weights), np.asarray(integral), np.asarray(coefficients)


# ----------------------------------------------------------------------------------------------------------------------

class Single:
    """One row that strikes alone: the problem of what acts with it, what its impulses move. No speeds are in it."""

    def __init__(self, account: ImpactProgress, row: int) -> None:
        self.some, self._account = select_rows(account.rows, (row,)), account
        self.name, self.row = account.problem.name(row), self.some.rows.index(row)
        parts = self.some.problem.parts
        self._simple = not parts or (len(parts) == 1 and parts[0].normals == (self.row,) and len(parts[0].rows) < 3)

    @property
    def followed(self) -> bool:
        """Whether its impact can be followed: not where several parts rub of which one does in space."""
        return self._simple or all(len(part.rows) == 1 for part in self.some.problem.parts)

    @property
    def part(self) -> FrictionLaw | None:
        """The friction of the contact, if nothing else rubs."""
        return next(iter(self.some.problem.parts), None) if self._simple else None

    @cached_property
    def moved(self) -> ImpulseResponse | None:
        """What impulses at the contact move; None where other parts rub than its own, or several."""
        verify_moves(self.some, self.row, self.name)
        return impulse_response(self.some, [self.row, *self.some.problem.tangents]) if self._simple else None

    @cached_property
    def table(self) -> list[list[float]] | None:
        """How the speeds along the normal and the tangents change with impulses there."""
        return None if self.moved is None else self.moved.K.tolist()

    @cached_property
    def push(self) -> Push | None:
        """What these impulses change in the whole problem; None where rows exert other forces than their own."""
        if self.moved is None or not self._account.pushes_back:
            return None
        return Push.of(self._account.rows, self.some, self.moved)

    @cached_property
    def rows(self) -> list[int]:
        """The rows that its course follows: normal and tangents, or all where other parts rub; of the chosen ones."""
        return list(range(len(self.some.rows))) if self.moved is None else self.moved.own

    @cached_property
    def whole(self) -> Places:
        """These rows among all."""
        return np.array(self.some.rows)[self.rows]

    @cached_property
    def lengths(self) -> list[float]:
        """Their lengths."""
        return [float(x) for x in scaled_rows(self.some.problem.matrix)[0][self.rows]]


def routh(account: ImpactProgress, single: Single) -> None:
    """Strike one row alone, with its friction and that in joints."""
    course = _Course(account, single)
    first = Normal(course.v[course.row])
    course.stop_at_once()
    left = Normal(course.v[course.row])  # what stops along the surface may push along the normal
    if left.v >= 0.0:
        course.end()
        return
    compressed = course.through("compression", COMPRESSED, left)
    e = float(account.restitution[single.some.rows[single.row]])
    if e > 0.0:
        ends = {
            "newton": Goal("v", -e * first.v),
            "poisson": Goal("p", (1.0 + e) * compressed.p),
            "stronge": Goal("W", (1.0 - e * e) * compressed.W),
        }
        course.through("restitution", ends[account.problem.law], compressed)
    course.end()


class _Course:
    """A contact on its way: present speeds v of the rows that its course follows; the account has the impulses.

    `moved` is None where other parts rub than that of the contact, or several; else `part` is the contact's, if any.
    """

    def __init__(self, account: ImpactProgress, single: Single) -> None:
        self.account, self.single, self.some, self.name = account, single, single.some, single.name
        self.moved, self.part = single.moved, single.part
        self.row = single.rows.index(single.row)
        self.slides = [[single.rows.index(k) for k in part.rows] for part in self.some.problem.parts]
        self.v: list[float] = account.v[single.whole].tolist()
        fastest = max(abs(v) / size for v, size in zip(self.v, single.lengths, strict=True))
        self.small = [AT_REST * fastest * size for size in single.lengths]
        self._phases, self._lost = list[PushPhase](), [0.0] * len(self.v)

    def through(self, stage: Stage, goal: Goal, at: Normal) -> Normal:
        """Go through a stage to its end, and return the normal state there."""
        for _ in range(MOST):
            if self._turns():
                at, ended = self._around(stage, goal, at)
            else:
                at, ended = self._straight(stage, goal, at)
            if ended:
                return at
        raise NoSolutionError(
            f"the impact at {self.name} does not end: friction in several places changes on and on",
            number="N108",
        )

    @property
    def _slip(self) -> list[float]:
        """The speeds along the tangents of the contact that rubs alone."""
        return self.v[1:]

    def _slips(self) -> bool:
        return math.hypot(*self._slip) > max(self.small[1:], default=0.0)

    def _turns(self) -> bool:
        if self.part is None or self.moved is None or len(self.v) < 3 or not self._slips():
            return False
        return turns(self.moved.K, self.part.kinetic, np.array(self._slip))

    # --- straight ways ------------------------------------------------------------------------------------------------

    def _pace(self) -> ImpulseRates:
        if self.single.table is None:
            return rates_with_joints(self.account, self.some, self.row, self.v, self.small)
        pace = rates_of_contact(self.single.table, self.part, self.v, max(self.small[1:], default=0.0))
        if pace.slips == (IN_SPACE,) and self._slips():
            e = np.array(self._slip) / math.hypot(*self._slip)
            pace.v[1:] = (e * float(e @ pace.v[1:])).tolist()
        return pace

    def _straight(self, stage: Stage, goal: Goal, at: Normal) -> tuple[Normal, bool]:
        """Go straight on to the end of the stage, or to where slip stops."""
        pace = self._pace()
        rate = pace.v[self.row]
        stop, stopping = self._next_stop(pace)
        end = goal.ahead(at, rate)
        ended = end <= stop
        dp = end if ended else stop
        if not math.isfinite(dp):
            raise NoSolutionError(self._wedged(rate), number="N108")
        at = at.on(dp, rate)
        at = goal.met(at) if ended else at
        if not ended and abs(at.v) <= self.small[self.row]:  # it stops as the slip does
            at = at._replace(v=0.0)
        before = self.v
        self.v = [v + dp * change for v, change in zip(before, pace.v, strict=True)]
        self.v[self.row] = at.v
        if stop <= dp:
            for k in stopping:
                self.v[k] = 0.0
        if dp > 0.0:
            f = [dp * x for x in pace.f]
            lost = [-x * (v + now) / 2.0 for x, v, now in zip(f, before, self.v, strict=True)]
            self._add(stage, pace.slips, f, lost, pace.x if pace.x is None else dp * pace.x)
        return at, ended

    def _wedged(self, rate: float) -> str:
        """Return that no impulse ends the impact: proved where the contact alone rubs, as its course is then unique."""
        does = f"closes it faster by {-rate:.3g} m/s" if rate < 0.0 else "does not move it"
        why = f"an impulse of 1 N s with its friction {does}, however large it grows"
        known = "" if self.moved is not None else "; proved for the way in which other parts slip or stick here only"
        return f"the impact at {self.name} has no end: its friction wedges it ({why}{known})"

    def _next_stop(self, pace: ImpulseRates) -> tuple[float, list[int]]:
        """Return the dp after which the first part stops to slip, and its rows."""
        first, rows = math.inf, list[int]()
        for own in self.slides:
            speed = math.hypot(*(self.v[k] for k in own))
            if speed > max(self.small[k] for k in own):
                slower = -sum(self.v[k] * pace.v[k] for k in own) / speed
                if slower > 0.0 and speed / slower < first:
                    first, rows = speed / slower, own
        return first, rows

    def _add(
        self, stage: Stage, slips: tuple[int, ...], f: list[float], lost: list[float], x: Floats | None = None
    ) -> None:
        """Add impulses f (k) of the rows that are followed, which take so much; x (n) is what joints make of them."""
        account, some = self.account, self.some
        every = some.of_all(slips, account.rows)
        if self.single.push is not None:
            self._phases.append((stage, every, f))
            self._lost = list(map(add, self._lost, lost))
            return
        impulses, taken = np.array(f), None
        z = np.zeros(len(account.z))
        z[some.rows] = impulses if self.moved is None else self.moved.Z @ impulses
        if self.moved is not None:
            x = self.moved.X @ impulses
            taken = np.zeros(len(account.z))
            taken[self.single.whole] = lost
        assert x is not None  # where it is followed with joints
        account.add(stage, [some.rows[self.single.row]], every, (z, x), taken)

    def end(self) -> None:
        """Let the account know what is not there yet."""
        if self._phases and self.single.push is not None:
            self.account.push(self.single.push, self.some.rows[self.single.row], self._phases, self._lost)

    # --- slip that turns, and that stops at once ----------------------------------------------------------------------

    def _around(self, stage: Stage, goal: Goal, at: Normal) -> tuple[Normal, bool]:
        assert self.moved is not None
        assert self.part is not None
        way = follow_turning_slip(self.moved.K, self.part.kinetic, np.array(self._slip), at, goal)
        lost = [at.W - way.at.W, *(way.lost * self._shares(way.impulse)).tolist()]
        self._add(stage, (IN_SPACE,), [way.at.p - at.p, *way.impulse.tolist()], lost)
        self.v = [way.at.v, *way.velocity.tolist()]
        return way.at, way.ended

    def _shares(self, impulse: Floats) -> Floats:
        """Return how the work of friction in space is shared by its two rows: by the squares of their impulses."""
        square = float(impulse @ impulse)
        return impulse * impulse / square if square else np.array([1.0, 0.0])

    def stop_at_once(self) -> None:
        """Stop slip where friction is always enough."""
        if self.part is None or self.moved is None or not self.part.enough or not self._slips():
            return
        K = self.moved.K
        held = least_squares(K[1:, 1:], -np.array(self._slip))
        lost = (-held * (np.array(self._slip) + K[1:, 1:] @ held + self._slip) / 2.0).tolist()
        self._add("compression", (STICKS,), [0.0, *held.tolist()], [0.0, *lost])
        self.v = [self.v[0] + float(K[0, 1:] @ held), *[0.0] * len(held)]
        if abs(self.v[self.row]) <= self.small[self.row]:  # where both move together it stops too
            self.v[self.row] = 0.0


# ----------------------------------------------------------------------------------------------------------------------
# Friction that is given back (a superball): p_t is reversed, up to the cone, and to the work that friction took.
#
# What sticks at the end of an impact has stored the part of p_t that its tangential coefficient says, and gives it
# back along p_t. What slips then has stored nothing. Without the last limit it could make energy where normal impulses
# move the tangents too; for a sphere it is none: v_t+ = -e_t v_t-.


def give_back(account: ImpactProgress, closed: Collection[int], before: ImpactProgress) -> None:
    """Give back the friction of an impact of rows that sticks now; `before` is the account before it."""
    some = select_rows(account.rows, closed)
    z, stored, one_way = account.z - before.z, np.zeros(len(account.z)), set(account.unilateral.tolist())
    v, rest = account.v, np.maximum(account.allowed, account.rounding)
    parts = list[int]()
    for k in range(len(some.parts)):
        own, normals = _rows(some, k)
        sticks = float(np.linalg.norm(v[own])) <= float(rest[own].max())
        if not (sticks and account.problem.given_back(some.parts[k]) > 0.0 and one_way.issuperset(normals)):
            continue
        parts.append(k)
        part, size = some.problem.parts[k], float(np.linalg.norm(z[own]))
        N = pressing(z[normals].tolist(), [1] * len(normals))
        if size > 0.0:
            back = account.problem.given_back(some.parts[k]) * size
            left = math.inf if part.enough else room(part.static, N, [size])
            stored[own] = z[own] * max(min(back, left), 0.0) / size
    if not stored.any():
        return
    own = some.problem.tangents
    moved, f = impulse_response(some, own), stored[some.rows][own]
    taken = sum(float((account.lost - before.lost)[_rows(some, k)[0]].sum()) for k in parts)
    needed = float(f @ moved.K @ f) / 2.0 + float(f @ v[some.rows][own])
    f = f * min(1.0, math.sqrt(max(taken, 0.0) / needed)) if needed > 0.0 else f
    if f.any():
        z = np.zeros(len(account.z))
        z[some.rows] = moved.Z @ f
        account.add("given back", (), some.of_all((STICKS,) * len(some.parts), account.rows), (z, moved.X @ f))


def _rows(some: Chosen, k: int) -> tuple[list[int], list[int]]:
    """Return the rows of a part, and its normals, among those of all."""
    part = some.problem.parts[k]
    return [some.rows[row] for row in part.rows], [some.rows[row] for row in part.normals]
