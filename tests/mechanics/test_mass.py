"""Shapes, frames and directions against numeric integration and rotation matrices."""

from __future__ import annotations

import math

import numpy as np
import pytest

from multibody_sym.model.bodies import SHAPES, Body, Frame, Turn, mass_of, pose_of, unit_vector
from multibody_sym.scalars.node import as_node

COUNT = 60


def numbers(nodes) -> np.ndarray:
    return np.array([node.shadow for node in nodes], dtype=float)


def grid(*ranges: tuple[float, float]) -> list[np.ndarray]:
    """Return the middles of a regular grid's cells."""
    axes = [low + (high - low) * (np.arange(COUNT) + 0.5) / COUNT for low, high in ranges]
    return [x.ravel() for x in np.meshgrid(*axes, indexing="ij")]


def cloud(kind: str, sizes: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n x 3) and weights of a homogeneous body of a shape, by its definition."""
    turn = (0.0, 2 * math.pi)
    if kind == "rod":
        (x,) = grid((0, sizes[0]))
        return np.column_stack([x, 0 * x, 0 * x]), np.ones_like(x)
    if kind == "box":
        points = np.column_stack(grid(*((-s / 2, s / 2) for s in sizes)))
        return points, np.ones(len(points))
    if kind == "ring":
        (angle,) = grid(turn)
        return sizes[0] * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), np.ones_like(angle)
    if kind in ("disc", "cylinder"):
        r, angle, z = grid((0, sizes[0]), turn, (-sizes[-1] / 2, sizes[-1] / 2) if kind == "cylinder" else (0, 0))
        return np.column_stack([r * np.cos(angle), r * np.sin(angle), z]), r
    r, angle, height = grid((0, sizes[0]), turn, (-1, 1))
    weights = r**2 if kind == "sphere" else np.ones_like(r)
    r = r if kind == "sphere" else sizes[0] + 0 * r
    across = r * np.sqrt(1 - height**2)
    return np.column_stack([across * np.cos(angle), across * np.sin(angle), r * height]), weights


@pytest.mark.parametrize("kind", SHAPES)
def test_inertia_of_a_shape_by_integration(kind: str) -> None:
    sizes = [0.7, 1.1, 0.4][: len(SHAPES[kind])]
    found = mass_of(Body(shape={kind: sizes, "mass": 3}))
    points, weights = cloud(kind, sizes)
    weights = 3 * weights / weights.sum()
    centre = weights @ points / 3
    np.testing.assert_allclose(numbers(found.com), centre, atol=1e-12)
    x, y, z = (points - centre).T
    moments = [weights @ (y**2 + z**2), weights @ (x**2 + z**2), weights @ (x**2 + y**2)]
    np.testing.assert_allclose(numbers(found.inertia[:3]), moments, rtol=1e-3, atol=1e-12)
    assert found.mass.shadow == 3
    assert [node.shadow for node in found.inertia[3:]] == [0, 0, 0]


def test_shape_may_stand_elsewhere() -> None:
    assert numbers(mass_of(Body(shape={"rod": 2, "mass": 1}, com=[0, 0, 0])).com).tolist() == [0, 0, 0]


def test_body_without_inertia_is_a_particle() -> None:
    found = mass_of(Body(mass=2, com=[1, 2, 3]))
    assert numbers(found.inertia).tolist() == [0] * 6
    assert numbers(found.com).tolist() == [1, 2, 3]


def test_turns_follow_each_other_about_turned_axes() -> None:
    frame = Frame(rotate=[Turn("z", "90 deg"), Turn("x", "90 deg"), Turn([1, 1, 0], 0.3)])
    R = np.array([numbers(row) for row in pose_of(frame).rotation])
    first, second = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    a = np.array([1, 1, 0]) / math.sqrt(2)
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    third = np.eye(3) + math.sin(0.3) * K + (1 - math.cos(0.3)) * K @ K
    np.testing.assert_allclose(R, first @ second @ third, atol=1e-15)


def test_right_angles_are_exact() -> None:
    rotation = pose_of(Frame(rotate=[Turn("z", "90 deg")])).rotation
    assert rotation[0] == tuple(map(as_node, (0, -1, 0)))


def test_unit_vectors_are_exact_where_they_can_be() -> None:
    assert unit_vector(tuple(map(as_node, (0, 3, -4)))) == (as_node(0), as_node(3) / 5, as_node(-4) / 5)
