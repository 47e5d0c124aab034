"""One contact in the plane through its impact, over any scalar: Routh's course written out.

While it slips v_n and v_t change in proportion to p_n: v' = (K_nn - mu s K_nt, K_nt - mu s K_tt), s being the sign of
v_t. Slip stops after p_1 = |v_t|/(-s v_t'), if it ever does, and then sticks (v_t' = 0), or goes on the other way. So
an impact has two straight stretches at most, and ends on one of them, by each law of restitution. Which it is, is left
to `Choose`: floats take one way, Programs both, closed forms the one that numbers have taken before.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Protocol

from multibody_sym.dynamics.impacts.impulsive import Blow, rubbing
from multibody_sym.dynamics.impacts.pace import AT_REST
from multibody_sym.dynamics.impacts.problem import ImpactLaw
from multibody_sym.kinematics.impacts import at_rest, resting
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import coefficients, row_motions
from multibody_sym.kinematics.state import State
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.one_way import OneWay
from multibody_sym.numerics.rank import ROUNDING
from multibody_sym.records import dataclass
from multibody_sym.scalars import limits
from multibody_sym.scalars.elementary import where
from multibody_sym.scalars.functions import absolute, minimum, sign, sqrt
from multibody_sym.scalars.node import ZERO, as_node, less
from multibody_sym.scalars.vectors import S

Pair = tuple[S, S]
Way = Callable[[], Pair]


class Choose(Protocol):
    """Which of two ways is gone: the first where a condition is positive; `broken` says what happens where it fails.

    Beside what it is `near` to it counts as positive where it is rounding.
    """

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair: ...


@dataclass
class Deciding:
    """The way that numbers go, and which it was."""

    taken: list[bool] = field(default_factory=list)

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
        self.taken.append(bool(condition > -ROUNDING * near))
        return first() if self.taken[-1] else second()


@dataclass
class Following:
    """The way that numbers have gone before, and the conditions for it: (expression > 0, what happens else)."""

    taken: list[bool]
    conditions: list[tuple[S, str]] = field(default_factory=list)

    def __call__(self, condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
        is_first = self.taken[len(self.conditions)]
        self.conditions.append((condition if is_first else -condition, broken[0 if is_first else 1]))
        return first() if is_first else second()


def both_ways(condition: S, first: Way, second: Way, /, broken: tuple[str, str], near: S = 0) -> Pair:
    """Return both ways as one expression over Nodes."""
    holds, a, b = less(ZERO, as_node(condition + ROUNDING * near)), first(), second()
    return where(holds, as_node(a[0]), as_node(b[0])), where(holds, as_node(a[1]), as_node(b[1]))


@dataclass(frozen=True)
class PlaneContact:
    """A contact: how impulses move it, (K_nn, K_nt, K_tt), its speeds (v_n, v_t) before, v_n < 0, and its laws.

    With `enough` friction it never slips. `e` is restitution by `law`, `returned` the part of the tangential one. In
    numbers slip that is `slow` beside the normal speed is none, and what no impulse moves (`stiff` beside K_nn) sticks.
    """

    K: tuple[S, S, S]
    v: Pair
    static: S
    kinetic: S
    e: S
    returned: S | None = None
    enough: bool = False
    law: ImpactLaw = "newton"
    slow: float = 0
    stiff: float = 0

    @property
    def held(self) -> S:
        """The change of p_t with p_n that keeps v_t."""
        knn, knt, ktt = self.K
        return -knt * ktt / (ktt * ktt + self.stiff**2 * knn * knn) if self.stiff else -knt / ktt

    def slipping(self, s: int) -> S:
        """Return the change of p_t with p_n while it slips with sign s."""
        return limits.sliding(self.kinetic, [s])[0]

    def rate(self, along: S) -> S:
        """Return the change of v_n with p_n while p_t changes by `along` with it."""
        return self.K[0] + along * self.K[1]


def plane_contact(
    blow: Blow,
    element: OneWay,
    law: ImpactLaw,
    motions: tuple[Motion, Motion],
    solve: Callable[[Mechanism, State], Sequence[S]],
    *,
    in_numbers: bool = True,
) -> PlaneContact:
    """Return the contact for motions (before, and just before it strikes); `solve` finds the jumps of a mechanism."""
    before, pushed = motions
    (part,) = rubbing(element)
    rows, own = (element.normals[0], part.rows[0]), len(blow.mechanism.rows)
    names = [row.name for row in rows]
    resting_ = at_rest(blow.mechanism, rows, elements=blow.impact.meetings, given=names)
    found = {row.name: moved for row, moved in zip(pushed.mechanism.rows, row_motions(pushed), strict=True)}
    columns = []
    for unit in ((1, 0), (0, 1)):
        jumps: dict[int, S] = dict.fromkeys(range(own), 0) | dict(enumerate(unit, own))
        du = solve(resting_, resting(before.state, jumps))
        columns.append([sum((h * x for h, x in zip(found[name].jacobian, du, strict=True)), 0) for name in names])
    state = before.state
    static, kinetic = coefficients(before, part.rows, [part.static, part.kinetic])
    e, returned = state.values([element.restitution, element.tangential_restitution])
    v = found[names[0]].phidot, found[names[1]].phidot
    K = columns[0][0], columns[1][0], columns[1][1]
    given_back = None if element.tangential_restitution is ZERO else returned
    rounding = (AT_REST, ROUNDING) if in_numbers else (0.0, 0.0)
    return PlaneContact(K, v, static, kinetic, e, given_back, part.enough, law, *rounding)


def plane_course(contact: PlaneContact, choose: Choose) -> Pair:
    """Return the normal impulse and the one along the tangent."""
    if contact.enough:
        return _never_slipping(contact, choose)
    (vn, vt), (_, knt, ktt) = contact.v, contact.K

    def slipping(s: int) -> Pair:
        slows = -s * (contact.slipping(s) * ktt + knt)
        return choose(
            slows,
            lambda: _Stopping(contact, s, slows, choose).impulses(),
            lambda: _straight(contact, s),
            broken=("slip grows on the way", "slip becomes slower on the way"),
        )

    def back() -> Pair:
        return choose(contact.slow * vn - vt, lambda: slipping(-1), at_rest_, broken=("it slips the other way", ""))

    def at_rest_() -> Pair:
        return _Stopping(contact, 1, 1, choose).beyond(contact.K[0], 0)

    return choose(vt + contact.slow * vn, lambda: slipping(1), back, broken=("it slips the other way", ""))


def _straight(contact: PlaneContact, s: int) -> Pair:
    """Return the impulses of slip that never stops; all laws are one there."""
    along = contact.slipping(s)
    p = -(1 + contact.e) * contact.v[0] / contact.rate(along)
    return p, along * p


def _never_slipping(contact: PlaneContact, choose: Choose) -> Pair:
    """Return the impulses where slip stops at once, which may push along the normal, too."""
    (vn, vt), (_, knt, ktt) = contact.v, contact.K
    stop = -vt / ktt
    left, rate = vn + knt * stop, contact.rate(contact.held)
    p = (-contact.e * vn - left) / rate if contact.law == "newton" else -(1 + contact.e) * left / rate
    none: S = 0
    return choose(
        -left, lambda: (p, stop + contact.held * p), lambda: (none, stop), broken=("it parts at once", "it is pressed")
    )


@dataclass(frozen=True)
class _Stopping:
    """Slip of sign s that becomes slower, v_t' = -s slows."""

    contact: PlaneContact
    s: int
    slows: S
    choose: Choose

    def impulses(self) -> Pair:
        contact = self.contact
        rate = contact.rate(contact.slipping(self.s))
        stop = self.s * contact.v[1] / self.slows
        return self.choose(
            self._lasts(rate, stop),
            lambda: _straight(contact, self.s),
            lambda: self.beyond(rate, stop),
            broken=("slip stops on the way", "slip lasts all the while"),
        )

    def _lasts(self, rate: S, stop: S) -> S:
        """Return what is positive where the impact ends before slip stops."""
        contact, vn = self.contact, self.contact.v[0]
        if contact.law == "poisson":
            return stop * rate + (1 + contact.e) * vn
        return vn + rate * stop + contact.e * vn  # by the speed, or the square root of the work: they are one here

    def beyond(self, rate: S, stop: S) -> Pair:
        """Return the impulses where slip has stopped at p_n = stop: it sticks then, or slips back."""
        contact, (knn, knt, ktt) = self.contact, self.contact.K

        def ended(along: S) -> Pair:
            return self._ended(rate, stop, contact.rate(along), along)

        def back(s: int) -> Pair:
            return ended(contact.slipping(s))

        return self.choose(
            limits.room(contact.static, ktt, [knt]),
            lambda: self._stuck(*ended(contact.held), stop),
            lambda: self.choose(
                knt, lambda: back(1), lambda: back(-1), broken=("it slips back the other way",) * 2
            ),
            broken=("it slips back", "it sticks"),
            near=knn,
        )

    def _ended(self, rate: S, stop: S, then: S, along: S) -> Pair:
        """Return the impulses at the end, when v_n changes with `then` and p_t with `along` once slip has stopped."""
        contact, (vn, _) = self.contact, self.contact.v
        e, reached = contact.e, vn + rate * stop
        friction = contact.slipping(self.s) * stop
        if contact.law == "newton":
            more = (-e * vn - reached) / then
            return stop + more, friction + along * more

        def early() -> Pair:
            """Slip stops while things part again."""
            if contact.law == "poisson":
                more = -(1 + e) * vn / rate - stop
            else:
                more = (sqrt(reached * reached + then * (e * e * vn * vn - reached * reached) / rate) - reached) / then
            return stop + more, friction + along * more

        def late() -> Pair:
            """Slip stops while they still press each other."""
            pressed = -reached / then
            if contact.law == "poisson":
                more = (1 + e) * (stop + pressed) - stop
            else:
                work = -vn * stop - rate * stop * stop / 2 + reached * reached / (2 * then)
                more = pressed + e * sqrt(2 * work / then)
            return stop + more, friction + along * more

        return self.choose(
            reached, early, late, broken=("slip stops before things part", "slip stops when things part again")
        )

    def _stuck(self, p: S, along: S, stop: S) -> Pair:
        """Return the impulses with what friction gives back: of its own, up to the cone and to what it took."""
        contact = self.contact
        if contact.returned is None:
            return p, along
        returned: S = contact.returned
        size = absolute(along)
        room = limits.room(contact.static, p, [along])
        most = sqrt(limits.most(contact.kinetic, stop) * absolute(contact.v[1]) / contact.K[2])

        def limited(back: S) -> Pair:
            return p, along + sign(along) * back

        def in_the_cone() -> Pair:
            return self.choose(
                most - wanted,
                lambda: (p, along + returned * along),
                lambda: limited(most),
                broken=("friction has taken less than it is to give back", "friction has taken more"),
                near=size,
            )

        wanted = returned * size
        return self.choose(
            room - wanted,
            in_the_cone,
            lambda: limited(minimum(room, most)),
            broken=("the cone lets less be given back", "the cone lets all be given back"),
            near=size,
        )
