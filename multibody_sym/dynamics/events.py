"""The Program of what may end a step: conditions that stop a run, and kinks of declared forces and inputs."""

from __future__ import annotations

from multibody_sym.dynamics.quantities import Sources, answered
from multibody_sym.kinematics.state import arrays
from multibody_sym.model.mechanism import Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.trace import Trace


def events(mechanism: Mechanism, sources: Sources) -> Program | None:
    """Return (t, q, u, ...) -> values: stops, then kinks; None where there are none.

    A stop's value becomes positive where its condition holds; a kink's value changes its sign.
    """
    asked = [*mechanism.stops.values(), *mechanism.kinks]
    if not asked:
        return None
    trace = Trace("events", arrays(mechanism))
    values = answered(trace, sources, asked)
    return trace.finish({"values": ((len(values),), values)})
