"""Links that may touch an obstacle: by hand, where the answers are known."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import trimesh
from arms import arm_of, at, ball, fcl_only, turning

from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Problem
from envs.collision.checked_pairs import CheckedPairs
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import (
    Box,
    Capsule,
    ConvexHull,
    Cylinder,
    Mesh,
    PlacedShape,
    Solid,
    Sphere,
)
from envs.problem import Array
from envs.robots.arm import Part
from envs.robots.arm_clearance import part_clearances
from envs.robots.point import PointRobot
from envs.scenes.arm_world import ArmWorld


def mesh_of(made: trimesh.Trimesh) -> Mesh:
    return Mesh(np.asarray(made.vertices), np.asarray(made.faces))


def angle() -> Mesh:
    """Two rods at a right angle, not convex."""
    rods = [trimesh.creation.box((0.1, 0.02, 0.02)), trimesh.creation.box((0.02, 0.02, 0.1))]
    rods[1].apply_translation([0.04, 0, 0.06])
    return mesh_of(trimesh.util.concatenate(rods))


EGG = mesh_of(trimesh.creation.icosphere(subdivisions=2, radius=0.05))

LINKS: dict[str, Solid] = {
    "ball": Sphere(0.05),
    "box": Box(np.zeros(3), np.full(3, 0.08)),
    "capsule": Capsule(0.03, 0.06),
    "hull": ConvexHull.of_points(EGG.vertices),
    "convex mesh": EGG,
    "mesh": angle(),
}

OBSTACLES: dict[str, Solid] = {
    "box": Box(np.zeros(3), np.full(3, 0.5)),
    "cylinder": Cylinder(0.25, 0.5),
    "hull": ConvexHull.of_points(trimesh.creation.box((0.5, 0.5, 0.5)).vertices),
    "mesh": mesh_of(trimesh.creation.box((0.5, 0.5, 0.5))),
    "mesh that is no hull": mesh_of(trimesh.creation.annulus(0.05, 0.25, 0.5)),
}

WITHIN, INTO, BESIDE, AT_POST = 1.0, 0.75, 0.0, 2.0
"""Angles at which the hand is all within the crate (in the hole of one that is a ring), in its
side, away from everything, and in the post."""


def swinging(
    link: Solid, obstacle: Solid, allows: Callable[[str, str], bool] | None = None
) -> ArmWorld:
    """A hand a metre from the axis that it turns about, which meets a crate and then a post."""
    arm = arm_of([turning("z")], Part(1, PlacedShape(link, at(1, 0, 0))))
    crate = PlacedShape(obstacle, at(math.cos(WITHIN), math.sin(WITHIN), 0))
    post = PlacedShape(Cylinder(0.05, 1), at(math.cos(AT_POST), math.sin(AT_POST), 0))
    return ArmWorld(arm, [crate, post], "test", names=("crate", "post"), allows=allows)


def at_crate(link: str, obstacle: str) -> bool:
    return (link, obstacle) == ("l1", "crate")


def answers(world: ArmWorld, q: float) -> set[bool]:
    """Whether a configuration is free, by everyone that is asked."""
    one = np.array([q])
    found = set()
    for model in (world.collision_model(), fcl_only(world)):
        found |= {model.is_valid(one), model.clearance(one) > 0}
        found.add(model.segment_is_free(one, one + 1e-4))
        found.add(model.min_clearance(np.array([one, one + 1e-4])) > 0)
    found.add(bool(world.clearance(one[None])[0] > 0))
    found.add(bool(world.paths_are_free([np.array([one, one + 1e-4])], 1e-3)[0]))
    return found


@pytest.mark.parametrize("obstacle", OBSTACLES)
@pytest.mark.parametrize("link", LINKS)
def test_a_link_may_be_in_what_it_may_touch_and_in_nothing_else(link: str, obstacle: str) -> None:
    solids = LINKS[link], OBSTACLES[obstacle]
    may, may_not = swinging(*solids, at_crate), swinging(*solids)
    for q in (WITHIN, INTO):
        assert answers(may, q) == {True}
        if q == INTO or obstacle != "mesh that is no hull":
            assert answers(may_not, q) == {False}
    for world in (may, may_not):
        assert answers(world, BESIDE) == {True}
        assert answers(world, AT_POST) == {False}


@pytest.mark.parametrize("obstacle", OBSTACLES)
@pytest.mark.parametrize("link", LINKS)
def test_motions_lead_through_what_may_be_touched_alone(link: str, obstacle: str) -> None:
    a, b, post = (np.array([q]) for q in (BESIDE, 1.7, AT_POST))
    solids = LINKS[link], OBSTACLES[obstacle]
    for world, free in ((swinging(*solids, at_crate), True), (swinging(*solids), False)):
        model = world.collision_model()
        assert model.segment_is_free(a, b) == fcl_only(world).segment_is_free(a, b) == free
        assert (world.prover.prove(a, b, 1e-3, 5e-4)[0] < 0) == free
        assert not model.segment_is_free(a, post)
        assert world.prover.prove(a, post, 1e-3, 5e-4)[0] >= 0
        paths = [np.array([a, b]), np.array([a, post])]
        assert world.paths_are_free(paths, 1e-3).tolist() == [free, False]


def test_the_judge_names_no_contact_that_is_allowed() -> None:
    solids = LINKS["capsule"], OBSTACLES["box"]
    path = np.array([[BESIDE], [1.7]])
    through, beyond = Problem(*path), Problem(path[0], np.array([AT_POST]))
    for world, verdict in (
        (swinging(*solids, at_crate), Verdict.VALID),
        (swinging(*solids), Verdict.COLLISION),
    ):
        judge = Judge(world)
        assert judge(through, path).verdict is verdict
        far = np.array([beyond.start, beyond.goal])
        found = judge.with_contact(judge(beyond, far), beyond, far)
        assert found.verdict is Verdict.COLLISION
        assert found.contact is not None
        met = "post" if verdict is Verdict.VALID else "crate"
        assert found.contact.between == ("link 'l1'", f"obstacle {met!r}")
        assert found.contact.distance <= world.tolerance


def test_one_obstacle_within_another_that_may_be_touched_may_not() -> None:
    arm = arm_of([turning("z")], ball(1, 0.05, 1))
    placed = [PlacedShape(one, at(1, 0, 0)) for one in (OBSTACLES["mesh"], Sphere(0.02))]
    world = ArmWorld(arm, placed, "test", names=("crate", ""), allows=at_crate)
    assert answers(world, 0.0) == {False}
    assert answers(world, 0.2) == {True}, "still within the crate"
    _, distance = world.checked_pairs().nearest(np.full(1, 0.2))
    assert distance == pytest.approx(2 * math.sin(0.1) - 0.07, abs=1e-6)


@pytest.mark.parametrize("hand", ["ball", "convex mesh", "mesh"])
def test_what_a_link_that_is_a_mesh_holds_within_may_be_there_if_it_may_touch_it(hand: str) -> None:
    shell = mesh_of(trimesh.creation.icosphere(subdivisions=3, radius=0.4))
    arm = arm_of([turning("z")], Part(1, PlacedShape(shell, at(1, 0, 0))))
    for allows, free in ((at_crate, True), (None, False)):
        crate = PlacedShape(LINKS[hand], at(1, 0, 0))
        assert answers(ArmWorld(arm, [crate], "test", names=("crate",), allows=allows), 0) == {free}


def test_of_two_links_one_may_touch_what_the_other_must_not() -> None:
    """An upper arm along x, and a hand beyond it that turns on its own."""
    joints = [turning("z"), turning("z", at(1, 0, 0))]
    arm = arm_of(joints, ball(1, 0.05, 0.9), ball(2, 0.05, 0.5))
    crate = PlacedShape(Box(np.zeros(3), np.full(3, 0.2)), at(1.5, 0, 0))
    for link, free in (("l2", True), ("l1", False)):
        world = ArmWorld(
            arm, [crate], "test", names=("crate",), allows=lambda one, _, link=link: one == link
        )
        model = world.collision_model()
        assert model.is_valid(np.zeros(2)) == free
        assert (world.approximate_clearance(np.zeros((1, 2)))[0] > 0) == free
    [folded] = world.clearance(np.array([[0, 3.0]]))
    gap = 1.4 - (1 + 0.5 * math.cos(3)) - 0.05
    assert folded == pytest.approx(gap, abs=1e-6), "although the upper arm is nearer"


def test_balls_are_asked_of_boxes_along_the_axes_that_they_must_not_touch() -> None:
    """These distances are FCL's."""
    boxes = [Box([0, 0, 0], [1, 1, 1]), Box([3, 0, 0], [1, 1, 1])]
    robot = PointRobot(0.1)
    for which, at_0, at_3 in (([], -1, -1), ([0], 2.4, -1), ([0, 1], np.inf, np.inf)):
        may_touch = np.isin(np.arange(2), which)[None]
        model = CollisionModel(robot, boxes, may_touch=may_touch)
        for x, expected in ((0, at_0), (3, at_3)):
            q = np.array([x, 0.0, 0])
            assert model.is_valid(q) == (expected > 0)
            found = model.clearance(q)
            assert found == pytest.approx(expected) if expected > 0 else found < 0


def test_a_table_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match=r"may_touch must be \(1, 2\), not \(2,\)"):
        CollisionModel(
            PointRobot(0.1), [Sphere(1), Sphere(2)], may_touch=np.zeros(2, dtype=np.bool_)
        )


def cluttered(seed: int, share: float) -> ArmWorld:
    """An arm of several links of all kinds among obstacles of all kinds, some of which some links
    may touch."""
    rng = np.random.default_rng(seed)
    joints = [turning("z"), *(turning(axis, at(0.25, 0, 0)) for axis in "yzy")]
    kinds = list(LINKS)
    parts = [
        Part(body, PlacedShape(LINKS[kinds[rng.integers(len(kinds))]], at(x, 0, 0)))
        for body in range(1, 5)
        for x in (0.08, 0.17)
    ]
    ways = rng.normal(size=(len(OBSTACLES), 3))
    places = rng.uniform(0.7, 1, (len(ways), 1)) * ways / np.linalg.norm(ways, axis=1)[:, None]
    obstacles = [
        PlacedShape(one, at(*place, *rng.uniform(-3, 3, 3)))
        for one, place in zip(OBSTACLES.values(), places, strict=True)
    ]
    names = [f"o{n}" for n in range(len(obstacles))]
    may = {(f"l{i}", name) for i in range(1, 5) for name in names if rng.random() < share}
    return ArmWorld(
        arm_of(joints, *parts, self_collision=True),
        obstacles,
        "test",
        names=names,
        allows=lambda link, name: (link, name) in may,
    )


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_each_part_sees_the_obstacles_that_it_must_not_touch(seed: int) -> None:
    """Its clearance by spheres is that in a world of these alone."""
    world = cluttered(seed, 0.4)
    assert world.may_touch is not None
    q = np.random.default_rng(seed).uniform(world.lower, world.upper, (50, 4))
    unpaired = world.robot.arrays._replace(branches=world.robot.arrays.branches[:0])

    def by_part(scene: ArmWorld) -> Array:
        found = np.empty((len(q), world.robot.moving))
        for one, parts in zip(q, found, strict=True):
            part_clearances(unpaired, scene.scenes, one, parts, np.inf)
        return found

    found = by_part(world)
    for first in range(0, world.robot.moving, 2):  # of each link
        passed = world.may_touch[first]
        seen = [one for one, may in zip(world.obstacles, passed, strict=True) if not may]
        alone = by_part(ArmWorld(world.robot, seen, "test"))
        parts = [first, first + 1]
        assert (found[:, parts] == alone[:, parts]).all()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_clearances_are_the_least_of_the_pairs_that_must_not_touch(seed: int) -> None:
    world = cluttered(seed, 0.4)
    pairs = world.checked_pairs()
    every = CheckedPairs(world.robot, world.obstacles)
    assert world.may_touch is not None
    assert len(every.numbers) - len(pairs.numbers) == world.may_touch.sum() > 0
    rng = np.random.default_rng(seed)
    q = rng.uniform(world.lower, world.upper, (150, 4))
    exact = world.clearance(q)
    free = exact > 0
    assert 50 < free.sum() < 140
    least = [pairs.nearest(one)[1] for one in q[free]]
    assert exact[free] == pytest.approx(least, abs=1e-9)
    rounding = 1e-6  # by which distances of meshes may be too short
    assert (world.approximate_clearance(q)[free] <= exact[free] + rounding).all()
    assert (world.clearance(q)[free] > [every.nearest(one)[1] for one in q[free]]).any()


def test_where_nothing_may_be_touched_nothing_is_new() -> None:
    """An array of none is none, and the world's fingerprint that of one without."""
    without, none, some = cluttered(0, -1), cluttered(0, -1), cluttered(0, 0.4)
    without._allows = None
    assert without.may_touch is None
    assert none.may_touch is None
    assert none.fingerprint == without.fingerprint != some.fingerprint
    assert "may_touch" not in none.definition()
    assert some.may_touch is not None
    assert some.definition()["may_touch"] == np.argwhere(some.may_touch).tolist()


def test_problems_are_made_where_a_link_is_always_in_what_it_may_touch() -> None:
    for allows, many in ((at_crate, 3), (None, 0)):
        arm = arm_of([turning("z")], ball(1, 0.05, 0.5))
        table = PlacedShape(Box(np.zeros(3), np.full(3, 2.0)), np.eye(4))
        post = PlacedShape(Cylinder(0.05, 1), at(-0.5, 0.1, 0))
        world = ArmWorld(arm, [table, post], "test", names=("crate", "post"), allows=allows)
        if many:
            problems = world.sample_problems(many, 0)
            ends = np.array([q for one in problems for q in (one.start, one.goal)])
            assert (world.clearance(ends) >= world.min_clearance).all()
            continue
        with pytest.raises(ValueError, match="found only 0 of 3 problems"):
            world.sample_problems(3, 0)


def test_what_may_be_touched_is_no_cause_of_having_no_problems() -> None:
    arm = arm_of([turning("z")], ball(1, 0.05, 0.5))
    boxes = [
        PlacedShape(Box(np.zeros(3), np.full(3, 2.0)), at(*place)) for place in ((0, 0, 0),) * 2
    ]
    world = ArmWorld(arm, boxes, "test", names=("crate", "wall"), allows=at_crate)
    with pytest.raises(ValueError, match=r"link 'l1' to obstacle 'wall' in 100%") as caught:
        world.sample_problems(3, 0)
    assert "crate" not in str(caught.value)
