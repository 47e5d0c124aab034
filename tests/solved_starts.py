"""What the equations of a mechanism, which may be in a mode, give at its start."""

from __future__ import annotations

from multibody_sym.derivation.routes import FORMALISMS
from multibody_sym.dynamics.formalisms.constrained import forward_dynamics
from multibody_sym.dynamics.programs.quantities import StateQuantities
from multibody_sym.dynamics.start.start import Start
from multibody_sym.mechanics.mechanism import Mechanism
from multibody_sym.mechanics.motion import motion_of, state_of


def solved_start(mechanism: Mechanism, begin: Start, formalism: str = "composite_body") -> StateQuantities:
    """Return the start of a mechanism with its accelerations and multipliers."""
    state = state_of(mechanism, float, 0.0, begin.q, begin.u, begin.parameters)
    found = forward_dynamics(FORMALISMS[formalism](mechanism, state))
    return StateQuantities(motion_of(mechanism, state), found.udot.tolist(), found.multipliers.tolist())
