"""Poses, points and distances at many places of a motion, against those at one place."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, sliding, turning

from envs.collision.primitive_sdf import to_solid
from envs.collision.shapes import Box, Cylinder, Mesh, PlacedShape, Sphere
from envs.problem import Array
from envs.robots.arm import Arm, Part
from envs.robots.arm_prover import ArmProver
from envs.robots.kinematic_tree import Joint, body_motions, body_poses
from envs.robots.motion_places import (
    BODY,
    PLACES,
    POINT,
    _cosines_and_sines_of,
    bodies_at_configurations,
    bodies_at_places,
    point_at_places,
)
from envs.robots.place_distances import to_ball, to_box, to_cylinder, to_point, unproved
from envs.robots.sphere_proofs import _nearing

SKEW = np.array([2.0, -1.0, 2.0]) / 3


def skew() -> Joint:
    return Joint("skew", at(0.1, 0.2, -0.3), SKEW, False, -math.pi, math.pi)


def arm() -> Arm:
    joints = [
        turning("z"),
        skew(),
        replace(sliding("y"), origin=at(0.2, 0, 0)),
        turning("x", at(0, 0, 0.4)),
        Joint("down", at(0, 0.1, 0.2), np.array([0.0, 0.0, -1.0]), False, -3.0, 3.0),
    ]
    return arm_of(joints, Part(5, PlacedShape(Sphere(0.1), at(0, 0, 0))))


def motion(seed: int) -> tuple[Arm, Array, Array]:
    made = arm()
    a, b = np.random.default_rng(seed).uniform(made.tree.lower, made.tree.upper, (2, 5))
    return made, a, b


@pytest.mark.parametrize(("begin", "width"), [(0.0, 1.0), (0.25, 1 / 16)])
def test_bodies_are_where_they_are_one_by_one(begin: float, width: float) -> None:
    made, a, b = motion(1)
    tree = made.arrays.tree
    count = 1 + len(tree.parents)
    bodies = np.empty(count * BODY)
    bodies_at_places(tree, a, b, begin, width, bodies, np.empty(2 * PLACES))
    found = bodies.reshape(count, 18, PLACES)
    poses, shifts, spins = np.empty((count, 3, 4)), np.empty((count, 3)), np.empty((count, 3))
    for place in range(PLACES):
        t = begin + width * (place + 0.5) / PLACES
        body_motions(tree, a + t * (b - a), tree.ratios * (b - a), poses, shifts, spins)
        assert found[:, :12, place].reshape(poses.shape) == pytest.approx(poses, abs=1e-12)
        assert found[:, 12:15, place] == pytest.approx(shifts, abs=1e-12)
        assert found[:, 15:, place] == pytest.approx(spins, abs=1e-12)


def test_bodies_at_configurations_are_where_they_are_one_by_one() -> None:
    """Also where joints have turned several times."""
    made = arm()
    tree = made.arrays.tree
    count = 1 + len(tree.parents)
    bodies, poses = np.full(count * BODY, np.nan), np.empty((count, 3, 4))
    for reach in (1.0, 20.0):
        q = reach * np.random.default_rng(3).uniform(-1, 1, (PLACES, 5))
        bodies_at_configurations(tree, q, bodies, np.empty(2 * PLACES))
        found = bodies.reshape(count, 18, PLACES)
        for place in range(PLACES):
            body_poses(tree, q[place], poses)
            assert found[:, :12, place].reshape(poses.shape) == pytest.approx(poses, abs=1e-9)
        assert (found[:, 12:] == 0.0).all()


@pytest.mark.parametrize("scale", [1e-9, 0.1, 1.0, 10.0, 1000.0])
def test_cosines_and_sines_by_series(scale: float) -> None:
    angles = scale * np.linspace(-math.pi, math.pi, PLACES)
    turns = np.concatenate([angles, np.empty(PLACES)])
    _cosines_and_sines_of(turns)
    assert turns[:PLACES] == pytest.approx(np.cos(angles), abs=2e-11)
    assert turns[PLACES:] == pytest.approx(np.sin(angles), abs=2e-11)


def test_velocities_of_points_are_those_of_their_ways() -> None:
    made, a, b = motion(2)
    tree, point, step = made.arrays.tree, np.array([0.3, -0.2, 0.1]), 1e-4
    bodies, out = np.empty((1 + len(tree.parents)) * BODY), np.empty(POINT)
    at_point = []
    for begin in (-step, 0.0, step):
        bodies_at_places(tree, a, b, begin, 1.0, bodies, np.empty(2 * PLACES))
        point_at_places(bodies[-BODY:], point, out)
        at_point.append(out.reshape(6, PLACES).copy())
    before, here, after = at_point
    assert (after[:3] - before[:3]) / (2 * step) == pytest.approx(here[3:], abs=1e-5)


SOLIDS = {
    "box": (Box(np.zeros(3), np.array([0.4, 0.6, 0.3])), to_box),
    "cylinder": (Cylinder(0.3, 0.5), to_cylinder),
    "ball": (Sphere(0.35), to_ball),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_distances_and_nearing_are_those_of_one_point(name: str) -> None:
    solid, to_this = SOLIDS[name]
    rng = np.random.default_rng(3)
    pose = np.eye(4)
    pose[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    pose[:3, 3] = 0.1, -0.2, 0.1
    row = solid.distance_row(pose)
    point = rng.uniform(-0.8, 0.8, (6, PLACES))
    point[:3, :4] = pose[:3, 3:] + point[:3, :4] / 8  # within
    apart, nearing = np.empty(PLACES), np.empty(PLACES)
    to_this(point.reshape(-1), row, 0.25, apart, nearing)
    for n in range(PLACES):
        distance, rate = _nearing(row.reshape(1, -1), 0, tuple(point[:, n]))
        assert apart[n] == pytest.approx(distance, abs=1e-12)
        assert apart[n] == pytest.approx(to_solid(row.reshape(1, -1), 0, *point[:3, n]), abs=1e-12)
        assert nearing[n] == pytest.approx(0.25 * rate, abs=1e-12)
    assert (apart < 0).any() and (apart > 0).any()


def test_a_place_is_left_where_two_points_may_come_too_near() -> None:
    rng = np.random.default_rng(4)
    point, other = rng.uniform(-1, 1, (2, 6, PLACES))
    apart, nearing = np.empty(PLACES), np.empty(PLACES)
    to_point(point.reshape(-1), other.reshape(-1), 0.1, apart, nearing)
    way, velocity = point[:3] - other[:3], point[3:] - other[3:]
    away = np.linalg.norm(way, axis=0)
    assert apart == pytest.approx(away)
    assert nearing == pytest.approx(0.1 * np.abs((way * velocity).sum(axis=0)) / away)
    left = unproved(apart, nearing, 0.8)
    assert [bool(left >> n & 1) for n in range(PLACES)] == list(apart - nearing <= 0.8)


def test_motions_go_through_a_frame_that_is_one_mesh() -> None:
    """Spheres about a mesh tell nothing of what is between its pieces."""
    pieces = [trimesh.creation.box((0.1, 0.1, 1.0)), trimesh.creation.box((0.1, 0.1, 1.0))]
    pieces[0].apply_translation((0.0, 0.5, 0.0))
    pieces[1].apply_translation((0.0, 1.1, 0.0))
    frame = trimesh.util.concatenate(pieces)
    obstacle = PlacedShape(Mesh(frame.vertices, frame.faces), np.eye(4))
    hand = trimesh.creation.box((0.6, 0.1, 0.1))
    hand.apply_translation((0.3, 0.0, 0.0))
    sliding_hand = arm_of(
        [replace(sliding("x", 4.0), origin=at(-3, 0.8, 0)), turning("z")],
        Part(2, PlacedShape(Mesh(hand.vertices, hand.faces), at(0, 0, 0))),
    )
    check = ArmProver(sliding_hand, [obstacle], None, 1.0).motion_check(1e-3)
    assert check is not None
    outside, within, beyond = np.array([[0.0, 0.0], [2.7, 0.0], [4.0, 0.0]])
    assert check.is_free(outside, within)
    assert check.is_free(outside, beyond)
    assert check.is_free(within, beyond)
    assert not check.is_free(within, within + [0.0, 1.5])
    assert not check.is_free(outside + [0.0, 1.5], beyond + [0.0, 1.5])
