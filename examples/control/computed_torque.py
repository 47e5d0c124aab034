"""Computed torque: an arm follows a path, although its motors know its masses only to a tenth.

The controller asks inverse dynamics of its own model, the arm moves by another. Run it:
`python examples/control/computed_torque.py`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import multibody_sym as mbs

Floats = NDArray[np.float64]
KP, KD = 400.0, 40.0  # 1/s^2, 1/s: errors die down with exp(-20 t)


def arm() -> mbs.System:
    """Return two rods with a torque in each of their hinges."""
    m = mbs.parameters("m", [1.0], positive=True)[0]
    tau = [mbs.variable("tau0"), mbs.variable("tau1")]
    return mbs.System(
        "arm",
        gravity=[0, -9.81, 0],
        bodies={
            "upper": mbs.Body(shape={"rod": 0.5, "mass": m}, points={"end": [0.5, 0, 0]}),
            "lower": mbs.Body(shape={"rod": 0.4, "mass": m / 2}),
        },
        joints={
            "shoulder": mbs.Revolute("ground", "upper", q="q0"),
            "elbow": mbs.Revolute("upper.end", "lower", q="q1"),
        },
        forces={f"motor{k}": mbs.Torque(tau[k], joint=joint) for k, joint in enumerate(("shoulder", "elbow"))},
        inputs={"tau0": 0, "tau1": 0},
    )


def path(t: float) -> tuple[Floats, Floats, Floats]:
    """Return the angles to follow, their rates and accelerations."""
    a, w = np.array([0.8, -0.5]), np.array([2.0, 3.0])
    return a * np.sin(w * t), a * w * np.cos(w * t), -a * w**2 * np.sin(w * t)


def largest_error(mass: float, t_end: float = 3.0) -> float:
    """Return the largest error (rad) in the last second, where the arm has this mass and its model 1 kg."""
    system = arm()
    model, motion = mbs.function(system, "inverse_dynamics"), mbs.function(system, "state_derivative")

    def rhs(t: float, x: Floats) -> Floats:
        q, u = x[:2].copy(), x[2:].copy()
        wanted, rates, accelerations = path(t)
        torques = model(t, q, u, accelerations + KD * (rates - u) + KP * (wanted - q))
        found = motion(t, q, u, inputs=torques, parameters={"m": mass})
        return np.concatenate([found.qdot, found.udot])

    start = np.concatenate([path(0.0)[0] + 0.2, path(0.0)[1]])
    run = solve_ivp(rhs, (0.0, t_end), start, rtol=1e-8, atol=1e-10, t_eval=np.linspace(t_end - 1.0, t_end, 101))
    wanted = np.array([path(t)[0] for t in run.t]).T
    return float(np.abs(run.y[:2] - wanted).max())


if __name__ == "__main__":
    for mass in (1.0, 1.1):
        print(f"mass {mass} kg, of which the model knows 1 kg: error {largest_error(mass):.1e} rad")
