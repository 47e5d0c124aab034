"""Sections of random beams and frames: equilibrium of the other part, and dM/dx = V, to 1e-12 of the largest."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import multibody_sym as mbs
from multibody_sym.scalars.functions import evaluate_float
from multibody_sym.scalars.node import symbol
from multibody_sym.text.printer import text

GAUSS = [np.asarray(x) for x in np.polynomial.legendre.leggauss(8)]
"""Places and weights that integrate polynomials of the 15th degree exactly."""
ASK = {name: {"section": "beam", "component": name} for name in ("axial", "shear", "moment")}
GREATEST = {"section": "beam", "component": "moment", "at": "greatest"}
Load = Callable[[float], tuple[float, float]]


@dataclass
class Case:
    """A model whose beam has the `length`; what acts on it along its axes: (x, X, Y, couple), and loads per metre."""

    model: dict[str, Any]
    length: float
    points: list[tuple[float, float, float, float]] = field(default_factory=list)
    loads: list[tuple[float, float, Load]] = field(default_factory=list)
    joints: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # its place, and the sign on the beam
    rows: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)  # place, and direction on the beam
    turned: float = 0.0

    @property
    def acted_on(self) -> list[float]:
        """The ends of the beam, and all places between which nothing but a smooth load acts."""
        found = {x for x, *_ in (*self.points, *self.joints.values(), *self.rows.values())}
        return sorted(found | {x for load in self.loads for x in load[:2]} | {0.0, self.length})

    def beyond(self, x: float, solution: mbs.Solution) -> tuple[float, float, float]:
        """Return N, V and M of a section by all that acts on the part with greater x."""
        acting = list(self.points)
        for name, (place, sign) in self.joints.items():
            fx, fy, mz = (sign * (solution.reactions[name][c].value or 0.0) for c in ("fx", "fy", "mz"))
            c, s = math.cos(self.turned), math.sin(self.turned)
            acting.append((place, c * fx + s * fy, c * fy - s * fx, mz))
        for name, (place, X, Y) in self.rows.items():
            (value,) = solution.reactions[name].values()
            assert value.value is not None
            acting.append((place, X * value.value, Y * value.value, 0.0))
        for first, last, load in self.loads:
            low = max(first, x)
            if last > low:
                for place, weight in zip(*GAUSS, strict=True):
                    at, per = (low + last) / 2 + (last - low) / 2 * place, (last - low) / 2 * weight
                    X, Y = load(at)
                    acting.append((at, per * X, per * Y, 0.0))
        kept = [each for each in acting if each[0] > x]
        return (
            math.fsum(X for _, X, _, _ in kept),
            -math.fsum(Y for _, _, Y, _ in kept),
            math.fsum((at - x) * Y + couple for at, _, Y, couple in kept),
        )


def system(points: dict[str, float], **more: Any) -> dict[str, Any]:
    body = {"points": {name: [x, 0, 0] for name, x in points.items()}, **more.pop("beam", {})}
    bodies = {"beam": body, **more.pop("bodies", {})}
    return {"multibody_sym": 1, "name": "case", "bodies": bodies, "ask": {**ASK, "greatest": GREATEST}, **more}


def supports(a: float, b: float) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Return ground, a pin at beam.a and a roller at beam.b."""
    ground = {"points": {"a": [a, 0, 0], "b": [b, 0, 0]}}
    pin = {"A": {"type": "revolute", "parent": "ground.a", "child": "beam.a", "q": "phi"}}
    roller = {"type": "point_in_plane", "point": "beam.b", "plane": {"through": "ground.b", "normal": "y"}}
    return ground, pin, {"B": roller}


def force(at: str, X: float, Y: float) -> dict[str, Any]:
    return {"type": "force", "on": "beam", "at": at, "value": [X, Y, 0]}


def line(ends: list[str], value: list[Any]) -> dict[str, Any]:
    return {"type": "distributed", "on": "beam", "between": ends, "value": value}


def cantilever(r: np.random.Generator) -> Case:
    L, a, q, F, C = r.uniform(1, 5), 0.35, *r.uniform(-9, 9, 3)
    forces = {
        "F": force("m", F, 2 * F),
        "C": {"type": "torque", "on": "beam", "at": "m", "value": [0, 0, C]},
        "w": line(["l", "e"], [q, f"{q}*s^2", 0]),
    }
    joints = {"A": {"type": "weld", "parent": "ground", "child": "beam"}}
    model = system({"l": 0, "m": a * L, "e": L}, joints=joints, forces=forces)
    return Case(model, L, [(a * L, F, 2 * F, C)], [(0.0, L, lambda x: (q, q * x * x))], {"A": (0.0, 1.0)})


def held_at_the_right(r: np.random.Generator) -> Case:
    L, q, F = r.uniform(1, 5), *r.uniform(-9, 9, 2)
    joints = {"A": {"type": "weld", "parent": "ground", "child": "beam.e"}}
    forces = {"F": force("l", F, -F), "w": line(["e", "m"], [0, f"{q}*s", 0])}
    model = system({"l": 0, "m": L / 3, "e": L}, joints=joints, forces=forces)
    return Case(model, L, [(0.0, F, -F, 0.0)], [(L / 3, L, lambda x: (0.0, q * (L - x)))], {"A": (L, 1.0)})


def overhang(r: np.random.Generator) -> Case:
    L, q, F, C = r.uniform(2, 5), *r.uniform(-9, 9, 3)
    a, b, m = 0.1 * L, 0.7 * L, 0.4 * L
    ground, pin, roller = supports(a, b)
    forces = {
        "F": force("e", F, F),
        "C": {"type": "torque", "on": "beam", "at": "l", "value": [0, 0, C]},
        "w": line(["m", "e"], [0, f"{q} - {q}*s/2", 0]),
    }
    places = {"l": 0.0, "a": a, "b": b, "m": m, "e": L}
    model = system(places, bodies={"ground": ground}, joints=pin, constraints=roller, forces=forces)
    loads: list[tuple[float, float, Load]] = [(m, L, lambda x: (0.0, q - q * (x - m) / 2))]
    return Case(model, L, [(L, F, F, 0.0), (0.0, 0.0, 0.0, C)], loads, {"A": (a, 1.0)}, {"B": (b, 0.0, 1.0)})


def heavy_and_inclined(r: np.random.Generator) -> Case:
    L, m, g, alpha, q = r.uniform(2, 5), r.uniform(1, 9), 9.81, r.uniform(0.2, 1.2), r.uniform(-9, 9)
    ground = {"frames": {"up": {"rotate": [{"axis": "z", "angle": alpha}]}}}
    joints = {"A": {"type": "weld", "parent": "ground.up", "child": "beam"}}
    beam = {"shape": {"rod": L, "mass": m}}
    forces = {"w": line(["l", "e"], [0, -q, 0])}
    model = system(
        {"l": 0, "e": L}, beam=beam, bodies={"ground": ground}, joints=joints, forces=forces, gravity=[0, -g, 0]
    )
    down = -q - m * g / L
    own = (down * math.sin(alpha), down * math.cos(alpha))
    return Case(model, L, [], [(0.0, L, lambda _: own)], {"A": (0.0, 1.0)}, turned=0.0)


def rotating(r: np.random.Generator) -> Case:
    L, m, w, g = r.uniform(1, 3), r.uniform(1, 9), r.uniform(1, 9), 9.81
    joints = {"A": {"type": "revolute", "parent": "ground", "child": "beam", "q": "phi", "initial": {"u": w}}}
    model = system({}, beam={"shape": {"rod": L, "mass": m}}, joints=joints, gravity=[0, -g, 0])
    alpha = -1.5 * g / L
    return Case(model, L, [], [(0.0, L, lambda x: (m / L * w**2 * x, -m / L * (g + alpha * x)))], {"A": (0.0, 1.0)})


def frame(r: np.random.Generator) -> Case:
    """A beam welded to a column on ground, and a second beam hinged to its end that rests on a roller."""
    h, L, b, F, q = *r.uniform(1, 4, 3), *r.uniform(-9, 9, 2)
    bodies = {
        "ground": {"points": {"b": [L + b, h, 0]}},
        "column": {"points": {"top": [0, h, 0]}},
        "arm": {"points": {"m": [b / 2, 0, 0], "e": [b, 0, 0]}},
    }
    joints = {
        "foot": {"type": "weld", "parent": "ground", "child": "column"},
        "corner": {"type": "weld", "parent": "column.top", "child": "beam"},
        "G": {"type": "revolute", "parent": "beam.e", "child": "arm", "q": "phi"},
    }
    roller = {"type": "point_in_plane", "point": "arm.e", "plane": {"through": "ground.b", "normal": "y"}}
    forces = {
        "F": {"type": "force", "on": "arm", "at": "m", "value": [F, F, 0]},
        "w": line(["l", "e"], [q, f"{q}*s/{L}", 0]),
    }
    model = system({"l": 0, "e": L}, bodies=bodies, joints=joints, constraints={"B": roller}, forces=forces)
    own = {"corner": (0.0, 1.0), "G": (L, -1.0)}
    return Case(model, L, [], [(0.0, L, lambda x: (q, q * x / L))], own)


def hung(r: np.random.Generator) -> Case:
    """A beam on a pin and a strut, a rod between points that is not square to it."""
    L, h, F, q = *r.uniform(1, 4, 2), *r.uniform(-9, 9, 2)
    m = 0.6 * L
    joints = {"A": {"type": "revolute", "parent": "ground", "child": "beam.l", "q": "phi"}}
    bodies = {"ground": {"points": {"up": [0, h, 0]}}}
    length = math.hypot(m, h)
    strut = {"type": "distance", "between": ["ground.up", "beam.m"], "value": length}
    forces = {"F": force("e", F, -F), "w": line(["m", "e"], [0, q, 0])}
    model = system({"l": 0, "m": m, "e": L}, bodies=bodies, joints=joints, constraints={"S": strut}, forces=forces)
    loads: list[tuple[float, float, Load]] = [(m, L, lambda _: (0.0, q))]
    return Case(model, L, [(L, F, -F, 0.0)], loads, {"A": (0.0, 1.0)}, {"S": (m, -m / length, h / length)})


def loaded_at_random(r: np.random.Generator) -> Case:
    """A beam on a clamp at either end or on a pin and a roller, or welded to a column, under loads at random places."""
    L, kind = r.uniform(1, 5), int(r.integers(4))
    places = {"l": 0.0, "e": L} | {f"p{k}": x for k, x in enumerate(np.sort(r.uniform(0.05, 0.95, 5)) * L)}
    forces: dict[str, Any] = {}
    points = []
    for name in ("p0", "p3", "e"):
        X, Y, C = r.uniform(-9, 9, 3)
        couple = {"type": "torque", "on": "beam", "at": name, "value": [0, 0, C]}
        forces |= {f"F{name}": {**force(name, X, Y), "frame": "beam"}, f"C{name}": couple}
        points.append((places[name], X, Y, C))
    (a, b, c), (first, last) = r.uniform(-9, 9, 3), r.choice(["l", "p1", "p4", "e"], 2, replace=False)
    forces["w"] = {**line([str(first), str(last)], [a, f"{b} + {c}*s", 0]), "frame": "beam"}
    begin, end = places[first], places[last]
    loads: list[tuple[float, float, Load]] = [
        (min(begin, end), max(begin, end), lambda x: (a, b + c * abs(x - begin)))
    ]
    if kind == 2:
        ground, pin, roller = supports(places["p2"], L)
        ends = {**places, "a": places["p2"], "b": L}
        model = system(ends, bodies={"ground": ground}, joints=pin, constraints=roller, forces=forces)
        return Case(model, L, points, loads, {"A": (places["p2"], 1.0)}, {"B": (L, 0.0, 1.0)})
    if kind == 3:
        top = {"position": [1, 2, 0], "rotate": [{"axis": "z", "angle": r.uniform(0.3, 1.2)}]}
        joints = {
            "foot": {"type": "weld", "parent": "ground", "child": "column"},
            "A": {"type": "weld", "parent": "column.top", "child": "beam"},
        }
        model = system(places, bodies={"column": {"frames": {"top": top}}}, joints=joints, forces=forces)
        return Case(model, L, points, loads, {"A": (0.0, 1.0)})
    joints = {"A": {"type": "weld", "parent": "ground", "child": ("beam", "beam.e")[kind]}}
    return Case(system(places, joints=joints, forces=forces), L, points, loads, {"A": (kind * L, 1.0)})


KINDS = (cantilever, held_at_the_right, overhang, heavy_and_inclined, rotating, frame, hung)


_FIRST_AT_RANDOM = 10


@cache
def solved(number: int) -> tuple[Case, mbs.Solution]:
    kind = loaded_at_random if number >= _FIRST_AT_RANDOM else KINDS[number % len(KINDS)]
    case = kind(np.random.default_rng(number))
    return case, mbs.solve(mbs.loads(json.dumps(case.model)))


def at(solution: mbs.Solution, name: str, x: float) -> float:
    value = solution.answers[name].expression
    known = {symbol(q): number for q, number in solution.coordinates.items()}
    return float(evaluate_float([value], {**known, symbol("x"): x})[0])


@pytest.mark.parametrize("number", range(30))
def test_both_parts_of_a_beam_are_in_equilibrium(number: int) -> None:
    case, solution = solved(number)
    places = [x * case.length for x in (0.03, 0.25, 0.45, 0.65, 0.85, 0.97)]
    found = np.array([[at(solution, name, x) for name in ASK] for x in places])
    expected = np.array([case.beyond(x, solution) for x in places])
    largest = np.abs(expected).max()
    assert np.abs(found - expected).max() <= 1e-12 * largest


@pytest.mark.parametrize("number", range(30))
def test_the_shear_force_is_the_slope_of_the_moment(number: int) -> None:
    case, solution = solved(number)
    for low, high in pairwise(case.acted_on):
        a, b = low + 1e-9, high - 1e-9
        places, weights = (a + b) / 2 + (b - a) / 2 * GAUSS[0], (b - a) / 2 * GAUSS[1]
        gained = math.fsum(w * at(solution, "shear", float(x)) for x, w in zip(places, weights, strict=True))
        ends = at(solution, "moment", a), at(solution, "moment", b)
        assert abs(ends[1] - ends[0] - gained) <= 1e-12 * max(map(abs, (*ends, gained)), default=0.0) + 1e-12


@pytest.mark.parametrize("number", range(0, 30, 6))
def test_the_greatest_moment_is_that_of_all_places(number: int) -> None:
    case, solution = solved(number)
    jumps = [x + side * 1e-9 for x in case.acted_on for side in (-1, 1)]
    places = [x for x in (*np.linspace(1e-9, case.length - 1e-9, 501), *jumps) if 0 < x < case.length]
    largest = max(abs(at(solution, "moment", float(x))) for x in places)
    found, place = solution.answers["greatest"].value, solution.answers["greatest.at"].value
    assert found is not None
    assert place is not None
    assert abs(found) == pytest.approx(largest, rel=1e-4)
    assert abs(found) >= largest * (1 - 1e-7)
    beside = [x for x in (place - 1e-9, place + 1e-9) if 0 < x < case.length]
    assert abs(found) == pytest.approx(max(abs(at(solution, "moment", x)) for x in beside), rel=1e-6)


OVERHANG = """
multibody_sym: 1
name: overhang
parameters: {L: {value: 3 m, positive: true}, q: {value: 400 N/m, positive: true}}
bodies:
  ground: {points: {B: [2*L/3, 0, 0]}}
  beam: {points: {left: [0, 0, 0], b: [2*L/3, 0, 0], right: [L, 0, 0]}}
joints: {A: {type: revolute, parent: ground, child: beam, q: phi}}
constraints: {B: {type: point_in_plane, point: beam.b, plane: {through: ground.B, normal: y}}}
forces: {w: {type: distributed, on: beam, between: [left, right], value: [0, -q, 0]}}
ask: {M: {section: beam, component: moment, at: 2*L/3}, V: {section: beam, component: shear, at: 2*L/3}}
"""


def test_a_section_at_a_support_is_just_behind_it_where_its_force_jumps() -> None:
    """Of the part with greater x: V = q*L/3, M = -q*(L/3)^2/2."""
    solution = mbs.solve(mbs.loads(OVERHANG))
    assert solution.answers["V"].value == pytest.approx(400, rel=1e-12)
    assert solution.answers["M"].value == pytest.approx(-200, rel=1e-12)
    assert [line for line in solution.conditions if line.startswith(("M:", "V:"))] == ["V: just behind 2*L/3"]


BALL = """
{multibody_sym: 1, name: b, bodies: {a: {mass: 1}}, joints: {j: {type: prismatic, parent: ground, child: a, axis: x}}}
"""
L_FRAME = """
multibody_sym: 1
name: l_frame
parameters: {a: 2 m, b: {value: 1 m, positive: true}, q0: 90 N/m}
bodies: {frame: {points: {foot: [0, 0, 0], corner: [a, 0, 0], top: [a, b, 0]}}}
joints: {A: {type: weld, parent: ground, child: frame}}
forces: {w: {type: distributed, on: frame, between: [top, corner], value: [-q0*s/b, 0, 0]}}
ask: {M: {section: frame, component: moment}, N: {section: frame, component: axial, at: greatest}}
"""


def test_a_load_on_an_arm_square_to_a_beam_acts_at_its_corner() -> None:
    """Its resultant q0*b/2 acts b/3 above the corner."""
    solution = mbs.solve(mbs.loads(L_FRAME))
    assert text(solution.answers["M"].expression) == "q0*b^2/6"
    assert solution.answers["N"].value == pytest.approx(-45, rel=1e-12)
    assert text(solution.answers["N"].expression) == "-b*q0/2"


def test_diagrams_are_drawn_to_scale_below_the_figure() -> None:
    """V runs from q*L/4 to -5*q*L/12, jumps by 3*q*L/4; M has q*L^2/32 where V vanishes and -q*L^2/18 at the roller."""
    model = mbs.loads(OVERHANG)
    figure, plain = mbs.draw(model, diagrams=True), mbs.draw(model)
    assert figure.size[1] > plain.size[1]
    assert "V along beam: L*q/4 at 0 m, -5*L*q/12 at 2 m, L*q/3 at 2 m." in figure.description
    assert "M along beam: q*L^2/32 at 0.75 m, -q*L^2/18 at 2 m." in figure.description
    outlines = [mark.points for mark in figure.picture.marks if mark.role == "diagram" and getattr(mark, "fill", None)]
    shear, moment = (points[:, 1] - points[0, 1] for points in outlines)
    assert np.ptp(shear) / abs(shear.min()) == pytest.approx((5 / 12 + 1 / 3) / (5 / 12), rel=1e-12)
    assert moment.max() / -moment.min() == pytest.approx(32 / 18, rel=1e-3)  # moments hang on the side of tension
    texts = ["".join(letters for letters, _ in mark.runs) for mark in figure.picture.marks if hasattr(mark, "runs")]
    assert {"+", "\u2212"} <= set(texts)
    with pytest.raises(mbs.NoSolutionError, match="no beam to cut: ask for a section"):
        mbs.draw(mbs.loads(BALL), diagrams=True)
