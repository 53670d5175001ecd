"""Distances to primitive solids and meshes in compiled code, and their gradients."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envs.collision.mesh import MeshQueries
from envs.collision.primitive_sdf import (
    MESHES,
    NO_OBSTACLE,
    SceneArrays,
    nearest,
    normal_at,
    scene_arrays,
)
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, Obstacle, PlacedShape, Solid, Sphere
from envs.problem import Array

SOLIDS: dict[str, Solid] = {
    "cube": Box(np.zeros(3), np.full(3, 0.5)),
    "board": Box(np.array([0.1, -0.2, 0.3]), np.array([0.8, 0.5, 0.02])),
    "rod": Cylinder(0.05, 1.0),
    "disc": Cylinder(0.4, 0.03),
    "ball": Sphere(0.3),
    "pill": Capsule(0.1, 0.8),
}
LOWER, UPPER = np.array([-0.9, -0.6, -0.6]), np.array([0.9, 0.7, 0.6])


def scene_of(*obstacles: Obstacle) -> SceneArrays:
    return scene_arrays(obstacles, LOWER.copy(), UPPER.copy())


def distances(scene: SceneArrays, points: Array) -> Array:
    return np.array([nearest(scene, x, y, z, np.inf)[0] for x, y, z in points])


def random_pose(rng: np.random.Generator) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    pose[:3, 3] = rng.uniform(-0.5, 0.5, 3)
    return pose


def surface(solid: Solid) -> trimesh.Trimesh:
    """Triangles within 1e-6 of a solid's surface."""
    if isinstance(solid, Box):
        return trimesh.creation.box(solid.sides).apply_translation(solid.center)
    if isinstance(solid, Cylinder):
        return trimesh.creation.cylinder(solid.radius, solid.length, sections=2048)
    assert isinstance(solid, Mesh)
    return trimesh.Trimesh(solid.vertices, solid.faces, process=False)


def about(solid: Solid, pose: Array, rng: np.random.Generator, n: int) -> Array:
    """Points (n, 3) in a box about a solid, a third of them or more within it."""
    if isinstance(solid, Sphere | Capsule):
        high = solid.triangulate().bounds[1]
        low = -high
    else:
        low, high = surface(solid).bounds
    margin = 0.1 * (high - low)
    return rng.uniform(low - margin, high + margin, (n, 3)) @ pose[:3, :3].T + pose[:3, 3]


def signed(solid: Solid, pose: Array, points: Array) -> Array:
    """Signed distances by libigl, or in closed form."""
    local = (points - pose[:3, 3]) @ pose[:3, :3]
    if isinstance(solid, Sphere | Capsule):
        half = solid.length / 2 if isinstance(solid, Capsule) else 0.0
        beyond = local - np.clip(local, [0, 0, -half], [0, 0, half])
        away: Array = np.linalg.norm(beyond, axis=1) - solid.radius
        return away
    mesh = surface(solid)
    queries = MeshQueries(Mesh(mesh.vertices, mesh.faces))
    return np.where(queries.is_inside(local), -1, 1) * queries.distance(local)


@pytest.mark.parametrize(
    ("solid", "point", "distance"),
    [
        ("cube", [1.25, 0, 0], 1),  # before a face
        ("cube", [1.25, -1.25, 0.1], 2**0.5),  # off an edge
        ("cube", [-1.25, 1.25, 1.25], 3**0.5),  # off a corner
        ("cube", [0, 0, 0], -0.25),
        ("cube", [0.2, 0.1, 0], -0.05),
        ("board", [0.1, -0.2, 1.31], 1),  # its centre is not at the origin
        ("rod", [1.05, 0, 0.4], 1),  # beside it
        ("rod", [0, 0.02, -1.5], 1),  # below an end
        ("rod", [0, 0.35, 0.9], 0.5),  # off the rim
        ("rod", [0, 0, 0], -0.05),
        ("rod", [0.01, 0, 0.49], -0.01),
        ("pill", [1.1, 0, 0.3], 1),  # beside it
        ("pill", [0, 0.3, -0.8], 0.4),  # off an end
        ("pill", [0, 0, 0.1], -0.1),
        ("pill", [0, 0, 0.45], -0.05),
        ("ball", [0, 0.6, 0.8], 0.7),
        ("ball", [0.1, 0, 0], -0.2),
    ],
)
def test_distance_to_one_solid(solid: str, point: list[float], distance: float) -> None:
    scene = scene_of(PlacedShape(SOLIDS[solid], np.eye(4)))
    x, y, z = map(float, point)
    found = nearest(scene, x, y, z, np.inf)
    assert found == (pytest.approx(distance, abs=1e-12), 0)


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("seed", range(3))
def test_distances_agree_with_those_to_the_surface(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    solid, pose = SOLIDS[name], random_pose(rng)
    wide = rng.uniform(-1.5, 1.5, (200, 3))
    points = np.concatenate([wide, about(solid, pose, rng, 200)])
    found = distances(scene_of(PlacedShape(solid, pose)), points)
    assert found == pytest.approx(signed(solid, pose, points), abs=2e-6)
    assert 40 < (found < 0).sum() < 200


def clutter(rng: np.random.Generator) -> list[Obstacle]:
    """Solids of every kind, some of them twice, and a box that is not placed."""
    placed = [PlacedShape(solid, random_pose(rng)) for solid in [*SOLIDS.values()] * 2]
    return [*placed, Box(np.array([0.7, 0.7, 0]), np.full(3, 0.2))]


def test_a_union_is_as_near_as_its_nearest_solid() -> None:
    rng = np.random.default_rng(0)
    obstacles = clutter(rng)
    scene = scene_of(*obstacles)
    alone = [scene_of(obstacle) for obstacle in obstacles]
    for point in rng.uniform(-1.5, 1.5, (300, 3)):
        each = [nearest(one, *point, np.inf)[0] for one in alone]
        assert nearest(scene, *point, np.inf) == (min(each), int(np.argmin(each)))


CLUTTER = scene_of(*clutter(np.random.default_rng(1)))
AT = st.floats(-1.5, 1.5)


@given(AT, AT, AT, st.floats(-1, 2))
def test_what_is_farther_than_asked_is_not_named(x: float, y: float, z: float, most: float) -> None:
    whole = nearest(CLUTTER, x, y, z, np.inf)
    capped = nearest(CLUTTER, x, y, z, most)
    assert capped == (whole if whole[0] < most else (most, NO_OBSTACLE))


def test_nothing_is_infinitely_far() -> None:
    scene = scene_of()
    assert nearest(scene, 0.1, 0.2, 0.3, np.inf) == (np.inf, NO_OBSTACLE)
    assert nearest(scene, 0.1, 0.2, 0.3, 0.5) == (0.5, NO_OBSTACLE)


def gradient(scene: SceneArrays, point: Array, h: float) -> Array:
    steps = h * np.eye(3)
    return (distances(scene, point + steps) - distances(scene, point - steps)) / (2 * h)


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_gradients(name: str) -> None:
    rng = np.random.default_rng(4)
    pose = random_pose(rng)
    scene = scene_of(PlacedShape(SOLIDS[name], pose))
    compared, inside = 0, 0
    normal = np.empty(3)
    within = about(SOLIDS[name], pose, rng, 100)
    for point in np.concatenate([rng.uniform(-1, 1, (200, 3)), within]):
        near, far = gradient(scene, point, 1e-6), gradient(scene, point, 1e-4)
        if np.abs(near - far).max() > 0.01:  # a bend, where there is no gradient
            continue
        distance, which = nearest(scene, *point, np.inf)
        normal_at(scene, which, *point, normal)
        assert normal == pytest.approx(near, abs=1e-6)
        assert np.linalg.norm(normal) == pytest.approx(1)
        compared += 1
        inside += distance < 0
    assert compared > 150
    assert inside > 20


@pytest.mark.parametrize("name", SOLIDS)
def test_normals_are_finite_at_centres_and_on_surfaces(name: str) -> None:
    scene, normal = scene_of(PlacedShape(SOLIDS[name], np.eye(4))), np.empty(3)
    for point in ((0, 0, 0), (0.1, -0.2, 0.3), (0.25, 0, 0), (0.1, -0.2, 0.31), (0, 0.3, 0)):
        normal_at(scene, 0, *map(float, point), normal)
        assert np.isfinite(normal).all()
        assert np.linalg.norm(normal) <= 1 + 1e-12


def ring() -> Mesh:
    mesh = trimesh.creation.torus(0.4, 0.15, major_sections=48, minor_sections=24)
    return Mesh(mesh.vertices, mesh.faces)


def block(sides: list[float]) -> Mesh:
    mesh = trimesh.creation.box(sides)
    return Mesh(mesh.vertices, mesh.faces)


SPACING = 0.02 * float((UPPER - LOWER).max())


@pytest.mark.parametrize("solid", [ring(), block([0.5, 0.3, 0.2])], ids=["ring", "block"])
def test_distances_to_meshes_are_never_too_great_and_by_little_too_small(solid: Mesh) -> None:
    rng = np.random.default_rng(6)
    pose = random_pose(rng)
    scene = scene_of(PlacedShape(solid, pose))
    points = rng.uniform(LOWER, UPPER, (3000, 3))
    exact = signed(solid, pose, points)
    short = exact - distances(scene, points)
    assert (short >= -1e-6).all()
    assert (short <= math.sqrt(3) * SPACING + 1e-6).all()
    assert (exact < 0).sum() > 20
    assert all(nearest(scene, *point, np.inf)[1] == MESHES for point in points[:5])


def test_distances_to_meshes_are_never_too_great_beyond_the_grid() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 1.5, 0, 0
    solid = block([0.2, 0.2, 0.2])
    points = np.linspace([0.5, 0, 0], [3.0, 0, 0], 100)
    exact = signed(solid, pose, points)
    assert (distances(scene_of(PlacedShape(solid, pose)), points) <= exact + 1e-6).all()


def test_meshes_and_primitives_are_met_in_one_scene() -> None:
    there = np.eye(4)
    there[:3, 3] = 0.6, 0, 0
    scene = scene_of(block([0.2, 0.2, 0.2]), PlacedShape(Sphere(0.1), there))
    for x, which in ((-0.5, MESHES), (0.8, 0)):
        distance, found = nearest(scene, x, 0.0, 0.0, np.inf)
        assert found == which
        assert nearest(scene, x, 0.0, 0.0, distance) == (distance, NO_OBSTACLE)


def test_normals_of_meshes_point_away_from_them() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.3)
    scene = scene_of(Mesh(ball.vertices, ball.faces))
    rng = np.random.default_rng(7)
    way = rng.normal(size=(200, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    normal = np.empty(3)
    for one in way:
        normal_at(scene, MESHES, *(0.45 * one), normal)
        assert normal == pytest.approx(one, abs=0.02)
