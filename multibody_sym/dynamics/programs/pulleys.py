"""What holds massless pulleys: the force on each, by the body that it stands on, against the ropes that run over it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from multibody_sym.kinematics.motion import Motion
from multibody_sym.kinematics.ropes import segments
from multibody_sym.model.mechanism.mechanism import COMPONENTS
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.scalars.vectors import ZERO_VECTOR, S, Vec, apply_transposed, scale, subtract


def pulley_reactions(motion: Motion, multipliers: Sequence[S]) -> Mapping[str, dict[str, S]]:
    """Return for each massless pulley with a rope fx .. mz on it, about its centre, in the axes of what carries it."""
    found: dict[str, Vec] = {}
    bodies: dict[str, int] = {}
    for row, tension in zip(motion.mechanism.rows, multipliers, strict=True):
        if not isinstance(row, RopeRow) or not any(bend.pulley for bend in row.path[1:-1]):
            continue
        pieces, _ = segments(motion, row.path, row.straight)
        for bend, before, after in zip(row.path[1:-1], pieces[:-1], pieces[1:], strict=True):
            if bend.pulley:
                held = scale(tension, subtract(before.direction, after.direction))
                known = found.get(bend.pulley, ZERO_VECTOR)
                found[bend.pulley] = (known[0] + held[0], known[1] + held[1], known[2] + held[2])
                bodies[bend.pulley] = bend.at.body
    return {
        name: dict(zip(COMPONENTS, (*apply_transposed(motion.rotation(bodies[name]), force), 0, 0, 0), strict=True))
        for name, force in found.items()
    }


def held_pulleys(rows: Sequence[object]) -> tuple[str, ...]:
    """Return the massless pulleys that ropes run over."""
    ropes = [row for row in rows if isinstance(row, RopeRow)]
    return tuple(dict.fromkeys(bend.pulley for row in ropes for bend in row.path[1:-1] if bend.pulley))
