"""Quick proofs of arms' motions, beside the search that asks the collision model step by step."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, fcl_only, turning
from conftest import has_data

import envs
from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.collision.motion_check import (
    MOTION_FREE,
    MOTION_NEARS,
    MOTION_OPEN,
    MOTION_TOUCHES,
)
from envs.collision.shapes import Box, Mesh, PlacedShape, Sphere
from envs.problem import Array
from envs.robots.arm import Part
from envs.robots.arm_prover import ArmProver
from envs.scenes.arm_world import ArmWorld


def motions(env: Environment, n: int) -> list[tuple[Array, Array]]:
    """From valid configurations, short and long ones."""
    rng, model = np.random.default_rng(2), env.collision_model()
    found = []
    while len(found) < n:
        a, b = rng.uniform(env.lower, env.upper, (2, env.dimension))
        b = a + (b - a) * rng.uniform(0.05, 1)
        if model.is_valid(a):
            found.append((a, b))
    return found


@pytest.mark.parametrize("text", ["arm4", "arm6:self_collision=true"])
def test_the_answers_are_those_of_the_search_alone(text: str) -> None:
    """Where the least clearance lies between half the tolerance and all of it, either may do."""
    env = envs.make(text)
    model, alone = env.collision_model(), fcl_only(env)
    answers = []
    for a, b in motions(env, 150):
        found, expected = model.segment_is_free(a, b), alone.segment_is_free(a, b)
        if found != expected:
            least = alone.min_clearance(np.array([a, b]))
            assert env.tolerance / 2 <= least <= 2 * env.tolerance
        answers.append(expected)
    assert 30 < sum(answers) < 120


@pytest.mark.parametrize("text", ["arm5", "arm6:self_collision=true"])
def test_what_is_proved_keeps_the_tolerance_everywhere(text: str) -> None:
    env = envs.make(text)
    tolerance, exact = 2 * env.tolerance, fcl_only(env)
    proved = 0
    for a, b in motions(env, 60):
        place, _ = env.prover.prove(a, b, tolerance, tolerance / 2)
        if place >= 0:
            assert exact.clearance(a + place * (b - a)) <= tolerance
            continue
        proved += 1
        least = min(exact.clearance(a + t * (b - a)) for t in np.linspace(0, 1, 300))
        assert least > tolerance / 2
    assert proved >= 20


@pytest.mark.parametrize("text", ["arm4", "arm5:self_collision=true"])
def test_what_is_told_quickly_of_planners_motions_is_so(text: str) -> None:
    env = envs.make(text)
    tolerance, exact = env.planning_tolerance, fcl_only(env)
    prover = env.prover
    assert isinstance(prover, ArmProver)
    assert prover._quick is not None
    count = Counter[int]()
    rng = np.random.default_rng(8)
    pairs = motions(env, 100)
    pairs += [(a, a + rng.uniform(-0.2, 0.2, len(a))) for a, _ in pairs]
    pairs += [(b, b) for _, b in pairs]
    for a, b in pairs:
        told = prover._quick.told(a, b)
        count[told] += 1
        place, _ = prover.prove(a, b, tolerance, tolerance / 2)
        along = [exact.clearance(q) for q in np.linspace(a, b, 400)]
        if told == MOTION_FREE:
            assert place < 0
            assert min(along) > tolerance / 2
        elif told != MOTION_OPEN:
            assert place >= 0
            assert min(along) <= (0.01 if told == MOTION_TOUCHES else tolerance)  # of a sample
        assert (prover.told(a, b, tolerance) == MOTION_FREE) == (place < 0)
    assert count[MOTION_FREE] > 40
    assert count[MOTION_TOUCHES] > 40
    assert count[MOTION_OPEN] > 5


def test_a_motion_that_ends_near_something_is_refused_by_its_end() -> None:
    """A bar in whose sides spheres reach out, above a plate at less than the tolerance of planners
    and at more; and within it."""
    bar = PlacedShape(Box((0, 0, 0), (1.0, 0.2, 0.2)), at(0.5, 0, 0))
    arm = arm_of([turning("z")], Part(1, bar))
    for gap, told in ((0.001, MOTION_NEARS), (0.05, MOTION_FREE), (-0.12, MOTION_TOUCHES)):
        plate = PlacedShape(Box((0, 0, 0), (0.6, 0.04, 0.6)), at(0.5, 0.1 + 0.02 + gap, 0))
        world = ArmWorld(arm, [plate], "test")
        assert 0.001 < world.planning_tolerance < 0.05
        prover = world.prover
        assert isinstance(prover, ArmProver)
        assert prover._quick is not None
        assert prover._quick.told(np.array([-1.0]), np.array([0.0])) == told


@pytest.mark.parametrize("text", ["arm4", "arm6:self_collision=true"])
def test_the_least_clearance_is_found_with_few_questions(text: str) -> None:
    """Never above the least of many samples by more than the tolerance, and that of a place on the
    path; what refutes a path may be any."""
    env = envs.make(text)
    model, alone = env.collision_model(), fcl_only(env)
    kept, asked = 0, {"with proofs": 0, "alone": 0}
    for a, b in motions(env, 40):
        path = np.array([a, (a + b) / 2 + 0.01, b])
        before = model.checks, alone.checks
        least, expected = model.min_clearance(path), alone.min_clearance(path)
        asked["with proofs"] += model.checks - before[0]
        asked["alone"] += alone.checks - before[1]
        assert (least > env.tolerance) == (expected > env.tolerance)
        if least <= env.tolerance:
            continue
        kept += 1
        assert abs(least - expected) <= env.tolerance
        along = np.concatenate([np.linspace(*ends, 200) for ends in (path[:2], path[1:])])
        sampled = min(alone.clearance(q) for q in along)
        assert sampled - 1e-9 <= least + env.tolerance
        assert least <= sampled + env.tolerance
    assert kept >= 5
    assert asked["with proofs"] < asked["alone"] / 4


def test_a_dip_between_waypoints_is_found() -> None:
    """A ball on an arm passes another at 3 cm, in the midst of a long swing."""
    arm = arm_of([turning("z")], Part(1, PlacedShape(Sphere(0.05), at(1, 0, 0))))
    world = ArmWorld(arm, [PlacedShape(Sphere(0.02), at(1.1, 0, 0))], "test")
    model = world.collision_model()
    for begin, end in ((-2.9, 2.5), (-0.3, 2.9), (-2.9, 0.001)):
        least = model.min_clearance(np.array([[begin], [end]]))
        assert 0.03 <= least <= 0.03 + world.tolerance


def hollow(radius: float) -> Mesh:
    shell = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return Mesh(np.asarray(shell.vertices), np.asarray(shell.faces))


def test_motions_within_a_closed_mesh_are_refused_though_nothing_is_touched() -> None:
    """A ball on an arm that swings inside of a shell, and one that swings outside."""
    arm = arm_of([turning("z")], Part(1, PlacedShape(Sphere(0.05), at(1, 0, 0))))
    a, b = np.array([-0.05]), np.array([0.05])
    for where, free in (((1, 0, 0), False), ((-1, 0, 0), True)):
        world = ArmWorld(arm, [PlacedShape(hollow(0.4), at(*where))], "test")
        model = world.collision_model()
        assert model.is_valid(a) == free
        assert model.segment_is_free(a, b) == free
        assert (model.clearance(a) > 0) == free


def test_a_link_that_holds_an_obstacle_within_is_refused() -> None:
    arm = arm_of([turning("z")], Part(1, PlacedShape(hollow(0.4), at(1, 0, 0))))
    world = ArmWorld(arm, [PlacedShape(Sphere(0.05), at(1, 0, 0))], "test")
    model = world.collision_model()
    assert not model.is_valid(np.zeros(1))
    assert not model.segment_is_free(np.array([-0.05]), np.array([0.05]))
    assert model.is_valid(np.full(1, 2.0))
    assert model.segment_is_free(np.array([1.9]), np.array([2.1]))


def test_known_to_be_apart_is_not_asked_of_insides() -> None:
    arm = arm_of([turning("z")], Part(1, PlacedShape(hollow(0.1), at(1, 0, 0))))
    asked = []

    def allowed(q: Array) -> Array:
        asked.append(q)
        return np.ones(len(q), dtype=np.bool_)

    shell = [PlacedShape(hollow(0.4), at(1, 0, 0))]
    model = CollisionModel(arm, shell, allowed=allowed, allowed_apart=True)
    model.is_valid(np.full(1, 3.0))
    assert not asked
    model.is_valid(np.zeros(1))
    assert len(asked) == 1


@pytest.mark.slow
def test_robots_of_meshes_are_proved_and_refused_alike() -> None:
    """Links that are meshes, some of them no hulls."""
    if not has_data("mbm/panda/panda.urdf"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    mbm = Path(os.environ["BENCH_DATA"]) / "mbm"
    env = envs.make(f"arm:urdf={mbm}/panda/panda.urdf,srdf={mbm}/panda/panda.srdf,group=panda_arm")
    model, alone = env.collision_model(), fcl_only(env)
    for a, b in motions(env, 40):
        found, expected = model.segment_is_free(a, b), alone.segment_is_free(a, b)
        if found != expected:
            least = alone.min_clearance(np.array([a, b]))
            assert env.tolerance / 2 <= least <= 2 * env.tolerance
