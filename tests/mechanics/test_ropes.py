"""Ropes over points and wheels: lengths of paths that were laid out piece by piece, and convex hulls."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from mechanisms import Case

from multibody_sym.dynamics.start.initial_geometry import with_constants
from multibody_sym.mechanics.resolve import mechanism
from multibody_sym.mechanics.ropes import segments
from multibody_sym.mechanics.row_kinematics import row_motions
from multibody_sym.model.bodies import GROUND, Body
from multibody_sym.model.constraints import Pulley, Rope
from multibody_sym.model.joints import Planar, Prismatic
from multibody_sym.model.system import System


def rope_case(points: list[np.ndarray], radii: list[float], axes: list[list[float]]) -> Case:
    """Return a rope along points of the ground; wheels with these radii at all but the ends (0: a point)."""
    names = [f"p{k}" for k in range(len(points))]
    pulleys = {f"P{k}": Pulley(f"ground.p{k}", radius=radii[k], axis=axes[k]) for k in range(1, len(points) - 1)}
    system = System(
        "rope",
        bodies={"load": Body(mass=1), GROUND: Body(points={n: p.tolist() for n, p in zip(names, points, strict=True)})},
        joints={"j": Prismatic("ground", "load", axis="x")},
        pulleys=pulleys,
        constraints={"rope": Rope(["ground.p0", *pulleys, f"ground.p{len(points) - 1}"], length=0)},
    )
    return measured_case(system, [0.0])


def measured_case(system: System, q: list[float]) -> Case:
    """Return a system whose ropes run on the sides that their bends have at q."""
    resolved = mechanism(system)
    return Case(0, system, resolved, with_constants(resolved, [0.0] * len(resolved.parameters), np.array(q)))


def length_of(case: Case) -> float:
    (row,) = row_motions(case.motion(0.0, [0.0], [0.0]))
    return -float(row.phi)


def laid_out(
    rng: np.random.Generator, turns: list[float], sizes: tuple[float, float] = (0.05, 0.3)
) -> tuple[list, list, float]:
    """Lay a rope: straight, round a wheel by a turn (left positive), straight ...; return centres, radii and length."""
    place, heading, length = np.zeros(3), float(rng.uniform(-math.pi, math.pi)), 0.0
    centres, radii = [place], [0.0]
    for turn in turns:
        straight, radius, side = float(rng.uniform(1, 3)), float(rng.uniform(*sizes)), math.copysign(1, turn)
        centre = place + straight * direction(heading) + side * radius * direction(heading + math.pi / 2)
        heading += turn
        place = centre - side * radius * direction(heading + math.pi / 2)
        centres.append(centre)
        radii.append(radius)
        length += straight + radius * abs(turn)
    straight = float(rng.uniform(1, 3))
    return [*centres, place + straight * direction(heading)], [*radii, 0.0], length + straight


def direction(angle: float) -> np.ndarray:
    return np.array([math.cos(angle), math.sin(angle), 0.0])


@pytest.mark.parametrize("wheels", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(15))
def test_length_of_a_path_laid_out_piece_by_piece(seed: int, wheels: int) -> None:
    """In any plane of space, for wheels whose axes point either way; the centres are inside the bends."""
    rng = np.random.default_rng([seed, wheels])
    turns = rng.uniform(0.7, 0.9 * math.pi, wheels) * rng.choice([-1, 1], wheels)
    flat, radii, length = laid_out(rng, turns.tolist(), sizes=(0.05, 0.15))
    frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    axes = [(float(rng.choice([-2, 1])) * frame[:, 2]).tolist() for _ in flat]
    assert length_of(rope_case([frame @ p for p in flat], radii, axes)) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("turn", [3.0, math.pi, 3.2, 3.25])
def test_wheel_may_be_wrapped_by_more_than_half_a_turn(turn: float) -> None:
    """Where the rope crosses over to the other side of the next wheel."""
    centres, radii, length = laid_out(np.random.default_rng(1), [turn, -2.0], sizes=(0.29, 0.3))
    before, after = centres[1] - centres[0], centres[2] - centres[1]
    assert np.cross(before, after)[2] > 0, "the centre is inside the bend"
    assert length_of(rope_case(centres, radii, [[0, 0, 1]] * 4)) == pytest.approx(length, rel=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_length_is_the_convex_hull_round_wheels_on_one_side(seed: int) -> None:
    """Pulled tight round wheels that all lie on one side, a rope is their convex hull without the base."""
    rng = np.random.default_rng(seed)
    heights = [0.0, *rng.uniform(1, 1.5, 2).tolist(), 0.0]
    centres = [np.array([x, y]) for x, y in zip((-2.0, -0.7, 0.8, 2.0), heights, strict=True)]
    radii = [0.0, *rng.uniform(0.05, 0.4, 2).tolist(), 0.0]
    around = np.linspace(0, 2 * math.pi, 40_001)
    cloud = [c + r * np.column_stack([np.cos(around), np.sin(around)]) for c, r in zip(centres, radii, strict=True)]
    perimeter = hull_perimeter(np.vstack(cloud))
    points = [np.append(p, 0.0) for p in centres]
    found = length_of(rope_case(points, radii, [[0, 0, 1]] * 4))
    assert found == pytest.approx(perimeter - 4.0, abs=1e-7)


def hull_perimeter(points: np.ndarray) -> float:
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points).vertices]
    return float(np.linalg.norm(hull - np.roll(hull, 1, axis=0), axis=1).sum())


def test_points_need_no_axis() -> None:
    points = [np.array(p, dtype=float) for p in ((0, 0, 0), (1, 2, 3), (-1, 0, 4), (2, 2, 2))]
    expected = sum(np.linalg.norm(b - a) for a, b in pairwise(points))
    assert length_of(rope_case(points, [0.0] * 4, [[0, 0, 1]] * 4)) == pytest.approx(expected, rel=1e-15)


def test_rope_over_a_movable_pulley_has_two_parts_to_its_load() -> None:
    """ground - movable wheel - fixed wheel - counterweight: sinks the wheel by x, the counterweight rises by 2 x."""
    system = System(
        "movable",
        bodies={
            "carrier": Body(mass=1),
            "weight": Body(mass=1),
            GROUND: Body(points={"hook": [-0.1, 3, 0], "top": [0.2, 3, 0], "right": [0.3, 0, 0]}),
        },
        joints={
            "A": Prismatic("ground", "carrier", axis="y", q="a"),
            "B": Prismatic("ground.right", "weight", axis="y", q="b"),
        },
        pulleys={"low": Pulley("carrier", radius=0.1), "high": Pulley("ground.top", radius=0.1)},
        constraints={"rope": Rope(["ground.hook", "low", "high", "weight"], length=0)},
    )
    (row,) = row_motions(measured_case(system, [0.5, 1.0]).motion(0.0, [0.5, 1.0], [0.25, 0.5]))
    assert row.jacobian == pytest.approx([2.0, 1.0])
    assert -row.phi == pytest.approx(2 * 2.5 + 2.0 + 2 * math.pi * 0.1)
    assert row.phidot == pytest.approx(2 * 0.25 + 0.5)
    assert row.gamma == pytest.approx(0.0, abs=1e-14)


def test_pieces_meet_wheels_as_tangents() -> None:
    for seed in range(10):
        rng = np.random.default_rng(seed)
        centres, radii, _ = laid_out(rng, rng.uniform(0.4, 2.5, 3).tolist())
        case = rope_case(centres, radii, [[0, 0, 1]] * 5)
        pieces, _ = segments(case.motion(0.0, [0.0], [0.0]), case.mechanism.rows[0].path)
        for k, piece in enumerate(pieces):
            n = np.array(piece.direction, dtype=float)
            assert np.linalg.norm(n) == pytest.approx(1.0)
            apart = abs(float(np.cross(n, centres[k + 1] - centres[k])[2]))
            assert min(abs(apart - abs(radii[k] + s * radii[k + 1])) for s in (-1, 1)) < 1e-12


def test_planar_joint_carries_the_end() -> None:
    system = System(
        "end",
        bodies={"load": Body(mass=1, inertia={"Izz": 1}, points={"p": [0, 1, 0]})},
        joints={"j": Planar("ground", "load")},
        constraints={"rope": Rope(["ground", "load.p"], length=2)},
    )
    case = Case(0, system, mechanism(system), [0.0, 0.0])
    (row,) = row_motions(case.motion(0.0, [3.0, 3.0, math.pi / 2], [0.0, 0.0, 0.0]))
    assert row.phi == pytest.approx(2 - math.hypot(2, 3))
