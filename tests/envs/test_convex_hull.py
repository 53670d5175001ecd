"""Convex hulls: what they are made of, what is within, and how far others are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from arms import TURNING_HAND, arm_file, at
from scipy.spatial import ConvexHull as Qhull

import envs
from envs.collision.fcl_model import CollisionModel
from envs.collision.mesh import Containment, queries
from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import Box, ConvexHull, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.problem import Array
from envs.robots.point import PointRobot

SIDES = np.array([0.4, 0.6, 0.8])
CORNERS = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3), axis=-1).reshape(-1, 3) * SIDES


def cloud(seed: int, n: int = 40) -> Array:
    return np.random.default_rng(seed).normal(size=(n, 3))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("places", [0, 1, 6])
def test_it_is_the_closed_surface_about_its_points(seed: int, places: int) -> None:
    """Rounded points are alike, and many of them in one plane."""
    points = cloud(seed).round(places)
    hull = ConvexHull.of_points(points)
    surface = hull.triangulate()
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.volume == pytest.approx(Qhull(points).volume)  # positive: outward
    assert surface.is_convex
    for place in points:
        assert queries(hull).distance(place[None]) <= 1e-12 or queries(hull).is_inside(place[None])


def test_the_order_of_points_and_those_within_do_not_matter() -> None:
    points, rng = cloud(0), np.random.default_rng(1)
    hull = ConvexHull.of_points(points)
    within = points.mean(axis=0) + 0.1 * rng.normal(size=(5, 3))
    more = rng.permutation(np.concatenate([points, points[:7], within]))
    assert ConvexHull.of_points(more) == hull
    assert ConvexHull.of_points(more).definition() == hull.definition()
    moved = points.copy()
    moved[np.argmax(points[:, 0])] *= 1 + 1e-12
    assert ConvexHull.of_points(moved).definition() != hull.definition()


def test_its_definition_is_by_its_corners_alone() -> None:
    """The triangles may come in another order, or be others where sides have many corners."""
    hull = ConvexHull.of_points(CORNERS)
    assert ConvexHull(hull.vertices, hull.faces[::-1]).definition() == hull.definition()
    assert hull.definition() != Mesh(hull.vertices, hull.faces).definition()


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([[0, 0, 0]] * 9, "at least 4 points that differ, not 1"),
        (CORNERS[:3], "at least 4 points that differ, not 3"),
        (CORNERS * [1, 1, 0], "must not all lie in one plane"),
        (cloud(0) * [1, 0, 0], "must not all lie in one plane"),
        (cloud(0) * [1, 1, 1e-10], "must not all lie in one plane"),
        (CORNERS + [0, np.nan, 0], "NaN or infinite"),
        (CORNERS * np.inf, "NaN or infinite"),
        (CORNERS + 1e7, "at most 1e+06"),
        (CORNERS[:, :2], r"must be \(n, 3\), not \(8, 2\)"),
        ([0, 0, 0], "has 1 axes, not 2"),
    ],
)
def test_points_that_make_no_solid_are_refused(points: Array, said: str) -> None:
    with np.errstate(invalid="ignore"), pytest.raises(ValueError, match=said.replace("+", r"\+")):
        ConvexHull.of_points(points)


@pytest.mark.parametrize("other", [Box(np.zeros(3), SIDES / 2), Sphere(0.2), Cylinder(0.1, 0.5)])
def test_the_hull_of_a_boxs_corners_is_as_far_as_the_box(other: Solid) -> None:
    hull, box = ConvexHull.of_points(CORNERS), Box(np.zeros(3), SIDES)
    shapes = shapes_of([hull, box, other])
    rng = np.random.default_rng(0)
    placed = [at(*rng.normal(size=3), *rng.normal(size=3)) for _ in range(200)]
    poses = np.array([[at(0, 0, 0), pose] for pose in placed])
    far = [separations(shapes, i, 2, poses[:, :, :3].copy(), np.inf) for i in (0, 1)]
    apart = far[1] > 0
    assert 20 < apart.sum() < 200
    assert far[0][apart] == pytest.approx(far[1][apart], abs=2e-6)
    assert far[0][~apart].max() < 0.5  # within, it is as far as the surface is; see Containment


def test_what_is_wholly_within_is_in_collision() -> None:
    hull = PlacedShape(ConvexHull.of_points(CORNERS), at(1, 0, 0))
    ball = PointRobot(radius=0.05)
    inside, beside = np.array([1.0, 0, 0]), np.array([1.3, 0, 0])
    outside = Containment(ball, [hull])
    assert outside(np.array([inside, beside])).tolist() == [False, True]
    model = CollisionModel(ball, [hull], allowed=outside)
    assert not model.is_valid(inside)
    assert model.clearance(inside) < 0
    assert model.is_valid(beside)
    assert model.clearance(beside) == pytest.approx(0.05, abs=1e-6)
    assert not model.segment_is_free(inside, inside + [0.01, 0, 0])


def test_an_arm_among_hulls_is_as_among_boxes(tmp_path: Path) -> None:
    """Its hand, a ball, goes round at 0.5 from the post."""
    file = arm_file(tmp_path, *TURNING_HAND)
    points = (CORNERS + [0.5, 0, 0.45]).tolist()
    clearances = []
    for entry in (
        f"hull: {points}",
        f"box: {SIDES.tolist()}, position: [0.5, 0, 0.45]",
    ):
        (tmp_path / "scene.yaml").write_text(f"obstacles: [{{{entry}}}]")
        env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
        q = np.linspace(-3, 3, 25)[:, None]
        clearances.append(env.clearance(q))
        assert (env.approximate_clearance(q) <= env.clearance(q) + 1e-9).all()
    assert env.obstacle_names == ["obstacle 1 (a box)"]
    assert clearances[0] == pytest.approx(clearances[1], abs=2e-6)
    assert clearances[0].min() < 0.05
