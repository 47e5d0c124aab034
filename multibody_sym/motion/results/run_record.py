"""What a run begins with, and how one that goes from mode to mode is taken: under way, or recalled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from multibody_sym.motion.loop.integrate import Integration
from multibody_sym.motion.loop.problem import Loop, Problem, RunFailure
from multibody_sym.motion.prepare.records import LegSamples, PreparedSystem
from multibody_sym.motion.prepare.run_labels import RunLabels
from multibody_sym.records import dataclass
from multibody_sym.scalars.arrays import Floats

if TYPE_CHECKING:
    from multibody_sym.motion.loop.chain import LegAnswer
    from multibody_sym.motion.results.integrals import FineLeg, ImpactBalance
    from multibody_sym.motion.switching.legs import ModeLeg
    from multibody_sym.scalars.node import Node


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

    See `ModeRun` of `motion.switching.mode_run`.
    """

    @property
    def legs(self) -> Sequence[ModeLeg]: ...

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
    def jumps(self) -> Sequence[LegAnswer]: ...

    @property
    def loop(self) -> Loop: ...

    @property
    def along(self) -> list[FineLeg]: ...

    @property
    def passed(self) -> Iterable[ImpactBalance]: ...

    def added(self, leaves: Sequence[Node]) -> list[tuple[float, Floats]]: ...

    def parts(self, t: Floats, q: Floats, u: Floats, first: int = 0) -> tuple[LegSamples, ...]: ...

    def passed_through(self, t: Floats, q: Floats, u: Floats) -> str: ...


class RunStart(NamedTuple):
    """The start of a run: the prepared system, the problem, its modes, the events of an impact before it."""

    ready: PreparedSystem
    problem: Problem
    modes: RunInModes | None = None
    events: tuple[Mapping[str, Any], ...] = ()
    hints: tuple[str, ...] = ()


class Departed(Exception):  # noqa: N818
    """A replayed run has not come to the state that was cached; `begin` makes it from its model."""

    def __init__(self, begin: Callable[[], RunStart]) -> None:
        super().__init__()
        self.begin = begin


# ----------------------------------------------------------------------------------------------------------------------
# Records of runs, which samples and trajectories read.


class Sampled(Protocol):
    """Times t (m,), coordinates q (m, nq) and speeds u (m, nu) of a system that is `ready`, with `parameters` (np,).

    A run in modes has `parts`, each with Programs of its own.
    """

    @property
    def ready(self) -> PreparedSystem: ...
    @property
    def told(self) -> RunLabels: ...
    @property
    def parameters(self) -> Floats: ...
    @property
    def t(self) -> Floats: ...
    @property
    def q(self) -> Floats: ...
    @property
    def u(self) -> Floats: ...
    @property
    def parts(self) -> Sequence[LegSamples]: ...


class RunRecord(Sampled, Protocol):
    """A run: the `problem` and its `integration`, the `modes` it went through, events of the impact it goes on from."""

    @property
    def problem(self) -> Problem: ...
    @property
    def integration(self) -> Integration: ...
    @property
    def failure(self) -> RunFailure | None: ...
    @property
    def modes(self) -> RunInModes | None: ...
    @property
    def begun(self) -> tuple[Mapping[str, Any], ...]: ...


class NewSamples(NamedTuple):
    """Samples of a run that goes on."""

    ready: PreparedSystem
    parameters: Floats
    t: Floats
    q: Floats
    u: Floats
    parts: Sequence[LegSamples]

    @property
    def told(self) -> RunLabels:
        """Names and units."""
        return self.ready.told


class SingleRun(NamedTuple):
    """A run that was not made with others."""

    ready: PreparedSystem
    problem: Problem
    integration: Integration
    parts: Sequence[LegSamples] = ()
    modes: RunInModes | None = None
    begun: tuple[Mapping[str, Any], ...] = ()

    @property
    def told(self) -> RunLabels:
        """Names and units."""
        return self.ready.told

    @property
    def parameters(self) -> Floats:
        """The parameter vector (np,)."""
        return self.problem.parameters

    @property
    def t(self) -> Floats:
        """The times of samples (m,)."""
        return self.integration.t

    @property
    def q(self) -> Floats:
        """Coordinates (m, nq)."""
        return self.integration.q

    @property
    def u(self) -> Floats:
        """Speeds (m, nu)."""
        return self.integration.u

    @property
    def failure(self) -> RunFailure | None:
        """Why it ended early, if it did."""
        return self.integration.failure
