"""Outputs that name work and impulses: integrals of powers and forces from the start of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from multibody_sym.dynamics.programs.quantities import quantities
from multibody_sym.expressions.quantities import QUANTITIES
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.numerics.arrays import Floats
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace
from multibody_sym.records import dataclass
from multibody_sym.runtime.loading import load
from multibody_sym.scalars.functions import evaluate
from multibody_sym.scalars.node import Node, as_node
from multibody_sym.scalars.traversal import leaves
from multibody_sym.simulation.along.fine import FineLeg, integral_until, with_program
from multibody_sym.simulation.parts import Part


@dataclass(frozen=True, eq=False)
class Adding:
    """The expressions of `asked` outputs, and which of their leaves add up."""

    asked: Mapping[str, Node]

    @property
    def leaves(self) -> list[Node]:
        """What adds up: work and impulses."""
        found = dict.fromkeys(leaves(self.asked.values(), "quantity"))
        return [leaf for leaf in found if leaf.data[0] in QUANTITIES and QUANTITIES[leaf.data[0]].of_run]

    def rates(self, mechanism: Mechanism) -> Program:
        """Return (t, q, u, ..., udot (nu), multipliers (ns)) -> values (leaves): powers and forces."""
        trace = _trace("rates", mechanism)
        motion = motion_of(mechanism, slot_state(mechanism))
        found = quantities(motion, trace["udot"], trace["multipliers"], self.leaves)
        return trace.finish({"values": ((len(found),), [as_node(x) for x in found.values()])})

    def outputs(self, mechanism: Mechanism) -> Program:
        """Return (t, q, u, ..., udot (nu), multipliers (ns), sums (leaves)) -> values (asked)."""
        sums = self.leaves
        trace = _trace("run_outputs", mechanism, Array("sums", (len(sums),)))
        others = [leaf for leaf in leaves(self.asked.values(), "quantity") if leaf not in sums]
        motion = motion_of(mechanism, slot_state(mechanism))
        found = quantities(motion, trace["udot"], trace["multipliers"], others)
        known = {**found, **dict(zip(sums, trace["sums"], strict=True))}
        values = evaluate(self.asked.values(), lambda leaf: known.get(leaf, leaf))
        return trace.finish({"values": ((len(values),), [as_node(x) for x in values])})


def _trace(name: str, mechanism: Mechanism, *more: Array) -> Trace:
    unknown = (Array("udot", (len(mechanism.speeds),)), Array("multipliers", (len(mechanism.rows),)))
    return Trace(name, (*arrays(mechanism), *unknown, *more))


def told(
    adding: Adding, stretches: Sequence[FineLeg], parts: Sequence[Part], jumps: Iterable[tuple[float, Floats]] = ()
) -> dict[str, Floats]:
    """Return outputs at the samples of a run's parts (m,), which are in the modes of its stretches.

    `jumps` are the times of impacts, and what each adds to the leaves; a sample at that time comes after it.
    """
    count = len(adding.leaves)
    times = np.concatenate([part.t for part in parts]) if parts else np.zeros(0)
    sums = np.zeros((len(times), count))
    for stretch, program in with_program(stretches, adding.rates):
        for part in stretch.smooth_parts():
            fine = part.fine()
            (values,) = program.map("rates", *fine.arguments, *fine.derivative[1:3])
            within = np.clip(times, fine.t[0], fine.t[-1])
            sums += integral_until(within, values, fine.t)
    for time, more in jumps:
        sums[times >= time] += more
    return _outputs(adding, parts, sums)


def _outputs(adding: Adding, parts: Sequence[Part], sums: Floats) -> dict[str, Floats]:
    found, first = [], 0
    for part in parts:
        own = sums[first : first + len(part.t)]
        first += len(part.t)
        program = load({"run_outputs": adding.outputs(part.mechanism)}, backend=part.compiled.likewise)
        (values,) = program.map("run_outputs", *part.arguments, *part.derivative[1:3], own)
        found.append(values)
    columns = np.concatenate(found) if found else np.zeros((0, len(adding.asked)))
    return dict(zip(adding.asked, columns.T, strict=True))
