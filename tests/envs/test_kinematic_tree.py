"""Arms that branch, and joints that follow others: where their links are and how fast they move."""

from __future__ import annotations

from pathlib import Path

import coal
import numpy as np
import pytest
from arm_speeds import assert_bounded, bounds_of
from arms import at, ball
from coal_shapes import coal_geometry
from made_trees import assert_as_in_pinocchio, made_tree

from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import Joint, KinematicTree, Link, Mimic
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld

SEEDS = range(12)


def written(folder: Path, text: str) -> Path:
    file = folder / "robot.urdf"
    file.write_text(text)
    return file


def tree_arm(folder: Path, seed: int, self_collision: bool = True) -> Arm:
    tree, parts = read_urdf(written(folder, made_tree(seed)))
    return Arm(tree, parts, self_collision)


def sampled(tree: KinematicTree, n: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(tree.lower, tree.upper, (n, tree.dimension))


@pytest.mark.parametrize("seed", SEEDS)
def test_links_of_random_trees_are_where_pinocchio_has_them(seed: int, tmp_path: Path) -> None:
    text = made_tree(seed)
    tree, _ = read_urdf(written(tmp_path, text))
    assert_as_in_pinocchio(text, tree, sampled(tree, 10, seed))


def test_random_trees_branch_and_mimic(tmp_path: Path) -> None:
    trees = [tree_arm(tmp_path, seed).tree for seed in SEEDS]
    assert sum(not tree.is_serial for tree in trees) > 8
    assert sum(tree.dimension < len(tree.joints) for tree in trees) > 4
    assert sum(any(one.wraps for one in tree.joints) for tree in trees) > 4


@pytest.mark.parametrize("seed", SEEDS)
def test_no_point_of_a_tree_outruns_its_bound(seed: int, tmp_path: Path) -> None:
    arm = tree_arm(tmp_path, seed, self_collision=False)
    rng = np.random.default_rng(seed)
    for length in 10 ** rng.uniform(-2, 0, 8):
        a, b = rng.uniform(arm.tree.lower, arm.tree.upper, (2, arm.tree.dimension))
        assert_bounded(arm, a, arm.tree.space.unwrapped(np.array([a, a + length * (b - a)]))[1])


def distances(arm: Arm, q: Array) -> Array:
    """Of the pairs of an arm, (n, pairs), by coal."""
    shapes = [(coal_geometry(one.placed.solid), one.placed.pose) for one in arm.parts]
    found = np.empty((len(q), len(arm.pairs)))
    for n, one in enumerate(q):
        bodies = arm.body_poses(one)
        whole = np.array([np.vstack([body, [0, 0, 0, 1]]) for body in bodies])
        placed = [
            coal.Transform3s(pose[:3, :3].copy(), pose[:3, 3].copy())
            for pose in (whole[p.body] @ s[1] for p, s in zip(arm.parts, shapes, strict=True))
        ]
        for k, (i, j) in enumerate(arm.pairs):
            result = coal.DistanceResult()
            request = coal.DistanceRequest()
            args = shapes[i][0], placed[i], shapes[j][0], placed[j]
            found[n, k] = coal.distance(*args, request, result)
    return found


@pytest.mark.slow(minutes=0.5)
@pytest.mark.parametrize("seed", SEEDS)
def test_distances_of_links_change_no_faster_than_the_bounds(seed: int, tmp_path: Path) -> None:
    """Of the parts of two branches both move: coal's distances, at steps of a 60th."""
    arm = tree_arm(tmp_path, seed)
    rng = np.random.default_rng(seed)
    first = [i for i, _ in arm.pairs]
    for length in 10 ** rng.uniform(-1.5, 0, 8):
        a, b = rng.uniform(arm.tree.lower, arm.tree.upper, (2, arm.tree.dimension))
        b = arm.tree.space.unwrapped(np.array([a, a + length * (b - a)]))[1]
        apart = distances(arm, a + np.linspace(0, 1, 61)[:, None] * (b - a))
        both = (apart[1:] > 0) & (apart[:-1] > 0)
        fastest = np.where(both, np.abs(np.diff(apart, axis=0)) * 60, 0).max(axis=0)
        bounds = bounds_of(arm, a, b)
        assert (fastest <= bounds[first] + 60 * 1e-5).all()
        assert arm.motion_bound(a, b) == bounds.max()
        assert bounds.max() <= arm.rate_bound * np.linalg.norm(b - a) + 1e-9


def facing(*extra: Joint, parents: tuple[int, ...] = (0, 0)) -> Arm:
    """Two balls that slide along x, one from either side, with what else is told."""
    slides = [
        Joint("left", at(-1, 0, 0), np.array([1.0, 0, 0]), True, 0.0, 1.0),
        Joint("right", at(1, 0, 0), np.array([-1.0, 0, 0]), True, 0.0, 1.0),
    ]
    joints = (*extra, *slides)
    links = tuple(
        Link(f"l{n}", n, np.eye(4), f"l{parent}" if n else "")
        for n, parent in enumerate((0, *parents))
    )
    tree = KinematicTree(joints, links, parents)
    n = len(joints)
    return Arm(tree, [ball(n - 1, 0.1, 0), ball(n, 0.1, 0)], True)


def test_two_that_come_toward_each_other_near_by_the_sum_of_their_speeds() -> None:
    arm = facing()
    assert arm.pairs == ((1, 0),)
    a, b = np.array([0.1, 0.2]), np.array([0.4, 0.6])
    assert bounds_of(arm, a, b) == pytest.approx([0.3, 0.7])
    assert arm.motion_bound(a, b) == pytest.approx(0.7)
    assert arm.rate_bound == pytest.approx(2**0.5)
    world = ArmWorld(arm, [], "test")
    model = world.collision_model()
    far, near, past = np.array([[0.0, 0.0], [0.85, 0.85], [1.0, 1.0]])
    for end, free in ((near, True), (past, False)):
        assert model.segment_is_free(far, end) == free
        assert world.paths_are_free([np.array([far, end])], 2e-3).tolist() == [free]
    assert world.clearance(near[None]) == pytest.approx(0.1, abs=1e-9)


def test_what_moves_both_alike_does_not_count_between_them() -> None:
    """A turntable that carries both of them."""
    table = Joint("table", at(0, 0, 0), np.array([0.0, 0, 1]), False, -3.0, 3.0)
    arm = facing(table, parents=(0, 1, 1))
    a, b = np.zeros(3), np.array([1.0, 0.2, 0.3])
    left, right = bounds_of(arm, a, b)
    assert left < 1.0 * 1.1 + 0.2 + 1e-9
    assert right < 1.0 * 1.1 + 0.3 + 1e-9, "not the sum of both"
    b = np.array([0.0, 0.2, 0.3])
    assert bounds_of(arm, a, b) == pytest.approx([0.2, 0.5])


def test_one_that_follows_moves_by_its_ratio() -> None:
    """The fingers of a gripper, of which one opens twice as far as the other."""
    left = Joint("left", at(0, 0, 0), np.array([1.0, 0, 0]), True, 0.0, 0.1)
    mimic = Mimic(0, 2.0, 0.3)
    right = Joint("right", at(0, 0, 0), np.array([-1.0, 0, 0]), True, 0.3, 0.5, mimic=mimic)
    links = tuple(Link(f"l{n}", n, np.eye(4), "l0" if n else "") for n in range(3))
    arm = Arm(KinematicTree((left, right), links, (0, 0)), [ball(1, 0.1, 0), ball(2, 0.1, 0)], True)
    assert arm.tree.dimension == 1
    assert arm.tree.forward(np.array([[0.05]]))[0, :, 0, 3] == pytest.approx([0, 0.05, -0.4])
    assert bounds_of(arm, np.array([0.0]), np.array([0.1])) == pytest.approx([0.1, 0.3])
    assert arm.rate_bound == pytest.approx(3.0)


def test_a_joint_that_moves_a_part_twice_counts_twice() -> None:
    """The second follows the first: a point on the second arm goes round both."""
    axis = np.array([0.0, 0, 1])
    first = Joint("first", at(0, 0, 0), axis, False, -1.0, 1.0)
    second = Joint("second", at(1, 0, 0), axis, False, -1.0, 1.0, mimic=Mimic(0, 1.0, 0.0))
    links = tuple(Link(f"l{n}", n, np.eye(4), f"l{n - 1}" if n else "") for n in range(3))
    arm = Arm(KinematicTree.serial((first, second), links), [ball(2, 0.1, 1)], False)
    assert arm.rate_bound == pytest.approx(2.1 + 1.1)
    assert_bounded(arm, np.array([-0.1]), np.array([0.1]))
