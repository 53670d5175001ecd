"""Bases that drive or float, and joints that turn any way: where links are, how fast they move, and
whether motions are certified."""

from __future__ import annotations

import math
from pathlib import Path
from time import perf_counter

import numpy as np
import pinocchio
import pytest
from arm_speeds import greatest_speeds_on
from bad_urdfs import LIMIT, collision, joint, link, robot
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import InputError
from envs.environment import Environment
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.base_placement import BasePlacement
from envs.robots.kinematic_tree import KinematicTree, body_poses
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import read_srdf
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from planners import REGISTRY, Budget, Status

BODY = collision('<box size="0.4 0.3 0.1"/>')
BOOM = collision('<box size="0.3 0.04 0.04"/>', '<origin xyz="0.15 0 0"/>')
HAND = collision('<sphere radius="0.05"/>', '<origin xyz="0.1 0 0"/>')
ARM = (
    link("body", BODY),
    link("boom", BOOM),
    link("hand", HAND),
    joint("shoulder", "body", "boom", inside='<origin xyz="0.2 0 0.05"/>' + LIMIT, axis="0 1 0"),
    joint("wrist", "boom", "hand", "continuous", '<origin xyz="0.35 0 0"/>', "0 0 1"),
)
PLACE = '<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/>'
FLOATS = robot(link("world", ""), joint("base", "world", "body", "floating", PLACE), *ARM)
VOLUME = (-1.0, -1.0, 0.0, 1.0, 1.0, 1.5)

SRDF = """<robot name="arm">
<virtual_joint name="float" type="floating" parent_frame="world" child_link="body"/>
<virtual_joint name="drive" type="planar" parent_frame="world" child_link="body"/>
<virtual_joint name="stand" type="fixed" parent_frame="world" child_link="body"/>
<group name="floating"><joint name="float"/><chain base_link="body" tip_link="hand"/></group>
<group name="driving"><group name="arm"/><joint name="drive"/></group>
<group name="standing"><group name="arm"/><joint name="stand"/></group>
<group name="arm"><joint name="shoulder"/><joint name="wrist"/></group>
<group name="bodies"><link name="body"/><link name="boom"/></group>
<group_state name="there" group="floating">
  <joint name="float" value="1 2 3 0 0 0.6 0.8"/><joint name="shoulder" value="0.5"/></group_state>
<group_state name="aside" group="driving"><joint name="drive" value="1 2 0.5"/></group_state>
<group_state name="short" group="driving"><joint name="drive" value="1"/></group_state>
<group_state name="null" group="floating"><joint name="float" value="1 2 3 0 0 0 0"/></group_state>
</robot>"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "arm.urdf").write_text(robot(*ARM))
    (tmp_path / "floats.urdf").write_text(FLOATS)
    (tmp_path / "arm.srdf").write_text(SRDF)
    return tmp_path


def tree_of(folder: Path, text: str, group: PlanningGroup | None = None) -> KinematicTree:
    (folder / "robot.urdf").write_text(text)
    placement = BasePlacement.of_numbers((), VOLUME)
    return read_urdf(folder / "robot.urdf", group, placement=placement)[0]


def made(folder: Path, arguments: str, urdf: str = "arm.urdf") -> ArmWorld:
    srdf = f"srdf={folder / 'arm.srdf'},"
    env = envs.make(f"arm:urdf={folder / urdf},{srdf}{arguments}")
    assert isinstance(env, ArmWorld)
    return env


IN_VOLUME = f'volume="{",".join(map(str, VOLUME))}"'


def poses_by_pinocchio(tree: KinematicTree, text: str, q: Array, root: object = None) -> Array:
    """Poses (links, 4, 4) of links at a configuration, whose joints Pinocchio has in the same
    order."""
    more = [] if root is None else [root]
    model = pinocchio.buildModelFromXML(text, *more)
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, q)
    frames = [model.getFrameId(one.name, pinocchio.FrameType.BODY) for one in tree.links]
    return np.array([data.oMf[frame].homogeneous for frame in frames])


def as_pinocchio_has_it(angle: float) -> list[float]:
    return [math.cos(angle), math.sin(angle)]


def assert_links_are(tree: KinematicTree, names: list[str], q: Array, expected: Array) -> None:
    [poses] = tree.forward(q[None])
    places = [n for n, one in enumerate(tree.links) if one.name in names]
    assert [tree.links[n].name for n in places] == names
    assert np.abs(poses[places] - expected).max() < 1e-12


LINKS = ["body", "boom", "hand"]


def test_a_floating_joint_is_where_pinocchio_has_it(tmp_path: Path) -> None:
    tree = tree_of(tmp_path, FLOATS)
    assert str(tree.space) == "R^3 x SO(3) x R^1 x S^1"
    names = [one.name for one in tree.joints]
    assert names[:4] == ["base/trans_x", "base/trans_y", "base/trans_z", "base/rot"]
    assert (tree.space.size, tree.dimension) == (9, 8)
    only = KinematicTree(tree.joints, tuple(x for x in tree.links if x.name in LINKS), tree.parents)
    for q in tree.space.sample(np.random.default_rng(0), 20):
        theirs = np.array([*q[:8], *as_pinocchio_has_it(q[8])])
        assert_links_are(only, LINKS, q, poses_by_pinocchio(only, FLOATS, theirs))


def test_a_virtual_joint_is_as_pinocchios_root_joints(folder: Path) -> None:
    for group, root in (
        ("floating", pinocchio.JointModelFreeFlyer()),
        ("driving", pinocchio.JointModelPlanar()),
    ):
        tree = made(folder, f"group={group},{IN_VOLUME}").robot.tree
        only = KinematicTree(tree.joints, tree.links[-3:], tree.parents)
        for q in tree.space.sample(np.random.default_rng(0), 20):
            base = q[:-2] if group == "floating" else [*q[:2], *as_pinocchio_has_it(q[2])]
            theirs = np.array([*base, q[-2], *as_pinocchio_has_it(q[-1])])
            assert_links_are(only, LINKS, q, poses_by_pinocchio(only, robot(*ARM), theirs, root))


def test_what_drives_is_in_the_plane_and_its_heading_wraps(folder: Path) -> None:
    tree = made(folder, f"group=driving,{IN_VOLUME}").robot.tree
    assert [one.name for one in tree.coordinates[:3]] == ["drive/x", "drive/y", "drive/theta"]
    assert tree.lower[:3] == pytest.approx([-1, -1, -math.pi])
    assert tree.upper[:2].tolist() == [1, 1]
    assert tree.space.wraps.tolist() == [False, False, True, False, True]
    in_plane = made(folder, 'group=driving,volume="-1,-2,3,4"').robot.tree
    assert in_plane.lower[:2].tolist() == [-1, -2]
    assert in_plane.upper[:2].tolist() == [3, 4]


@pytest.mark.parametrize("group", ["standing", "arm", "bodies"])
def test_other_groups_leave_the_base_where_it_is(group: str, folder: Path) -> None:
    tree = made(folder, f"group={group}").robot.tree
    assert [one.name for one in tree.links] == LINKS
    assert (tree.links[0].offset == np.eye(4)).all()


def test_a_joint_names_a_virtual_one(folder: Path) -> None:
    tree = made(folder, f'joints="drive,wrist",{IN_VOLUME}').robot.tree
    assert [one.name for one in tree.coordinates] == ["drive/x", "drive/y", "drive/theta", "wrist"]


def test_a_state_says_where_a_base_stands_that_does_not_move(folder: Path) -> None:
    """Wherever the group ends, and whichever joints are asked for."""
    at = np.array([[0.28, -0.96, 0, 1], [0.96, 0.28, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])
    for which in ("group=arm", "tip=hand", "joints=wrist", "group=bodies", ""):
        tree = made(folder, f"state=there,{which}").robot.tree
        [body] = [one for one in tree.links if one.name == "body"]
        assert body.body == 0
        assert body.offset == pytest.approx(at)
        moving = {one.name for one in tree.coordinates}
        assert moving <= {"shoulder", "wrist"}
    c, s = math.cos(0.5), math.sin(0.5)
    tree = made(folder, "state=aside,group=arm").robot.tree
    [body] = [one for one in tree.links if one.name == "body"]
    assert body.offset[:3, [0, 3]] == pytest.approx(np.array([[c, 1], [s, 2], [0, 0]]))


def test_a_base_that_moves_is_not_where_the_state_has_it(folder: Path) -> None:
    tree = made(folder, f"group=floating,state=there,{IN_VOLUME}").robot.tree
    assert tree.dimension == 8


def test_a_floating_joint_of_a_urdf_stands_where_a_state_has_it(folder: Path) -> None:
    there = '<joint name="base" value="1 2 3 0 0 0.6 0.8"/><joint name="shoulder" value="0.5"/>'
    state = f'<group_state name="there" group="x">{there}</group_state>'
    (folder / "arm.srdf").write_text(f'<robot name="arm">{state}</robot>')
    standing = made(folder, "joints=wrist,state=there", "floats.urdf").robot.tree
    moving = made(folder, IN_VOLUME, "floats.urdf").robot.tree
    q = np.array([[1, 2, 3, 0, 0, 0.6, 0.8, 0.5, 0.7]])
    assert standing.forward(q[:, -1:])[0, -1] == pytest.approx(moving.forward(q)[0, -1], abs=1e-12)
    by_default = made(folder, "joints=wrist", "floats.urdf").robot.tree
    q = np.array([[0, 0, 0, 0, 0, 0, 1, 0, 0.7]])
    assert by_default.forward(q[:, -1:])[0, -1] == pytest.approx(moving.forward(q)[0, -1])


def test_obstacles_are_in_the_frame_of_the_world(folder: Path) -> None:
    """A base that is placed elsewhere among obstacles that are placed likewise is as far from
    them."""
    base = (0.5, -0.3, 0.2, 0.1, 0.2, 2.0)
    pose = BasePlacement.of_numbers(base, ()).pose
    here = np.array([0.6, 0.1, 0.3])
    there = pose[:3, :3] @ here + pose[:3, 3]
    worlds = []
    for place, argument in ((here, ""), (there, f'base="{",".join(map(str, base))}"')):
        scene = folder / "scene.yaml"
        scene.write_text(f"obstacles: [{{sphere: 0.1, position: {place.tolist()}}}]")
        worlds.append(made(folder, f"group=arm,scene={scene},{argument}"))
    q = worlds[0].space.sample(np.random.default_rng(0), 30)
    assert worlds[0].clearance(q) == pytest.approx(worlds[1].clearance(q), abs=1e-6)
    assert worlds[0].fingerprint != worlds[1].fingerprint
    assert worlds[1].robot.trace(q)[:, 0] == pytest.approx(
        worlds[0].robot.trace(q)[:, 0] @ pose[:3, :3].T + pose[:3, 3]
    )


def test_a_base_without_a_turn_and_one_of_a_moving_frame(folder: Path) -> None:
    shifted = made(folder, 'group=arm,base="1,2,3"').robot.tree
    assert shifted.links[0].offset[:3, 3].tolist() == [1, 2, 3]
    driving = made(folder, f'group=driving,{IN_VOLUME},base="1,2,3,0,0,{math.pi / 2}"').robot.tree
    [pose] = driving.forward(np.array([[0.5, 0, 0, 0, 0]]))
    [body] = [n for n, one in enumerate(driving.links) if one.name == "body"]
    assert pose[body, :3, 3] == pytest.approx([1, 2.5, 3])


def test_a_robot_may_be_a_single_link_that_floats(folder: Path) -> None:
    """As the frame of a drone: its URDF has no joints at all."""
    (folder / "body.urdf").write_text(robot(link("body", BODY)))
    (folder / "scene.yaml").write_text("obstacles: [{sphere: 0.1, position: [0.5, 0, 0.5]}]")
    with_scene = f"joints=float,{IN_VOLUME},scene={folder / 'scene.yaml'}"
    env = made(folder, with_scene, "body.urdf")
    assert str(env.space) == "R^3 x SO(3)"
    turned = [0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4)]
    q = np.array([[0, 0, 0.5, 0, 0, 0, 1], [0, 0, 0.5, *turned]])
    assert env.clearance(q) == pytest.approx([0.5 - 0.2 - 0.1, 0.5 - 0.15 - 0.1], abs=1e-6)
    with pytest.raises(InputError, match="has no joints"):
        made(folder, "", "body.urdf")


BAD = {
    "group=floating": "joint 'float/trans_x' has no limits; say between which corners it moves, "
    'volume="X,Y,Z,X,Y,Z", or which joints move instead',
    "group=driving": "joint 'drive/x' has no limits; say between which corners",
    'group=floating,volume="-1,-1,1,1"': "joint 'float/trans_z' has no limits",
    'group=driving,volume="-1,-1,1"': "volume=-1,-1,1 must be two corners",
    'group=driving,volume="-1,-1,-1,1"': "the lower corner comes first",
    'group=driving,volume="-1,-1,nan,1"': "'-1,-1,nan,1' is not values with commas",
    "group=driving,volume=x": "'x' is not values with commas",
    'group=arm,base="1,2"': "base=1,2 must be x,y,z or x,y,z,roll,pitch,yaw",
    'group=arm,base="1,2,inf"': "base=1,2,inf must be",
    'group=arm,base="1,2,1e7"': "base=1,2,1e+07 must be",
    "group=arm,state=short": "joint 'drive' has 3 values, not 1",
    "group=arm,state=null": "joint 'float' has 7 values: x y z and a unit quaternion x y z w",
    "group=arm,pose=drive/x:1": "unknown joint 'drive/x'",
    'joints="float,drive"': "link 'body' is the child of two joints",
}


@pytest.mark.parametrize("number", [math.nan, math.inf, 1e7])
def test_places_are_finite_numbers(number: float) -> None:
    for base, volume in (((1, 2, number), ()), ((), (0, 0, 1, number))):
        with pytest.raises(InputError, match="finite numbers in metres"):
            BasePlacement.of_numbers(base, volume)


@pytest.mark.parametrize("arguments", BAD)
def test_what_cannot_be_is_one_clear_line(arguments: str, folder: Path) -> None:
    with pytest.raises(InputError) as caught:
        made(folder, arguments)
    assert BAD[arguments] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_floating_joint_without_bounds_is_one_clear_line(folder: Path) -> None:
    with pytest.raises(InputError, match=r"joint 'base/trans_x' has no limits; say between which"):
        envs.make(f"arm:urdf={folder / 'floats.urdf'}")


def test_what_mimics_a_turn_any_way_is_one_clear_line(tmp_path: Path) -> None:
    follows = joint("m", "hand", "more", inside='<mimic joint="base/rot"/>' + LIMIT)
    text = FLOATS.replace("</robot>", link("more") + follows + "</robot>")
    with pytest.raises(InputError, match="joint 'm' mimics 'base/rot', which has no one value"):
        tree_of(tmp_path, text)


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ('<virtual_joint name="v" type="planar"/>', "<virtual_joint> without child_link"),
        (
            '<virtual_joint name="v" type="floatin" child_link="body"/>',
            "virtual joint 'v' is of type 'floatin'; did you mean 'floating'?",
        ),
    ],
)
def test_bad_virtual_joints_are_one_clear_line(inside: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "arm.srdf").write_text(f'<robot name="arm">{inside}</robot>')
    with pytest.raises(InputError) as caught:
        read_srdf(tmp_path / "arm.srdf")
    assert said in str(caught.value)


MIDDLE = robot(
    *(link("post", HAND), link("ball", BODY), link("tool", HAND)),
    joint(
        "turn", "post", "ball", "floating", '<origin xyz="0.5 0 0"/><limit lower="0" upper="1"/>'
    ),
    joint("out", "ball", "tool", inside='<origin xyz="0.4 0.1 0"/>' + LIMIT, axis="0 1 0"),
    *(link("foot", ""), joint("lift", "foot", "post", "continuous", "", "0 0 1")),
)


@pytest.mark.parametrize("text", [FLOATS, MIDDLE], ids=["base", "middle"])
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), length=st.floats(0.01, 1))
def test_compiled_motions_are_the_shortest_ways(
    text: str, seed: int, length: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    tree = tree_of(tmp_path_factory.mktemp("arm"), text)
    a, b = tree.space.sample(np.random.default_rng(seed), 2)
    b = tree.space.between(a, b, length)
    [(arrays, (begin, end))] = tree.motions(np.array([a, b]))
    expected, found = np.empty((2, 1 + len(tree.joints), 3, 4))
    for t in (0.0, 0.3, 1.0):
        body_poses(tree.arrays, tree.space.between(a, b, t), expected)
        body_poses(arrays, begin + t * (end - begin), found)
        assert np.abs(found - expected).max() < 1e-9


def test_a_path_of_one_waypoint_stands_still(tmp_path: Path) -> None:
    tree = tree_of(tmp_path, FLOATS)
    q = tree.space.sample(np.random.default_rng(0), 1)
    [(_, (begin, end))] = tree.motions(q)
    assert begin == pytest.approx(end, abs=1e-15)


@pytest.mark.parametrize("text", [FLOATS, MIDDLE], ids=["base", "middle"])
@pytest.mark.parametrize("seed", range(4))
def test_no_point_outruns_its_bound(text: str, seed: int, tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(text)
    placement = BasePlacement.of_numbers((), VOLUME)
    arm = Arm(*read_urdf(tmp_path / "robot.urdf", placement=placement), self_collision=False)
    space, shares = arm.tree.space, []
    rng = np.random.default_rng(seed)
    for length in 10 ** rng.uniform(-2, 0, 25):
        a, b = space.sample(rng, 2)
        b = space.between(a, b, length)
        t = np.linspace(0, 1, 41)
        way = space.interpolate(np.tile(a, (41, 1)), np.tile(b, (41, 1)), t)
        fastest, bound = greatest_speeds_on(arm, way).max(), arm.motion_bound(a, b)
        assert fastest <= bound + 1e-9
        assert bound == pytest.approx(arm.motion_bound(b, a))
        assert bound <= arm.rate_bound * space.distance(a[None], b[None])[0] + 1e-9
        shares.append(fastest / bound)
    assert np.median(shares) > 0.4


def among_balls(folder: Path, rng: np.random.Generator) -> ArmWorld:
    places = rng.uniform([-1.2, -1.2, 0], [1.2, 1.2, 1.5], (6, 3)).round(3)
    entries = (f"{{sphere: 0.15, position: {place.tolist()}}}" for place in places)
    (folder / "scene.yaml").write_text(f"obstacles: [{', '.join(entries)}]")
    text = f"arm:urdf={folder / 'floats.urdf'},{IN_VOLUME},scene={folder / 'scene.yaml'}"
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    return env


@pytest.mark.parametrize("seed", range(3))
def test_accepted_motions_of_a_floating_arm_are_free_all_along(seed: int, folder: Path) -> None:
    rng = np.random.default_rng(seed)
    env = among_balls(folder, rng)
    model, t = env.collision_model(), np.linspace(0, 1, 200)
    found = {True: 0, False: 0}
    for a, b in env.space.sample(rng, 80).reshape(40, 2, -1):
        b = env.space.between(a, b, rng.uniform(0.1, 0.6))
        exact = model.segment_is_free(a, b)
        compiled = bool(env.paths_are_free([np.array([a, b])], 2e-3)[0])
        assert exact or not compiled
        found[exact] += 1
        way = env.space.interpolate(np.tile(a, (200, 1)), np.tile(b, (200, 1)), t)
        least = env.clearance(way).min()
        step = env.robot.motion_bound(a, b) / 199
        assert least > 0 if exact else least <= model.tolerance + step
        assert (env.approximate_clearance(way) <= np.maximum(env.clearance(way), 0) + 1e-9).all()
    assert min(found.values()) > 3


def assert_solves(env: Environment, planner: str) -> None:
    solver, judge = REGISTRY.make(planner), Judge(env)
    solver.setup(env, seed=0)
    for problem in env.sample_problems(2, 0):
        ends = np.array([problem.start, problem.goal])
        assert env.contains(ends).all()
        assert env.clearance(ends).min() >= env.min_clearance - 1e-6
        result = solver.solve(problem, Budget(perf_counter() + 20))
        assert result.status is Status.EXACT_SOLUTION
        assert result.path is not None
        assert judge(problem, result.path).verdict is Verdict.VALID


@pytest.mark.slow
@pytest.mark.parametrize("planner", ["rrtconnect", "bitstar"])
def test_ompl_plans_for_a_floating_arm(planner: str, folder: Path) -> None:
    assert_solves(among_balls(folder, np.random.default_rng(0)), planner)


@pytest.mark.slow
def test_ompl_plans_for_an_arm_that_drives(folder: Path) -> None:
    scene = folder / "scene.yaml"
    scene.write_text("obstacles: [{box: [0.1, 1.2, 1], position: [0, 0.4, 0]}]")
    assert_solves(made(folder, f"group=driving,{IN_VOLUME},scene={scene}"), "rrtconnect")


def test_networks_and_grids_say_that_rotations_are_not_for_them(folder: Path) -> None:
    env = among_balls(folder, np.random.default_rng(0))
    for planner in ("ntfields", "mpnet", "fmm"):
        assert REGISTRY.make(planner).unsupported(env)
