"""Problems of small oscillations as model files, with the formulas that books print."""

from __future__ import annotations

from typing import NamedTuple


class Problem(NamedTuple):
    """A model file's content, and the printed omega by its number; `signs` of what must be positive for the formulas.

    `given`: parameters with their sample values, all positive; `range`: those that random sets draw from elsewhere than
    0.5 .. 2 times the sample.
    """

    name: str
    given: str
    model: str
    printed: dict[int, str]
    signs: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The model file."""
        pairs = (word.split("=") for word in self.given.split())
        parameters = "".join(f"  {name}: {{value: {value}, positive: true}}\n" for name, value in pairs)
        return f"multibody_sym: 1\nname: {self.name}\nparameters:\n{parameters}{self.model.lstrip()}"

    @property
    def values(self) -> dict[str, float]:
        """The sample values of the parameters."""
        return {name: float(value) for name, value in (word.split("=") for word in self.given.split())}


DOWN = "gravity: [0, -g, 0]\n"
SINK = "gravity: [0, 0, -g]\n"


def sliders(*masses: str) -> str:
    """Return bodies a, b, .. that slide along x, by their masses."""
    names = "abcdefgh"[: len(masses)]
    bodies = "".join(f"  {n}: {{mass: {m}}}\n" for n, m in zip(names, masses, strict=True))
    joints = "".join(
        f"  {n.upper()}: {{type: prismatic, parent: ground, child: {n}, axis: x, q: x{k}}}\n"
        for k, n in enumerate(names, 1)
    )
    return f"bodies:\n{bodies}joints:\n{joints}"


def rotors(*inertias: str) -> str:
    """Return discs a, b, .. that turn about x, by their moments of inertia."""
    names = "abcdefgh"[: len(inertias)]
    bodies = "".join(f"  {n}: {{mass: 1, inertia: {{Ixx: {J}}}}}\n" for n, J in zip(names, inertias, strict=True))
    joints = "".join(
        f"  {n.upper()}: {{type: revolute, parent: ground, child: {n}, axis: x, q: phi{k}}}\n"
        for k, n in enumerate(names, 1)
    )
    return f"bodies:\n{bodies}joints:\n{joints}"


def springs(*pairs: tuple[str, str]) -> str:
    """Return springs: (place, stiffness), the place a joint or `a-b` for two bodies."""
    lines = []
    for k, (place, stiffness) in enumerate(pairs):
        first, _, second = place.partition("-")
        where = f"between: [{first}, {second}]" if second else f"joint: {first}"
        lines.append(f"  s{k}: {{type: spring_damper, {where}, stiffness: {stiffness}}}\n")
    return "forces:\n" + "".join(lines)


def twists(*pairs: tuple[str, str, str]) -> str:
    """Return torsional springs between the angles of two rotors, as forces on both: (a, b, stiffness)."""
    lines = []
    for k, (a, b, c) in enumerate(pairs):
        i, j = "ABCDEFGH".index(a) + 1, "ABCDEFGH".index(b) + 1
        lines.append(f'  p{k}: {{type: torque, joint: {a}, value: "{c}*(phi{j} - phi{i})"}}\n')
        lines.append(f'  m{k}: {{type: torque, joint: {b}, value: "{c}*(phi{i} - phi{j})"}}\n')
    return "forces:\n" + "".join(lines)


CHAINS = [
    Problem("mass_on_a_spring", "k=3 m=2", sliders("m") + springs(("A", "k")), {1: "sqrt(k/m)"}),
    Problem(
        "two_equal_masses_three_springs", "k=3 kc=1 m=2",
        sliders("m", "m") + springs(("A", "k"), ("a-b", "kc"), ("B", "k")),
        {1: "sqrt(k/m)", 2: "sqrt((k + 2*kc)/m)"},
    ),
    Problem(
        "two_free_masses", "k=3 m1=2 m2=1", sliders("m1", "m2") + springs(("a-b", "k")),
        {1: "sqrt(k*(m1 + m2)/(m1*m2))"},
    ),
    Problem(
        "linear_triatomic_molecule", "k=3 m=1 M=2", sliders("m", "M", "m") + springs(("a-b", "k"), ("b-c", "k")),
        {1: "sqrt(k/m)", 2: "sqrt(k*(2*m + M)/(m*M))"},
    ),
    Problem(
        "three_equal_masses_four_springs", "k=3 m=2",
        sliders("m", "m", "m") + springs(("A", "k"), ("a-b", "k"), ("b-c", "k"), ("C", "k")),
        {1: "sqrt((2 - sqrt(2))*k/m)", 2: "sqrt(2*k/m)", 3: "sqrt((2 + sqrt(2))*k/m)"},
    ),
    Problem(
        "four_equal_masses_five_springs", "k=3 m=2",
        sliders("m", "m", "m", "m") + springs(("A", "k"), ("a-b", "k"), ("b-c", "k"), ("c-d", "k"), ("D", "k")),
        {
            1: "sqrt((3 - sqrt(5))*k/(2*m))", 2: "sqrt((5 - sqrt(5))*k/(2*m))",
            3: "sqrt((3 + sqrt(5))*k/(2*m))", 4: "sqrt((5 + sqrt(5))*k/(2*m))",
        },
    ),
    Problem(
        "two_masses_hung_on_two_springs", "k=3 m=2", sliders("m", "m") + springs(("A", "k"), ("a-b", "k")),
        {1: "sqrt((3 - sqrt(5))*k/(2*m))", 2: "sqrt((3 + sqrt(5))*k/(2*m))"},
    ),
    Problem(
        "two_discs_on_a_free_shaft", "c=3 J1=2 J2=1", rotors("J1", "J2") + twists(("A", "B", "c")),
        {1: "sqrt(c*(J1 + J2)/(J1*J2))"},
    ),
    Problem(
        "three_equal_discs_on_a_shaft", "c=3 J=2", rotors("J", "J", "J") + twists(("A", "B", "c"), ("B", "C", "c")),
        {1: "sqrt(c/J)", 2: "sqrt(3*c/J)"},
    ),
    Problem(
        "geared_shafts", "c=3 J1=2 J2=1 n=3",
        rotors("J1", "J2") + "forces: {s: {type: spring_damper, joint: A, stiffness: c}}\n"
        "constraints: {mesh: {type: gear, joints: [B, A], ratio: -n}}\n",
        {1: "sqrt(c/(J1 + J2*n^2))"},
    ),
    Problem(
        "ring_of_three_beads", "k=3 J=2",
        rotors("J", "J", "J") + twists(("A", "B", "k"), ("B", "C", "k"), ("C", "A", "k")),
        {1: "sqrt(3*k/J)", 2: "sqrt(3*k/J)"},
    ),
    Problem(
        "two_springs_one_behind_the_other", "k1=3 k2=1 m=2",
        sliders("m") + 'forces: {s: {type: spring_damper, joint: A, stiffness: "k1*k2/(k1 + k2)"}}\n',
        {1: "sqrt(k1*k2/(m*(k1 + k2)))"},
    ),
]

PENDULUM = "joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta}}\n"

PENDULUMS = [
    Problem(
        "simple_pendulum", "g=9.81 m=2 l=0.5", DOWN + "bodies: {bob: {mass: m, com: [0, -l, 0]}}\n" + PENDULUM,
        {1: "sqrt(g/l)"},
    ),
    Problem(
        "physical_pendulum", "g=9.81 m=2 s=0.5 J=0.3",
        DOWN + "bodies: {bob: {mass: m, com: [0, -s, 0], inertia: {Izz: J}}}\n" + PENDULUM,
        {1: "sqrt(m*g*s/(J + m*s^2))"},
    ),
    Problem(
        "rod_on_its_end", "g=9.81 m=2 l=0.5",
        DOWN + "bodies: {bob: {mass: m, com: [0, -l/2, 0], inertia: {Izz: m*l^2/12}}}\n" + PENDULUM,
        {1: "sqrt(3*g/(2*l))"},
    ),
    Problem(
        "torsional_pendulum", "c=3 J=2", rotors("J") + springs(("A", "c")), {1: "sqrt(c/J)"},
    ),
    Problem(
        "pendulum_with_a_spring", "g=9.81 m=2 l=0.5 a=0.2 k=30",
        DOWN + "bodies: {ground: {points: {wall: [-1, -a, 0]}}, bob: {mass: m, com: [0, -l, 0], "
        "points: {p: [0, -a, 0]}}}\n" + PENDULUM
        + "forces: {s: {type: spring_damper, between: [bob.p, ground.wall], stiffness: k, length: 1}}\n",
        {1: "sqrt(g/l + k*a^2/(m*l^2))"},
    ),
    Problem(
        "inverted_pendulum_on_a_torsional_spring", "g=9.81 m=2 l=0.5 c=30",
        DOWN + "bodies: {bob: {mass: m, com: [0, l, 0]}}\n" + PENDULUM
        + "forces: {s: {type: spring_damper, joint: hinge, stiffness: c}}\n",
        {1: "sqrt((c - m*g*l)/(m*l^2))"}, ("c - m*g*l",),
    ),
    Problem(
        "pendulum_in_a_lift", "g=9.81 m=2 l=0.5 a=3",
        DOWN + "bodies: {ground: {motion: {y: a*t^2/2}}, bob: {mass: m, com: [0, -l, 0]}}\n" + PENDULUM,
        {1: "sqrt((g + a)/l)"},
    ),
    Problem(
        "pendulum_in_a_braking_waggon", "g=9.81 m=2 l=0.5 a=3",
        DOWN + "bodies: {ground: {motion: {x: a*t^2/2}}, bob: {mass: m, com: [0, -l, 0]}}\n"
        "joints: {hinge: {type: revolute, parent: ground, child: bob, axis: z, q: theta, initial: {q: -atan(a/g)}}}\n",
        {1: "sqrt(sqrt(g^2 + a^2)/l)"},
    ),
    Problem(
        "two_pendulums_and_a_spring", "g=9.81 m=2 l=0.5 a=0.2 k=30 d=1",
        DOWN + "bodies:\n  ground: {points: {p: [0, 0, 0], r: [d, 0, 0]}}\n"
        "  a: {mass: m, com: [0, -l, 0], points: {s: [0, -a, 0]}}\n"
        "  b: {mass: m, com: [0, -l, 0], points: {s: [0, -a, 0]}}\n"
        "joints:\n  A: {type: revolute, parent: ground.p, child: a, axis: z, q: q1}\n"
        "  B: {type: revolute, parent: ground.r, child: b, axis: z, q: q2}\n"
        "forces: {s: {type: spring_damper, between: [a.s, b.s], stiffness: k, length: d}}\n",
        {1: "sqrt(g/l)", 2: "sqrt(g/l + 2*k*a^2/(m*l^2))"},
    ),
    Problem(
        "double_pendulum", "g=9.81 m=2 l=0.5",
        DOWN + "bodies: {a: {mass: m, com: [0, -l, 0], points: {p: [0, -l, 0]}}, b: {mass: m, com: [0, -l, 0]}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: a, axis: z, q: q1}\n"
        "  B: {type: revolute, parent: a.p, child: b, axis: z, q: q2}\n",
        {1: "sqrt((2 - sqrt(2))*g/l)", 2: "sqrt((2 + sqrt(2))*g/l)"},
    ),
    Problem(
        "double_pendulum_of_two_masses", "g=9.81 m1=2 m2=1 l=0.5",
        DOWN + "bodies: {a: {mass: m1, com: [0, -l, 0], points: {p: [0, -l, 0]}}, b: {mass: m2, com: [0, -l, 0]}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: a, axis: z, q: q1}\n"
        "  B: {type: revolute, parent: a.p, child: b, axis: z, q: q2}\n",
        {
            1: "sqrt(g/(m1*l)*(m1 + m2 - sqrt((m1 + m2)*m2)))",
            2: "sqrt(g/(m1*l)*(m1 + m2 + sqrt((m1 + m2)*m2)))",
        },
    ),
    Problem(
        "rod_on_a_string", "g=9.81 m=2 l=0.5",
        DOWN + "bodies: {a: {points: {p: [0, -l, 0]}}, "
        "b: {mass: m, com: [0, -l/2, 0], inertia: {Izz: m*l^2/12}}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: a, axis: z, q: q1}\n"
        "  B: {type: revolute, parent: a.p, child: b, axis: z, q: q2}\n",
        {1: "sqrt((5 - sqrt(19))*g/l)", 2: "sqrt((5 + sqrt(19))*g/l)"},
    ),
    Problem(
        "trolley_with_pendulum", "g=9.81 m=2 M=3 l=0.5",
        DOWN + "bodies: {cart: {mass: M}, bob: {mass: m, com: [0, -l, 0]}}\n"
        "joints:\n  rail: {type: prismatic, parent: ground, child: cart, axis: x, q: x}\n"
        "  hinge: {type: revolute, parent: cart, child: bob, axis: z, q: theta}\n",
        {1: "sqrt(g*(M + m)/(M*l))"},
    ),
    Problem(
        "elastic_pendulum", "g=9.81 m=2 k=200 l=0.5",
        DOWN + "bodies: {arm: {}, bob: {mass: m}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta}\n"
        "  B: {type: prismatic, parent: arm, child: bob, axis: -y, q: r, initial: {q: l + m*g/k}}\n"
        "forces: {s: {type: spring_damper, joint: B, stiffness: k, length: l}}\n",
        {1: "sqrt(g/(l + m*g/k))", 2: "sqrt(k/m)"}, ("k*l - 3*m*g",),
    ),
    Problem(
        "bifilar_pendulum", "g=9.81 m=2 J=0.3 a=0.2 h=0.5",
        SINK + "bodies: {ground: {points: {p: [a, 0, 0], r: [-a, 0, 0]}}, "
        "bar: {mass: m, inertia: {Izz: J}, points: {p: [a, 0, 0], r: [-a, 0, 0]}}}\n"
        "joints: {free: {type: cylindrical, parent: ground, child: bar, axis: z, q: [z, phi], "
        "initial: {q: [-h, 0]}}}\n"
        "constraints: {string: {type: distance, between: [ground.p, bar.p], value: h}}\n",
        {1: "sqrt(m*g*a^2/(J*h))"},
    ),
]

ROLLING = [
    Problem(
        "cylinder_on_a_spring", "k=3 m=2 r=0.3",
        "bodies: {slide: {}, disc: {mass: m, inertia: {Izz: m*r^2/2}}}\n"
        "joints:\n  A: {type: prismatic, parent: ground, child: slide, axis: x, q: x}\n"
        "  B: {type: revolute, parent: slide, child: disc, axis: z, q: phi}\n"
        "constraints: {roll: {type: coupler, joints: {A: 1, B: r}}}\n"
        "forces: {s: {type: spring_damper, joint: A, stiffness: k}}\n",
        {1: "sqrt(2*k/(3*m))"},
    ),
    Problem(
        "disc_in_a_hollow", "g=9.81 m=2 R=1 r=0.3",
        DOWN + "bodies: {arm: {points: {c: [0, -(R - r), 0]}}, disc: {mass: m, inertia: {Izz: m*r^2/2}}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta}\n"
        "  B: {type: revolute, parent: arm.c, child: disc, axis: z, q: phi}\n"
        "constraints: {roll: {type: coupler, joints: {A: R, B: r}}}\n",
        {1: "sqrt(2*g/(3*(R - r)))"}, ("R - 2*r",),
    ),
    Problem(
        "ball_in_a_hollow", "g=9.81 m=2 R=1 r=0.3",
        DOWN + "bodies: {arm: {points: {c: [0, -(R - r), 0]}}, ball: {mass: m, inertia: {Izz: 2*m*r^2/5}}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta}\n"
        "  B: {type: revolute, parent: arm.c, child: ball, axis: z, q: phi}\n"
        "constraints: {roll: {type: coupler, joints: {A: R, B: r}}}\n",
        {1: "sqrt(5*g/(7*(R - r)))"}, ("R - 2*r",),
    ),
    Problem(
        "half_cylinder_that_rocks", "g=9.81 m=2 r=0.3",
        DOWN + "bodies: {slide: {}, half: {mass: m, com: [0, -4*r/(3*pi), 0], "
        "inertia: {Izz: m*r^2*(1/2 - 16/(9*pi^2))}}}\n"
        "joints:\n  A: {type: prismatic, parent: ground, child: slide, axis: x, q: x}\n"
        "  B: {type: revolute, parent: slide, child: half, axis: z, q: phi}\n"
        "constraints: {roll: {type: coupler, joints: {A: 1, B: r}}}\n",
        {1: "sqrt(8*g/((9*pi - 16)*r))"},
    ),
    Problem(
        "rod_that_slides_in_a_hollow", "g=9.81 m=2 R=1 l=0.7",
        DOWN + "bodies: {rod: {mass: m, com: [0, -sqrt(R^2 - l^2/4), 0], inertia: {Izz: m*l^2/12}}}\n"
        "joints: {A: {type: revolute, parent: ground, child: rod, axis: z, q: theta}}\n",
        {1: "sqrt(g*sqrt(R^2 - l^2/4)/(R^2 - l^2/6))"}, ("R - 1.4*l",),
    ),
    Problem(
        "ladder_in_a_hollow", "g=9.81 m=2 R=1 l=0.7",
        DOWN + "bodies: {rod: {mass: m, inertia: {Izz: m*l^2/12}, points: {a: [-l/2, 0, 0], b: [l/2, 0, 0]}}}\n"
        "joints: {free: {type: planar, parent: ground, child: rod, q: [x, y, phi], "
        "initial: {q: [0, -sqrt(R^2 - l^2/4), 0]}}}\n"
        "constraints:\n  left: {type: distance, between: [ground, rod.a], value: R}\n"
        "  right: {type: distance, between: [ground, rod.b], value: R}\n",
        {1: "sqrt(g*sqrt(R^2 - l^2/4)/(R^2 - l^2/6))"}, ("R - 1.4*l",),
    ),
    Problem(
        "board_on_a_cylinder", "g=9.81 m=2 R=1 l=0.7",
        DOWN + "bodies: {arm: {points: {c: [0, R, 0]}}, "
        "board: {mass: m, inertia: {Izz: m*l^2/12}}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: theta}\n"
        "  B: {type: prismatic, parent: arm.c, child: board, axis: x, q: s}\n"
        "constraints: {roll: {type: coupler, joints: {A: -R, B: 1}}}\n",
        {1: "sqrt(12*g*R)/l"},
    ),
]

MIXED = [
    Problem(
        "wedge_with_a_block_on_a_spring", "g=9.81 k=3 m=2 M=3 theta=0.5",
        DOWN + "bodies: {wedge: {mass: M}, block: {mass: m}}\n"
        "joints:\n  A: {type: prismatic, parent: ground, child: wedge, axis: x, q: x}\n"
        "  B: {type: prismatic, parent: wedge, child: block, axis: [cos(theta), sin(theta), 0], q: s}\n"
        "forces: {spring: {type: spring_damper, joint: B, stiffness: k}}\n",
        {1: "sqrt(k*(M + m)/(m*(M + m*sin(theta)^2)))"},
    ),
    Problem(
        "floating_cylinder", "g=9.81 m=2 rho=1000 A=0.01",
        DOWN + "bodies: {buoy: {mass: m}}\n"
        "joints: {P: {type: prismatic, parent: ground, child: buoy, axis: y, q: y}}\n"
        'forces: {lift: {type: force, on: buoy, value: [0, "m*g - rho*g*A*y", 0]}}\n',
        {1: "sqrt(rho*g*A/m)"},
    ),
    Problem(
        "water_in_a_bent_tube", "g=9.81 rho=1000 A=0.01 L=2",
        "bodies: {water: {mass: rho*A*L}}\n"
        "joints: {P: {type: prismatic, parent: ground, child: water, axis: x, q: x}}\n"
        'forces: {weight: {type: force, on: water, value: ["-2*rho*g*A*x", 0, 0]}}\n',
        {1: "sqrt(2*g/L)"},
    ),
    Problem(
        "spring_over_a_pulley", "g=9.81 k=30 m=2 M=3 r=0.2",
        DOWN + "bodies: {wheel: {mass: M, inertia: {Izz: M*r^2/2}}, load: {mass: m}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: wheel, axis: z, q: phi}\n"
        "  B: {type: prismatic, parent: ground, child: load, axis: -y, q: y}\n"
        "constraints: {rope: {type: coupler, joints: {A: r, B: -1}}}\n"
        "forces: {s: {type: spring_damper, joint: A, stiffness: k*r^2}}\n",
        {1: "sqrt(2*k/(2*m + M))"},
    ),
    Problem(
        "movable_pulley_on_a_spring", "g=9.81 k=30 m=2",
        DOWN + "bodies: {load: {mass: m}, end: {}}\n"
        "joints:\n  A: {type: prismatic, parent: ground, child: load, axis: -y, q: y}\n"
        "  B: {type: prismatic, parent: ground, child: end, axis: -y, q: s}\n"
        "constraints: {rope: {type: coupler, joints: {A: 2, B: -1}}}\n"
        "forces: {s: {type: spring_damper, joint: B, stiffness: k}}\n",
        {1: "2*sqrt(k/m)"},
    ),
    Problem(
        "rod_on_two_springs", "g=9.81 k=30 m=2 l=0.7",
        "bodies: {rod: {mass: m, inertia: {Izz: m*l^2/12}}}\n"
        "joints: {free: {type: planar, parent: ground, child: rod, q: [x, y, phi]}}\n"
        "forces:\n"
        '  sy: {type: spring_damper, joint: free, freedom: y, stiffness: 2*k}\n'
        '  sp: {type: spring_damper, joint: free, freedom: phi, stiffness: k*l^2/2}\n',
        {1: "sqrt(2*k/m)", 2: "sqrt(6*k/m)"},
    ),
    Problem(
        "bead_on_a_stretched_string", "T=30 m=2 l=0.7",
        "bodies: {ground: {points: {p: [-l/2, 0, 0], r: [l/2, 0, 0]}}, bead: {mass: m}}\n"
        "joints: {P: {type: prismatic, parent: ground, child: bead, axis: y, q: y}}\n"
        "forces:\n  a: {type: pull, between: [bead, ground.p], value: T}\n"
        "  b: {type: pull, between: [bead, ground.r], value: T}\n",
        {1: "2*sqrt(T/(m*l))"},
    ),
    Problem(
        "damped_oscillator", "k=30 m=2 c=3",
        sliders("m") + "forces: {s: {type: spring_damper, joint: A, stiffness: k, damping: c}}\n",
        {1: "sqrt(k/m - c^2/(4*m^2))"}, ("4*k*m - c^2",),
    ),
    Problem(
        "rolling_mill_of_unequal_masses", "k=3 m=2 M=5",
        sliders("m", "M") + springs(("A", "k"), ("a-b", "k")),
        {
            1: "sqrt(k*(m + 2*M - sqrt(m^2 + 4*M^2))/(2*m*M))",
            2: "sqrt(k*(m + 2*M + sqrt(m^2 + 4*M^2))/(2*m*M))",
        },
    ),
]

STEADY = [
    Problem(
        "bead_on_a_turning_hoop_below", "g=9.81 m=2 R=0.3 W=4",
        SINK + "bodies: {hoop: {}, bead: {mass: m, com: [0, 0, -R]}}\n"
        "joints:\n  axle: {type: revolute, parent: ground, child: hoop, axis: z, motion: W*t}\n"
        "  slide: {type: revolute, parent: hoop, child: bead, axis: x, q: theta}\n",
        {1: "sqrt(g/R - W^2)"}, ("g - R*W^2",),
    ),
    Problem(
        "bead_on_a_turning_hoop", "g=9.81 m=2 R=0.3 W=8",
        SINK + "bodies: {hoop: {}, bead: {mass: m, com: [0, 0, -R]}}\n"
        "joints:\n  axle: {type: revolute, parent: ground, child: hoop, axis: z, motion: W*t}\n"
        "  slide: {type: revolute, parent: hoop, child: bead, axis: x, q: theta, initial: {q: acos(g/(R*W^2))}}\n",
        {1: "sqrt(W^2 - g^2/(R^2*W^2))"}, ("R*W^2 - 1.01*g",),
    ),
    Problem(
        "conical_pendulum", "g=9.81 m=2 l=0.3 alpha=0.6",
        SINK + "bodies: {arm: {}, bob: {mass: m, com: [0, 0, -l]}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: phi, "
        'initial: {u: "sqrt(g/(l*cos(alpha)))"}}\n'
        "  B: {type: revolute, parent: arm, child: bob, axis: x, q: theta, initial: {q: alpha}}\n",
        {1: "sqrt(g*(1 + 3*cos(alpha)^2)/(l*cos(alpha)))"}, ("1.5 - alpha",),
    ),
    Problem(
        "circular_orbit_of_keplers_force", "k=3 m=2 R=1.5",
        "bodies: {arm: {}, a: {mass: m}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: phi, "
        'initial: {u: "sqrt(k/(m*R^3))"}}\n'
        "  B: {type: prismatic, parent: arm, child: a, axis: x, q: r, initial: {q: R}}\n"
        "forces: {pull: {type: force, on: a, value: [-k/r^2, 0, 0], frame: arm}}\n",
        {1: "sqrt(k/(m*R^3))"},
    ),
    Problem(
        "circular_orbit_on_a_spring", "k=3 m=2 R=1.5",
        "bodies: {arm: {}, a: {mass: m}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: phi, initial: {u: sqrt(k/m)}}\n"
        "  B: {type: prismatic, parent: arm, child: a, axis: x, q: r, initial: {q: R}}\n"
        "forces: {pull: {type: spring_damper, joint: B, stiffness: k}}\n",
        {1: "2*sqrt(k/m)"},
    ),
    Problem(
        "mass_on_a_table_with_a_hanging_one", "g=9.81 m=2 M=3 R=1.5",
        SINK + "bodies: {arm: {}, a: {mass: m}, b: {mass: M}}\n"
        "joints:\n  A: {type: revolute, parent: ground, child: arm, axis: z, q: phi, "
        'initial: {u: "sqrt(M*g/(m*R))"}}\n'
        "  B: {type: prismatic, parent: arm, child: a, axis: x, q: r, initial: {q: R}}\n"
        "  C: {type: prismatic, parent: ground, child: b, axis: z, q: z}\n"
        "constraints: {string: {type: coupler, joints: {B: 1, C: -1}, value: R}}\n",
        {1: "sqrt(3*M*g/((M + m)*R))"},
    ),
    Problem(
        "governor_of_two_balls", "g=9.81 m=2 l=0.5 alpha=0.6",
        SINK + "bodies: {shaft: {}, a: {mass: m, com: [0, 0, -l]}, b: {mass: m, com: [0, 0, -l]}}\n"
        "joints:\n  S: {type: revolute, parent: ground, child: shaft, axis: z, q: phi, "
        'initial: {u: "sqrt(g/(l*cos(alpha)))"}}\n'
        "  A: {type: revolute, parent: shaft, child: a, axis: x, q: theta, initial: {q: alpha}}\n"
        "  B: {type: revolute, parent: shaft, child: b, axis: x, q: psi, initial: {q: -alpha}}\n"
        "constraints: {even: {type: coupler, joints: {A: 1, B: 1}}}\n",
        {1: "sqrt(g*(1 + 3*cos(alpha)^2)/(l*cos(alpha)))"}, ("1.5 - alpha",),
    ),
    Problem(
        "governor_with_a_flywheel", "g=9.81 m=2 l=0.5 J=0.7 alpha=0.6",
        SINK + "bodies: {shaft: {mass: 1, inertia: {Izz: J}}, a: {mass: m, com: [0, 0, -l]}, "
        "b: {mass: m, com: [0, 0, -l]}}\n"
        "joints:\n  S: {type: revolute, parent: ground, child: shaft, axis: z, q: phi, "
        'initial: {u: "sqrt(g/(l*cos(alpha)))"}}\n'
        "  A: {type: revolute, parent: shaft, child: a, axis: x, q: theta, initial: {q: alpha}}\n"
        "  B: {type: revolute, parent: shaft, child: b, axis: x, q: psi, initial: {q: -alpha}}\n"
        "constraints: {even: {type: coupler, joints: {A: 1, B: 1}}}\n",
        {
            1: "sqrt(g*sin(alpha)^2/(l*cos(alpha))*(J + 2*m*l^2*(1 + 3*cos(alpha)^2))"
            "/(J + 2*m*l^2*sin(alpha)^2))"
        },
        ("1.5 - alpha",),
    ),
    Problem(
        "spring_on_a_turning_table", "k=30 m=2 W=2",
        "bodies: {table: {}, slide: {}, a: {mass: m}}\n"
        "joints:\n  T: {type: revolute, parent: ground, child: table, axis: z, motion: W*t}\n"
        "  A: {type: prismatic, parent: table, child: slide, axis: x, q: x}\n"
        "  B: {type: prismatic, parent: slide, child: a, axis: y, q: y}\n"
        + springs(("A", "k"), ("B", "k")),
        {1: "sqrt(k/m) - W", 2: "sqrt(k/m) + W"}, ("k - m*W^2",),
    ),
    Problem(
        "precession_and_nutation_of_a_top", "g=9.81 m=0.3 h=0.04 A=0.0003 C=0.0002 theta=0.5 W=5",
        SINK + "bodies: {r1: {}, r2: {}, top: {mass: m, com: [0, 0, h], inertia: {Ixx: A, Iyy: A, Izz: C}}}\n"
        "joints:\n  P: {type: revolute, parent: ground, child: r1, axis: z, q: psi, initial: {u: W}}\n"
        "  N: {type: revolute, parent: r1, child: r2, axis: x, q: th, initial: {q: theta}}\n"
        "  S: {type: revolute, parent: r2, child: top, axis: z, q: phi, "
        'initial: {u: "m*g*h/(C*W) + (A + m*h^2 - C)*W*cos(theta)/C"}}\n',
        {1: "sqrt(W^2 - 2*m*g*h*cos(theta)/(A + m*h^2) + (m*g*h/((A + m*h^2)*W))^2)"},
    ),
]

PROBLEMS = [*CHAINS, *PENDULUMS, *ROLLING, *MIXED, *STEADY]
