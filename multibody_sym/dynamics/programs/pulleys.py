"""What holds massless pulleys: the force on each, by the body that it stands on, against the ropes that run over it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.dynamics.programs.tensions import ropes, tensions
from multibody_sym.expressions.components import COMPONENTS
from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import segments, wheel_at
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, add, apply_transposed, scale, subtract


def pulley_reactions(motion: Motion, multipliers: Sequence[S]) -> Mapping[str, dict[str, S]]:
    """Return for each massless pulley with a rope fx .. mz on it, about its centre, in the axes of what carries it.

    The moment is what a drum that stands still takes of the rope's friction.
    """
    found: dict[str, tuple[Vec, Vec]] = {}
    bodies: dict[str, int] = {}
    for row in ropes(motion.mechanism):
        own = [k for k, bend in enumerate(row.path[1:-1], 1) if bend.pulley and bend.massless]
        pulls = _along_path(row, tensions(motion, multipliers, row)) if own else []
        pieces = segments(motion, row.path, row.straight)[0] if own else []
        for k in own:
            name, before, after = row.path[k].pulley, pulls[k - 1], pulls[k]
            force = subtract(scale(before, pieces[k - 1].direction), scale(after, pieces[k].direction))
            wheel = wheel_at(motion, row.path, k) if before is not after else None
            moment = ZERO_VECTOR if wheel is None else scale((before - after) * wheel.radius, wheel.axis)
            known = found.get(name, (ZERO_VECTOR, ZERO_VECTOR))
            found[name] = add(known[0], force), add(known[1], moment)
            bodies[name] = row.path[k].at.body
    return {name: _components(motion, bodies[name], *wrench) for name, wrench in found.items()}


def _along_path(row: RopeRow, pulls: Sequence[S]) -> list[S]:
    """Return the tension of each piece."""
    rough = [k for k, bend in enumerate(row.path[:-1]) if k and bend.rough] if len(pulls) > 1 else []
    return [pulls[sum(k <= piece for k in rough)] for piece in range(len(row.path) - 1)]


def _components(motion: Motion, body: int, force: Vec, moment: Vec) -> dict[str, S]:
    F, M = (apply_transposed(motion.rotation(body), v) for v in (force, moment))
    return dict(zip(COMPONENTS, (*F, *M), strict=True))


def held_pulleys(mechanism: Mechanism) -> tuple[str, ...]:
    """Return the massless pulleys that ropes run over."""
    bends = (bend for row in ropes(mechanism) for bend in row.path[1:-1])
    return tuple(dict.fromkeys(bend.pulley for bend in bends if bend.pulley and bend.massless))
