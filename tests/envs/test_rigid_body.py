"""Rigid bodies: where they are, and how fast they move at most."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from envs.collision.shapes import PlacedShape
from envs.errors import InputError
from envs.problem import Array
from envs.robots.bodies import NAMED, body
from envs.robots.rigid_body import InSpace, InThePlane, RigidBody, Translation

LOW, HIGH = np.full(3, -5.0), np.full(3, 5.0)
PLACEMENTS = {
    "r3": Translation(LOW, HIGH),
    "se2": InThePlane(LOW, HIGH, z=1.5, weight=0.7),
    "se3": InSpace(LOW, HIGH, weight=2.0),
}
seeds = st.integers(0, 2**32 - 1)


def surface(parts: list[PlacedShape]) -> Array:
    """Corners of a body's triangles (n, 3), in its frame."""
    return np.concatenate([np.asarray(part.triangulate().vertices) for part in parts])


def moved(robot: RigidBody, q: Array) -> Array:
    """The same at a configuration, by the poses of its shapes."""
    found = []
    for part, pose in zip(robot.parts, robot.poses(q), strict=True):
        points = np.asarray(part.solid.triangulate().vertices)
        found.append(points @ pose[:, :3].T + pose[:, 3])
    return np.concatenate(found)


@pytest.mark.parametrize("name", PLACEMENTS)
@settings(deadline=None)  # compiled at first
@given(seed=seeds)
def test_it_is_where_scipy_turns_it(name: str, seed: int) -> None:
    robot = RigidBody(body("piano", 2.0), PLACEMENTS[name])
    q = robot.placement.space.sample(np.random.default_rng(seed), 1)[0]
    points = surface(list(robot.parts))
    turn, shift = {
        "r3": lambda: (Rotation.identity(), q),
        "se2": lambda: (Rotation.from_euler("z", q[2]), np.array([*q[:2], 1.5])),
        "se3": lambda: (Rotation.from_quat(q[3:]), q[:3]),
    }[name]()
    expected = turn.apply(points) + shift
    assert moved(robot, q) == pytest.approx(expected, abs=1e-12)
    assert robot.placed(points, q[None])[0] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("name", PLACEMENTS)
@pytest.mark.parametrize("shape", NAMED)
@settings(max_examples=20, deadline=None)
@given(seed=seeds, share=st.floats(1e-6, 1.0))
def test_no_point_moves_faster_than_the_bounds_say(
    name: str, shape: str, seed: int, share: float
) -> None:
    robot = RigidBody(body(shape, 2.0), PLACEMENTS[name])
    space = robot.placement.space
    a, far = space.sample(np.random.default_rng(seed), 2)
    b = space.between(a, far, share)
    bound = robot.motion_bound(a, b)
    [length] = space.distance(a[None], b[None])
    assert bound <= robot.rate_bound * length + 1e-9
    t = np.linspace(0, 1, 33)
    steps = [moved(robot, space.between(a, b, x)) for x in t]
    fastest = max(
        np.linalg.norm(later - now, axis=1).max() / (t[1] - t[0]) for now, later in pairwise(steps)
    )
    assert fastest <= bound + 1e-9


def test_the_bound_is_reached_by_the_farthest_point() -> None:
    """A bar that turns about its middle: its corners travel the radius times the angle."""
    robot = RigidBody(body("box", 2.0), PLACEMENTS["se2"])
    bound = robot.motion_bound(np.array([0, 0, 3.0]), np.array([0, 0, -3.0]))
    assert bound == pytest.approx(robot.radius * (2 * np.pi - 6))
    corner = float(np.linalg.norm([1, 0.4, 0.2]))
    assert corner <= robot.radius <= 1.05 * corner


def test_a_quaternion_and_its_opposite_are_no_motion() -> None:
    robot = RigidBody(body("l", 1.0), PLACEMENTS["se3"])
    q = robot.placement.space.sample(np.random.default_rng(0), 1)[0]
    opposite = np.concatenate([q[:3], -q[3:]])
    assert robot.motion_bound(q, opposite) == pytest.approx(0, abs=1e-12)
    assert moved(robot, q) == pytest.approx(moved(robot, opposite))


@pytest.mark.parametrize("shape", NAMED)
def test_named_bodies_are_as_long_as_was_asked_about_their_middles(shape: str) -> None:
    points = surface(body(shape, 3.0))
    low, high = points.min(axis=0), points.max(axis=0)
    assert (high - low).max() == pytest.approx(3.0)
    assert low + high == pytest.approx(np.zeros(3), abs=1e-12)


def test_a_file_s_body_is_about_the_middle_of_its_box(tmp_path: Path) -> None:
    cone = trimesh.creation.cone(0.5, 2.0)
    cone.apply_translation([7, 8, 9])
    cone.export(tmp_path / "cone.stl")
    for size, longest in ((0.0, 2.0), (5.0, 5.0)):
        points = surface(body(str(tmp_path / "cone.stl"), size))
        low, high = points.min(axis=0), points.max(axis=0)
        assert (high - low).max() == pytest.approx(longest)
        assert low + high == pytest.approx(np.zeros(3), abs=1e-6)


def test_what_is_no_body_is_said_in_a_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no body is called 'pinao'; did you mean 'piano'"):
        body("pinao", 1.0)
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    sheet.export(tmp_path / "sheet.stl")
    with pytest.raises(InputError, match="its surface is not closed"):
        body(str(tmp_path / "sheet.stl"), 1.0)
    with pytest.raises(InputError, match="no such file"):
        body(str(tmp_path / "none.stl"), 1.0)
    with pytest.raises(ValueError, match="at least one solid"):
        RigidBody([], PLACEMENTS["se3"])
