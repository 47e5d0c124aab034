"""A budget of time and size for symbolic derivations, so that a large model ends in advice and not in a hang."""

from __future__ import annotations

import time
from dataclasses import field

from multibody_sym.errors import NoSolutionError
from multibody_sym.records import dataclass


@dataclass
class Budget:
    """What a derivation may cost; it is spent in stages, and past it an error names the stage and the sizes."""

    seconds: float = 60.0
    operations: int = 1_000_000
    stage: str = "start"
    spent: int = 0
    started: float = field(default_factory=time.monotonic)

    def enter(self, stage: str) -> None:
        """Say what is being derived from here on."""
        self.stage = stage
        self.spend(0)

    def spend(self, operations: int) -> None:
        """Count operations; raise NoSolutionError past either limit."""
        self.spent += operations
        elapsed = time.monotonic() - self.started
        if elapsed > self.seconds or self.spent > self.operations:
            raise NoSolutionError(
                f"the closed form is too large: stopped at {self.stage} after {elapsed:.0f} s (limit {self.seconds:g}) "
                f"with {self.spent} operations (limit {self.operations}); choose a recursive formalism, such as "
                "composite_body, which needs no closed form",
                number="N104",
            )
