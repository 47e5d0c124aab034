"""Discs and ellipses that roll on curves: first integrals, arc lengths, where they leave, by formulas by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from runs import Floats, G, by_hand, run_of
from scipy.integrate import quad
from twins import from_file

import multibody_sym as mbs
from multibody_sym.text.printer import text

P, RADIUS = 0.8, 0.2


def on_a_curve(curve: mbs.Curve, radius: float, start: list[float | None], **fields: Any) -> mbs.System:
    """Return a disc, or a particle if the radius is zero, over a curve of ground."""
    shape = {"shape": mbs.Shape("disc", radius, 2)} if radius else {"mass": 2}
    joint: Any = mbs.Planar if radius else mbs.PointJoint
    return mbs.System(
        "on a curve",
        gravity=[0, -G, 0],
        bodies={"ground": mbs.Body(surfaces={"hill": mbs.Surface(curve=curve)}), "disc": mbs.Body(**shape)},
        joints={"free": joint("ground", "disc", q=["x", "y", "phi"][: len(start)], initial={"q": start})},
        **fields,
    )


def test_the_disc_in_the_hollow_rolls_as_one_coordinate_does() -> None:
    """With w = |c'|, curvature 1/(p w^3): the centre's speed is f s', f = w - r/(p w^2), and T = 3/4 m f^2 s'^2."""

    def accelerations(t: float, q: Floats, u: Floats) -> list[float]:
        (s,), (v,) = q, u
        w = np.sqrt(1 + s**2 / P**2)
        f = w - RADIUS / (P * w**2)
        slope = s / (P**2 * w) * (1 + 2 * RADIUS / (P * w**3))
        return [-(slope * v**2) / f - 2 * G / 3 * s / (P * w * f)]

    run = run_of("disc_in_a_parabolic_hollow", t_end=2.0, samples=21)
    s = run["rolls_x"]
    (expected,) = by_hand(accelerations, [s[0]], run.t)
    assert np.abs(s - expected).max() < 1e-9
    assert np.ptp(run["energy"]) < 1e-10 * run["energy"][0]
    assert run["normal"][0] == pytest.approx(3 * G / np.sqrt(1 + (s[0] / P) ** 2), rel=1e-12)
    way = s / 2 * np.sqrt(1 + (s / P) ** 2) + P / 2 * np.arcsinh(s / P) - RADIUS * np.arctan(s / P)
    assert run["phi"] == pytest.approx(-(way - way[0]) / RADIUS, abs=1e-10)


def test_the_normal_force_is_that_of_an_incline() -> None:
    solution = mbs.solve(from_file("disc_in_a_parabolic_hollow"))
    assert text(solution.reactions["rolls.n"]["tension"].expression or 0) == "g*m*p/sqrt(p^2 + rolls_x^2)"


def test_the_ellipse_keeps_its_first_integral_and_rolls_its_arc() -> None:
    run = run_of("rolling_ellipse", t_end=3.0, samples=31)
    a, b, m = 0.5, 0.3, 2.0
    phi, rate, s = run["phi"], run["u_phi"], run["rolls_s"]
    h = np.sqrt((a * np.sin(phi)) ** 2 + (b * np.cos(phi)) ** 2)
    slope = (a**2 - b**2) * np.sin(phi) * np.cos(phi) / h
    assert run["y"] == pytest.approx(h, rel=1e-12)
    integral = (m * (a**2 + b**2) / 4 + m * (h**2 + slope**2)) * rate**2 / 2 + m * G * h
    assert np.ptp(integral) < 1e-10 * integral[0]
    touched = run["x"] + a * np.cos(s) * np.cos(phi) - b * np.sin(s) * np.sin(phi)
    arcs = [quad(lambda x: np.hypot(a * np.sin(x), b * np.cos(x)), s[0], end, epsabs=1e-13)[0] for end in s]
    assert np.ptp(phi) > 1
    assert touched - touched[0] == pytest.approx(np.array(arcs), abs=1e-10)  # material and ground pass alike


@pytest.mark.parametrize(
    ("radius", "static", "cosine"), [(0.0, None, 2 / 3), (0.3, None, 2 / 3), (0.3, "enough", 4 / 7)]
)
def test_what_goes_down_a_round_hill_leaves_it_where_a_book_says(
    radius: float, static: str | None, cosine: float
) -> None:
    """A smooth body leaves at cos = 2/3 of the height it began at, one that rolls at 4/7."""
    hill = mbs.Curve(x="2*sin(s)", y="2*cos(s)", parameter="s")
    start = 0.1
    place = [(2 + radius) * np.sin(start), (2 + radius) * np.cos(start), 0.0][: 3 if radius else 2]
    contact = mbs.Contact(("disc", "ground.hill"), static=static)
    run = run_of(on_a_curve(hill, radius, place, contacts={"c": contact}, stop={"off": "c opens"}), t_end=5.0)
    assert run["y"][-1] == pytest.approx((2 + radius) * np.cos(start) * cosine, rel=1e-9)


def test_a_disc_slides_lifts_off_and_lands_with_its_energy_accounted() -> None:
    wave = mbs.Curve(y="0.3*sin(2*x)")
    contact = mbs.Contact(("disc", "ground.hill"), static=0.3, kinetic=0.2, restitution=0.4)
    system = on_a_curve(wave, 0.1, [-2.0, 0.9, 0.0], contacts={"c": contact})
    run = mbs.simulate(system, t_end=1.5)
    kinds = [change["kind"] for change in run.changes]
    assert kinds.count("impact") > 1
    assert "slide+" in kinds or "slide-" in kinds
    assert np.abs(run.energy_residual).max() < 1e-6 * run.energy[0]


def test_an_ellipse_rolls_in_a_hollow_with_all_formalisms_agreed() -> None:
    begin = {"q": [0.4, None, 0.3], "u": [None, None, 1]}
    system = mbs.System(
        "egg",
        gravity=[0, -G, 0],
        bodies={
            "ground": mbs.Body(surfaces={"bowl": mbs.Surface(curve=mbs.Curve(y="x^2/4"))}),
            "egg": mbs.Body(
                mass=2,
                inertia={"Izz": 0.2},
                surfaces={"rim": mbs.Surface(outline=mbs.Curve(x="0.5*cos(s)", y="0.3*sin(s)", parameter="s"))},
            ),
        },
        joints={"free": mbs.Planar("ground", "egg", q=["x", "y", "phi"], initial=begin)},
        constraints={"rolls": mbs.Rolling("egg", "ground.bowl")},
        outputs={"e": "total_energy()"},
    )
    assert mbs.check(system).agrees
    run = run_of(system, t_end=1.0, samples=11)
    assert np.ptp(run["e"]) < 1e-10 * run["e"][0]
    s, x = run["rolls_s1"], run["rolls_x2"]
    egg = [quad(lambda v: np.hypot(0.5 * np.sin(v), 0.3 * np.cos(v)), s[0], end, epsabs=1e-13)[0] for end in s]
    bowl = [quad(lambda v: np.hypot(1, v / 2), x[0], end, epsabs=1e-13)[0] for end in x]
    assert np.abs(egg).max() > 0.02
    assert bowl == pytest.approx(egg, abs=1e-10)


def in_a_drum(a: float, b: float, start: list[Any], radius: float = 0.5, **fields: Any) -> mbs.System:
    """Return an ellipse with half axes a, b in a drum of ground."""
    outline = mbs.Curve(x=f"{a}*cos(s)", y=f"{b}*sin(s)", parameter="s")
    egg = mbs.Body(mass=2, inertia={"Izz": (a**2 + b**2) / 2}, surfaces={"rim": mbs.Surface(outline=outline)})
    return mbs.System(
        "in a drum",
        gravity=[0, -G, 0],
        bodies={"ground": mbs.Body(surfaces={"drum": mbs.Surface(disc=radius, inside=True)}), "egg": egg},
        joints={"free": mbs.Planar("ground", "egg", q=["x", "y", "phi"], initial={"q": start})},
        outputs={"e": "total_energy()"},
        **fields,
    )


def test_an_ellipse_rolls_the_same_arc_on_itself_and_in_the_drum() -> None:
    """From rest it is touched where it is farthest from the drum's middle, and keeps its energy."""
    roll = {"constraints": {"rolls": mbs.Rolling("egg.rim", "ground.drum")}}
    run = run_of(in_a_drum(0.12, 0.1, [0.1, -0.4, 0.3], **roll), t_end=0.4, samples=5)
    s, phi = run["rolls_s"], run["phi"]
    foot_x = run["x"] + 0.12 * np.cos(s) * np.cos(phi) - 0.1 * np.sin(s) * np.sin(phi)
    foot_y = run["y"] + 0.12 * np.cos(s) * np.sin(phi) + 0.1 * np.sin(s) * np.cos(phi)
    assert np.hypot(foot_x, foot_y) == pytest.approx(0.5, rel=1e-12)
    arcs = [quad(lambda v: np.hypot(0.12 * np.sin(v), 0.1 * np.cos(v)), s[0], end, epsabs=1e-13)[0] for end in s]
    assert np.ptp(arcs) > 0.05
    along = 0.5 * np.arctan2(foot_y, foot_x)
    assert along - along[0] == pytest.approx(np.array(arcs), abs=1e-10)
    assert np.ptp(run["e"]) < 1e-10


@pytest.mark.parametrize("law", ["rolling", "contact"])
def test_a_round_outline_in_a_drum_rolls_as_a_disc_does(law: str) -> None:
    """At the angle b from the lowest place the centre's acceleration is 2/3 g sin(b), and N = m g cos(b)."""
    angle, around = 0.4, 0.5 - 0.1
    fields: dict[str, Any] = {"constraints": {"c": mbs.Rolling("egg.rim", "ground.drum")}}
    if law == "contact":
        fields = {"contacts": {"c": mbs.Contact(("egg.rim", "ground.drum"), static="enough")}}
    start = [around * np.sin(angle), -around * np.cos(angle), 0.0]
    found = mbs.solve(in_a_drum(0.1, 0.1, start, **fields))
    along = 2 / 3 * G * np.sin(angle)
    assert found.accelerations["x"].value == pytest.approx(-along * np.cos(angle), rel=1e-12)
    assert found.accelerations["y"].value == pytest.approx(-along * np.sin(angle), rel=1e-12)
    assert found.accelerations["phi"].value == pytest.approx(along / 0.1, rel=1e-12)
    normal = found.reactions["c.n"]["tension"] if law == "rolling" else found.reactions["c"]["normal"]
    assert normal.value == pytest.approx(2 * G * np.cos(angle), rel=1e-12)


def test_an_outline_comes_where_it_does_not_fit_into_the_drum() -> None:
    """An ellipse bends with radii up to a^2/b = 0.144 m, and rolls to where it bends as the drum does."""
    system = in_a_drum(0.12, 0.1, [0.0, -0.03, 0.0], 0.13, constraints={"rolls": mbs.Rolling("egg", "ground.drum")})
    with pytest.raises(mbs.RunError, match=r"egg\.rim does not fit into ground\.drum .* its .* is 0\.13 m.* larger"):
        mbs.simulate(system, t_end=0.1, backend="python")


def test_the_place_where_a_disc_does_not_fit_is_told() -> None:
    system = from_file("disc_in_a_parabolic_hollow")
    with pytest.raises(mbs.ModelError, match=r"disc \(radius 0.2 m\) does not fit .* at \(0, 0\) m, .* is 0.1 m"):
        mbs.solve(system, parameters={"p": 0.1, "x0": 0.0})
    with pytest.raises(mbs.RunError, match=r"disc .* does not fit into ground.hollow at \(0\.0766"):
        mbs.simulate(system, parameters={"p": 0.1, "x0": 0.15})


def test_a_rod_whose_end_is_guided_along_a_curve_keeps_energy_in_both_coordinates() -> None:
    begin = {"q": [0.5, None, 0.3], "known": True}
    system = mbs.System(
        "guided",
        gravity=[0, -G, 0],
        bodies={"rod": mbs.Body(shape=mbs.Shape("rod", 1, 1), points={"end": [0.5, 0, 0]})},
        joints={"free": mbs.Planar("ground", "rod", q=["x", "y", "phi"], initial=begin)},
        constraints={"guide": mbs.OnCurve("rod.end", mbs.Curve(x="2*cos(s)", y="sin(s)", parameter="s"))},
        outputs={"e": "total_energy()", "n": "reaction(guide.foot, normal)"},
    )
    run = run_of(system, t_end=1.0, samples=11)
    end = np.array([run["x"] + 0.5 * np.cos(run["phi"]), run["y"] + 0.5 * np.sin(run["phi"])])
    assert (end[0] / 2) ** 2 + end[1] ** 2 == pytest.approx(1.0, abs=1e-12)
    assert np.ptp(run["e"]) < 1e-9
    normal = np.array([-np.cos(run["guide_s"]), -2 * np.sin(run["guide_s"])])
    force = run.multipliers["guide.x"], run.multipliers["guide.y"]
    assert run["n"] == pytest.approx((normal * force).sum(0) / np.hypot(*normal), rel=1e-9)
    absolute = mbs.simulate(system, t_end=1.0, samples=11, coordinates="absolute", rtol=1e-12, backend="python")
    assert absolute["guide_s"] == pytest.approx(run["guide_s"], abs=1e-9)


def test_the_ellipse_rests_upright_and_flat_on_the_floor_never_under_it() -> None:
    found = mbs.equilibrium(from_file("rolling_ellipse"))
    heights = {round(place["y"], 9) for place in found.positions}
    assert heights == {0.3, 0.5}
    assert not any(stable for place, stable in zip(found.positions, found.stable, strict=True) if place["y"] > 0.4)


def test_the_steps_of_a_rolling_disc_are_those_of_a_book() -> None:
    solution = mbs.solve(from_file("disc_in_a_parabolic_hollow"), steps=True)
    assert solution.steps is not None
    assert [step.title for step in solution.steps.steps if "cut free" in step.title] == ["disc, cut free"]
