"""Compiled checks of motions: what they take is free, and they refuse little else."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import trimesh
from map_files import write_ros
from slit_boxes import cracked_room, cracked_solid

import envs
from envs import Environment
from envs.collision.motion_check import (
    MotionCheck,
    array_at,
    checks_motions,
    known_as,
    motion_is_free,
)
from envs.problem import Array
from envs.robots.arm import SLACK, Arm
from envs.robots.sphere_trees import _to_solid, sphere_trees


def room(folder: Path) -> Environment:
    file = folder / "room.ply"
    trimesh.creation.box((10, 8, 4)).export(file)
    return envs.make(f"mesh:file={file},kind=interior")


def plan(folder: Path) -> Environment:
    return envs.make(f"grid:file={write_ros(folder)},radius=0.02")


def shell(folder: Path) -> Environment:
    file = folder / "ball.ply"
    trimesh.creation.icosphere(subdivisions=2).export(file)
    return envs.make(f"mesh:file={file},kind=shell")


def ball(folder: Path) -> Environment:
    file = folder / "ball.ply"
    trimesh.creation.icosphere(subdivisions=2).export(file)
    return envs.make(f"mesh:file={file},kind=solid")


def body_in_room(folder: Path) -> Environment:
    room(folder)
    return envs.make(f"rigid:body=l,size=2,world=mesh,file={folder / 'room.ply'},kind=interior")


WORLDS: dict[str, Callable[[Path], Environment]] = {
    **{
        text: lambda _, text=text: envs.make(text)  # type: ignore[misc]
        for text in (
            *("c3d", "box:robot_radius=0.5", "arm4", "arm6", "arm5:self_collision=true"),
            *(f"rigid:body=l,space={space}" for space in ("r3", "se2", "se3")),
        )
    },
    "shell": shell,
    "plan": plan,
    "room": room,
    "ball": ball,
    "body in a room": body_in_room,
}


_LOOKED_AT = 10
"""Motions that are refused though states along them are free."""


def sphere_reach(env: Environment) -> float:
    """How far the spheres that tell of an arm's links reach out of these, at most."""
    if not isinstance(env.robot, Arm):
        return 0.0
    trees = sphere_trees([part.placed for part in env.robot.parts])
    rng = np.random.default_rng(0)
    outward = rng.normal(size=(200, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    reach = 0.0
    for n, part in enumerate(env.robot.parts):
        for node in range(trees.firsts[n], trees.firsts[n + 1]):
            if trees.skips[node] == node + 1:  # a leaf
                points = trees.centers[node] + trees.radii[node] * outward
                reach = max(
                    reach, _to_solid(part.placed.solid.distance_row(part.placed.pose), points).max()
                )
    return reach


@pytest.mark.parametrize("name", WORLDS)
def test_what_is_taken_is_free_and_little_else_is_refused(name: str, tmp_path: Path) -> None:
    env = WORLDS[name](tmp_path)
    tolerance = env.planning_tolerance
    check, model = env.motion_check(tolerance), env.collision_model(tolerance / 2)
    assert check is not None
    reach = sphere_reach(env)
    planners_model = env.collision_model(tolerance)
    rng = np.random.default_rng(5)
    taken = refused = 0
    for a in env.space.sample(rng, 400):
        if not model.is_valid(a):
            continue
        [b] = env.space.sample(rng, 1)
        b = env.space.between(a, b, rng.uniform(0.05, 0.6))
        places = env.space.interpolate(
            *(np.repeat([x], 60, 0) for x in (a, b)), np.linspace(0, 1, 60)
        )
        least = min(model.clearance(q) for q in places)
        is_free = check.is_free(a, b)
        if env.prover is None:
            assert planners_model.stays_free(a, b) == is_free
        if is_free:
            taken += 1
            assert least > tolerance / 2
        elif least > 0 and refused < _LOOKED_AT:
            refused += 1
            finer = np.linspace(0, 1, 4000)
            ends = (np.repeat([x], len(finer), 0) for x in (a, b))
            found = (model.clearance(q) for q in env.space.interpolate(*ends, finer))
            assert min(found) <= 2 * tolerance + 2 * reach  # two links may be near each other
    assert taken > 40


def test_what_is_told_does_not_depend_on_what_was_asked_before(tmp_path: Path) -> None:
    env = ball(tmp_path)
    ends = np.random.default_rng(0).uniform(-9, 9, (300, 2, 3))
    [first, other] = (env.motion_check(env.planning_tolerance) for _ in range(2))
    assert first is not None
    assert other is not None
    told = [first.told(a, b) for a, b in ends]
    assert told == [other.told(a, b) for a, b in ends[::-1]][::-1]
    assert 0 < np.mean(told) < 1


CROSSINGS = {
    "out of a room": ("interior", cracked_room, (4.0, 0.0, 1.0), (6.0, 0.0, 1.0)),
    "into a pillar": ("interior", cracked_room, (2.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    "through a pillar": ("interior", cracked_room, (2.0, 0.0, 1.0), (-2.0, 0.0, 1.0)),
    "into a box": ("solid", cracked_solid, (4.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    "through a box": ("solid", cracked_solid, (4.5, 0.0, 1.0), (-4.5, 0.0, 1.0)),
}
"""What each crosses by cracks that the robot fits through: kind, file, and ends in its units."""

ROBOTS = {
    "ball": "mesh:file={file},kind={kind}",
    "body": "rigid:body=l,space=r3,size=0.03,world=mesh,file={file},kind={kind}",
}


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("name", CROSSINGS)
def test_through_cracks_nothing_comes_to_the_other_side(
    name: str, robot: str, tmp_path: Path
) -> None:
    kind, make, begin, end = CROSSINGS[name]
    env = envs.make(ROBOTS[robot].format(file=make(tmp_path / "cracked.ply"), kind=kind))
    transform = getattr(env, "world", env).transform
    a, b = transform.to_world(np.array([begin, end]))
    check, model = env.motion_check(env.planning_tolerance), env.collision_model()
    planners_model = env.collision_model(env.planning_tolerance)
    assert check is not None
    places = np.linspace(a, b, 200)
    touched = env.surface_clearance(places) if robot == "ball" else env._surface_clearance(places)  # type: ignore[attr-defined]
    assert (touched > 2 * env.tolerance).all(), "nothing is in the way"
    for one, other in ((a, b), (b, a)):
        if model.is_valid(one):
            assert not check.is_free(one, other)
            assert not planners_model.segment_is_free(one, other)
    assert model.min_clearance(np.array([a, b])) <= model.tolerance, "nor does the judge take it"


@pytest.mark.parametrize("robot", ROBOTS)
def test_beside_cracks_motions_are_free(robot: str, tmp_path: Path) -> None:
    file = cracked_room(tmp_path / "cracked.ply")
    env = envs.make(ROBOTS[robot].format(file=file, kind="interior"))
    transform = getattr(env, "world", env).transform
    check, model = env.motion_check(env.planning_tolerance), env.collision_model()
    assert check is not None
    for x, along in ((4.8, 2), (0.7, 2), (0.7, 1), (4.8, 1)):
        ends = np.full((2, 3), (x, 0.0, 0.0))
        ends[:, along] = -1.2, 1.2
        a, b = transform.to_world(ends)
        assert check.is_free(a, b)
        assert model.min_clearance(np.array([a, b])) > model.tolerance


@pytest.mark.parametrize("name", ["arm4", "arm6", "arm5:self_collision=true"])
def test_from_where_spheres_do_not_tell_a_motion_is_asked_for_distances(name: str) -> None:
    env = envs.make(name)
    tolerance = env.planning_tolerance
    check, model = env.motion_check(tolerance), env.collision_model(tolerance)
    assert check is not None
    rng, near = np.random.default_rng(6), 0
    sampled = env.space.sample(rng, 30_000)
    by_spheres = env.approximate_clearance(sampled)
    for a in sampled[(by_spheres > -SLACK) & (by_spheres < tolerance / 2)]:
        if model.clearance(a) > 1.5 * tolerance:
            near += 1
            b = a + rng.uniform(-1e-3, 1e-3, len(a))
            assert check.is_free(a, b) == model.stays_free(a, b)
    assert near > 10


class Above(NamedTuple):
    """What is above a height is free."""

    heights: Array
    tolerance: float


@checks_motions(Above)
def ends_are_above(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "Above")
    begin, end = array_at(a, size), array_at(b, size)
    least = check.heights.max() + check.tolerance
    return bool(begin[-1] > least and end[-1] > least)


def test_a_kind_of_ones_own_is_asked_by_compiled_code_and_by_others() -> None:
    check = MotionCheck(Above(np.array([1.0, 2.0, 0.5]), 0.25))
    for low, high, free in ((3.0, 4.0, True), (2.2, 4.0, False), (3.0, 0.0, False)):
        a, b = np.array([0.0, low]), np.array([[0.0, high], [9.0, 9.0]])[0]
        assert check.is_free(a, b) is free
        assert bool(motion_is_free(check.compiled, a, b)) is free


def test_what_it_knows_is_kept_and_may_change() -> None:
    heights = np.zeros(3)
    heights.flags.writeable = True
    check = MotionCheck(Above(heights, 0.25))
    high = np.array([0.0, 1.0])
    assert check.is_free(high, high)
    heights[1] = 2.0
    del heights
    gc.collect()
    assert not check.is_free(high, high)


def test_ends_that_are_no_whole_arrays_are_asked_all_the_same() -> None:
    check = MotionCheck(Above(np.zeros(3), 0.25))
    columns = np.array([[0.0, 9.0], [1.0, 9.0]])
    assert check.is_free(columns[:, 0], columns[:, 0])
    assert not check.is_free([0, 0], [1, 1])


def test_fields_of_other_types_are_refused() -> None:
    MotionCheck(Above(np.zeros(3), 0.25))
    with pytest.raises(TypeError, match="fields of other types"):
        MotionCheck(Above(np.zeros((3, 3)), 0.25))
    with pytest.raises(TypeError, match="not in C's order"):
        MotionCheck(Above(np.zeros(6)[::2], 0.25))
