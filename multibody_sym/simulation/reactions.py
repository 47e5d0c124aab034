"""The reactions of all joints as a compiled Program of the state, the accelerations and the multipliers."""

from __future__ import annotations

from multibody_sym.dynamics.programs.reactions import reactions
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.rows import row_motions
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.model.mechanism import COMPONENTS, Mechanism
from multibody_sym.program.program import Array
from multibody_sym.program.trace import Trace
from multibody_sym.runtime.loading import Backend, Compiled, load


def reaction_program(mechanism: Mechanism, backend: Backend) -> Compiled:
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
