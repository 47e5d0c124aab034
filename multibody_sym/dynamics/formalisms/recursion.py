"""Dynamics of a tree whose factors take forces where they act: one inward pass carries the wrenches and eliminates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from multibody_sym.dynamics.formalisms.equations import MassFactors, TreeDynamics, tree_dynamics
from multibody_sym.dynamics.formalisms.inverse_dynamics import bias_wrenches
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.wrenches import Wrench, generalized_forces
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S, negate


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
        """M^-1 f (n)."""
        return self.factors.accelerations(self.of_speed, self.of_body)


def recursive_dynamics(motion: Motion, factors: TreeRecursion) -> RecursiveDynamics:
    """Return the dynamics of a mechanism at a state by a recursion."""
    given = applied(motion, weight=False)
    left = [(negate(force), negate(moment)) for force, moment in bias_wrenches(motion, given.of_body)]
    forcing = [q + x for q, x in zip(given.of_speed, generalized_forces(motion, left), strict=True)]
    tree = tree_dynamics(motion, factors, forcing, row_motions(motion))
    return RecursiveDynamics(**vars(tree), of_speed=given.of_speed, of_body=left)
