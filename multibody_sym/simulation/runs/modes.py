"""What a run begins with, and how one that goes from mode to mode is taken: under way, or recalled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from multibody_sym.numerics.arrays import Floats
from multibody_sym.records import dataclass
from multibody_sym.runtime.problem import Loop, Problem
from multibody_sym.simulation.runs.runnable import Runnable

if TYPE_CHECKING:  # few runs need any of it
    from multibody_sym.runtime.chain import Answer
    from multibody_sym.scalars.node import Node
    from multibody_sym.simulation.along.fine import FineLeg
    from multibody_sym.simulation.along.jumps import Passed
    from multibody_sym.simulation.one_way.legs import Leg
    from multibody_sym.simulation.parts import Part


@dataclass
class FrictionWork:
    """The work of one friction part in J: on all bodies together, negative, and on each that it acts on, by name.

    Of friction in a joint only the first is known: its force is the joint's own.
    """

    total: float = 0.0
    bodies: dict[str, float] = field(default_factory=dict)


@dataclass
class EnergyAccount:
    """The work of each friction part by name, and that of the loads that the potential energy does not hold, in J."""

    friction: dict[str, FrictionWork]
    loads: float = 0.0


class RunInModes(Protocol):
    """A run from mode to mode: its `loop`, which adds to `legs`, and what there is to tell of it afterwards.

    See `ModeRun` of `one_way.mode_run`.
    """

    @property
    def legs(self) -> Sequence[Leg]: ...

    @property
    def events(self) -> list[dict[str, Any]]: ...

    @property
    def account(self) -> EnergyAccount: ...

    @property
    def lost(self) -> Mapping[str, float]: ...

    @property
    def lost_at_start(self) -> float: ...

    @property
    def stabilised(self) -> tuple[float, float] | None: ...

    @property
    def project(self) -> bool: ...

    @property
    def jumps(self) -> Sequence[Answer]: ...

    @property
    def loop(self) -> Loop: ...

    @property
    def along(self) -> list[FineLeg]: ...

    @property
    def passed(self) -> Iterable[Passed]: ...

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]: ...

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[Part, ...]: ...

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str: ...


class Beginning(NamedTuple):
    """What a run begins with: what is ready, the problem, how it goes from mode to mode, what struck before."""

    ready: Runnable
    problem: Problem
    modes: RunInModes | None = None
    events: tuple[Mapping[str, Any], ...] = ()
    hints: tuple[str, ...] = ()


class Departed(Exception):  # noqa: N818
    """A run that was recalled has not come to where it was before; `begin` makes it from its model."""

    def __init__(self, begin: Callable[[], Beginning]) -> None:
        super().__init__()
        self.begin = begin
