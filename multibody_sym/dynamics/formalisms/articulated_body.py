"""The sweep along a tree: accelerations and the wrenches of all joints, once inward and once outward.

With U = M* A, V = A^T U and accelerations w counted from those with udot = 0, whose inertia forces are in f:

    inward:   M* = M + sum C Ma C^T,  f* = f + sum C pa,  K = U V^-1,  e = Q + A^T f*,
              Ma = M* - K U^T,  pa = f* - K e
    outward:  a = C^T w_k,  udot = V^-1 e - K^T a,  w = a + A udot,  R = Ma a - pa

V is factorised and Ma formed in one triangle: with an explicit inverse M* loses its symmetry, and the error grows along
a chain. A second part eliminates freedom by freedom (`block_ldl`).

In hybrid dynamics some joints' accelerations are given and their forces sought: such a joint hands M* and f* on
unchanged. With all accelerations given this is inverse dynamics, with none forward dynamics.

Sources: Vereshchagin (1974); Featherstone, Rigid Body Dynamics Algorithms, chapter 7 and section 9.2 (hybrid dynamics).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property
from typing import Final, Protocol

from multibody_sym.dynamics.formalisms.composite_body import needed_wrenches, unbalanced_wrenches
from multibody_sym.dynamics.formalisms.equations import (
    BodyAxes,
    MassFactors,
    TreeDynamics,
    along_body_axes,
    tree_dynamics,
    verify_massive,
)
from multibody_sym.dynamics.formalisms.inertia import Inertia, articulated_inertia, base_inertias, rigid_inertia
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import BodyMotion, Motion, State, from_parent
from multibody_sym.mechanics.points import Wrench, generalized_forces, joint_projection, power, to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import sqrt
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Factors,
    Mat,
    S,
    Vec,
    add,
    combination,
    dot,
    factorize,
    negate,
    scale,
    subtract,
    symmetric,
)

# ----------------------------------------------------------------------------------------------------------------------
# Dynamics of a tree whose factors take wrenches on bodies: one inward pass carries and eliminates them.


class TreeRecursion(MassFactors, Protocol):
    """Factors of a mass matrix along a tree."""

    def accelerations(self, of_speed: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        """Return M^-1 (Q + sum of A^T R) (n) for forces Q on the speeds and wrenches R on the bodies."""


@dataclass(frozen=True)
class RecursiveDynamics(TreeDynamics):
    """The dynamics with f in parts: forces on the speeds, and wrenches on the bodies, applied ones and of inertia."""

    factors: TreeRecursion
    of_speed: list[S]
    of_body: list[Wrench]

    @property
    def bias_acceleration(self) -> list[S]:
        return self.factors.accelerations(self.of_speed, self.of_body)


def recursive_dynamics(motion: Motion, factors: TreeRecursion) -> RecursiveDynamics:
    """Return the dynamics of a mechanism at a state by a recursion."""
    given = applied_forces(motion, weight=False)
    needed = needed_wrenches(motion, [0] * len(motion.state.u), given.of_body)
    left = [(negate(force), negate(moment)) for force, moment in needed]
    forcing = [q + x for q, x in zip(given.of_speed, generalized_forces(motion, left), strict=True)]
    tree = tree_dynamics(motion, factors, forcing, row_motions(motion))
    return RecursiveDynamics(**vars(tree), of_speed=given.of_speed, of_body=left)


# ----------------------------------------------------------------------------------------------------------------------

_TRIANGLE: Final = ((0, 0), (1, 1), (2, 2), (1, 0), (2, 0), (2, 1))
_NOTHING: Final = (ZERO_VECTOR, ZERO_VECTOR)
"""No motion, or no wrench."""


def sweep(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics at a state. Raises NoSolutionError where only rows hold a freedom without mass."""
    verify_massive(mechanism, "sweep")
    motion = economical_motion(mechanism, state)
    return recursive_dynamics(motion, Sweep(motion, swept_joints(motion)))


def hybrid_dynamics(motion: Motion, given: Collection[int], udot: Sequence[S]) -> tuple[list[S], list[S]]:
    """Return all accelerations (nu), and the generalised forces (nu) that hold the given ones.

    The joints of the bodies `given` have the accelerations `udot` (nu; the others' are not read), all others move
    under the loads. The forces come on top of the loads; they are zero where no acceleration is given.
    """
    held = {k for index in given for k in motion.mechanism.bodies[index].u}
    begin = [x if k in held else 0 for k, x in enumerate(udot)]
    forces = applied_forces(motion)
    found, wrenches = Sweep(motion, swept_joints(motion, given)).swept(
        unbalanced_wrenches(motion, begin, forces.of_body), forces.of_speed
    )
    transmitted = joint_projection(motion, wrenches)
    needed = [transmitted[k] - drive if k in held else 0 for k, drive in enumerate(forces.of_speed)]
    return [a + b for a, b in zip(begin, found, strict=True)], needed


@dataclass(frozen=True)
class SweptJoint:
    """A joint swept over: its free `speeds` with A, the factors of V, the gains K by columns, and Ma."""

    speeds: tuple[int, ...]
    linear: tuple[Vec, ...]
    angular: tuple[Vec, ...]
    pivot: Factors
    gains: tuple[Wrench, ...]
    handed_on: Inertia


def swept_joints(motion: Motion, given: Collection[int] = ()) -> tuple[SweptJoint, ...]:
    """Return all joints swept over from the leaves to the root; bodies in `given` have given accelerations."""
    inertias = [rigid_inertia(mass) for mass in motion.masses]
    found: list[SweptJoint] = []
    for index in range(len(inertias) - 1, -1, -1):
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        freedoms = (body.u, moved.linear, moved.angular) if index not in given else ((), (), ())
        joint = _sweep_over(*freedoms, inertias[index])
        found.append(joint)
        if body.parent >= 0:
            handed = joint.handed_on.moved(moved.R_PB, moved.p_PB)
            inertias[body.parent] = inertias[body.parent].plus(handed)
    return tuple(reversed(found))


def _sweep_over(
    speeds: tuple[int, ...], linear: tuple[Vec, ...], angular: tuple[Vec, ...], inertia: Inertia
) -> SweptJoint:
    """Return a joint with K = U V^-1 and Ma = M* - U K^T, of which one triangle is formed."""
    columns = [inertia.wrench(v, w) for v, w in zip(linear, angular, strict=True)]
    pivot = factorize([[power(v, w, column) for column in columns] for v, w in zip(linear, angular, strict=True)])
    rows = [pivot.solve([part[i] for part in parts]) for parts in zip(*columns, strict=True) for i in range(3)]
    gains: list[Wrench] = [((x, y, z), (mx, my, mz)) for x, y, z, mx, my, mz in zip(*rows, strict=True)]

    def left(m: Mat, part: int, i: int, other: int, j: int) -> S:
        return m[i][j] - sum((u[part][i] * k[other][j] for u, k in zip(columns, gains, strict=True)), 0)

    of_forces = symmetric([left(inertia.linear, 0, i, 0, j) for i, j in _TRIANGLE])
    of_moments = symmetric([left(inertia.angular, 1, i, 1, j) for i, j in _TRIANGLE])
    x, y, z = ([left(inertia.coupling, 0, i, 1, j) for j in range(3)] for i in range(3))
    coupling = (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
    return SweptJoint(speeds, linear, angular, pivot, tuple(gains), Inertia(of_forces, coupling, of_moments))


@dataclass(frozen=True)
class Sweep:
    """A mass matrix factorised by sweeping: the joints of all bodies, in tree order."""

    motion: Motion
    joints: tuple[SweptJoint, ...]

    def solve(self, right: Sequence[S]) -> list[S]:
        return self.accelerations(right, [_NOTHING] * len(self.joints))

    def accelerations(self, of_speed: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        return self.swept(of_body, of_speed)[0]

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T e (n) with V = L^T D L of every joint."""
        e, _ = self._inward([_NOTHING] * len(self.joints), right)
        return [x for joint, part in zip(self.joints, e, strict=True) for x in joint.pivot.weighted(part)]

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return the accelerations of which `weighted` are x (n)."""
        return self._outward([joint.pivot.unweighted([x[k] for k in joint.speeds]) for joint in self.joints], len(x))[0]

    def swept(self, forces: Sequence[Wrench], drives: Sequence[S]) -> tuple[list[S], list[Wrench]]:
        """Return udot (n) and the joints' wrenches on their children (about the origin, in the body's axes).

        `forces` f act on the bodies, `drives` Q (n) on the speeds; udot of given joints is zero: an acceleration
        counted from the given one.
        """
        e, handed_on = self._inward(forces, drives)
        free = [joint.pivot.solve(part) for joint, part in zip(self.joints, e, strict=True)]
        udot, carried = self._outward(free, len(drives))
        wrenches = []
        for joint, (a, alpha), (force, moment) in zip(self.joints, carried, handed_on, strict=True):
            needed = joint.handed_on.wrench(a, alpha)
            wrenches.append((subtract(needed[0], force), subtract(needed[1], moment)))
        return udot, wrenches

    def _inward(self, forces: Sequence[Wrench], drives: Sequence[S]) -> tuple[list[list[S]], list[Wrench]]:
        """Return e of every joint, and pa."""
        total = list(forces)
        remaining: list[list[S]] = [[] for _ in total]
        for index in range(len(total) - 1, -1, -1):
            joint, (force, moment) = self.joints[index], total[index]
            for k, linear, angular in zip(joint.speeds, joint.linear, joint.angular, strict=True):
                remaining[index].append(drives[k] + power(linear, angular, (force, moment)))
            force = subtract(force, combination([gain[0] for gain in joint.gains], remaining[index]))
            moment = subtract(moment, combination([gain[1] for gain in joint.gains], remaining[index]))
            total[index] = force, moment
            parent = self.motion.mechanism.bodies[index].parent
            if parent >= 0:
                handed, known = to_parent(self.motion.bodies[index], total[index]), total[parent]
                total[parent] = add(known[0], handed[0]), add(known[1], handed[1])
        return remaining, total

    def _outward(self, free: Sequence[Sequence[S]], count: int) -> tuple[list[S], list[tuple[Vec, Vec]]]:
        """Return udot and a = C^T w_k of every body from V^-1 e."""
        udot: list[S] = [0] * count
        reached: list[tuple[Vec, Vec]] = []
        carried: list[tuple[Vec, Vec]] = []
        for index, (body, joint) in enumerate(zip(self.motion.mechanism.bodies, self.joints, strict=True)):
            a = from_parent(self.motion.bodies[index], reached[body.parent]) if body.parent >= 0 else _NOTHING
            rates = [x - power(*a, gain) for x, gain in zip(free[index], joint.gains, strict=True)]
            for k, rate in zip(joint.speeds, rates, strict=True):
                udot[k] = rate
            reached.append((add(a[0], combination(joint.linear, rates)), add(a[1], combination(joint.angular, rates))))
            carried.append(a)
        return udot, carried


# ----------------------------------------------------------------------------------------------------------------------
# Block L^T D L along the tree: M^-1 applied in time linear in the number of bodies, M never formed.
#
# The mass matrix of a tree factorises along it; its pivots are those of each joint's V = A^T M* A, where M* is the
# articulated inertia of everything the joint carries. V is never inverted: the freedoms of a joint are eliminated one
# by one, which is V's own L D L^T, and each takes its symmetric share U U^T / d from M* (21 elements).
#
# Sources: Vereshchagin (1974); Shimanovskii (2017); Featherstone, Rigid Body Dynamics Algorithms, chapter 7.


def block_ldl(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics at a state. Raises NoSolutionError where only rows hold a freedom without mass."""
    verify_massive(mechanism, "block_ldl")
    motion = economical_motion(mechanism, state)
    return recursive_dynamics(motion, tree_factors(motion))


@dataclass(frozen=True)
class EliminatedFreedom:
    """One eliminated freedom of a body: its speed, partial velocity A, pivot d and gain K = U / d."""

    speed: int
    linear: Vec
    angular: Vec
    pivot: S
    gain: Wrench


@dataclass(frozen=True)
class TreeFactors:
    """The factorised mass matrix of a tree: the freedoms of each body in tree order, free bodies `along` their axes."""

    motion: Motion
    freedoms: tuple[tuple[EliminatedFreedom, ...], ...]
    along: tuple[BodyAxes, ...]

    def solve(self, right: Sequence[S]) -> list[S]:
        return self.accelerations(right, [_NOTHING] * len(self.freedoms))

    def accelerations(self, of_speed: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        remaining = self._inward(of_speed, of_body)
        return self._outward([e / d for e, d in zip(remaining, self._pivots(), strict=True)])

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T right (n)."""
        remaining = self._inward(right, [_NOTHING] * len(self.freedoms))
        return [e if e is ZERO else e * root for e, root in zip(remaining, self._roots, strict=True)]

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 D^-1/2 x (n)."""
        return self._outward([value * root for value, root in zip(x, self._roots, strict=True)])

    @cached_property
    def _roots(self) -> list[S]:
        return [1 / sqrt(d) for d in self._pivots()]

    def _pivots(self) -> list[S]:
        return [freedom.pivot for of_body in self.freedoms for freedom in of_body]

    def _inward(self, right: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        """Return e = Q + A^T p of every freedom, from the leaves to the root; p -= K e."""
        for axes in self.along:
            right = axes.forces(right)
        carried, remaining = list(of_body), list(right)
        for index in range(len(carried) - 1, -1, -1):
            if carried[index] is _NOTHING and all(right[freedom.speed] is ZERO for freedom in self.freedoms[index]):
                continue
            left, wrench = inward(self.freedoms[index], right, carried[index])
            for freedom, e in zip(self.freedoms[index], left, strict=True):
                remaining[freedom.speed] = e
            parent = self.motion.mechanism.bodies[index].parent
            if parent >= 0:
                handed, known = to_parent(self.motion.bodies[index], wrench), carried[parent]
                carried[parent] = add(known[0], handed[0]), add(known[1], handed[1])
        return remaining

    def _outward(self, x: Sequence[S]) -> list[S]:
        """Return udot from x = e / d, from the root to the leaves: udot = x - K . a, a += A udot."""
        udot = list(x)
        reached: list[tuple[Vec, Vec]] = []
        for index, body in enumerate(self.motion.mechanism.bodies):
            above = reached[body.parent] if body.parent >= 0 else _NOTHING
            if above is _NOTHING and all(x[freedom.speed] is ZERO for freedom in self.freedoms[index]):
                reached.append(_NOTHING)
                continue
            above = above if above is _NOTHING else from_parent(self.motion.bodies[index], above)
            rates, here = outward(self.freedoms[index], x, above)
            for freedom, rate in zip(self.freedoms[index], rates, strict=True):
                udot[freedom.speed] = rate
            reached.append(here)
        for axes in self.along:
            udot = axes.rates(udot)
        return udot


def inward(freedoms: Sequence[EliminatedFreedom], right: Sequence[S], wrench: Wrench) -> tuple[list[S], Wrench]:
    """Return e = Q + A^T p of each freedom of a body, eliminated from the last on, and the rest of its wrench p."""
    force, moment = wrench
    remaining = []
    for freedom in reversed(freedoms):
        e = right[freedom.speed] + (dot(freedom.linear, force) + dot(freedom.angular, moment))
        remaining.append(e)
        k_force, k_moment = freedom.gain
        force, moment = subtract(force, scale(e, k_force)), subtract(moment, scale(e, k_moment))
    return remaining[::-1], (force, moment)


def outward(
    freedoms: Sequence[EliminatedFreedom], x: Sequence[S], above: tuple[Vec, Vec]
) -> tuple[list[S], tuple[Vec, Vec]]:
    """Return udot of each freedom of a body and the accelerations it reaches, from those without them."""
    a, alpha = above
    rates = []
    for freedom in freedoms:
        rate = x[freedom.speed] - (dot(freedom.gain[0], a) + dot(freedom.gain[1], alpha))
        a, alpha = add(a, scale(rate, freedom.linear)), add(alpha, scale(rate, freedom.angular))
        rates.append(rate)
    return rates, (a, alpha)


def tree_factors(motion: Motion) -> TreeFactors:
    """Return the factors of a tree's mass matrix, from the leaves to the root."""
    motion, along = along_body_axes(motion)
    inertias = [articulated_inertia(rigid) for rigid in base_inertias(motion)]
    freedoms: list[tuple[EliminatedFreedom, ...]] = [()] * len(inertias)
    for index in range(len(inertias) - 1, -1, -1):
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        freedoms[index], left = eliminate_joint(body.u, moved, inertias[index])
        if body.parent >= 0:
            inertias[body.parent] = inertias[body.parent].plus(left.moved(moved.R_PB, moved.p_PB))
    return TreeFactors(motion, tuple(freedoms), along)


def eliminate_joint(
    speeds: Sequence[int], moved: BodyMotion, inertia: Inertia
) -> tuple[tuple[EliminatedFreedom, ...], Inertia]:
    """Return a joint's freedoms, eliminated from the last on, and the inertia that the parent feels through it."""
    freedoms = []
    for speed, linear, angular in reversed(list(zip(speeds, moved.linear, moved.angular, strict=True))):
        force, moment = inertia.wrench(linear, angular)
        pivot = dot(linear, force) + dot(angular, moment)
        gain = _over(force, pivot), _over(moment, pivot)
        freedoms.append(EliminatedFreedom(speed, linear, angular, pivot, gain))
        inertia = inertia.without((force, moment), gain)
    return tuple(reversed(freedoms)), inertia


def _over(u: Vec, pivot: S) -> Vec:
    """Return U / d; the component that is the pivot itself becomes an exact 1."""
    inverse = 1 / pivot
    x, y, z = (1 if component is pivot else component * inverse for component in u)
    return x, y, z
