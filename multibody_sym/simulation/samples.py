"""Samples of a motion: times, coordinates and speeds, and everything that follows from them at those times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.errors import InputError, ModelError, suggestion
from multibody_sym.expressions.chosen_units import Units, chosen_units
from multibody_sym.formats.tables import Table
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.mechanism import COMPONENTS, Mechanism
from multibody_sym.model.mechanism.rows import RopeRow
from multibody_sym.model.mechanism.units import MechanismUnits
from multibody_sym.model.resolution.force_places import reasons
from multibody_sym.numerics.arrays import Floats
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.runtime.loading import Backend, Compiled, load
from multibody_sym.simulation.runnable import Runnable


@dataclass(frozen=True, eq=False, repr=False)
class Samples:
    """A motion at times t (m,): coordinates q (m, nq) and speeds u (m, nu) of a system with `parameters` (np,).

    `samples["theta"]` is a coordinate, a speed, an input or a declared output by name, (m,).
    """

    ready: Runnable
    parameters: Floats
    t: Floats
    q: Floats
    u: Floats

    def __len__(self) -> int:
        return len(self.t)

    @cached_property
    def units(self) -> Mapping[str, str]:
        """The SI unit of each coordinate, speed and input, measured coordinates too; empty where none is known."""
        told = MechanismUnits(self.ready.mechanism)
        return {**told.inputs, **told.state}

    @cached_property
    def output_units(self) -> Mapping[str, str]:
        """The SI unit of each output; empty where none is known, as of what hangs on parameters without units."""
        return MechanismUnits(self.ready.mechanism).outputs

    def __getitem__(self, name: str) -> Floats:
        if not isinstance(name, str):
            raise InputError(f"a run is asked by name, such as run['theta'] (its times are run.t), not by {name!r}")
        for kind in ("coordinates", "speeds", "outputs", "inputs"):  # one after the other: the first two take no code
            columns: Mapping[str, Floats] = getattr(self, kind)
            if name in columns:
                return columns[name]
        known = [*self.coordinates, *self.speeds, *self.ready.mechanism.outputs, *self.ready.mechanism.inputs]
        raise InputError(f"nothing in this run is called {name!r}{suggestion(name, known)}")

    @property
    def coordinates(self) -> Mapping[str, Floats]:
        """Each coordinate (m,) by name."""
        return dict(zip((c.name for c in self.ready.mechanism.coordinates), self.q.T, strict=True))

    @property
    def speeds(self) -> Mapping[str, Floats]:
        """Each speed (m,) by name."""
        return dict(zip((s.name for s in self.ready.mechanism.speeds), self.u.T, strict=True))

    @cached_property
    def inputs(self) -> Mapping[str, Floats]:
        """Each input (m,) by name."""
        return dict(zip(self.ready.mechanism.inputs, self._arguments[4].T, strict=True))

    @cached_property
    def outputs(self) -> Mapping[str, Floats]:
        """Each declared output (m,) by name; nan where it hangs on a reaction that is withheld."""
        (values,) = self._evaluated("outputs")
        untold = {name: np.full(len(self.t), np.nan) for name in self.ready.mechanism.untold}
        return {**dict(zip(self.ready.mechanism.outputs, values.T, strict=True)), **untold}

    @cached_property
    def kinetic_energy(self) -> Floats:
        """T (m,) in J."""
        return self._energies[0]

    @cached_property
    def potential_energy(self) -> Floats:
        """V (m,) in J: of weights and springs."""
        return self._energies[1]

    @cached_property
    def energy(self) -> Floats:
        """T + V (m,) in J."""
        return self.kinetic_energy + self.potential_energy

    @cached_property
    def accelerations(self) -> Mapping[str, Floats]:
        """The rate of each speed (m,), by the speed's name."""
        return dict(zip((s.name for s in self.ready.mechanism.speeds), self._derivative[1].T, strict=True))

    @cached_property
    def multipliers(self) -> Mapping[str, Floats]:
        """The multiplier of each constraint (m,) by name: a rope's or rod's tension."""
        return dict(zip((row.name for row in self.ready.mechanism.rows), self._derivative[2].T, strict=True))

    @cached_property
    def reactions(self) -> Mapping[str, Mapping[str, Floats]]:
        """What each joint exerts on its child: fx, fy, fz, mx, my, mz (m,), by the joint's name.

        About the joint's point on the child, in the axes of the joint's frame on the parent; components along free
        directions are those of motors and springs in the joint. What is `withheld` is nan.
        """
        program = reaction_program(self.ready.mechanism, self.ready.compiled.likewise)
        (values,) = program.map("reactions", *self._arguments, self._derivative[1], self._derivative[2])
        names = self.ready.mechanism.joint_names
        for joint, components in self.withheld.items():
            values[:, names.index(joint), [COMPONENTS.index(c) for c in components]] = np.nan
        return {name: dict(zip(COMPONENTS, values[:, k].T, strict=True)) for k, name in enumerate(names)}

    @property
    def withheld(self) -> Mapping[str, tuple[str, ...]]:
        """Components of joints' reactions that are not determined: constraints do not say where their forces act."""
        return {name: each.components for name, each in self.ready.mechanism.withheld.items()}

    @property
    def withheld_reasons(self) -> list[str]:
        """Why reactions are withheld, and what to declare instead."""
        return reasons(self.ready.mechanism.withheld)

    def table(self, units: str | Sequence[str] | Units | None = None) -> Table:
        """Return time, coordinates, speeds and outputs as columns, with the units that are known.

        They are SI but for those chosen, such as `units="mm,deg"`. Raises InputError for what is no unit.
        """
        columns = {"t": self.t, **self.coordinates, **self.speeds}
        known = {name: self.units[name] for name in columns if name != "t"}
        for name, values in self.outputs.items():
            column = f"output {name}" if name in columns else name
            columns[column], known[column] = values, self.output_units[name]
        known = {"t": "s", **{name: unit for name, unit in known.items() if unit}}
        about = {"system": self.ready.mechanism.name, "formalism": self.ready.formalism}
        try:
            return Table(columns, known, about).told_in(chosen_units(units))
        except ValueError as problem:
            raise ModelError(f"the outputs cannot be columns of a table: {problem}") from None

    # --- evaluated over all samples -------------------------------------------------------------------------------

    @cached_property
    def _arguments(self) -> tuple[Floats, ...]:
        """What every Program takes: t, q, u, parameters, inputs, modes."""
        given = (self.t, self.q, self.u, self.parameters)
        if len(self.t) == 0:
            return (*given, np.empty((0, len(self.ready.mechanism.inputs))), np.empty(0))
        (inputs,) = self.ready.compiled.map("inputs", *given)
        return (*given, inputs, np.empty(0))

    @cached_property
    def _derivative(self) -> tuple[Floats, ...]:
        return self._evaluated("state_derivative")

    @cached_property
    def _energies(self) -> tuple[Floats, ...]:
        return self._evaluated("energy")

    @cached_property
    def tensions(self) -> Mapping[str, Floats]:
        """The tension of each rope (m,) by name; negative where it would have to push."""
        rows = self.ready.mechanism.rows
        ropes = {row.name: k for k, row in enumerate(rows) if isinstance(row, RopeRow)}
        if not ropes:
            return {}
        multipliers = self._derivative[2]
        return {name: multipliers[:, k] for name, k in ropes.items()}

    def _evaluated(self, name: str) -> tuple[Floats, ...]:
        return self.ready.compiled.map(name, *self._arguments)


def reaction_program(mechanism: Mechanism, backend: Backend | None) -> Compiled:
    """Return `reactions`: (t, q, u, parameters, inputs, modes, udot (nu), multipliers (ns)) -> values (joints, 6).

    The joints are those of the tree, then the cut ones (`Mechanism.joint_names`).
    """
    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    trace = Trace("reactions", (*arrays(mechanism), *unknown))
    motion = motion_of(mechanism, slot_state(mechanism))
    found = reactions(motion, trace["udot"], row_motions(motion), trace["multipliers"])
    names = mechanism.joint_names
    values = [found[name][component] for name in names for component in COMPONENTS]
    program = trace.finish({"values": ((len(names), len(COMPONENTS)), values)})
    return load({"reactions": program}, backend=backend)
