"""Reactions as arrows: what joints exert on their children, at the joints' points, in the world."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

import numpy as np

from multibody_sym.model.declaration.system import System
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.numerics.arrays import Floats
from multibody_sym.scene.forms import vector
from multibody_sym.scene.items import Anchor, ArrowItem, Placed
from multibody_sym.scene.scene import Scene
from multibody_sym.scene.stage import Stage

if TYPE_CHECKING:  # a figure without reactions needs no run
    from multibody_sym.simulation.trajectory import Trajectory

_NEGLIGIBLE: Final = 1e-9
"""Forces below this part of the largest are zero but for rounding, and have no direction."""


def reaction_arrows(system: System, scene: Scene, placed: Placed, run: Trajectory) -> tuple[ArrowItem, ...]:
    """Return the reactions at the end of a run: a force `F_<joint>` and a couple `M_<joint>` for each joint.

    Components that are not determined are left out with the rest of their vector: a part of a force points elsewhere.
    """
    found = list(_arrows(system, scene, placed, run))
    largest: dict[str, float] = {}
    for arrow in found:
        size = float(np.linalg.norm(arrow.vector))
        largest[arrow.role] = max(size, largest.get(arrow.role, 0.0))
    return tuple(a for a in found if float(np.linalg.norm(a.vector)) > _NEGLIGIBLE * largest[a.role])


def _arrows(system: System, scene: Scene, placed: Placed, run: Trajectory) -> Iterator[ArrowItem]:
    stage = Stage(system, scene.mechanism, scene.begin)
    values = run.reactions
    for name, joint in system.joints.items():
        if name not in values:
            continue
        parent, child = stage.place(joint.parent), stage.place(joint.child)
        axes = placed.poses[parent.body][:, :3] @ parent.rotation
        force, couple = _six(values[name])
        at, path = Anchor(child.body, child.point), ("joints", name)
        if np.isfinite(force).all() and force.any():
            yield ArrowItem("reaction", name, f"F_{name}", path, at, vector(axes @ force))
        if np.isfinite(couple).all() and couple.any():
            yield ArrowItem("couple", name, f"M_{name}", path, at, vector(axes @ couple))


def _six(components: Mapping[str, Floats]) -> tuple[Floats, Floats]:
    """Return the force and the couple at the last sample."""
    values = np.array([float(components[c][-1]) for c in COMPONENTS])
    return values[:3], values[3:]
