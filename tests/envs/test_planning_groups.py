"""Which joints of a robot move, where the others stand, and which links an SRDF lets touch."""

from __future__ import annotations

import logging
import shlex
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from bad_urdfs import LIMIT, collision, joint, link, robot
from documents import block_after
from made_trees import assert_as_in_pinocchio, made_tree

import envs
import planners
from bench.cli import app
from envs import InputError
from envs.errors import tell_once
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import read_srdf
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld

FINGER = '<limit lower="0.01" upper="0.04" effort="1" velocity="1"/>'


def ball(radius: float, height: float = 0.0) -> str:
    return collision(f'<sphere radius="{radius}"/>', f'<origin xyz="0 0 {height}"/>')


def arm(side: str) -> tuple[str, ...]:
    """Of two joints, with a hand on it whose two fingers move as one."""
    out = f'<origin xyz="{0.5 if side == "l" else -0.5} 0 0.1"/>'
    up, mimic = '<origin xyz="0 0 0.4"/>', f'<mimic joint="{side}_left" multiplier="-1"/>'
    names = ("upper", "fore", "hand", "left_finger", "right_finger")
    solids = (ball(0.06, 0.2), ball(0.05, 0.2), ball(0.04), ball(0.01, 0.05), ball(0.01, 0.05))
    return (
        *(link(f"{side}_{name}", solid) for name, solid in zip(names, solids, strict=True)),
        joint(f"{side}_shoulder", "torso", f"{side}_upper", inside=out + LIMIT, axis="0 1 0"),
        joint(f"{side}_elbow", f"{side}_upper", f"{side}_fore", inside=up + LIMIT, axis="0 1 0"),
        joint(f"{side}_wrist", f"{side}_fore", f"{side}_hand", "fixed", up),
        joint(f"{side}_left", f"{side}_hand", f"{side}_left_finger", "prismatic", FINGER, "1 0 0"),
        joint(
            *(f"{side}_right", f"{side}_hand", f"{side}_right_finger", "prismatic"),
            *(FINGER + mimic, "1 0 0"),
        ),
    )


RAISED = '<limit lower="0.1" upper="0.5" effort="1" velocity="1"/>'
LIFT = joint("lift", "base", "torso", "prismatic", RAISED, "0 0 1")
ROBOT = robot(link("base", ball(0.1)), link("torso", ball(0.2)), LIFT, *arm("l"), *arm("r"))

SRDF = """<?xml version="1.0"?><!-- made by hand --><robot name="arm">
<group name="left"><chain base_link="torso" tip_link="l_hand"/></group>
<group name="right"><joint name="r_shoulder"/><joint name="r_elbow"/><joint name="r_wrist"/></group>
<group name="hand"><link name="l_left_finger"/><link name="l_right_finger"/></group>
<group name="across"><chain base_link="r_fore" tip_link="l_fore"/></group>
<group name="both"><group name="left"/><group name="right"/></group>
<group name="placed"><joint name="in_world"/><group name="left"/></group>
<group name="still"><link name="l_hand"/></group>
<group_state name="up" group="left"><joint name="l_shoulder" value="0.5"/>
  <joint name="l_elbow" value="-0.25"/></group_state>
<group_state name="up" group="right"><joint name="r_shoulder" value="0.75"/></group_state>
<group_state name="open" group="hand"><joint name="l_left" value="0.03"/>
  <joint name="l_right" value="0.5"/></group_state>
<group_state name="mixed" group="left"><joint name="l_elbow" value="1"/></group_state>
<group_state name="mixed" group="both"><joint name="l_elbow" value="2"/></group_state>
<group_state name="broken" group="left"><joint name="l_elbow" value="9"/></group_state>
<group_state name="of_base"><joint name="root_joint" value="0 0 1.02 0 0 0 1"/>
  <joint name="r_shoulder" value="0.75"/></group_state>
<virtual_joint name="in_world" type="floating" parent_frame="world" child_link="base"/>
<passive_joint name="r_left"/>
<end_effector name="grips" group="hand" parent_link="l_fore"/>
<disable_collisions link1="l_hand" link2="r_hand" reason="Never"/>
<disable_collisions link1="l_left_finger" link2="l_right_finger"/>
<disable_collisions link1="l_hand" link2="sensor" reason="Default"/>
</robot>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "robot.urdf").write_text(ROBOT)
    (tmp_path / "robot.srdf").write_text(SRDF)
    tell_once.cache_clear()
    return tmp_path


@pytest.fixture
def told(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    with caplog.at_level(logging.INFO):
        yield caplog


def made(folder: Path, arguments: str) -> ArmWorld:
    srdf = f"srdf={folder / 'robot.srdf'},"
    env = envs.make(f"arm:urdf={folder / 'robot.urdf'},{srdf}{arguments}")
    assert isinstance(env, ArmWorld)
    return env


def moving(tree: KinematicTree) -> list[str]:
    return [one.name for one in tree.coordinates]


BOTH = ["l_shoulder", "l_elbow", "r_shoulder", "r_elbow"]

CHOICES = {
    "group=left": BOTH[:2],
    "group=right": BOTH[2:],
    "group=hand": ["l_left"],
    "group=across": BOTH,
    "group=both": BOTH,
    "tip=l_hand": ["lift", *BOTH[:2]],
    "tip=l_right_finger": ["lift", *BOTH[:2], "l_left"],
    "joints=lift": ["lift"],
    'joints="r_elbow,l_left"': ["l_left", "r_elbow"],
    "": ["lift", *BOTH[:2], "l_left", *BOTH[2:], "r_left"],
}


@pytest.mark.parametrize("arguments", CHOICES)
def test_these_joints_move(arguments: str, folder: Path) -> None:
    tree = made(folder, arguments).robot.tree
    assert moving(tree) == CHOICES[arguments]


@pytest.mark.parametrize(
    ("arguments", "values"),
    [
        ("group=left", {"lift": 0.1, "r_shoulder": 0, "l_left": 0.01, "r_left": 0.01}),
        ("group=left,state=up", {"r_shoulder": 0.75}),
        ("group=left,state=open", {"l_left": 0.03}),
        ("group=left,state=of_base", {"r_shoulder": 0.75}),
        ("group=left,state=up,pose=r_shoulder:-0.5", {"r_shoulder": -0.5}),
        ('group=left,pose="lift:0.3,r_elbow:1e-1,r_left:0.02"', {"lift": 0.3, "r_elbow": 0.1}),
    ],
)
def test_the_others_stand_where_they_are_told_to(
    arguments: str, values: dict[str, float], folder: Path
) -> None:
    tree = made(folder, arguments).robot.tree
    assert moving(tree) == BOTH[:2]
    locked = {"lift": 0.1, "l_left": 0.01, "r_left": 0.01, **values}
    locked |= {"r_left": 0.02} if "r_left" in arguments else {}
    q = np.random.default_rng(0).uniform(tree.lower, tree.upper, (5, 2))
    assert_as_in_pinocchio(ROBOT, tree, q, locked)


def test_what_stands_still_is_said_once(folder: Path, told: pytest.LogCaptureFixture) -> None:
    for _ in range(2):
        made(folder, "group=both,pose=lift:0.25")
    still = "joints that stand still: 'lift' at 0.25, 'l_left' at 0.01, 'r_left' at 0.01"
    assert told.messages.count(f"{folder / 'robot.urdf'}: {still}") == 1
    told.clear()
    made(folder, "")
    assert not any("stand still" in message for message in told.messages)


BAD = {
    "group=lefd": "unknown group 'lefd'; did you mean 'left'",
    "tip=l_hant": "unknown link 'l_hant'; did you mean 'l_hand'",
    "joints=lift_": "unknown joint 'lift_'; did you mean 'lift'",
    "group=left,state=upp": "unknown state 'upp'; did you mean 'up'",
    "group=left,pose=r_elbo:1": "unknown joint 'r_elbo'; did you mean",
    "group=left,tip=l_hand": "group and tip both say which joints move; give one of them",
    "tip=l_hand,joints=lift": "tip and joints both say",
    "joints=l_right": "joint 'l_right' follows 'l_left'; leave it out",
    "joints=l_wrist": "joint 'l_wrist' is fixed; leave it out",
    "group=still": "group 'still' has no joint that moves by itself",
    "tip=base": "tip 'base' has no joint that moves by itself",
    "group=left,pose=l_elbow:1": "pose: joint 'l_elbow' is one that moves",
    "group=left,pose=l_right:0": "pose: joint 'l_right' follows 'l_left'",
    "group=left,pose=r_elbow:90": "joint 'r_elbow' cannot stand at 90, only at -2 to 1.5",
    "group=right,state=broken": "joint 'l_elbow' cannot stand at 9, only at",
    "group=right,state=mixed": "two groups have a state 'mixed' with other values of 'l_elbow'",
    "group=placed": "joint 'in_world/trans_x' has no limits; say between which corners it moves",
    "group=left,pose=r_elbow": "pose='r_elbow' must be JOINT:VALUE",
    "group=left,pose=r_elbow:x": "pose='r_elbow:x' must be JOINT:VALUE",
    "group=left,pose=r_elbow:nan": "must be JOINT:VALUE",
}


@pytest.mark.parametrize("arguments", BAD)
def test_what_cannot_be_is_one_clear_line(arguments: str, folder: Path) -> None:
    with pytest.raises(InputError) as caught:
        made(folder, arguments)
    assert BAD[arguments] in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("arguments", ["group=left", "joints=lift,state=up"])
def test_groups_and_states_need_an_srdf(arguments: str, folder: Path) -> None:
    with pytest.raises(InputError, match=r"is in an SRDF file; give that, too: srdf=FILE"):
        envs.make(f"arm:urdf={folder / 'robot.urdf'},{arguments}")


BAD_SRDFS = {
    "empty": ("", "not well-formed XML"),
    "URDF's macros": (
        '<robot name="a" xmlns:xacro="http://ros.org/xacro"><xacro:arm/></robot>',
        "xacro IN > OUT.srdf",
    ),
    "not a robot": ("<sdf/>", "is this SRDF?"),
    "half a pair": ('<robot name="a"><disable_collisions link1="a"/></robot>', "without link2"),
    "half a chain": (
        '<robot name="a"><group name="g"><chain tip_link="a"/></group></robot>',
        "<chain> without base_link",
    ),
    "nameless group": ('<robot name="a"><group/></robot>', "<group> without name"),
    "word as value": (
        '<robot name="a"><group_state name="s" group="g"><joint name="j" value="x"/>'
        "</group_state></robot>",
        "state 's': value='x' must hold 1 or 3 or 4 or 7 finite",
    ),
    "no value": (
        '<robot name="a"><group_state name="s" group="g"><joint name="j"/></group_state></robot>',
        "value='' must hold 1 or 3 or 4 or 7 finite",
    ),
}


@pytest.mark.parametrize("name", BAD_SRDFS)
def test_bad_srdfs_are_one_clear_line(name: str, folder: Path) -> None:
    text, said = BAD_SRDFS[name]
    file = folder / "robot.srdf"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_srdf(file)
    assert str(caught.value).startswith(f"{file}: ")
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ('<group name="g"><group name="h"/></group>', "unknown group 'h'"),
        (
            '<group name="g"><group name="h"/></group><group name="h"><group name="g"/></group>',
            "groups 'g', 'h' are within each other",
        ),
        ('<group name="g"><joint name="none"/></group>', "unknown joint 'none'"),
        ('<group name="g"><chain base_link="base" tip_link="x"/></group>', "unknown link 'x'"),
    ],
)
def test_groups_of_what_is_not_there_are_one_clear_line(
    groups: str, said: str, folder: Path
) -> None:
    (folder / "robot.srdf").write_text(f'<robot name="arm">{groups}</robot>')
    with pytest.raises(InputError) as caught:
        made(folder, "group=g")
    assert said in str(caught.value)


def checked(env: ArmWorld) -> set[frozenset[str]]:
    links = env.robot.links
    return {frozenset((links[i], links[j])) for i, j in env.robot.pairs}


def test_links_that_the_srdf_names_may_touch(folder: Path, told: pytest.LogCaptureFixture) -> None:
    pairs = {frozenset(("l_hand", "r_hand")), frozenset(("l_left_finger", "l_right_finger"))}
    without = envs.make(f"arm:urdf={folder / 'robot.urdf'}")
    assert isinstance(without, ArmWorld)
    env = made(folder, "")
    assert checked(without) - checked(env) == pairs
    assert checked(env) < checked(without)
    assert env.fingerprint != without.fingerprint
    said = [message for message in told.messages if "robot.srdf" in message]
    assert said == [
        f"{folder / 'robot.srdf'}: disables collisions of 'sensor', not among the robot's links"
    ]


def test_collisions_of_a_link_are_disabled_with_all_but_those_enabled(folder: Path) -> None:
    (folder / "robot.srdf").write_text(
        '<robot name="arm"><disable_default_collisions link="l_hand"/>'
        '<enable_collisions link1="r_hand" link2="l_hand"/></robot>'
    )
    with_hand = {pair for pair in checked(made(folder, "")) if "l_hand" in pair}
    assert with_hand == {frozenset(("l_hand", "r_hand"))}


def test_arms_on_a_frame_without_solids_are_not_neighbours(folder: Path) -> None:
    """Nothing solid is between their upper arms, but two joints are."""
    text = ROBOT.replace(link("torso", ball(0.2)), link("torso", ""))
    text = text.replace('xyz="0.5 0 0.1"', 'xyz="0.1 0 0.1"').replace(
        'xyz="-0.5 0 0.1"', 'xyz="-0.1 0 0.1"'
    )
    (folder / "robot.urdf").write_text(text)
    found = checked(made(folder, ""))
    assert frozenset(("l_upper", "r_upper")) in found
    assert frozenset(("base", "l_upper")) not in found


@pytest.mark.slow
def test_two_arms_have_problems_and_keep_apart(folder: Path) -> None:
    env = made(folder, "group=both")
    assert len(env.robot.arrays.branches) > 4
    model = env.collision_model()
    for problem in env.sample_problems(5, 0):
        assert model.is_valid(problem.start)
        assert model.is_valid(problem.goal)


def test_a_planar_base_is_two_slides_and_a_turn_that_wraps(tmp_path: Path) -> None:
    limit = '<origin xyz="0 0 0.3" rpy="0 0 0.5"/><limit lower="-2" upper="3"/>'
    text = robot(
        *(link("world", ""), link("base", ball(0.2)), link("arm", ball(0.1, 0.4))),
        joint("drive", "world", "base", "planar", limit),
        joint("lift", "base", "arm", axis="0 1 0"),
    )
    (tmp_path / "robot.urdf").write_text(text)
    tree, parts = read_urdf(tmp_path / "robot.urdf")
    assert moving(tree) == ["drive/x", "drive/y", "drive/theta", "lift"]
    assert tree.lower.tolist() == pytest.approx([-2, -2, -np.pi, -2])
    assert [one.wraps for one in tree.coordinates] == [False, False, True, False]
    assert [part.link for part in parts] == ["base", "arm"]
    [pose] = tree.forward(np.array([[1.0, 2.0, np.pi / 2, 0.0]]))
    at = dict(zip((one.name for one in tree.links), pose, strict=True))
    c, s = np.cos(0.5), np.sin(0.5)
    assert at["base"][:3, 3] == pytest.approx([c - 2 * s, s + 2 * c, 0.3])
    assert at["base"][:2, 0] == pytest.approx([-s, c])
    [standing] = [read_urdf(tmp_path / "robot.urdf", PlanningGroup(joints=("lift",)))[0]]
    assert moving(standing) == ["lift"]
    [driving] = [read_urdf(tmp_path / "robot.urdf", PlanningGroup(joints=("drive",)))[0]]
    assert moving(driving) == ["drive/x", "drive/y", "drive/theta"]


@pytest.mark.parametrize("seed", range(8))
def test_locked_joints_of_random_trees_are_where_pinocchio_has_them(
    seed: int, tmp_path: Path
) -> None:
    text = made_tree(seed, joints=10)
    (tmp_path / "robot.urdf").write_text(text)
    whole, _ = read_urdf(tmp_path / "robot.urdf")
    rng = np.random.default_rng(seed)
    names = moving(whole)
    chosen = [name for name in names if rng.random() < 0.5] or names[:1]
    values = dict(zip(names, rng.uniform(whole.lower, whole.upper).tolist(), strict=True))
    pose = {name: value for name, value in values.items() if name not in chosen}
    group = PlanningGroup(joints=tuple(chosen), pose=pose)
    try:
        tree, _ = read_urdf(tmp_path / "robot.urdf", group)
    except InputError as error:
        assert "no link that moves has collision geometry" in str(error)
        return
    assert set(moving(tree)) == set(chosen)
    q = rng.uniform(tree.lower, tree.upper, (6, tree.dimension))
    assert_as_in_pinocchio(text, tree, q, pose)


def test_the_commands_of_the_documentation_are_accepted() -> None:
    for line in (block_after("planning groups") + block_after("bases")).splitlines():
        chosen = vars(app.parse(shlex.split(line)[1:]))
        [entry] = envs.REGISTRY.entries(chosen["env"])
        assert entry.spec.id == "arm"
        assert planners.REGISTRY.entries(chosen["planners"])
