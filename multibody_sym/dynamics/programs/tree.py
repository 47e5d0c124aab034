"""Programs of a tree besides its motion: the mass matrix, inverse and hybrid dynamics.

Inputs are t, q, u, parameters, inputs, modes as of every system Program; where accelerations are given, udot follows.
"""

from __future__ import annotations

from collections.abc import Collection

from multibody_sym.dynamics.formalisms.composite_body import mass_matrix
from multibody_sym.dynamics.formalisms.inverse_dynamics import joint_wrenches
from multibody_sym.dynamics.formalisms.massless import massless_speeds
from multibody_sym.dynamics.formalisms.sweep import hybrid_dynamics
from multibody_sym.errors import ModelError, NoSolutionError, at
from multibody_sym.kinematics.loads import applied
from multibody_sym.kinematics.motion import motion_of
from multibody_sym.kinematics.state import arrays, slot_state
from multibody_sym.kinematics.wrenches import joint_projection
from multibody_sym.model.mechanism.mechanism import Mechanism
from multibody_sym.program.program import Program
from multibody_sym.program.statements import Array
from multibody_sym.program.trace import Trace


def mass_matrix_program(mechanism: Mechanism) -> Program:
    """Return -> mass_matrix (nu, nu), that of the tree whatever its rows."""
    trace = Trace("mass_matrix", arrays(mechanism))
    matrix = mass_matrix(motion_of(mechanism, slot_state(mechanism)))
    return trace.finish({"mass_matrix": ((len(matrix), len(matrix)), [x for row in matrix for x in row])})


def inverse_dynamics_program(mechanism: Mechanism) -> Program:
    """Return (.., udot) -> forces (nu): M udot + c - Q, what the accelerations need on top of the loads.

    Raises ModelError where rows restrict the tree: their forces would share the work.
    """
    _verify_tree(mechanism)
    trace = Trace("inverse_dynamics", (*arrays(mechanism), Array("udot", (len(mechanism.speeds),))))
    motion = motion_of(mechanism, slot_state(mechanism))
    loads = applied(motion)
    transmitted = joint_projection(motion, joint_wrenches(motion, trace["udot"], loads.of_body))
    forces = [x - drive for x, drive in zip(transmitted, loads.of_speed, strict=True)]
    return trace.finish({"forces": ((len(forces),), forces)})


def hybrid_dynamics_program(mechanism: Mechanism, given: Collection[str]) -> Program:
    """Return (.., udot) -> udot (nu), forces (nu); `given` names the joints whose udot is read.

    Raises ModelError where rows restrict the tree, NoSolutionError where a free joint moves nothing that has mass.
    """
    _verify_tree(mechanism)
    bodies = [k for k, body in enumerate(mechanism.bodies) if body.joint_name in given]
    held = {k for index in bodies for k in mechanism.bodies[index].u}
    massless = [mechanism.speeds[k] for k in massless_speeds(mechanism) if k not in held]
    if massless:
        raise NoSolutionError(
            f"joint {massless[0].joint!r} moves nothing that has mass; give its acceleration, or the body a mass",
            number="N102",
        )
    trace = Trace("hybrid_dynamics", (*arrays(mechanism), Array("udot", (len(mechanism.speeds),))))
    udot, forces = hybrid_dynamics(motion_of(mechanism, slot_state(mechanism)), bodies, trace["udot"])
    return trace.finish({"udot": ((len(udot),), udot), "forces": ((len(forces),), forces)})


def _verify_tree(mechanism: Mechanism) -> None:
    if mechanism.rows:
        section, name = mechanism.row_path(0)
        what = f"joint {name!r} closes a loop," if section == "joints" else f"{name!r} restricts the joints,"
        with at(section, name):
            raise ModelError(
                f"{what} and its force shares in the work: given accelerations determine the forces of joints only "
                "where nothing else holds them; leave it out (load_urdf(..., mimic=False) leaves out the couplers of "
                "joints that mimic others), or put its force in as a force",
                number="M110",
            )
