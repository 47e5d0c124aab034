"""The sweep as it was first published, for comparison: V inverted by cofactors, all 36 elements of every inertia.

    inward:   M* = M + sum C Ma C^T,  f* = f + sum C pa,  U = M* A,  V = A^T U,  K = U V^-1,
              e = Q + A^T f*,  Ma = M* - K U^T,  pa = f* - K e
    outward:  a = C^T w_k,  udot = V^-1 e - K^T a,  w = a + A udot,  R = Ma a - pa

Accelerations count from those with udot = 0, whose inertia forces are in f. This is no route to trust: the
inverse makes M* unsymmetric, and the error grows along a chain of thin rods. `sweep` is the same with V factorised and
one triangle of Ma.

Source: Vereshchagin (1974).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from multibody_sym.dynamics.formalisms.composite_body import unbalanced_wrenches
from multibody_sym.dynamics.formalisms.inertia import rigid_inertia
from multibody_sym.mechanics.forces import applied_forces
from multibody_sym.mechanics.motion import BodyMass, BodyMotion, Motion
from multibody_sym.mechanics.points import Wrench
from multibody_sym.scalars.vectors import ZERO_VECTOR, Mat, S, cross, transpose

Matrix = list[list[S]]
"""Rows of a matrix; a vector is a matrix of one column."""


@dataclass(frozen=True)
class Link:
    """A body and its joint: predecessor k, inertia M (6 x 6), C (6 x 6) that moves a wrench to k, A (6 x n), f, Q."""

    parent: int
    inertia: Matrix
    carrier: Matrix
    freedoms: Matrix
    force: Matrix
    drives: Matrix


def plain_sweep(motion: Motion) -> tuple[list[S], list[list[S]]]:
    """Return udot (nu) of a tree under its loads, and the wrench R (6) of each joint on its child."""
    udot, wrenches = swept(links(motion))
    return [rate for part in udot for (rate,) in part], [[x for (x,) in wrench] for wrench in wrenches]


def links(motion: Motion) -> list[Link]:
    """Return what is swept over, in tree order."""
    forces = applied_forces(motion)
    left = unbalanced_wrenches(motion, [0] * len(motion.state.u), forces.of_body)
    found = []
    for body, moved, mass, wrench in zip(motion.mechanism.bodies, motion.bodies, motion.masses, left, strict=True):
        drives = [[forces.of_speed[k]] for k in body.u]
        found.append(Link(body.parent, _rigid(mass), _carrier(moved), _freedoms(moved), _column(wrench), drives))
    return found


def swept(tree: Sequence[Link]) -> tuple[list[Matrix], list[Matrix]]:
    """Return udot (n x 1) and R (6 x 1) of every joint."""
    inertias, forces = [link.inertia for link in tree], [link.force for link in tree]
    kept: list[_Swept] = []
    for index in range(len(tree) - 1, -1, -1):
        link = tree[index]
        joint = _Swept.over(link, inertias[index], forces[index])
        kept.insert(0, joint)
        if link.parent >= 0:
            moved = times(times(link.carrier, joint.inertia), turned(link.carrier))
            inertias[link.parent] = plus(inertias[link.parent], moved)
            forces[link.parent] = plus(forces[link.parent], times(link.carrier, joint.force))
    reached: list[Matrix] = []
    found: tuple[list[Matrix], list[Matrix]] = [], []
    for link, joint in zip(tree, kept, strict=True):
        a = times(turned(link.carrier), reached[link.parent]) if link.parent >= 0 else [[0]] * 6
        udot = minus(joint.free, times(turned(joint.gain), a))
        reached.append(plus(a, times(link.freedoms, udot)))
        found[0].append(udot)
        found[1].append(minus(times(joint.inertia, a), joint.force))
    return found


@dataclass(frozen=True)
class _Swept:
    """What the inward pass leaves of a joint: K, V^-1 e, Ma and pa."""

    gain: Matrix
    free: Matrix
    inertia: Matrix
    force: Matrix

    @classmethod
    def over(cls, link: Link, inertia: Matrix, force: Matrix) -> _Swept:
        if not link.drives:  # a rigid joint
            return cls(link.freedoms, [], inertia, force)
        columns, rows = times(inertia, link.freedoms), turned(link.freedoms)
        inverse = inverted(times(rows, columns))
        gain = times(columns, inverse)
        e = plus(link.drives, times(rows, force))
        left = minus(inertia, times(gain, turned(columns)))
        return cls(gain, times(inverse, e), left, minus(force, times(gain, e)))


# --- a link in 6 x 6 -----------------------------------------------------------------------------------------------


def _rigid(mass: BodyMass) -> Matrix:
    inertia = rigid_inertia(mass)
    return _blocks(inertia.linear, inertia.coupling, transpose(inertia.coupling), inertia.angular)


def _carrier(moved: BodyMotion) -> Matrix:
    """Return C = [[G, 0], [p~ G, G]]."""
    columns = [cross(moved.p_PB, column) for column in transpose(moved.R_PB)]
    lever = transpose((columns[0], columns[1], columns[2]))
    return _blocks(moved.R_PB, (ZERO_VECTOR,) * 3, lever, moved.R_PB)


def _freedoms(moved: BodyMotion) -> Matrix:
    columns = [[*linear, *angular] for linear, angular in zip(moved.linear, moved.angular, strict=True)]
    return [[column[i] for column in columns] for i in range(6)]


def _column(wrench: Wrench) -> Matrix:
    return [[x] for vector in wrench for x in vector]


def _blocks(a: Mat, b: Mat, c: Mat, d: Mat) -> Matrix:
    return [[*a[i], *b[i]] for i in range(3)] + [[*c[i], *d[i]] for i in range(3)]


# --- matrices of any size, every element for itself ----------------------------------------------------------------


def times(a: Matrix, b: Matrix) -> Matrix:
    """Return A B; where B has no rows it is a vector."""
    columns = len(b[0]) if b else 1
    return [[_sum(x * b[k][j] for k, x in enumerate(row)) for j in range(columns)] for row in a]


def plus(a: Matrix, b: Matrix) -> Matrix:
    """Return A + B."""
    return [[x + y for x, y in zip(one, other, strict=True)] for one, other in zip(a, b, strict=True)]


def minus(a: Matrix, b: Matrix) -> Matrix:
    """Return A - B."""
    return [[x - y for x, y in zip(one, other, strict=True)] for one, other in zip(a, b, strict=True)]


def turned(a: Matrix) -> Matrix:
    """Return A^T."""
    return [list(column) for column in zip(*a, strict=True)]


def inverted(a: Matrix) -> Matrix:
    """Return A^-1 by cofactors."""
    places = range(len(a))
    cofactors = [[(-1) ** (i + j) * _determinant(_without(a, i, j)) for i in places] for j in places]
    determinant = _sum(x * row[0] for x, row in zip(a[0], cofactors, strict=True))
    return [[x / determinant for x in row] for row in cofactors]


def _determinant(a: Matrix) -> S:
    if not a:
        return 1
    return _sum((-1) ** j * x * _determinant(_without(a, 0, j)) for j, x in enumerate(a[0]))


def _without(a: Matrix, i: int, j: int) -> Matrix:
    return [row[:j] + row[j + 1 :] for k, row in enumerate(a) if k != i]


def _sum(terms: Iterable[S]) -> S:
    added = list(terms)
    return sum(added[1:], added[0]) if added else 0
