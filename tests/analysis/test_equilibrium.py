"""Equilibrium: positions and their stability known beforehand, by hand or from a potential."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import multibody_sym as mbs
from multibody_sym.analysis import equilibrium_search as search_module
from multibody_sym.dynamics.start.start import start
from multibody_sym.mechanics.resolve import mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"
G = 9.81


def test_double_pendulum_rests_in_four_positions_and_safely_in_one() -> None:
    found = mbs.equilibrium(mbs.load(EXAMPLES / "double_pendulum.yaml"))
    assert Counter(found.stable) == {True: 1, False: 3}
    places = {tuple(round(abs(x) / np.pi) for x in position.values()) for position in found.positions}
    assert places == {(0, 0), (0, 1), (1, 0), (1, 1)}
    for position in found.positions:
        assert np.abs(np.sin(list(position.values()))).max() < 1e-9
    hanging = found.positions[found.stable.index(True)]
    assert list(hanging.values()) == pytest.approx([0, 0], abs=1e-9)


def held_upright(stiffness: float) -> mbs.System:
    return mbs.System(
        "inverted",
        gravity=[0, -G, 0],
        bodies={"bob": mbs.Body(mass=1, com=[0, 1, 0])},
        joints={"hinge": mbs.Revolute("ground", "bob", q="theta", initial={"q": 0.3})},
        forces={"spring": mbs.SpringDamper(stiffness, joint="hinge", damping=0.5)},
    )


def test_a_stiff_spring_holds_a_pendulum_upright() -> None:
    found = mbs.equilibrium(held_upright(20))
    assert found.stable == (True,)
    assert found.positions[0]["theta"] == pytest.approx(0, abs=1e-9)


def test_a_soft_spring_lets_it_lean_to_either_side() -> None:
    """k theta = m g l sin(theta): three positions for k < m g l, the outer ones stable."""
    found = mbs.equilibrium(held_upright(5))
    leaning = brentq(lambda x: 5 * x - G * np.sin(x), 0.5, 3.0, xtol=1e-14)
    stable = {round(p["theta"], 9): s for p, s in zip(found.positions, found.stable, strict=True)}
    assert stable == {0.0: False, round(leaning, 9): True, round(-leaning, 9): True}


def test_four_bar_without_motor_rests_where_its_potential_is_stationary() -> None:
    a, b, c, d = 0.2, 0.5, 0.4, 0.5
    text = (EXAMPLES / "four_bar.yaml").read_text().replace("torque: 0.5 N*m", "torque: 0 N*m")
    found = mbs.equilibrium(mbs.loads(text))

    def potential(crank: float, branch: float) -> float:
        """Return V/(rho g/2), heights weighted by lengths; `branch` +-1: which way the loop is closed."""
        end = a * np.exp(1j * crank)
        reach = end - d
        inside = np.arccos((abs(reach) ** 2 + c**2 - b**2) / (2 * abs(reach) * c))
        tip = d + c * np.exp(1j * (np.angle(reach) - branch * inside))
        return float(a * end.imag + b * (end + tip).imag + c * tip.imag)

    step = 1e-4
    assert {True, False} <= set(found.stable)
    for position, stable in zip(found.positions, found.stable, strict=True):
        crank, rocker = position["crank_angle"], position["rocker_angle"]
        reach = a * np.exp(1j * crank) - d
        branch = -float(np.sign(np.imag(np.exp(1j * rocker) / reach)))
        low, here, high = (potential(crank + k * step, branch) for k in (-1, 0, 1))
        assert abs(high - low) / (2 * step) < 1e-6
        assert stable is bool(high - 2 * here + low > 0)


def test_nothing_to_rest_on_is_told() -> None:
    falling = mbs.System(
        "stone",
        gravity=[0, -G, 0],
        bodies={"stone": mbs.Body(mass=1)},
        joints={"fall": mbs.Prismatic("ground", "stone", axis="y")},
    )
    with pytest.raises(mbs.NoSolutionError, match=r"equilibrium was found: .* alike \(u_fall' = -9\.81 m/s\^2\)"):
        mbs.equilibrium(falling)


def test_a_slider_crank_rests_in_mirror_images_too() -> None:
    """The crank stands up or hangs down, the slider on either side: one stable position on each."""
    found = mbs.equilibrium(mbs.load(EXAMPLES / "slider_crank.yaml"))
    side = [(p["s"] > 0, p["phi"] > 0, s) for p, s in zip(found.positions, found.stable, strict=True)]
    assert sorted(side) == [(False, False, True), (False, True, False), (True, False, True), (True, True, False)]


def test_an_indifferent_position_beside_which_forces_grow_leaves_nothing_free() -> None:
    """V = x^4."""
    found = mbs.equilibrium(
        mbs.System(
            "flat",
            bodies={"bob": mbs.Body(mass=1)},
            joints={"rail": mbs.Prismatic("ground", "bob", axis="x", q="x")},
            forces={"spring": mbs.Force("bob", ["-4*x^3", 0, 0])},
        )
    )
    assert found.stable == (None,)
    assert found.free == ((),)
    assert found.positions[0]["x"] == pytest.approx(0, abs=1e-6)


# --- each position once ----------------------------------------------------------------------------------------------


def test_both_signs_of_a_quaternion_are_one_attitude() -> None:
    """A bob with a spring to a post beside it: in the plane of both, four places by brentq on its angle."""
    held = mbs.loads(f"""
multibody_sym: 1
name: held
gravity: [0, 0, -{G}]
bodies:
  ground: {{points: {{o: [2, 0, 0]}}}}
  bob: {{mass: 1, com: [0, 0, -1], inertia: {{Ixx: 0.1, Iyy: 0.1, Izz: 0.1}}, points: {{p: [0.3, 0, -1]}}}}
joints: {{S: {{type: spherical, parent: ground, child: bob, initial: {{q: [0.9, 0.2, 0.1, 0.3]}}}}}}
forces: {{k: {{type: spring_damper, between: [ground.o, bob.p], stiffness: 20, length: 0.2}}}}
""")
    found = mbs.equilibrium(held)
    attitudes = [Rotation.from_quat(list(p.values()), scalar_first=True).as_matrix() for p in found.positions]
    for k, R in enumerate(attitudes):
        assert all(np.abs(R - other).max() > 1e-6 for other in attitudes[:k])
    assert all(p["S_qw"] >= 0 for p in found.positions)
    assert Counter(found.stable) == {True: 1, False: 3}


def test_turns_that_wind_a_spring_up_are_told_apart() -> None:
    """k theta = m g l sin(theta) with k = m g l/10: three turns of positions, and 7 rad is not 0.72 rad."""
    found = mbs.equilibrium(held_upright(G / 10))
    for position in found.positions:
        assert position["theta"] / 10 == pytest.approx(np.sin(position["theta"]), abs=1e-9)
    assert max(position["theta"] for position in found.positions) > 2 * np.pi


def pendulums(count: int) -> mbs.System:
    names = [f"p{k}" for k in range(count)]
    return mbs.System(
        "pendulums",
        gravity=[0, -G, 0],
        bodies={
            name: mbs.Body(mass=1 + 0.3 * k, com=[0, -1, 0], points={"e": [0, -1, 0]}) for k, name in enumerate(names)
        },
        joints={
            f"J{k}": mbs.Revolute("ground" if k == 0 else f"{names[k - 1]}.e", name, q=f"t{k}", initial={"q": 0.2})
            for k, name in enumerate(names)
        },
    )


@pytest.mark.parametrize("count", [3, 4])
def test_every_pendulum_of_a_chain_hangs_or_stands(count: int) -> None:
    found = mbs.equilibrium(pendulums(count))
    upright = {tuple(np.round(np.cos(np.cumsum(list(p.values()))), 9)) for p in found.positions}
    assert upright == set(product([1.0, -1.0], repeat=count))
    assert len(found.positions) == 2**count
    assert found.complete
    assert Counter(found.stable)[True] == 1


def test_what_is_not_proved_is_not_called_complete() -> None:
    assert not mbs.equilibrium(mbs.load(EXAMPLES / "slider_crank.yaml")).complete
    assert not mbs.equilibrium(held_upright(5)).complete
    assert mbs.equilibrium(mbs.load(EXAMPLES / "bead_on_hoop.yaml")).complete  # a polynomial of cos and sin


def slider_under(force: str) -> mbs.System:
    return mbs.System(
        "slider",
        bodies={"a": mbs.Body(mass=1)},
        joints={"X": mbs.Prismatic("ground", "a", axis="x", q="x", initial={"q": 0.3})},
        forces={"f": mbs.Force(on="a", value=[force, 0, 0])},
    )


@pytest.mark.parametrize(
    "far", ["-20*x + 1e-9*x^3", "-20*x*(1 - x/1e9)", "-20*x + 1e-7*x*abs(x)", "-x - 1e3*x*exp(-(x - 40)^2)"]
)
def test_what_bends_far_away_is_not_affine(far: str) -> None:
    """The first three rest again at sqrt(20e9) m, 1e9 m and 2e8 m, and the last is pulled back by little at 40 m."""
    assert not mbs.equilibrium(slider_under(far)).complete


def test_what_is_affine_by_its_expression_is_proved() -> None:
    assert mbs.equilibrium(slider_under("-20*(x - 1)*3 + (2*x + 5)/4")).complete


def test_why_nothing_rests_is_told_where_it_is_the_same_everywhere() -> None:
    with pytest.raises(mbs.NoSolutionError, match=r"at rest accelerates alike \(u_x' = 2\.5 m/s\^2\)"):
        mbs.equilibrium(slider_under("5/2"))


def test_positions_at_zero_are_told_without_rounding() -> None:
    found = mbs.equilibrium(slider_under("-20*x + 1e-9*x^3"))
    assert found.positions[0] == {"x": 0.0}
    assert mbs.equilibrium(slider_under("-20*(x - 1e-12)")).positions[0]["x"] == pytest.approx(1e-12)


def hinge_under(torque: str) -> mbs.System:
    return mbs.System(
        "hinge",
        bodies={"a": mbs.Body(mass=1, com=[0, -1, 0])},
        joints={"H": mbs.Revolute("ground", "a", q="x", initial={"q": 0.3})},
        gravity=[0, -1, 0],
        forces={"f": mbs.Torque(joint="H", value=torque)},
    )


def test_a_pulse_between_samples_hides_no_position() -> None:
    """-sin(x) plus a pulse at 1.03, narrower than a 64th of a turn, has zeros on both of its sides."""
    found = mbs.equilibrium(hinge_under("2*exp(-1e5*(1 - cos(x - 1.03)))"))
    assert not found.complete


@pytest.mark.parametrize(
    ("torque", "same"),
    [
        ("3*sin(x)*cos(x)", lambda x: 3 * np.sin(x) * np.cos(x)),
        ("2*sin(2*x + 1)*cos(x)^2/3", lambda x: 2 * np.sin(2 * x + 1) * np.cos(x) ** 2 / 3),
    ],
)
def test_polynomials_of_sine_and_cosine_are_counted(torque: str, same: Callable[[Any], Any]) -> None:
    found = mbs.equilibrium(hinge_under(torque))
    angles = np.linspace(-np.pi, np.pi, 200_001) + 1e-4
    value = same(angles) - np.sin(angles)
    assert found.complete
    assert len(found.positions) == (value[:-1] * value[1:] < 0).sum()


def test_what_takes_two_turns_is_not_counted_on_one() -> None:
    assert not mbs.equilibrium(hinge_under("sin(x/2)")).complete


def test_positions_of_one_family_are_one_and_what_tips_over_is_unstable() -> None:
    """A coin on its edge leans by +-90 deg from flat, with headings half a turn apart: on edge it tips over."""
    found = mbs.equilibrium(mbs.load(EXAMPLES / "rolling_coin.yaml"))
    assert found.stable == (False,)
    assert found.free == (("x", "y", "heading", "roll"),)
    assert abs(found.positions[0]["lean"]) == pytest.approx(np.pi / 2)


def test_a_search_that_finds_nothing_ends_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    """The centre of two rods falls whatever they do; each guess takes a second here."""
    model = mbs.loads(
        "multibody_sym: 1\nname: falling\ngravity: [0, -9.81, 0]\n"
        "bodies: {a: {mass: 1}, b: {mass: 1, com: [0, -1, 0]}}\njoints:\n"
        "  A: {type: point, parent: ground, child: a, q: [x, y]}\n"
        "  B: {type: revolute, parent: a, child: b, axis: z}\n"
    )
    clock = iter(range(10_000))
    tried = []
    reached = search_module.EquilibriumSearch.reached
    monkeypatch.setattr(search_module.time, "process_time", lambda: float(next(clock)))
    monkeypatch.setattr(search_module.EquilibriumSearch, "reached", lambda *given: tried.append(1) or reached(*given))
    with pytest.raises(mbs.NoSolutionError, match="no position of equilibrium was found"):
        mbs.equilibrium(model)
    assert len(tried) <= 5


def test_an_arm_falls_to_rest_where_newtons_method_ends_between_positions() -> None:
    """Three hinges and offset links: forces vanish where the height of all masses, built by hand, is stationary."""
    masses, steps = (3.0, 2.0, 1.0), np.array([[0.0, 0.0, 0.4], [0.1, 0.05, 0.4], [0.0, 0.1, 0.4]])
    bodies, joints = {}, {}
    for k, (mass, step) in enumerate(zip(masses, steps, strict=True)):
        inertia = dict.fromkeys(("Ixx", "Iyy", "Izz"), 0.01)
        bodies[f"b{k}"] = mbs.Body(mass=mass, com=list(step / 2), inertia=inertia, points={"end": list(step)})
        joints[f"j{k}"] = mbs.Revolute(f"b{k - 1}.end" if k else "ground", f"b{k}", axis="y", q=f"q{k}")
    resolved = mechanism(mbs.System("arm", gravity=[0, 0, -G], bodies=bodies, joints=joints))
    search = search_module.search_from(resolved, start(resolved), None)
    begin = np.array([1.5, 0.0, 0.0])
    assert search.reached(begin) is None
    q = search.reached(begin, np.inf)
    assert q is not None

    def energy(q: Any) -> float:
        turned = [Rotation.from_euler("y", angle) for angle in np.cumsum(q)]
        ends = np.array([each.apply(step) for each, step in zip(turned, steps, strict=True)])
        return float(G * np.array(masses) @ (np.cumsum(ends, axis=0) - ends / 2)[:, 2])

    slopes = [(energy(q + x) - energy(q - x)) / 2e-5 for x in 1e-5 * np.eye(3)]
    assert np.abs(slopes).max() < 1e-7
    assert energy(q) < energy(begin)
