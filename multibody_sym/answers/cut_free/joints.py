"""What joints exert, component by component: reactions across their freedoms, drives and friction along these."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from multibody_sym.answers.cut_free.records import Key
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.model.declaration.joint import Joint
from multibody_sym.model.mechanism.loads import JointForce, JointSpring
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.scalars.vectors import S
from multibody_sym.scene.scene import Scene
from multibody_sym.scene.stage import Stage

_ALONG: Final = 1.0 - 1e-9


@dataclass(frozen=True)
class JointForces:
    """The components of joints' forces of a mechanism, whose `stage` has the numbers of what is declared.

    `rows` are the constraints that act on freedoms of joints alone, with the generalised force of each.
    """

    mechanism: Mechanism
    stage: Stage
    rows: Mapping[str, Sequence[S]]

    def keys(self, name: str) -> Iterator[tuple[str, Key]]:
        """Yield each component fx .. mz of a joint with what it is: its reaction, or what acts along a freedom."""
        free = self._free(self.stage.system.joints[name])
        acting = list(self._acting(name)) if free else []
        for component in COMPONENTS:
            along = component in free
            yield component, acting[0] if along and len(acting) == 1 else ("joint", name, component)

    def _free(self, joint: Joint) -> set[str]:
        """Return the components along the freedoms of a joint, as far as these keep to the axes of its frame."""
        found = set()
        turns = [axis for step in joint.steps for axis in step.turns]
        for step in joint.steps:
            for letter, axes in (("f", step.slides), ("m", step.turns if len(turns) in (1, 3) else ())):
                for axis in axes:
                    ways = np.abs(self.stage.vector(axis))
                    k = int(np.argmax(ways))
                    if ways[k] >= _ALONG * float(np.linalg.norm(ways)):
                        found.add(f"{letter}{'xyz'[k]}")
        return found

    def _acting(self, name: str) -> Iterator[Key]:
        """Yield what acts along the freedoms of a joint: loads, friction, stops, constraints on its coordinates."""
        for load in self.mechanism.loads:
            if isinstance(load, (JointForce, JointSpring)) and load.joint == name:
                yield "drive", load.name
        for element in self.mechanism.one_way:
            if element.joint == name:
                rows = [row for part in element.frictions for row in part.rows] or list(element.normals)
                yield from (("row", row.name) for row in rows)
        if self.rows:
            speeds = [k for body in self.mechanism.bodies if body.joint_name == name for k in body.u]
            yield from (("row", row) for row, forces in self.rows.items() if any(float(forces[k]) for k in speeds))


def shown_components(scene: Scene) -> Callable[[bool, Floats], bool]:
    """Return whether a component is seen: in a plane mechanism forces in the plane and couples across it alone.

    What redundant constraints leave open is among the others.
    """
    towards = np.asarray(scene.view.towards)

    def seen(turns: bool, axis: Floats) -> bool:
        across = abs(float(towards @ axis))
        return not scene.plane or abs(across - (0.0 if turns else 1.0)) > 1.0 - _ALONG

    return seen
