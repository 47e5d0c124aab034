"""Rutherford's experiment: the twin of scattering.yaml in Python."""

import multibody_sym as mbs

(m,) = mbs.parameters("m", [1], positive=True)
K, v, b, far = mbs.parameters("K v b far", [1, "1.5", "0.8", 200])

system = mbs.System(
    "scattering",
    description="Rutherford's experiment: a charge flies past a heavy one of the same sign and leaves at an angle.",
    bodies={"alpha": mbs.Body(mass=m)},
    joints={
        "flight": mbs.PointJoint("ground", "alpha", q=["x", "y"], initial={"q": [-far, b], "u": [v, 0]}),
    },
    forces={"nucleus": mbs.Coulomb(["ground", "alpha"], charges=[1, K], constant=1)},
    outputs={"angle": "atan2(u_y, u_x)", "deflection": 2 * mbs.atan(K / (m * v**2 * b)), "energy": "total_energy()"},
    simulation={"t_end": 280, "rtol": 1e-10, "atol": 1e-11},
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    print(f"it leaves at {run['angle'][-1]:.4f} rad; Rutherford's formula: {run['deflection'][-1]:.4f} rad")
