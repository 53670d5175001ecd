"""The exact checks that ours are held to, against plain ones."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pinocchio
import pytest
from coal_shapes import ExactSolid, coal_mesh
from compared_robots import comparison
from exact_bodies import BodyMotion
from exact_scene import ExactScene, Frames
from made_robots import made_mesh
from scipy.spatial.transform import Rotation, Slerp

FLOOR = 0.02


def plain_distance(exact: ExactScene, frames: Frames) -> float:
    """The least distance of all pairs, each asked."""
    exact.place(frames)
    geometries = [solid.geometry for solid in exact.solids]
    return min(exact.by_coal((a, b), geometries[a], geometries[b]) for a, b in exact.pairs)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree 1", "tree 5", "body 6", "body 9"])
def test_a_motion_keeps_its_distance_until_it_comes_too_near(name: str, tmp_path: Path) -> None:
    compared = comparison(name, tmp_path)
    exact, space = compared.exact, compared.env.space
    rng = np.random.default_rng(0)
    found = {True: 0, False: 0}
    for a, b in zip(space.sample(rng, 20), space.sample(rng, 20), strict=True):
        motion = exact.motion(a, b)
        near = exact.first_below(motion, FLOOR, 1e-6)
        found[near is None] += 1
        times = np.linspace(0, 1.0 if near is None else near.t, 40, endpoint=False)
        for t in times if times[-1] > 0 else ():
            least = plain_distance(exact, motion.at(t))
            assert least > FLOOR - 1e-9
            assert exact.distance(motion.at(t)) == pytest.approx(least, abs=1e-9)
        if near is not None:
            assert plain_distance(exact, motion.at(near.t)) <= near.distance <= FLOOR
    assert all(found.values()), "of both kinds"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree 1", "tree 5", "body 6", "body 9"])
def test_what_is_found_in_a_hurry_is_there_and_seldom_missed(name: str, tmp_path: Path) -> None:
    compared = comparison(name, tmp_path)
    exact, space = compared.exact, compared.env.space
    rng = np.random.default_rng(1)
    found, missed = 0, 0
    for a, b in zip(space.sample(rng, 60), space.sample(rng, 60), strict=True):
        motion = exact.motion(a, b)
        first, soon = (
            search(motion, FLOOR, 1e-6) for search in (exact.first_below, exact.soon_below)
        )
        if soon is None:
            missed += first is not None
            continue
        assert first is not None
        assert plain_distance(exact, motion.at(soon.t)) <= soon.distance <= FLOOR
        assert soon.t > first.t - 1e-4
        if soon.t > 0:
            assert soon.distance > FLOOR - 1e-5
            found += soon.t < first.t + 1e-4
            missed += soon.t >= first.t + 1e-4
    assert found > 10
    assert missed < 0.1 * found


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tree 1", "tree 2", "tree 5", "body 6"])
def test_no_point_of_a_solid_outruns_its_bound(name: str, tmp_path: Path) -> None:
    compared = comparison(name, tmp_path)
    exact, space = compared.exact, compared.env.space
    # Those sides that are seen from the base, as by obstacles.
    whole = (exact.moved == exact.joints.moves[exact.sides]).all(axis=1)
    solids = exact.sides[whole]
    rng = np.random.default_rng(0)
    for a, b in zip(space.sample(rng, 100), space.sample(rng, 100), strict=True):
        motion = exact.motion(a, b)
        t, step = rng.uniform(0, 1), 10 ** rng.uniform(-4, -0.5)
        way = rng.normal(size=(len(exact.solids), 3))
        radii = np.array([solid.radius for solid in exact.solids])
        out = way * (radii / np.linalg.norm(way, axis=1))[:, None]
        exact.place(motion.at(t))
        bounds = step * exact.speeds(motion.at(t)) + step**2 / 2 * exact.bends(motion)
        before = exact.centres + np.einsum("gij,gj->gi", exact.turns, out)
        exact.place(motion.at(t + step))
        after = exact.centres + np.einsum("gij,gj->gi", exact.turns, out)
        moved = np.linalg.norm(after - before, axis=1)[solids]
        assert (moved <= bounds[whole] + 1e-12).all()


def test_a_body_goes_straight_and_turns_the_short_way() -> None:
    rng = np.random.default_rng(0)
    for turns in Rotation.random(20, rng=rng).as_matrix().reshape(10, 2, 3, 3):
        shifts = rng.normal(size=(2, 3))
        motion = BodyMotion(*map(pinocchio.SE3, turns, shifts))
        between = Slerp([0, 1], Rotation.from_matrix(turns))
        assert motion.speeds[1] == pytest.approx(
            (Rotation.from_matrix(turns[0]).inv() * Rotation.from_matrix(turns[1])).magnitude()
        )
        for t in (0.0, 0.3, 1.0):
            frames = motion.at(t)
            assert frames.turns[1] == pytest.approx(between(t).as_matrix(), abs=1e-12)
            assert frames.shifts[1] == pytest.approx((1 - t) * shifts[0] + t * shifts[1])


def test_convex_meshes_are_as_far_as_their_surfaces() -> None:
    """And solid: nothing is free within."""
    rng = np.random.default_rng(0)
    still, request = coal.Transform3s(), coal.DistanceRequest()
    kinds = set()
    for _ in range(30):
        mesh = made_mesh(rng, 0.1, 0.4)
        surface = coal_mesh(mesh.vertices, mesh.faces)
        solid = ExactSolid(coal_mesh(mesh.vertices, mesh.faces))
        kinds.add(solid.geometry is solid.hull)
        way = rng.normal(size=3)
        ball, at = coal.Sphere(0.05), coal.Transform3s()
        at.setTranslation(0.6 * way / np.linalg.norm(way))
        ours, plain, hull = (
            coal.distance(one, still, ball, at, request, coal.DistanceResult())
            for one in (solid.geometry, surface, solid.hull)
        )
        assert ours == pytest.approx(plain, abs=1e-6)
        assert hull <= plain + 1e-6
        assert np.abs(mesh.vertices - solid.middle).max(axis=0) == pytest.approx(solid.half)
        outside = np.linalg.norm(mesh.vertices - solid.middle, axis=1) > solid.radius + 1e-9
        assert not outside.any()
    assert kinds == {True, False}, "convex ones and others"


def test_what_is_within_a_mesh_is_in_contact_with_it() -> None:
    mesh = made_mesh(np.random.default_rng(5), 0.1, 0.4)
    while mesh.is_convex:
        mesh = made_mesh(np.random.default_rng(6), 0.1, 0.4)
    solid = ExactSolid(coal_mesh(mesh.vertices, mesh.faces))
    samples = np.random.default_rng(0).uniform(*mesh.bounds, (200, 3))
    expected = mesh.contains(samples)
    found = [solid.encloses(point[None]) for point in samples]
    assert found == expected.tolist()
    assert 0 < sum(found) < 200
