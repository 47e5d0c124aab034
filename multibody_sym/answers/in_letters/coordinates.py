"""Letters for coordinates, speeds and accelerations; for what turns in the plane its angle there, from the x-axis.

Loops close by directions. So formulas are found in absolute angles, of whose differences a book writes the sines, and
told in the coordinates of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field
from typing import Final

from multibody_sym.answers.symbolic_state import SymbolicState
from multibody_sym.kinematics.motion import Motion, motion_of
from multibody_sym.kinematics.state import state_of
from multibody_sym.model.declaration.values import Point
from multibody_sym.model.mechanism.mechanism import Mechanism, TreeBody
from multibody_sym.records import dataclass
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import ONE, ZERO, Node, as_node, slot, symbol

TIME: Final = symbol("t")

Rates = tuple[Node, Node, Node]
"""An angle or a way, its rate, and the rate of that."""


@dataclass(frozen=True)
class Absolute:
    """A coordinate of the model (numbers `q`, `u` of it and of its speed), and the letters that stand for it.

    `letters`: of where it leads in the plane, or of itself; `shown`: the same in the names `own` of the model. They are
    `before` + `sense` times its own; `body` is what it moves.
    """

    q: int
    u: int
    body: str
    own: Rates
    letters: Rates
    shown: Rates
    before: Rates
    sense: int


@dataclass
class Coordinates:
    """All coordinates of a mechanism whose speeds are their rates; `names`: those of the accelerations, by speed.

    `q`, `u`, `udot`: coordinates, speeds and accelerations of joints over the letters.
    """

    mechanism: Mechanism
    symbolic: SymbolicState
    names: Sequence[str]
    all: list[Absolute] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.q: list[Node] = [ZERO] * len(self.mechanism.coordinates)
        self.u: list[Node] = [ZERO] * len(self.mechanism.speeds)
        self.udot: list[Node] = [ZERO] * len(self.mechanism.speeds)
        turned: list[tuple[Rates, Rates]] = []
        for body in self.mechanism.bodies:
            turned.append(self._of_body(body, turned[body.parent] if body.parent >= 0 else (_STILL, _STILL)))

    def _of_body(self, body: TreeBody, turned: tuple[Rates, Rates]) -> tuple[Rates, Rates]:
        """Give letters to the coordinates of a body's joint, and return its angle in letters and in names."""
        free = iter(body.free_steps)
        for step, given in zip(body.steps, body.given, strict=True):
            sense = _sense(step.turns)
            if given is None:
                for i, k in next(free).rate_pairs:
                    turned = self._of_pair(i, k, body.name, sense, turned)
            elif sense:
                moved = _triple(evaluate(given, self._in_time))
                turned = _plus(turned[0], sense, moved), _plus(turned[1], sense, moved)
        return turned

    def _in_time(self, leaf: Node) -> Node:
        """Return what a slot is at the time t."""
        return TIME if leaf is slot("t", 0) else as_node(self.symbolic.state.slots.get(leaf, leaf))

    def _of_pair(self, i: int, k: int, body: str, sense: int, turned: tuple[Rates, Rates]) -> tuple[Rates, Rates]:
        """Give letters to a coordinate and its rates, and return the angle of what they turn."""
        names = self.mechanism.coordinates[i].name, self.mechanism.speeds[k].name, self.names[k]
        own = _triple([symbol(name) for name in names])
        if not sense or (sense == 1 and turned[0] == _STILL):
            letters = shown = values = own
            before, sense_here = _STILL, 1
        else:
            letters = _triple([symbol(f"{name}_in_plane") for name in names])
            shown = _plus(turned[1], sense, own)
            values = _triple([sense * (x - y) for x, y in zip(letters, turned[0], strict=True)])
            before, sense_here = turned[0], sense
        self.q[i], self.u[k], self.udot[k] = values
        self.all.append(Absolute(i, k, body, own, letters, shown, before, sense_here))
        return (letters, shown) if sense else turned

    @property
    def plain(self) -> bool:
        """Whether all speeds are the rates of coordinates."""
        return len(self.all) == len(self.q) == len(self.u)

    @property
    def motion(self) -> Motion:
        """The motion of all bodies over the letters and the time."""
        parameters = [self._in_time(slot("parameters", k)) for k in range(len(self.mechanism.parameters))]
        return motion_of(self.mechanism, state_of(self.mechanism, Node, TIME, self.q, self.u, parameters))

    @property
    def in_names(self) -> dict[Node, Node]:
        """What each letter is in the names of the model, at the time 0."""
        pairs = [pair for x in self.all for pair in zip(x.letters, x.shown, strict=True)]
        return {letter: at_start(node) for letter, node in pairs}

    @property
    def rates(self) -> dict[Node, Node]:
        """The rates of the time and of all letters of coordinates."""
        return {TIME: ONE, **{x.letters[0]: x.letters[1] for x in self.all}}


def at_start(node: Node) -> Node:
    """Return an expression at the time 0."""
    return as_node(evaluate([node], lambda leaf: ZERO if leaf is TIME else leaf)[0])


def _sense(turns: Sequence[Point]) -> int:
    """Return 1 where something turns about z, -1 about -z, 0 else."""
    if len(turns) != 1:
        return 0
    x, y, z = (component.shadow for component in turns[0])
    return 0 if (x, y) != (0, 0) or z not in (1, -1) else int(z)


def _plus(rates: Rates, sense: int, more: Rates) -> Rates:
    return _triple([x + sense * y for x, y in zip(rates, more, strict=True)])


def _triple(nodes: Sequence[object]) -> Rates:
    a, b, c = map(as_node, nodes)
    return a, b, c


_STILL: Final[Rates] = (ZERO, ZERO, ZERO)
