"""What the runs of one prepared system have decided: each of them may go the way of those before it, after a look."""

from __future__ import annotations

from dataclasses import field

from multibody_sym.records import dataclass
from multibody_sym.simulation.one_way.decision import Decided
from multibody_sym.simulation.one_way.modes import Key
from multibody_sym.simulation.one_way.stretches import Stretch
from multibody_sym.simulation.one_way.turns import Turn, turn_of


@dataclass(eq=False)
class Remembered:
    """Where switching functions of modes have led, by mode and number, and modes that the loop in C can follow.

    Whether a turn is taken is decided by the laws alone, so that it does not matter which run remembered it.
    """

    turns: dict[tuple[Key, int], tuple[Turn, ...]] = field(default_factory=dict)
    stretches: dict[Key, Stretch] = field(default_factory=dict)

    def learn(self, found: Decided, now: Stretch, key: Key, index: int) -> None:
        """Remember where a switch led: for forces at a limit all ways, for others the last one."""
        cause = now.cause(index)
        turn = turn_of(found, now.mode, cause)
        others = self.turns.get((key, index), ()) if cause.limits else ()
        new = () if turn is None else (turn,)
        self.turns[key, index] = (*(x for x in others if turn is None or x.mode != turn.mode), *new)
