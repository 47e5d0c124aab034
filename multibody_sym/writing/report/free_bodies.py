"""Bodies cut free: a figure of each with all forces on it at the start, as numbers and geometry have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from multibody_sym.answers.cut_free.arrows import all_arrows
from multibody_sym.answers.cut_free.joints import shown_components
from multibody_sym.answers.cut_free.pulls import CutFree
from multibody_sym.answers.cut_free.values import open_of, sliding_of, values_of
from multibody_sym.answers.solution import Solution
from multibody_sym.answers.solve import solve
from multibody_sym.drawing.draw import draw as draw_scene
from multibody_sym.drawing.figure import Figure
from multibody_sym.drawing.shown import Shown
from multibody_sym.dynamics.derivation.letters import component_label
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.model.declaration.system import System
from multibody_sym.scene.items import ArrowItem
from multibody_sym.scene.scene import Scene, scene_of

_ROLES: Final = ("body", "mass centre", "pulley", "gear")
MOST: Final = 12
"""Systems of more bodies have no figure of each: nobody would look at them."""


def free_bodies(system: System) -> Mapping[str, Figure]:
    """Return a figure of each body with the forces on it: weight, loads, joints, ropes, contacts.

    None for an impact and for many bodies. Raises what `solve` raises.
    """
    if len(system.bodies) > MOST or system.impact is not None:
        return {}
    scene = scene_of(system)
    solution = solve(system)
    known = values_of(solution), sliding_of(solution), open_of(solution)
    arrows = all_arrows(CutFree(system, scene, scene.motion(), *known))
    undrawn = _undrawn(scene, solution)
    return {
        body.name: _figure(scene, k, [arrow for arrow in arrows if arrow.at.body == k], undrawn.get(k, ()))
        for k, body in enumerate(scene.mechanism.bodies)
        if not (body.is_double or body.is_foot) and any(arrow.at.body == k for arrow in arrows)
    }


def _undrawn(scene: Scene, solution: Solution) -> Mapping[int, Sequence[str]]:
    """Return by body the letters of joints' reactions, and the names of ropes and rods, that are not unique."""
    seen, found = shown_components(scene), dict[int, list[str]]()
    bodies = {item.name: set(item.bodies) for item in scene.items if item.path[0] == "joints" and item.bodies}
    bodies |= {strand.name: {anchor.body for anchor in strand.anchors} for strand in scene.strands}
    for name, part in open_of(solution):
        of_joint = part in COMPONENTS
        if of_joint and not seen(part[0] == "m", np.eye(3)["xyz".index(part[1])]):
            continue
        for body in bodies.get(name, ()):
            found.setdefault(body, []).append(component_label(name, part).text if of_joint else name)
    return {body: sorted(names) for body, names in found.items()}


def _figure(scene: Scene, body: int, arrows: Sequence[ArrowItem], undrawn: Sequence[str]) -> Figure:
    """Return a body alone with the forces on it."""
    items = tuple(item for item in scene.items if item.body == body and item.role in _ROLES)
    name = scene.mechanism.bodies[body].name
    alone = replace(scene, name=name, items=items, strands=(), dimensions=(), angles=(), arrows=(), ropes=())
    shown = Shown(names=False, reactions=tuple(arrows), undrawn=tuple(undrawn))
    placed = replace(scene.at(), strands=(), vectors=np.zeros((0, 3)))
    return Figure(draw_scene(alone, placed, shown=shown))
