"""Computed torque: a UR5 (`pip install example-robot-data`) follows a path by torques computed 1,000 times a second."""

from importlib.metadata import files

import numpy as np

import multibody_sym as mbs

URDF = next(file.locate() for file in files("example-robot-data") if str(file).endswith("urdf/ur5_robot.urdf"))
KP, KD = 400.0, 40.0  # 1/s^2, 1/s: errors die down with exp(-20 t)
A, W = np.array([0.8, -0.5, 0.6, 0.4, -0.7, 0.3]), np.array([2.0, 1.5, 3.0, 2.5, 1.0, 2.0])


def largest_error(dt: float = 1e-3, t_end: float = 2.0) -> float:
    """Return the largest error (rad) of the last half of the time; the arm begins 0.2 rad beside its path, at rest."""
    robot = mbs.load_urdf(URDF, torques=True)
    model = mbs.function(robot, "inverse_dynamics")
    arm, error = mbs.prepare(robot, method="rk4", step=dt).stepper(dt), 0.0
    arm.reset(initial=dict(zip(arm.coordinates, np.full(6, 0.2), strict=True)))
    while arm.t < t_end:
        off, rates_off = A * np.sin(W * arm.t) - arm.q, A * W * np.cos(W * arm.t) - arm.u
        arm.step(model(arm.t, arm.q, arm.u, -A * W**2 * np.sin(W * arm.t) + KD * rates_off + KP * off))
        error = max(error, np.abs(off).max()) if arm.t > t_end / 2 else 0.0
    return error


if __name__ == "__main__":
    print(f"largest error {largest_error():.1e} rad; with twice as many samples {largest_error(5e-4):.1e} rad")
