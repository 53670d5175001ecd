"""Trees of spheres that cover the parts of arms, and what bounds the motions of these."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from arms import at
from made_trees import made_arm

from envs.collision.mesh import queries
from envs.collision.primitive_sdf import solid_rows, to_solid
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import body_motions, body_poses
from envs.robots.motion_proof import bound
from envs.robots.sphere_trees import NONE_INSIDE, SphereTrees, sphere_trees


def as_mesh(made: trimesh.Trimesh) -> Mesh:
    return Mesh(made.vertices, made.faces)


def open_box() -> Mesh:
    box = trimesh.creation.box((0.2, 0.2, 0.2)).subdivide().subdivide()
    return Mesh(box.vertices, box.faces[box.triangles_center[:, 2] < 0.09])


SOLIDS: dict[str, Solid] = {
    "box": Box(np.zeros(3), np.array([0.3, 0.2, 0.1])),
    "cylinder": Cylinder(0.05, 0.4),
    "capsule": Capsule(0.05, 0.4),
    "sphere": Sphere(0.1),
    "ring": as_mesh(trimesh.creation.annulus(0.1, 0.15, 0.1)),
    "open box": open_box(),
}


def tree_of(name: str) -> tuple[SphereTrees, PlacedShape]:
    placed = PlacedShape(SOLIDS[name], at(0.1, -0.2, 0.3, 0.4, 0.5, 0.6))
    return sphere_trees([placed]), placed


def leaves(trees: SphereTrees) -> Array:
    return np.flatnonzero(trees.skips == np.arange(len(trees.skips)) + 1)


@pytest.mark.parametrize("name", SOLIDS)
def test_a_sphere_holds_the_leaves_below_it(name: str) -> None:
    trees, _ = tree_of(name)
    is_leaf = np.isin(np.arange(len(trees.skips)), leaves(trees))
    assert trees.skips[0] == len(trees.skips) == trees.firsts[1]
    for number, end in enumerate(trees.skips):
        below = number + np.flatnonzero(is_leaf[number:end])
        away = np.linalg.norm(trees.centers[below] - trees.centers[number], axis=1)
        assert (away + trees.radii[below] <= trees.radii[number] * (1 + 1e-9)).all()


@pytest.mark.parametrize("name", SOLIDS)
def test_leaves_cover_the_surface(name: str) -> None:
    trees, placed = tree_of(name)
    points, _ = trimesh.sample.sample_surface(placed.solid.triangulate(), 5000, seed=0)
    points = np.asarray(points) @ placed.pose[:3, :3].T + placed.pose[:3, 3]
    some = leaves(trees)
    away = np.linalg.norm(points[:, None] - trees.centers[some], axis=2)
    assert (away - trees.radii[some]).min(axis=1).max() <= 1e-9


@pytest.mark.parametrize("name", SOLIDS)
def test_inner_spheres_are_within(name: str) -> None:
    trees, placed = tree_of(name)
    inner = leaves(trees)[trees.inner[leaves(trees)] > NONE_INSIDE]
    if name == "open box":  # who can tell what is within it?
        assert len(inner) == 0
        assert (trees.inner == NONE_INSIDE).all()
        return
    assert len(inner) > 0
    centers, radii = trees.centers[inner], trees.inner[inner]
    if isinstance(placed.solid, Mesh):
        local = (centers - placed.pose[:3, 3]) @ placed.pose[:3, :3]
        assert queries(placed.solid).is_inside(local).all()
        assert (radii <= queries(placed.solid).distance(local) + 1e-12).all()
    else:
        row = solid_rows([placed])
        assert all(to_solid(row, 0, *c) <= -r + 1e-12 for c, r in zip(centers, radii, strict=True))


@pytest.mark.parametrize("name", SOLIDS)
def test_inner_spheres_reach_no_farther_than_is_said(name: str) -> None:
    trees, _ = tree_of(name)
    some = leaves(trees)
    for number, end in enumerate(trees.skips):
        below = some[(some >= number) & (some < end)]
        away = np.linalg.norm(trees.centers[below] - trees.centers[number], axis=1)
        assert (away + trees.inner[below] <= trees.inner[number] + 1e-12).all()
        assert trees.inner[number] <= trees.radii[number] * (1 + 1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_velocities_and_bounds_of_accelerations_are_those_of_motions(
    seed: int, tmp_path: Path
) -> None:
    """|x(t + s) - x(t) - s v(t)| <= s^2 / 2 B of the spheres' centres, also seen from each
    other."""
    arm = made_arm(tmp_path, seed, meshes=0.5)
    arrays, trees = arm.arrays, sphere_trees([part.placed for part in arm.parts])
    rng = np.random.default_rng(seed)
    for a, b in rng.uniform(arm.tree.lower, arm.tree.upper, (20, 2, arm.tree.dimension)):
        speeds = arrays.tree.ratios * (b - a)[arrays.tree.coordinates]
        count = arm.moving + len(arrays.branches)
        bends, moves = np.full(count, np.nan), np.full(count, np.nan)
        bound(arrays, trees, speeds, np.empty(1 + len(speeds)), bends, moves)
        t, s = rng.uniform(0, 1), rng.uniform(-0.5, 0.5)
        now, then = (centers(arm, trees, a + x * (b - a)) for x in (t, t + s))
        velocity = velocities(arm, trees, a + t * (b - a), speeds)
        off = then - now - s * velocity
        for part in range(arm.moving):
            own = slice(trees.firsts[part], trees.firsts[part + 1])
            assert (np.linalg.norm(off[own], axis=1) <= s**2 / 2 * bends[part] + 1e-9).all()
            assert (np.linalg.norm((then - now)[own], axis=1) <= abs(s) * moves[part] + 1e-9).all()
        for n, (part, other, _) in enumerate(arrays.branches):
            i, j = rng.integers(trees.firsts[[part, other]], trees.firsts[[part + 1, other + 1]])
            between = now[i] - now[j]
            distance = np.linalg.norm(between)
            rate = abs(between @ (velocity[i] - velocity[j])) / max(distance, 1e-12)
            least = distance - abs(s) * rate - s**2 / 2 * bends[arm.moving + n]
            assert np.linalg.norm(then[i] - then[j]) >= least - 1e-9


def centers(arm: Arm, trees: SphereTrees, q: Array) -> Array:
    poses = np.empty((1 + len(arm.tree.joints), 3, 4))
    body_poses(arm.arrays.tree, q, poses)
    pose = poses[owners(arm, trees)]
    found: Array = np.einsum("nij,nj->ni", pose[:, :, :3], trees.centers) + pose[:, :, 3]
    return found


def velocities(arm: Arm, trees: SphereTrees, q: Array, speeds: Array) -> Array:
    count = 1 + len(arm.tree.joints)
    poses, shifts, spins = np.empty((count, 3, 4)), np.empty((count, 3)), np.empty((count, 3))
    body_motions(arm.arrays.tree, q, speeds, poses, shifts, spins)
    of = owners(arm, trees)
    found: Array = shifts[of] + np.cross(spins[of], centers(arm, trees, q) - poses[of][:, :, 3])
    return found


def owners(arm: Arm, trees: SphereTrees) -> Array:
    return np.repeat([part.body for part in arm.parts], np.diff(trees.firsts))
