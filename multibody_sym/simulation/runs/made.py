"""How runs came about: what samples and trajectories tell of, and the run that was made alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from multibody_sym.numerics.arrays import Floats
from multibody_sym.runtime.integration import Integration
from multibody_sym.runtime.problem import Problem, RunFailure
from multibody_sym.simulation.parts import Part
from multibody_sym.simulation.runs.runnable import Runnable
from multibody_sym.simulation.runs.told import Told

if TYPE_CHECKING:
    from multibody_sym.simulation.runs.modes import RunInModes


class Sampled(Protocol):
    """Times t (m,), coordinates q (m, nq) and speeds u (m, nu) of a system that is `ready`, with `parameters` (np,).

    A run in modes has `parts`, each with Programs of its own.
    """

    @property
    def ready(self) -> Runnable: ...
    @property
    def told(self) -> Told: ...
    @property
    def parameters(self) -> Floats: ...
    @property
    def t(self) -> Floats: ...
    @property
    def q(self) -> Floats: ...
    @property
    def u(self) -> Floats: ...
    @property
    def parts(self) -> Sequence[Part]: ...


class Made(Sampled, Protocol):
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


class Piece(NamedTuple):
    """Samples of a run that goes on."""

    ready: Runnable
    parameters: Floats
    t: Floats
    q: Floats
    u: Floats
    parts: Sequence[Part]

    @property
    def told(self) -> Told:
        """What is told of the system."""
        return self.ready.told


class MadeAlone(NamedTuple):
    """A run that was made by itself."""

    ready: Runnable
    problem: Problem
    integration: Integration
    parts: Sequence[Part] = ()
    modes: RunInModes | None = None
    begun: tuple[Mapping[str, Any], ...] = ()

    @property
    def told(self) -> Told:
        """What is told of the system."""
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
