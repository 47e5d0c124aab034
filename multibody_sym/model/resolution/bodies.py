"""The bodies of the tree with the joints that carry them, a moving ground first."""

from __future__ import annotations

from collections.abc import Iterable

from multibody_sym.errors import ModelError
from multibody_sym.model.declaration.curves.foot import Foot
from multibody_sym.model.declaration.steps import Rotate, Translate
from multibody_sym.model.mechanism.mass import GROUND, IDENTITY, NO_MASS, Pose, mass_of, unit_vector
from multibody_sym.model.mechanism.mechanism import TreeBody, double_name
from multibody_sym.model.resolution.references import BARE, References
from multibody_sym.model.resolution.spanning_tree import body_part
from multibody_sym.scalars.node import ZERO


def tree_bodies(references: References, carrying: Iterable[str], doubled: Iterable[str]) -> tuple[TreeBody, ...]:
    """Return the bodies in tree order, then the massless doubles that cut joints carry, named by their joints."""
    system = references.system
    carried = [(name, body_part(system.joints[name].child, system.bodies)[0]) for name in carrying]
    wanted = [(name, child, mass_of(system.bodies[child]), False) for name, child in carried]
    wanted += [(name, double_name(system.joints[name].child, name), NO_MASS, True) for name in doubled]
    made, q, u = [], 0, 0
    for joint_name, name, mass, double in wanted:
        joint, (on_parent, on_body) = system.joints[joint_name], references.frames(joint_name)
        steps = tuple(step.with_directions(unit_vector) for step in joint.moves)
        nq, nu = len(joint.coordinate_units), len(joint.speed_units)
        numbers = tuple(range(q, q + nq)), tuple(range(u, u + nu))
        ends = on_parent.pose, on_body.pose
        foot = isinstance(joint, Foot)
        made.append(TreeBody(name, on_parent.body, joint_name, steps, *ends, mass, *numbers, double, foot))
        q, u = q + nq, u + nu
    return (*_ground(references), *made)


def _ground(references: References) -> tuple[TreeBody, ...]:
    """Return a ground that moves as a body on prescribed steps."""
    body = references.system.bodies.get(GROUND, BARE)
    if body.motion is None:
        return ()
    if GROUND in references.system.joints:
        raise ModelError(
            "ground moves, and its own drive is called 'ground'; give the joint another name", number="M108"
        ).under(
            "joints"
        )
    places = zip(IDENTITY, (body.motion.x, body.motion.y, body.motion.z), strict=True)
    moves = [Translate(axis, motion=place) for axis, place in places if place is not ZERO]
    turns = [Rotate(unit_vector(turn.axis), motion=turn.angle) for turn in body.motion.turn]
    return (TreeBody(GROUND, -1, GROUND, (*moves, *turns), Pose(), Pose(), mass_of(body), (), ()),)
