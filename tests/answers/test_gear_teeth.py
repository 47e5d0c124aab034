"""Gears with radii: the force acts at the pitch point, and every bearing is that of the bodies cut free by hand."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.motion import motion_of, state_of
from multibody_sym.mechanics.points import generalized_forces
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.row_kinematics import row_motions

Floats = np.ndarray[Any, Any]
G = 9.81
UP = np.array([0.0, 1.0])


def moment(arm: Floats, force: Floats) -> float:
    return float(arm[0] * force[1] - arm[1] * force[0])


def turned(v: Floats) -> Floats:
    """Return z x v."""
    return np.array([-v[1], v[0]])


def in_plane(found: mbs.Solution, joint: str) -> Floats:
    return np.array([found.reactions[joint][c].value for c in ("fx", "fy", "mz")], dtype=float)


def file(name: str, bodies: str, joints: str, rest: str) -> str:
    head = f"multibody_sym: 1\nname: {name}\ngravity: [0, -{G}, 0]\n"
    return f"{head}bodies:\n{bodies}\njoints:\n{joints}\n{rest}\n"


def wheel(name: str, mass: float, inertia: float) -> str:
    return f"  {name}: {{mass: {mass}, inertia: {{Izz: {inertia}}}}}\n"


# --- wheels in a row -------------------------------------------------------------------------------------------------

RADII, MASSES, INERTIAS = [0.1, 0.25, 0.15], [2.0, 7.0, 3.0], [0.02, 0.3, 0.05]
DRIVES = [5.0, 0.0, -1.5]


def train(angles: list[float], more: str = "") -> str:
    """Return wheels that touch outside one after the other, from each to the next at an angle; torques drive them."""
    places = [np.zeros(2)]
    for k, angle in enumerate(angles):
        places.append(places[-1] + (RADII[k] + RADII[k + 1]) * np.array([np.cos(angle), np.sin(angle)]))
    points = ", ".join(f"p{k}: [{x!r}, {y!r}, 0]" for k, (x, y) in enumerate(np.array(places).tolist()))
    count = len(places)
    bodies = f"  ground: {{points: {{{points}}}}}\n"
    bodies += "".join(wheel(f"w{k}", MASSES[k], INERTIAS[k]) for k in range(count))
    joints = "".join(f"  J{k}: {{type: revolute, parent: ground.p{k}, child: w{k}}}\n" for k in range(count))
    gears = "".join(
        f"  g{k}: {{type: gear, joints: [J{k}, J{k + 1}], ratio: {-RADII[k + 1] / RADII[k]!r}, "
        f"radii: [{RADII[k]}, {RADII[k + 1]}]}}\n"
        for k in range(count - 1)
    )
    drives = "".join(f"  d{k}: {{type: torque, on: w{k}, value: [0, 0, {DRIVES[k]}]}}\n" for k in range(count))
    return file("train", bodies, joints, f"constraints:\n{gears}forces:\n{drives}{more}")


def train_by_hand(angles: list[float]) -> tuple[Floats, Floats]:
    """Return angular accelerations (n) and bearing forces (n x 2): J a = M + sum of r x T, B + T - m g = 0.

    Unknowns: n accelerations and n - 1 tooth forces T_k on wheel k along z x d_k, d_k the way to the next wheel.
    """
    n = len(angles) + 1
    ways = [np.array([np.cos(angle), np.sin(angle)]) for angle in angles]
    matrix, right = np.zeros((2 * n - 1, 2 * n - 1)), np.zeros(2 * n - 1)
    for k in range(n):
        matrix[k, k], right[k] = INERTIAS[k], DRIVES[k]
    for k, way in enumerate(ways):
        tooth = turned(way)
        matrix[k, n + k] -= moment(RADII[k] * way, tooth)
        matrix[k + 1, n + k] -= moment(-RADII[k + 1] * way, -tooth)
        matrix[n + k, [k, k + 1]] = RADII[k], RADII[k + 1]
    found = np.linalg.solve(matrix, right)
    bearings = np.array([MASSES[k] * G * UP for k in range(n)])
    for k, way in enumerate(ways):
        bearings[k] -= found[n + k] * turned(way)
        bearings[k + 1] += found[n + k] * turned(way)
    return found[:n], bearings


@pytest.mark.parametrize("angles", [[0.0], [2.1], [0.4, -1.3], [np.pi / 2, np.pi / 2]])
def test_bearings_of_a_train_are_those_of_wheels_cut_free(angles: list[float]) -> None:
    found = mbs.solve(mbs.loads(train(angles)))
    turning, bearings = train_by_hand(angles)
    assert found.withheld == {}
    size = np.abs(bearings).max()
    for k, (acceleration, bearing) in enumerate(zip(turning, bearings, strict=True)):
        assert found.accelerations[f"J{k}"].value == pytest.approx(acceleration, rel=1e-12)
        np.testing.assert_allclose(in_plane(found, f"J{k}"), [*bearing, 0.0], rtol=1e-12, atol=1e-12 * size)
    first = INERTIAS[0] * turning[0] - DRIVES[0]
    assert found.reactions["g0"]["multiplier"].value == pytest.approx(first, rel=1e-12), "the moment on the first"


def test_absolute_coordinates_find_the_same_bearings() -> None:
    system = mbs.loads(train([0.4, -1.3], "simulation: {coordinates: absolute}\n"))
    run = mbs.simulate(system, t_end=0.05, samples=3, rtol=1e-10, atol=1e-12, backend="python")
    turning, bearings = train_by_hand([0.4, -1.3])
    for k, bearing in enumerate(bearings):
        found = [run.reactions[f"J{k}"][c] for c in ("fx", "fy", "mz")]
        np.testing.assert_allclose(np.transpose(found), [[*bearing, 0.0]] * 3, atol=1e-8)
    assert run["J0"][-1] == pytest.approx(turning[0] * 0.05**2 / 2, rel=1e-8)


# --- a planetary gear ------------------------------------------------------------------------------------------------

SUN, PLANET = 0.1, 0.06
RING, ARM = SUN + 2 * PLANET, SUN + PLANET
MASS = {"arm": 1.5, "sun": 2.0, "planet": 0.8}
INERTIA = {"arm": 0.04, "sun": 0.015, "planet": 0.0014}


def planetary(angle: float, speed: float, joints: str = "") -> str:
    """Return a sun driven by 4 N m, a planet on an arm, and a ring that is ground; the arm starts at an angle."""
    bodies = f"  arm: {{mass: {MASS['arm']}, com: [{ARM / 2}, 0, 0], inertia: {{Izz: {INERTIA['arm']}}},"
    bodies += f" points: {{pin: [{ARM!r}, 0, 0]}}}}\n"
    bodies += wheel("sun", MASS["sun"], INERTIA["sun"]) + wheel("planet", MASS["planet"], INERTIA["planet"])
    joints = joints or (
        f"  A: {{type: revolute, parent: ground, child: arm, initial: {{q: {angle}, u: {speed}, known: true}}}}\n"
        "  S: {type: revolute, parent: arm, child: sun}\n"
        "  P: {type: revolute, parent: arm.pin, child: planet}\n"
    )
    gears = f"  inner: {{type: gear, joints: [S, P], ratio: {-PLANET / SUN!r}, radii: [{SUN}, {PLANET}]}}\n"
    gears += f"  outer: {{type: gear, joints: [P, A], ratio: {-RING / PLANET!r}, radii: [{PLANET}, {RING!r}], "
    gears += f"value: {RING / PLANET * angle!r}}}\n"
    return file("planetary", bodies, joints, f"constraints:\n{gears}forces: {{d: {{type: torque, on: sun, "
                "value: [0, 0, 4]}}")  # fmt: skip


def planetary_by_hand(angle: float, speed: float) -> dict[str, Floats]:
    """Return the bearing forces: nine equations for A, S, P (on arm, sun, planet), both tooth forces and the arm's a.

    The planet rolls in the ring: w_P = w - w R/r; the sun's rim moves with it: w_S = w + w R/s.
    """
    d = np.array([np.cos(angle), np.sin(angle)])
    tooth = turned(d)
    of_planet, of_sun = 1 - RING / PLANET, 1 + RING / SUN
    names = ["Ax", "Ay", "Sx", "Sy", "Px", "Py", "inner", "outer", "a"]
    column = {name: k for k, name in enumerate(names)}
    rows: list[Floats] = []
    right: list[float] = []

    def balance(mass: float, inertia: float, place: float, spin: float, acting: list[Any], driven: float) -> None:
        """Add m a_C = F and J a = M about the centre of mass, `place` along d; acting: (name, sign, direction, arm)."""
        of_force, of_moment = np.zeros((2, 9)), np.zeros(9)
        of_force[:, column["a"]], of_moment[column["a"]] = mass * place * tooth, inertia * spin
        for name, sign, direction, where in acting:
            of_force[:, column[name]] -= sign * direction
            of_moment[column[name]] -= sign * moment((where - place) * d, direction)
        weight = -mass * G * UP + mass * place * speed**2 * d
        rows.extend([*of_force, of_moment])
        right.extend([*weight, driven])

    x, y = np.array([1.0, 0.0]), UP
    balance(MASS["sun"], INERTIA["sun"], 0.0, of_sun, [("Sx", 1, x, 0), ("Sy", 1, y, 0), ("inner", 1, tooth, SUN)], 4.0)
    on_planet = [("Px", 1, x, ARM), ("Py", 1, y, ARM), ("inner", -1, tooth, SUN), ("outer", 1, tooth, RING)]
    balance(MASS["planet"], INERTIA["planet"], ARM, of_planet, on_planet, 0.0)
    on_arm = [("Ax", 1, x, 0), ("Ay", 1, y, 0), ("Sx", -1, x, 0), ("Sy", -1, y, 0), ("Px", -1, x, ARM)]
    balance(MASS["arm"], INERTIA["arm"], ARM / 2, 1.0, [*on_arm, ("Py", -1, y, ARM)], 0.0)
    found = dict(zip(names, np.linalg.solve(np.array(rows), np.array(right)), strict=True))
    return {**{j: np.array([found[f"{j}x"], found[f"{j}y"]]) for j in "ASP"}, "a": np.array(found["a"])}


@pytest.mark.parametrize(("angle", "speed"), [(0.0, 0.0), (0.7, 3.0), (2.5, -8.0)])
def test_bearings_of_a_planetary_gear_are_those_of_bodies_cut_free(angle: float, speed: float) -> None:
    found = mbs.solve(mbs.loads(planetary(angle, speed)))
    by_hand = planetary_by_hand(angle, speed)
    assert found.accelerations["A"].value == pytest.approx(by_hand["a"], rel=1e-11)
    size = max(np.abs(by_hand[joint]).max() for joint in "ASP")
    in_arm = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    for joint in "ASP":
        force = by_hand[joint] if joint == "A" else in_arm @ by_hand[joint]
        np.testing.assert_allclose(in_plane(found, joint), [*force, 0.0], atol=1e-12 * size)


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_a_run_tells_the_same_bearings(coordinates: str) -> None:
    text = planetary(0.7, 3.0) + f"simulation: {{coordinates: {coordinates}}}\n"
    run = mbs.simulate(mbs.loads(text), t_end=0.2, samples=3, rtol=1e-11, atol=1e-12, backend="python")
    for k in range(3):
        angle, speed = float(run["A"][k]), float(run["u_A"][k])
        by_hand = planetary_by_hand(angle, speed)
        in_arm = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        for joint in "ASP":
            force = by_hand[joint] if joint == "A" else in_arm @ by_hand[joint]
            found = [run.reactions[joint][c][k] for c in ("fx", "fy", "mz")]
            np.testing.assert_allclose(found, [*force, 0.0], atol=1e-9 * np.abs(by_hand["A"]).max())


# --- bevel wheels ----------------------------------------------------------------------------------------------------


def bevel(second: Floats, ratio: float, at: str = "") -> str:
    """Return a wheel about z at height 0.2 and one about `second`, both axes through the origin."""
    places = f"{{a: [0, 0, 0.2], b: {(0.1 * second).tolist()}, near: [0.01, 0, 0.02]}}"
    inertias = "mass: {m}, inertia: {{Ixx: 0.02, Iyy: 0.02, Izz: {J}}}"
    frame = f"{{position: {(0.1 * second).tolist()}}}"
    bodies = f"  ground: {{points: {places}, frames: {{f: {frame}}}}}\n"
    bodies += f"  one: {{{inertias.format(m=2, J=0.03)}}}\n  two: {{mass: 3, inertia: {{Ixx: 1, Iyy: 1, Izz: 1}}}}\n"
    joints = "  A: {type: revolute, parent: ground.a, child: one, axis: z}\n"
    joints += f"  B: {{type: revolute, parent: ground.b, child: two, axis: {second.tolist()}}}\n"
    gears = f"  g: {{type: gear, joints: [A, B], ratio: {ratio}, radii: [0.1, 0.2]{at}}}\n"
    return file("bevel", bodies, joints, f"constraints:\n{gears}forces: {{d: {{type: torque, on: one, "
                "value: [0, 0, 5]}}")  # fmt: skip


@pytest.mark.parametrize("tilt", [90.0, 60.0, 130.0])
def test_bearings_of_bevel_wheels_are_those_of_wheels_cut_free(tilt: float) -> None:
    """P = (r2 z + r1 b)/sin(tilt) turns wheel 1 by w1 z x P = w1 r1 e and wheel 2 by w2 b x P = -w2 r2 e."""
    z, angle = np.array([0.0, 0.0, 1.0]), np.radians(tilt)
    b = np.array([np.sin(angle), 0.0, np.cos(angle)])
    e = np.cross(z, b) / np.sin(angle)
    place = (0.2 * z + 0.1 * b) / np.sin(angle)
    found = mbs.solve(mbs.loads(bevel(b, -2.0)))
    a2 = -5 / (2 * 0.03 + 0.1 / 0.2)  # 0.03 a1 = 5 + 0.1 T, 1 a2 = 0.2 T (moments about the axes), a1 = -2 a2
    tooth = a2 / 0.2 * e
    assert found.accelerations["B"].value == pytest.approx(a2, rel=1e-12)
    weights = {"A": np.array([0, 2 * G, 0]), "B": np.array([0, 3 * G, 0])}
    for joint, sign, centre, axis in (("A", 1, 0.2 * z, z), ("B", -1, 0.1 * b, b)):
        arm = np.cross(place - centre, sign * tooth)
        wanted = [*(weights[joint] - sign * tooth), *(-(arm - (arm @ axis) * axis))]
        values = [value.value for value in found.reactions[joint].values()]
        np.testing.assert_allclose(np.array(values, dtype=float), wanted, atol=1e-11)
    assert found.withheld == {}


# --- loops -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "joint", "carried"),
    [
        (train([0.4, -1.3]), "J1: {type: revolute, parent: ground.p1, child: w1", "parent: ground.p1, child: w1"),
        (planetary(0.7, 3.0), "A: {type: revolute, parent: ground, child: arm", "parent: ground, child: arm"),
        (planetary(0.7, 3.0), "S: {type: revolute, parent: arm, child: sun", "parent: arm, child: sun"),
    ],
)
def test_joints_that_are_cut_have_the_same_reactions(text: str, joint: str, carried: str) -> None:
    """A planar joint beside a bearing carries nothing; the bearing is cut then, and rows stand for it."""
    assert joint in text
    planar = f"joints:\n  L: {{type: planar, {carried}}}\n"
    loop = text.replace(joint, f"{joint}, cut: true").replace("joints:\n", planar)
    found, wanted = mbs.solve(mbs.loads(loop)), mbs.solve(mbs.loads(text))
    for name, components in wanted.reactions.items():
        for component in {"fx", "fy", "mz", "multiplier"} & set(components):
            value = found.reactions[name][component].value
            assert value == pytest.approx(components[component].value, rel=1e-10, abs=1e-10), (name, component)
    assert all(abs(found.reactions["L"][component].value or 0.0) < 1e-10 for component in ("fx", "fy", "mz"))
    assert mbs.check(mbs.loads(loop)).agrees


# --- geometry --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("outside", "carried", "flipped"), list(product([1, -1], ["plate", "one", "two"], [1, -1])))
def test_the_tooth_does_the_power_that_the_ratio_says(outside: int, carried: str, flipped: int) -> None:
    """Wheels inside and outside each other, axes opposite to each other, carried by or carrying what they turn on."""
    radii = [0.3, 0.1]
    apart = radii[0] + outside * radii[1]
    ratio = -outside * flipped * radii[1] / radii[0] * (1 if carried == "plate" else -1)
    ends = {"one": "parent: plate.a, child: one", "two": "parent: plate.b, child: two"}
    if carried != "plate":
        point = {"one": "a", "two": "b"}[carried]
        ends[carried] = f"parent: {carried}, child: plate.{point}"
    joints = f"  F: {{type: free, parent: ground, child: {carried}}}\n"
    joints += f"  A: {{type: revolute, {ends['one']}, axis: z}}\n"
    joints += f"  B: {{type: revolute, {ends['two']}, axis: {'z' if flipped > 0 else '-z'}}}\n"
    plate = f"{{mass: 1, inertia: {{Ixx: 1, Iyy: 1, Izz: 1}}, points: {{a: [0.1, 0, 0], b: [0.1, {apart}, 0]}}}}"
    others = "".join(f"  {name}: {{mass: 1, inertia: {{Ixx: 1, Iyy: 1, Izz: 1}}}}\n" for name in ("one", "two"))
    gears = f"constraints: {{g: {{type: gear, joints: [A, B], ratio: {ratio}, radii: {radii}}}}}"
    verify_power(file("plate", f"  plate: {plate}\n{others}", joints, gears))


@pytest.mark.parametrize("ratio", [2.0, -2.0])
@pytest.mark.parametrize("at", ["", ", at: ground.near"])
def test_bevel_teeth_do_the_power_that_the_ratio_says(ratio: float, at: str) -> None:
    verify_power(bevel(np.array([0.6, 0.0, 0.8]), ratio, at))


def test_bevel_wheels_in_absolute_coordinates() -> None:
    text = bevel(np.array([0.6, 0.0, 0.8]), -2.0)
    one, two = (
        mbs.simulate(mbs.loads(f"{text}simulation: {{coordinates: {c}}}\n"), t_end=0.1, samples=3, backend="python")
        for c in ("relative", "absolute")
    )
    for joint, components in one.reactions.items():
        for component, values in components.items():
            np.testing.assert_allclose(two.reactions[joint][component], values, atol=1e-6)


def verify_power(text: str) -> None:
    """Compare the generalised forces of the tooth with the row, at a state with random speeds."""
    resolved = mechanism(mbs.loads(text))
    begin = start(resolved)
    rng = np.random.default_rng(4)
    q = (np.array(begin.q) + rng.normal(size=len(begin.q))).tolist()
    state = state_of(resolved, float, 0.0, q, rng.normal(size=len(begin.u)).tolist(), begin.parameters)
    motion = motion_of(resolved, state)
    (row,) = row_motions(motion)
    np.testing.assert_allclose(generalized_forces(motion, row.of_body), row.jacobian, atol=1e-13)


PAIR = """\
multibody_sym: 1
name: pair
parameters: {r: 0.1, s: 0.2, d: 0.3}
bodies:
  ground:
    points: {p: [d, 0, 0], high: [d, 0, 1]}
    frames: {skew: {position: [d, 0, 0], rotate: [{axis: x, angle: 1}]}}
  box: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
  a: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
  b: {mass: 1, inertia: {Ixx: 1, Iyy: 1, Izz: 1}}
joints:
  X: {type: free, parent: ground, child: box}
  A: {type: revolute, parent: ground, child: a, axis: z}
  B: {type: revolute, parent: ground.p, child: b, axis: z}
constraints:
  g: {type: gear, joints: [A, B], ratio: -s/r, radii: [r, s]}
"""


def test_a_point_tells_the_plane_of_the_wheels() -> None:
    text = PAIR.replace("ground.p, child: b", "ground.high, child: b").replace("[r, s]", "[r, s], at: ground.p")
    system = mbs.loads(text)
    assert mbs.loads(mbs.dumps(system)) == system
    assert mbs.Gear(["A", "B"], "-s/r", radii=["r", "s"], at="ground.p") == system.constraints["g"]
    verify_power(text)
