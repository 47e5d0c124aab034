"""What a run that could not go on raises."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from multibody_sym.errors import RunError

if TYPE_CHECKING:
    from multibody_sym.simulation.trajectory import Trajectory


class FailedRunError(RunError):
    """A run that could not go on; `trajectory` holds what it had computed."""

    def __init__(self, message: str, trajectory: Trajectory) -> None:
        super().__init__(message)
        self.trajectory = trajectory

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.message, self.trajectory), vars(self)


class MotionEndsError(FailedRunError):
    """The motion of the model itself has no continuation; `trajectory` is all of it.

    A speed or a force grows without bound there, constraints contradict each other, a mass is used up, a rope comes off
    its wheel, or no state fulfils the laws of contact and friction.
    """

    number = "R101"
