"""A wheel without its rim walks down a slope: the twin of rimless_wheel.yaml in Python."""

import multibody_sym as mbs

g, m, l, J, mu, w0 = mbs.parameters(
    "g m l J mu w0", ["9.81 m/s^2", "2 kg", "0.5 m", "0.1 kg*m^2", 0.9, "2 rad/s"], positive=True
)
a, gamma = mbs.parameters("a gamma", ["pi/6", "12 deg"])
face = mbs.Surface(plane=[0, 0, 0], normal=[mbs.sin(gamma), mbs.cos(gamma), 0])
slope = mbs.Frame(rotate=[mbs.Turn(axis="z", angle=-gamma)])
spokes = range(1, 7)
start = mbs.Initial(q=[0, l * mbs.cos(a), 0], u=[w0 * l * mbs.cos(a), w0 * l * mbs.sin(a), -w0])

system = mbs.System(
    "rimless_wheel",
    description=(
        "A wheel without its rim walks down a slope on its six spokes, which neither slip nor rebound. How fast does "
        "it walk at last, and on which slopes does it come to stand?"
    ),
    gravity=[0, -g, 0],
    bodies={
        "ground": mbs.Body(frames={"slope": slope}, surfaces={"face": face}),
        "wheel": mbs.Body(
            mass=m,
            inertia={"Izz": J},
            points={f"p{k}": [l * mbs.sin((2 * k - 1) * a), -l * mbs.cos((2 * k - 1) * a), 0] for k in spokes},
            surfaces={
                name: mbs.Surface(segment=[f"p{k}", f"p{k + 3}"]) for k, name in enumerate(("one", "two", "three"), 1)
            },
        ),
    },
    joints={"free": mbs.Planar("ground.slope", "wheel", q=["s", "n", "phi"], initial=start)},
    contacts={f"foot{k}": mbs.Contact([f"wheel.p{k}", "ground.face"], static=mu) for k in spokes},
    simulation=mbs.Settings(t_end="10 s"),
)

if __name__ == "__main__":
    run = mbs.simulate(system)
    steps = [event["t"] for event in run.events if event["kind"] == "stick"]
    print(f"time of a step = {steps[-1] - steps[-2]:.9f} s")
