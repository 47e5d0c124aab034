"""What the runs of one prepared system share: laws, modes, and a memory of what was decided."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Final

from multibody_sym.dynamics.laws.assemble import Scale
from multibody_sym.errors import NoSolutionError
from multibody_sym.integrators.methods.library import LibraryMethod
from multibody_sym.records import dataclass
from multibody_sym.runtime.problem import Problem
from multibody_sym.simulation.one_way import thin_bars
from multibody_sym.simulation.one_way.facts import Facts, Laws
from multibody_sym.simulation.one_way.impact import Returns, Standstill
from multibody_sym.simulation.one_way.legs import Cause, Leg
from multibody_sym.simulation.one_way.modes import Modes
from multibody_sym.simulation.one_way.switch_memory import SwitchMemory
from multibody_sym.simulation.one_way.switches import Switches

_AT_ONCE: Final = 1e-3
"""The part of a mean step within which a return to a mode is no motion."""
_UNSEEN: Final = 100.0
"""The multiple of a run's absolute tolerance below which a speed is rounding of its steps."""
_UNSEEN_MOST: Final = 1e-8
"""The largest such speed (m/s): a tenth of that up to which slip keeps the direction in which it starts."""


@dataclass(eq=False)
class PreparedRuns:
    """What the runs of one prepared system share, by `laws`: their first decision, modes, and where switches led.

    `template` is the problem of all, `scale` tells how large and fast the model is where they begin; `bars` have no
    thickness. Rows are put back after each step if the template's are, or `stabilised` by Baumgarte's alpha, beta
    (1/s).
    """

    laws: Laws
    modes: Modes
    template: Problem
    scale: Scale
    stabilised: tuple[float, float] | None
    bars: tuple[thin_bars.ThinBar, ...] = ()

    @property
    def soon(self) -> float:
        """The time (s) within which a return to a mode is no motion."""
        return _AT_ONCE * self.template.t_end / 200.0

    @cached_property
    def memory(self) -> SwitchMemory:
        """What runs have decided."""
        return SwitchMemory(self.laws, self.template, self.soon)

    def switches(self) -> Switches:
        """Return the decisions of a run that has not begun."""
        unseen = min(_UNSEEN * self.template.atol, _UNSEEN_MOST)
        scale = replace(self.scale, unseen=unseen, steps=0.0 if self.template.step else self.template.rtol)
        if isinstance(self.template.method, LibraryMethod):
            scale = replace(scale, rtol=self.template.rtol, atol=self.template.atol)
        standstill = Standstill(self.template.t_end - self.template.t0)
        return Switches(self.laws, scale, self.bars, standstill, Returns(self.soon))

    @cached_property
    def first(self) -> tuple[Leg, Facts, tuple[str, ...]]:
        """The leg with which runs begin, what holds there, and the sides of bars on which no points are.

        Raises NoSolutionError where there is no mode, ModelError where a point moves across a thin bar that it touches.
        """
        switches = self.switches()
        found = switches.first(self.template.start, self.template.x0)
        if found.mode is None:
            raise NoSolutionError(f"{found.why_none.text} at the start")
        problem, program = self.modes.problem(found, None)
        first = Leg(problem, program=program, mode=found.mode, cause=Cause.of(found, found.facts.t))
        return first, found.facts, switches.hidden
