"""Distances of capsules from all kinds of shapes, against coal's."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import coal
import numpy as np
import pytest
import trimesh
from coal_shapes import coal_mesh
from scipy.spatial.transform import Rotation

from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.problem import Array

STILL = np.eye(3, 4)
EGG = trimesh.creation.icosphere(subdivisions=1).apply_scale([0.1, 0.06, 0.13])
MESH = Mesh(EGG.vertices, EGG.faces)
COAL_MESH = coal_mesh(EGG.vertices, EGG.faces)

Made = tuple[Solid, Any]
"""A shape, and the same as coal has it."""


def _capsule(rng: np.random.Generator) -> Made:
    radius, length = rng.uniform(0.01, 0.2), rng.uniform(0.01, 0.8)
    return Capsule(radius, length), coal.Capsule(radius, length)


def _box(rng: np.random.Generator) -> Made:
    sides = rng.uniform(0.02, 0.6, 3)
    return Box(np.zeros(3), sides), coal.Box(*sides)


def _cylinder(rng: np.random.Generator) -> Made:
    radius, length = rng.uniform(0.01, 0.3), rng.uniform(0.01, 0.8)
    return Cylinder(radius, length), coal.Cylinder(radius, length)


def _ball(rng: np.random.Generator) -> Made:
    radius = rng.uniform(0.01, 0.3)
    return Sphere(radius), coal.Sphere(radius)


OTHERS: dict[str, Callable[[np.random.Generator], Made]] = {
    "box": _box,
    "cylinder": _cylinder,
    "ball": _ball,
    "capsule": _capsule,
    "mesh": lambda rng: (MESH, COAL_MESH),
}


def by_coal(a: Any, b: Any, pose: Array) -> float:
    """Asked for more digits than by default, so that what it is off is not taken for ours."""
    at = coal.Transform3s(np.ascontiguousarray(pose[:, :3]), pose[:, 3])
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-8, 1000
    return float(coal.distance(a, coal.Transform3s(), b, at, request, result))


def random_pose(rng: np.random.Generator) -> Array:
    """One in four with axes that are almost those of the other shape."""
    turn = Rotation.random(rng=rng)
    if rng.random() < 0.25:
        nudge = Rotation.from_rotvec(10 ** rng.uniform(-12, -2) * rng.normal(size=3))
        turn = nudge * Rotation.from_euler("xyz", rng.integers(4, size=3) * np.pi / 2)
    return np.column_stack([turn.as_matrix(), rng.normal(size=3) * rng.uniform(0.1, 0.8)])


@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_distances_of_capsules_are_never_above_coals_and_hardly_below(name: str) -> None:
    rng = np.random.default_rng(0)
    apart, above, below = 0, [], []
    for _ in range(5000):
        (capsule, a), (other, b) = _capsule(rng), OTHERS[name](rng)
        shapes = shapes_of([PlacedShape(capsule, np.eye(4)), PlacedShape(other, np.eye(4))])
        pose = random_pose(rng)
        exact = by_coal(a, b, pose)
        found = separations(shapes, 0, 1, np.array([[STILL, pose]]), np.inf)[0]
        apart += exact > 0
        above.append(found - max(exact, 0.0))
        below.append(max(exact, 0.0) - found)
    assert 2000 < apart < 5000
    assert max(above) <= 1e-9
    assert max(below) <= 1e-6
