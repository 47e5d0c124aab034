"""Chaplygin's sleigh: the twin of chaplygin_sleigh.yaml in Python."""

import multibody_sym as mbs

m, J, a = mbs.parameters("m J a", ["1 kg", "0.1 kg*m^2", "0.2 m"])

system = mbs.System(
    "chaplygin_sleigh",
    description="Chaplygin's sleigh: a body in the plane on a knife edge that cannot slip sideways.",
    bodies={"sleigh": mbs.Body(mass=m, com=[a, 0, 0], inertia={"Izz": J})},
    joints={"table": mbs.Planar("ground", "sleigh", q=["x", "y", "theta"], initial={"u": [-1, 0, 0.1]})},
    constraints={"edge": mbs.VelocityConstraint("-u_x*sin(theta) + u_y*cos(theta)", acts="in_joints")},
    outputs={"side_force": "multiplier(edge)", "energy": "total_energy()"},
    simulation={"t_end": "20 s"},
)

if __name__ == "__main__":
    print(mbs.simulate(system))
