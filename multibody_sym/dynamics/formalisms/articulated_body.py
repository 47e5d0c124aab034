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

from multibody_sym.dynamics.formalisms.composite_body import (
    composite_body,
    needed_wrenches,
    summed_inward,
    unbalanced_wrenches,
    wrench_difference,
    wrench_sum,
)
from multibody_sym.dynamics.formalisms.equations import (
    BodyAxes,
    TreeDynamics,
    along_body_axes,
    massless_speeds,
    tree_dynamics,
    verify_massive,
)
from multibody_sym.dynamics.formalisms.inertia import (
    TRIANGLE,
    Inertia,
    articulated_inertia,
    base_inertias,
    rigid_inertia,
)
from multibody_sym.mechanics.alignment import economical_motion
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import BodyMotion, Motion, State, from_parent
from multibody_sym.mechanics.points import Wrench, generalized_forces, joint_projection, power, to_parent
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.records import dataclass
from multibody_sym.scalars.node import ZERO
from multibody_sym.scalars.vectors import (
    ZERO_VECTOR,
    Factors,
    Mat,
    S,
    Vec,
    add,
    combination,
    factorize,
    negate,
    scale,
    subtract,
    symmetric,
)

# ----------------------------------------------------------------------------------------------------------------------
# The mass matrix factorised along the tree, whatever eliminates the freedoms of each joint.

_NOTHING: Final = (ZERO_VECTOR, ZERO_VECTOR)
"""No motion, or no wrench."""


class JointFactors(Protocol):
    """The freedoms of a body's joint, eliminated; `pivot` are the factors of their V = A^T M* A."""

    @property
    def speeds(self) -> tuple[int, ...]: ...

    @property
    def pivot(self) -> Factors: ...

    def inward(self, right: Sequence[S], wrench: Wrench) -> tuple[list[S], Wrench]:
        """Return e = Q + A^T p of each freedom, from the forces `right` on all speeds, and what is left of p."""

    def outward(self, x: Sequence[S], above: tuple[Vec, Vec]) -> tuple[list[S], tuple[Vec, Vec]]:
        """Return udot of each freedom from V^-1 e of all speeds, and the accelerations reached from those without."""


@dataclass(frozen=True)
class TreeFactors:
    """The factorised mass matrix of a tree: all joints in tree order; free bodies `along` their axes."""

    motion: Motion
    joints: tuple[JointFactors, ...]
    along: tuple[BodyAxes, ...] = ()

    @cached_property
    def pivot(self) -> Factors:
        """The factors of V of all joints together, with a 1 for each speed (n) that none of them frees."""
        count = len(self.motion.state.u)
        below: list[tuple[tuple[int, S], ...]] = [()] * count
        pivots: list[S] = [1] * count
        for joint in self.joints:
            for k, own, pivot in zip(joint.speeds, joint.pivot.below, joint.pivot.pivots, strict=True):
                below[k], pivots[k] = tuple((joint.speeds[i], x) for i, x in own), pivot
        return Factors(tuple(below), tuple(pivots))

    @property
    def pivots(self) -> Sequence[S]:
        return self.pivot.pivots

    def solve(self, right: Sequence[S]) -> list[S]:
        return self.accelerations(right, [_NOTHING] * len(self.joints))

    def accelerations(self, of_speed: Sequence[S], of_body: Sequence[Wrench]) -> list[S]:
        """Return M^-1 (Q + sum of A^T R) (n) for forces Q on the speeds and wrenches R on the bodies."""
        return self.outward(self.inward(of_speed, of_body)[0])[0]

    def weighted(self, right: Sequence[S]) -> list[S]:
        """Return D^-1/2 L^-T right (n)."""
        return self.pivot.weighted(self.inward(right, [_NOTHING] * len(self.joints))[0])

    def unweighted(self, x: Sequence[S]) -> list[S]:
        """Return L^-1 D^-1/2 x (n)."""
        return self._reached(self.pivot.unweighted(x))[0]

    def inward(self, right: Sequence[S], of_body: Sequence[Wrench]) -> tuple[list[S], list[Wrench]]:
        """Return e of every freedom (n), from the leaves to the root, and what is left of the wrench on each body."""
        for axes in self.along:
            right = axes.forces(right)
        carried, remaining = list(of_body), list(right)
        for index in range(len(carried) - 1, -1, -1):
            joint = self.joints[index]
            if carried[index] is _NOTHING and all(right[k] is ZERO for k in joint.speeds):
                continue
            e, carried[index] = joint.inward(right, carried[index])
            for k, x in zip(joint.speeds, e, strict=True):
                remaining[k] = x
            parent = self.motion.mechanism.bodies[index].parent
            if parent >= 0:
                carried[parent] = wrench_sum(carried[parent], to_parent(self.motion.bodies[index], carried[index]))
        return remaining, carried

    def outward(self, e: Sequence[S]) -> tuple[list[S], list[tuple[Vec, Vec]]]:
        """Return udot (n), from the root to the leaves, and each body's accelerations without its own udot."""
        return self._reached(self.pivot.solve(e))

    def _reached(self, x: Sequence[S]) -> tuple[list[S], list[tuple[Vec, Vec]]]:
        udot = list(x)
        reached: list[tuple[Vec, Vec]] = []
        carried: list[tuple[Vec, Vec]] = []
        for index, (body, joint) in enumerate(zip(self.motion.mechanism.bodies, self.joints, strict=True)):
            above = reached[body.parent] if body.parent >= 0 else _NOTHING
            if above is not _NOTHING:
                above = from_parent(self.motion.bodies[index], above)
            carried.append(above)
            if above is _NOTHING and all(x[k] is ZERO for k in joint.speeds):
                reached.append(_NOTHING)
                continue
            rates, here = joint.outward(x, above)
            for k, rate in zip(joint.speeds, rates, strict=True):
                udot[k] = rate
            reached.append(here)
        for axes in self.along:
            udot = axes.rates(udot)
        return udot, carried


@dataclass(frozen=True)
class RecursiveDynamics(TreeDynamics):
    """The dynamics with f in parts: forces on the speeds, and wrenches on the bodies, applied ones and of inertia."""

    factors: TreeFactors
    of_speed: list[S]
    of_body: list[Wrench]

    @property
    def bias_acceleration(self) -> list[S]:
        return self.factors.accelerations(self.of_speed, self.of_body)


def recursive_dynamics(motion: Motion, factors: TreeFactors) -> RecursiveDynamics:
    """Return the dynamics of a mechanism at a state by a recursion."""
    given = applied_forces(motion, weight=False)
    needed = needed_wrenches(motion, [0] * len(motion.state.u), given.of_body)
    left = [(negate(force), negate(moment)) for force, moment in needed]
    forcing = [q + x for q, x in zip(given.of_speed, generalized_forces(motion, left), strict=True)]
    tree = tree_dynamics(motion, factors, forcing, row_motions(motion))
    return RecursiveDynamics(**vars(tree), of_speed=given.of_speed, of_body=left)


# ----------------------------------------------------------------------------------------------------------------------
# The sweep: all freedoms of a joint at once.


def sweep(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics at a state. Raises NoSolutionError where only rows hold a freedom without mass."""
    verify_massive(mechanism, "sweep")
    motion = economical_motion(mechanism, state)
    return recursive_dynamics(motion, TreeFactors(motion, swept_joints(motion)))


def hybrid_dynamics(motion: Motion, given: Collection[int], udot: Sequence[S]) -> tuple[list[S], list[S]]:
    """Return all accelerations (nu), and the generalised forces (nu) that hold the given ones.

    The joints of the bodies `given` have the accelerations `udot` (nu; the others' are not read), all others move
    under the loads. The forces come on top of the loads; they are zero where no acceleration is given.
    """
    held = {k for index in given for k in motion.mechanism.bodies[index].u}
    begin = [x if k in held else 0 for k, x in enumerate(udot)]
    forces = applied_forces(motion)
    missing = unbalanced_wrenches(motion, begin, forces.of_body)
    found, wrenches = swept(motion, swept_joints(motion, given), missing, forces.of_speed)
    transmitted = joint_projection(motion, wrenches)
    needed = [transmitted[k] - drive if k in held else 0 for k, drive in enumerate(forces.of_speed)]
    return [a + b for a, b in zip(begin, found, strict=True)], needed


def swept(
    motion: Motion, joints: tuple[SweptJoint, ...], forces: Sequence[Wrench], drives: Sequence[S]
) -> tuple[list[S], list[Wrench]]:
    """Return udot (n) and the joints' wrenches on their children (about the origin, in the body's axes).

    `forces` f act on the bodies, `drives` Q (n) on the speeds; udot of given joints is zero: an acceleration counted
    from the given one.
    """
    factors = TreeFactors(motion, joints)
    e, left = factors.inward(drives, forces)
    freed = {k for joint in joints for k in joint.speeds}
    udot, before = factors.outward([x if k in freed else 0 for k, x in enumerate(e)])
    every = zip(joints, before, left, strict=True)
    return udot, [wrench_difference(joint.handed_on.wrench(*reached), known) for joint, reached, known in every]


@dataclass(frozen=True)
class SweptJoint:
    """A joint swept over: its free `speeds` with A, the factors of V, the gains K by columns, and Ma."""

    speeds: tuple[int, ...]
    linear: tuple[Vec, ...]
    angular: tuple[Vec, ...]
    pivot: Factors
    gains: tuple[Wrench, ...]
    handed_on: Inertia

    @staticmethod
    def over(
        speeds: tuple[int, ...], linear: tuple[Vec, ...], angular: tuple[Vec, ...], inertia: Inertia
    ) -> SweptJoint:
        """Return a joint with K = U V^-1 and Ma = M* - U K^T, of which one triangle is formed."""
        columns = [inertia.wrench(v, w) for v, w in zip(linear, angular, strict=True)]
        pivot = factorize([[power(v, w, column) for column in columns] for v, w in zip(linear, angular, strict=True)])
        rows = [pivot.solve([part[i] for part in parts]) for parts in zip(*columns, strict=True) for i in range(3)]
        gains: list[Wrench] = [((x, y, z), (mx, my, mz)) for x, y, z, mx, my, mz in zip(*rows, strict=True)]

        def left(m: Mat, part: int, i: int, other: int, j: int) -> S:
            return m[i][j] - sum((u[part][i] * k[other][j] for u, k in zip(columns, gains, strict=True)), 0)

        of_forces = symmetric([left(inertia.linear, 0, i, 0, j) for i, j in TRIANGLE])
        of_moments = symmetric([left(inertia.angular, 1, i, 1, j) for i, j in TRIANGLE])
        x, y, z = ([left(inertia.coupling, 0, i, 1, j) for j in range(3)] for i in range(3))
        coupling = (x[0], x[1], x[2]), (y[0], y[1], y[2]), (z[0], z[1], z[2])
        return SweptJoint(speeds, linear, angular, pivot, tuple(gains), Inertia(of_forces, coupling, of_moments))

    def inward(self, right: Sequence[S], wrench: Wrench) -> tuple[list[S], Wrench]:
        partials = zip(self.speeds, self.linear, self.angular, strict=True)
        e = [right[k] + power(linear, angular, wrench) for k, linear, angular in partials]
        taken = combination([force for force, _ in self.gains], e), combination([moment for _, moment in self.gains], e)
        return e, wrench_difference(wrench, taken)

    def outward(self, x: Sequence[S], above: tuple[Vec, Vec]) -> tuple[list[S], tuple[Vec, Vec]]:
        rates = [x[k] - power(*above, gain) for k, gain in zip(self.speeds, self.gains, strict=True)]
        return rates, wrench_sum(above, (combination(self.linear, rates), combination(self.angular, rates)))


def swept_joints(motion: Motion, given: Collection[int] = ()) -> tuple[SweptJoint, ...]:
    """Return all joints swept over from the leaves to the root; bodies in `given` have given accelerations."""
    found: list[SweptJoint] = []

    def hand_on(index: int, inertia: Inertia) -> Inertia:
        body, moved = motion.mechanism.bodies[index], motion.bodies[index]
        freedoms = (body.u, moved.linear, moved.angular) if index not in given else ((), (), ())
        found.append(SweptJoint.over(*freedoms, inertia))
        return found[-1].handed_on.moved(moved.R_PB, moved.p_PB)

    summed_inward(motion, [rigid_inertia(mass) for mass in motion.masses], hand_on)
    return tuple(reversed(found))


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
    """One eliminated freedom of a body: its speed, partial velocity A and gain K = U / d."""

    speed: int
    linear: Vec
    angular: Vec
    gain: Wrench


@dataclass(frozen=True)
class EliminatedJoint:
    """The freedoms of a body's joint, eliminated from the last on."""

    freedoms: tuple[EliminatedFreedom, ...]
    pivot: Factors

    @cached_property
    def speeds(self) -> tuple[int, ...]:
        return tuple(freedom.speed for freedom in self.freedoms)

    def inward(self, right: Sequence[S], wrench: Wrench) -> tuple[list[S], Wrench]:
        force, moment = wrench
        remaining = []
        for freedom in reversed(self.freedoms):
            e = right[freedom.speed] + power(freedom.linear, freedom.angular, (force, moment))
            remaining.append(e)
            k_force, k_moment = freedom.gain
            force, moment = subtract(force, scale(e, k_force)), subtract(moment, scale(e, k_moment))
        return remaining[::-1], (force, moment)

    def outward(self, x: Sequence[S], above: tuple[Vec, Vec]) -> tuple[list[S], tuple[Vec, Vec]]:
        a, alpha = above
        rates = []
        for freedom in self.freedoms:
            rate = x[freedom.speed] - power(a, alpha, freedom.gain)
            a, alpha = add(a, scale(rate, freedom.linear)), add(alpha, scale(rate, freedom.angular))
            rates.append(rate)
        return rates, (a, alpha)


def tree_factors(motion: Motion) -> TreeFactors:
    """Return the factors of a tree's mass matrix, from the leaves to the root."""
    motion, along = along_body_axes(motion)
    joints: list[EliminatedJoint] = []

    def hand_on(index: int, inertia: Inertia) -> Inertia:
        moved = motion.bodies[index]
        joint, left = eliminate_joint(motion.mechanism.bodies[index].u, moved, inertia)
        joints.append(joint)
        return left.moved(moved.R_PB, moved.p_PB)

    summed_inward(motion, map(articulated_inertia, base_inertias(motion)), hand_on)
    return TreeFactors(motion, tuple(reversed(joints)), along)


def eliminate_joint(speeds: Sequence[int], moved: BodyMotion, inertia: Inertia) -> tuple[EliminatedJoint, Inertia]:
    """Return a joint's freedoms, eliminated from the last on, and the inertia that the parent feels through it."""
    freedoms, pivots = [], list[S]()
    for speed, linear, angular in reversed(list(zip(speeds, moved.linear, moved.angular, strict=True))):
        wrench = inertia.wrench(linear, angular)
        pivots.append(power(linear, angular, wrench))
        gain = _over(wrench[0], pivots[-1]), _over(wrench[1], pivots[-1])
        freedoms.append(EliminatedFreedom(speed, linear, angular, gain))
        inertia = inertia.without(wrench, gain)
    return EliminatedJoint(tuple(reversed(freedoms)), Factors(((),) * len(pivots), tuple(reversed(pivots)))), inertia


def _over(u: Vec, pivot: S) -> Vec:
    """Return U / d; the component that is the pivot itself becomes an exact 1."""
    inverse = 1 / pivot
    x, y, z = (1 if component is pivot else component * inverse for component in u)
    return x, y, z


def tree_dynamics_of(mechanism: Mechanism, state: State) -> TreeDynamics:
    """Return the dynamics by the formalism that is linear in the bodies, where no freedom is massless."""
    return (composite_body if massless_speeds(mechanism) else block_ldl)(mechanism, state)
