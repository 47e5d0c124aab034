"""What results tell of a mechanism: names, units, and what there is to look for in a run.

It is text and numbers, so that a run that was made before is told without the mechanism that it is of.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final, NamedTuple, Protocol

if TYPE_CHECKING:  # a run that is recalled needs none of it
    from multibody_sym.mechanics.mechanism import Mechanism
    from multibody_sym.mechanics.units import MechanismUnits


class Resolved(Protocol):
    """Who has the mechanism, or makes it when it is asked for."""

    @property
    def mechanism(self) -> Mechanism: ...


class ResolvedAlone(NamedTuple):
    """A mechanism that is of no run by itself, as a mode is."""

    mechanism: Mechanism


Names = tuple[str, ...]


class RunLabels:
    """What results tell of a mechanism, each found when it is first asked for."""

    def __init__(self, resolved: Resolved) -> None:
        self._resolved = resolved

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism itself, for what is seldom told."""
        return self._resolved.mechanism

    @cached_property
    def name(self) -> str:
        """What the system is called."""
        return self.mechanism.name

    @cached_property
    def coordinates(self) -> Names:
        """The names of the coordinates."""
        return tuple(c.name for c in self.mechanism.coordinates)

    @cached_property
    def quaternions(self) -> Names:
        """The names of the coordinates that are parts of quaternions."""
        bodies = self.mechanism.bodies
        return tuple(self.coordinates[k] for body in bodies for places in body.quaternions for k in places)

    @cached_property
    def speeds(self) -> Names:
        """The names of the speeds."""
        return tuple(s.name for s in self.mechanism.speeds)

    @cached_property
    def inputs(self) -> Names:
        """The names of the inputs."""
        return tuple(self.mechanism.inputs)

    @cached_property
    def outputs(self) -> Names:
        """The outputs that a Program tells."""
        return tuple(self.mechanism.outputs)

    @cached_property
    def run_outputs(self) -> Names:
        """The outputs that add up along a run."""
        return tuple(self.mechanism.run_outputs)

    @cached_property
    def untold(self) -> Names:
        """The outputs that cannot be told."""
        return self.mechanism.untold

    @cached_property
    def rows(self) -> Names:
        """The names of the constraint rows."""
        return tuple(row.name for row in self.mechanism.rows)

    @cached_property
    def doubles(self) -> dict[str, int]:
        """The joints whose coordinates massless doubles keep, with their speeds."""
        return self.mechanism.doubles

    @cached_property
    def stops(self) -> Names:
        """What ends a run, in the order of its switching functions."""
        return (*self.mechanism.stops, *self.mechanism.state_stops)

    @cached_property
    def ropes(self) -> Names:
        """The rows of ropes that have one tension."""
        runs = (row.rope_run for row in self.mechanism.rows)
        return tuple(run.name for run in runs if run is not None and not run.rubs)

    @cached_property
    def drives(self) -> Names:
        """The joints (and ground) that move as prescribed."""
        return self.mechanism.drives

    @cached_property
    def working(self) -> Names:
        """The loads and rows that may change the total energy."""
        from multibody_sym.mechanics.energy import working_names

        return working_names(self.mechanism)

    @cached_property
    def driven(self) -> bool:
        """Whether loads or rows may raise the total energy."""
        from multibody_sym.mechanics.energy import driving_names

        return bool(driving_names(self.mechanism))

    @cached_property
    def moved_by_time(self) -> bool:
        """Whether time, or an input, moves what does work."""
        from multibody_sym.mechanics.energy import moved_by_time

        return moved_by_time(self.mechanism)

    @cached_property
    def state_units(self) -> dict[str, str]:
        """The SI unit of each coordinate and speed, measured ones too; empty where none is known."""
        return self._units.state

    @cached_property
    def input_units(self) -> dict[str, str]:
        """The SI unit of each input; empty where none is known."""
        return self._units.inputs

    @cached_property
    def output_units(self) -> dict[str, str]:
        """The SI unit of each output; empty where none is known."""
        return self._units.outputs

    @cached_property
    def _units(self) -> MechanismUnits:
        from multibody_sym.mechanics.units import MechanismUnits

        return MechanismUnits(self.mechanism)

    @cached_property
    def withheld(self) -> dict[str, Names]:
        """Components of joints' reactions that are not determined."""
        return {name: each.components for name, each in self.mechanism.withheld.items()}

    @cached_property
    def withheld_reasons(self) -> Names:
        """Why they are not, and what to declare instead."""
        if not self.mechanism.withheld:
            return ()
        from multibody_sym.mechanics.gears import reasons

        return tuple(reasons(self.mechanism.withheld))

    @cached_property
    def limited(self) -> bool:
        """Whether a joint has limits."""
        return bool(self.mechanism.limits)

    @cached_property
    def rolls(self) -> bool:
        """Whether a wheel rolls that nothing but its weight keeps down."""
        from multibody_sym.mechanics.mechanism import normal_forces

        return bool(normal_forces(self.mechanism))

    @cached_property
    def one_way(self) -> bool:
        """Whether something holds one way only."""
        return bool(self.mechanism.one_way)

    @cached_property
    def boxes(self) -> bool:
        """Whether two boxes in space touch, of which edges may pass into each other."""
        from multibody_sym.mechanics.law_elements import boxes_that_touch

        return bool(boxes_that_touch(self.mechanism.one_way))

    @cached_property
    def works_unseen(self) -> bool:
        """Whether something does work that no load tells."""
        from multibody_sym.mechanics.energy import works_unseen

        return works_unseen(self.mechanism)

    @cached_property
    def loses_mass(self) -> bool:
        """Whether the mass of a body varies."""
        from multibody_sym.mechanics.forces import varies

        return any(map(varies, self.mechanism.bodies))


ALL: Final = tuple(x for x, part in vars(RunLabels).items() if isinstance(part, cached_property) and x[0] != "_")
"""The names of all that is told."""


def as_json(told: RunLabels) -> dict[str, Any]:
    """Return all of it as JSON values."""
    return {name: getattr(told, name) for name in ALL}


class _Recalled(RunLabels):
    """What was told before; the mechanism is made where it is needed after all."""

    def __init__(self, resolved: Resolved, known: Mapping[str, Any]) -> None:
        super().__init__(resolved)
        vars(self).update(known)


def labels_from_json(values: Any, resolved: Resolved) -> RunLabels:
    """Return what `as_json` wrote; raises KeyError or TypeError for anything else."""
    if set(values) != set(ALL):
        raise KeyError("not what is told of a mechanism")
    return _Recalled(resolved, {name: freeze(values[name]) for name in ALL})


def freeze(value: Any) -> Any:
    """Return a value as it was before it was JSON, which has no tuples."""
    if isinstance(value, list):
        return tuple(map(freeze, value))
    return {name: freeze(x) for name, x in value.items()} if isinstance(value, dict) else value
