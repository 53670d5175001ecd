"""Arms and scenes of users, as environments."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from arms import TURNING_HAND, arm_file
from bad_urdfs import LIMIT, collision, joint, link, robot

import envs
from envs import InputError
from envs.collision.shapes import PlacedShape, Sphere
from envs.robots import rrt_connect
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld


def test_a_users_arm_among_a_users_solids(tmp_path: Path) -> None:
    file = arm_file(tmp_path, *TURNING_HAND)
    (tmp_path / "scene.yaml").write_text("obstacles: [{sphere: 0.1, position: [0.5, 0, 0]}]")
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    assert [*env.lower, *env.upper] == [-math.pi, math.pi]
    (obstacle,) = env.obstacles
    assert isinstance(obstacle, PlacedShape)
    assert obstacle.solid == Sphere(0.1)
    found = env.clearance(np.array([[0.0], [math.pi / 2], [math.pi]]))
    assert found == pytest.approx([0, 0.5 * 2**0.5 - 0.15, 0.85], abs=1e-6)
    for problem in env.sample_problems(5, 0):
        assert env.clearance(np.array([problem.start, problem.goal])).min() >= 0.02
    assert isinstance(env.robot, Arm)
    assert env.robot.self_collision, "unless told otherwise"


def test_with_nothing_about_all_is_free(tmp_path: Path) -> None:
    env = envs.make(f"arm:urdf={arm_file(tmp_path, *TURNING_HAND)}")
    q = np.array([[0.0], [1.0]])
    assert np.isposinf(env.clearance(q)).all()
    assert np.isposinf(env.approximate_clearance(q)).all()
    assert env.speed(q).tolist() == [1, 1]
    model = env.collision_model()
    assert model.segment_is_free(env.lower, env.upper)
    assert model.min_clearance(np.array([env.lower, env.upper])) > 1e9


def test_with_nothing_about_there_are_problems(tmp_path: Path) -> None:
    env = envs.make(f"arm:urdf={arm_file(tmp_path, *TURNING_HAND)}")
    problems = env.sample_problems(7, 0)
    assert len(problems) == 7
    model = env.collision_model()
    assert all(model.segment_is_free(p.start, p.goal) for p in problems)


def test_too_little_room_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text("obstacles: [{box: [2, 2, 2]}]")
    file = arm_file(tmp_path, *TURNING_HAND)
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    with pytest.raises(InputError, match="found only 0 of 3 problems") as caught:
        env.sample_problems(3, 0)
    assert "\n" not in str(caught.value)


def test_ends_that_cannot_be_joined_are_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two posts part the one way there is, and in neither half are ends far enough apart."""
    monkeypatch.setattr(rrt_connect, "ITERATIONS", 20)
    entries = [f"{{sphere: 0.1, position: [{x}, {y}, 0]}}" for x, y in ((0.5, 0), (-0.5, 0))]
    (tmp_path / "scene.yaml").write_text(f"obstacles: [{', '.join(entries)}]")
    file = arm_file(tmp_path, *TURNING_HAND)
    env = envs.make(f"arm:urdf={file},scene={tmp_path / 'scene.yaml'}")
    env.min_separation = 2.6  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="joined") as caught:
        env.sample_problems(3, 0)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_a_table_with_no_blocked_line_has_too_few_problems(tmp_path: Path) -> None:
    class Demanding(ArmWorld):
        most_free_of_five = 2

    chain, parts = read_urdf(arm_file(tmp_path, *TURNING_HAND))
    far = np.eye(4)
    far[0, 3] = 9
    world = Demanding(Arm(chain, parts, False), [PlacedShape(Sphere(0.1), far)], "test")
    with pytest.raises(InputError, match="found only 2 of 3 problems") as caught:
        world.sample_problems(3, 0)
    assert "straight lines" in str(caught.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("arm", "urdf=FILE or robot=NAME is needed"),
        ("arm:scene=x.yaml", "urdf=FILE or robot=NAME is needed"),
        ("arm:urdf=FOLDER/none.urdf", "none.urdf: no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER/none.yaml", "none.yaml: no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER", "no such file"),
        ("arm:urdf=FOLDER/arm.urdf,scene=FOLDER/arm.urdf", "arm.urdf: "),
        ("arm:urdf=FOLDER/bad.urdf", "no limits"),
        ("arm:file=FOLDER/arm.urdf", "has no argument 'file'"),
        ("arm4:scene=-1", "scene must be between"),
        ("arm6:scene=4294967296", "scene must be between"),
        ("arm6:self_collision=perhaps", "not of type bool"),
        ("arm5:model=arm4", "has no argument 'model'"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(text: str, said: str, tmp_path: Path) -> None:
    arm_file(tmp_path, *TURNING_HAND)
    (tmp_path / "bad.urdf").write_text(
        robot(link("a"), link("b"), joint("j", "a", "b", inside="", axis="0 0 1"))
    )
    with pytest.raises(InputError) as caught:
        envs.make(text.replace("FOLDER", str(tmp_path)))
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_fingerprints_of_users_worlds_follow_content(tmp_path: Path) -> None:
    chains = {}
    for limit in (LIMIT, LIMIT.replace("1.5", "1.6")):
        file = arm_file(tmp_path, link("a"), link("b"), joint("j", "a", "b", inside=limit))
        for self_collision in ("true", "false"):
            env = envs.make(f"arm:urdf={file},self_collision={self_collision}")
            chains[limit, self_collision] = env.fingerprint
    assert len(set(chains.values())) == 4
    copy = tmp_path / "copy.urdf"
    copy.write_bytes(file.read_bytes())
    assert envs.make(f"arm:urdf={copy}").fingerprint == chains[limit, "true"]


def ball_at(x: float) -> str:
    return collision('<sphere radius="0.04"/>', f'<origin xyz="{x} 0.2 0"/>')


GRIPPER = (
    *TURNING_HAND,
    *(link(side, ball_at(x)) for side, x in (("left", 0.45), ("right", 0.55))),
    joint("holds", "hand", "left", "fixed", ""),
    joint("opens", "hand", "right", inside=LIMIT, axis="0 1 0"),
)


def gripper_in(folder: Path, pairs: str, post: str = "[1, 0, 0]") -> ArmWorld:
    """A hand with two fingers beside each other, between a post that has a name and another."""
    posts = f"{{sphere: 0.1, position: {post}, name: post}}, {{sphere: 0.1, position: [-1, 0, 0]}}"
    (folder / "scene.yaml").write_text(f"obstacles: [{posts}]\nallowed_collisions: {pairs}\n")
    env = envs.make(f"arm:urdf={arm_file(folder, *GRIPPER)},scene={folder / 'scene.yaml'}")
    assert isinstance(env, ArmWorld)
    return env


def test_links_that_a_scene_names_may_touch(tmp_path: Path) -> None:
    with_pair, without = (gripper_in(tmp_path, pairs) for pairs in ("[[right, left]]", "[]"))
    links = without.robot.links
    checked = [
        {frozenset((links[i], links[j])) for i, j in e.robot.pairs} for e in (without, with_pair)
    ]
    assert checked[0] - checked[1] == {frozenset(("left", "right"))}
    assert with_pair.fingerprint != without.fingerprint
    assert with_pair.clearance(np.zeros((1, 2)))[0] > without.clearance(np.zeros((1, 2)))[0]


def test_links_and_obstacles_that_a_scene_names_may_touch(tmp_path: Path) -> None:
    """The post is between the hand and the fingers, and meets all three."""
    q, beside = np.array([math.pi / 2 - 0.2, 0.0]), np.array([0.8, 0.0])
    texts = ("[]", "[[hand, post]]", "[[hand, post], [post, left], [right, post]]")
    worlds = {pairs: gripper_in(tmp_path, pairs, "[0, 0.5, 0]") for pairs in texts}
    for pairs, world in worlds.items():
        model, free = world.collision_model(), pairs == texts[2]
        assert model.is_valid(q) == free
        assert model.segment_is_free(beside, q) == free
        assert model.is_valid(beside)
    assert len({world.fingerprint for world in worlds.values()}) == 3
    post = len(world.robot.shapes)
    asked = [one.checked_pairs().numbers for one in worlds.values()]
    assert [sum(other == post for _, other in pairs) for pairs in asked] == [3, 2, 0]


def test_obstacles_are_called_by_their_names(tmp_path: Path) -> None:
    names = gripper_in(tmp_path, "[]").obstacle_names
    assert names == ["obstacle 'post'", "obstacle 2 (a sphere)"]


def test_what_stands_still_may_touch_obstacles(tmp_path: Path) -> None:
    """It is not checked against them."""
    assert (
        gripper_in(tmp_path, "[[base, post]]").fingerprint == gripper_in(tmp_path, "[]").fingerprint
    )


@pytest.mark.parametrize(
    ("pairs", "said"),
    [
        ("[[right, pots]]", "unknown link or obstacle 'pots'; did you mean 'post'?"),
        ("[[hnd, post]]", "unknown link or obstacle 'hnd'; did you mean 'hand'?"),
    ],
)
def test_pairs_that_cannot_be_allowed_are_one_clear_line(
    pairs: str, said: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError) as caught:
        gripper_in(tmp_path, pairs)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)
