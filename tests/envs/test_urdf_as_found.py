"""URDFs as they are found: what is left over in them, grippers, and the robots that people have."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from bad_urdfs import BALL, LIMIT, joint, link, robot, with_shape

from envs import InputError
from envs.errors import tell_once
from envs.robots import example_robot_data
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.planning_group import PlanningGroup
from envs.robots.srdf import read_srdf
from envs.robots.urdf import read_urdf

A, B = link("a"), link("b")
AB = joint("ab", "a", "b")
FINGER = '<limit lower="0" upper="0.04" effort="1" velocity="1"/>'


def chain_of(folder: Path, text: str) -> KinematicTree:
    (folder / "arm.urdf").write_text(text)
    return read_urdf(folder / "arm.urdf")[0]


def refusal(folder: Path, text: str) -> str:
    with pytest.raises(InputError) as caught:
        chain_of(folder, text)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def names(chain: KinematicTree) -> list[str]:
    return [one.name for one in chain.joints]


IDLE = {
    "mimic": '<mimic joint="ab" multiplier="-1"/>',
    "mimic of none": '<mimic joint="nowhere"/>',
    "hollow mimic": '<mimic multiplier="much"/>',
    "limit": '<limit lower="0" upper="0"/>',
    "limit in words": '<limit lower="${low}" upper="none" effort="much"/>',
    "axis": '<axis xyz="0 0 0"/>',
    "safety controller": '<safety_controller soft_lower_limit="x"/>',
    "dynamics": '<dynamics damping="a lot"/>',
}


@pytest.mark.parametrize("name", IDLE)
def test_what_is_left_over_in_a_fixed_joint_changes_nothing(name: str, tmp_path: Path) -> None:
    held = joint("held", "b", "tool", "fixed", '<origin xyz="0 0 1"/>' + IDLE[name])
    chain = chain_of(tmp_path, robot(A, B, link("tool"), AB, held))
    assert names(chain) == ["ab"]
    assert [(one.name, one.body) for one in chain.links] == [("a", 0), ("b", 1), ("tool", 1)]
    assert chain.links[2].offset[2, 3] == 1


FOREIGN = {
    "tag": '<tool:hint value="1"/>',
    "tag with what looks like ours": f"<tool:link>{AB}</tool:link>",
    "declared": '<tool:hint xmlns:tool="http://tool"/>',
    "gazebo": '<gazebo reference="b"><sensor:camera name="eye"><x/></sensor:camera></gazebo>',
    "ros2_control": '<ros2_control name="x"><joint name="ab"><command_interface/></joint>'
    "</ros2_control>",
    "transmission": '<transmission name="t"><joint/><actuator/></transmission>',
    "material": '<material name="grey"><color rgba="grey"/></material>',
}


@pytest.mark.parametrize("name", FOREIGN)
def test_elements_of_others_are_left_alone(name: str, tmp_path: Path) -> None:
    assert names(chain_of(tmp_path, robot(A, B, AB, FOREIGN[name]))) == ["ab"]


INSIDE = {
    "visual": '<visual><geometry><capsule radius="1"/></geometry></visual>',
    "visual without a shape": "<visual><geometry/></visual>",
    "inertial": '<inertial><origin xyz="nan 0 0"/><mass value="heavy"/></inertial>',
    "prefix": "<drake:hint/>",
}


@pytest.mark.parametrize("name", INSIDE)
def test_what_is_not_read_of_a_link_may_be_anything(name: str, tmp_path: Path) -> None:
    assert names(chain_of(tmp_path, robot(A, link("b", INSIDE[name] + BALL), AB))) == ["ab"]


def test_attributes_of_others_and_a_default_namespace_are_left_alone(tmp_path: Path) -> None:
    text = robot(A, B, AB).replace('name="arm"', 'name="arm" xmlns="http://www.ros.org"')
    text = text.replace('name="b"', 'name="b" tool:color="red"').replace(
        "<collision>", '<collision tool:kind="1">'
    )
    assert names(chain_of(tmp_path, text)) == ["ab"]


def test_limits_of_a_continuous_joint_are_not_read(tmp_path: Path) -> None:
    endless = '<limit lower="-inf" upper="inf" effort="1" velocity="1"/>'
    chain = chain_of(tmp_path, robot(A, B, joint("ab", "a", "b", "continuous", endless)))
    assert chain.joints[0].upper == pytest.approx(3.14159, abs=1e-4)


@pytest.mark.parametrize(
    ("limit", "velocity"),
    [
        ('<limit effort="1" velocity="2.5"/>', 2.5),
        ('<limit lower="none" upper="none" effort="much" velocity="2.5"/>', 2.5),
        ('<limit lower="-1" upper="1" effort="1" velocity="0"/>', None),
        ('<limit effort="1" velocity="inf"/>', None),
        ('<limit effort="1"/>', None),
        ("", None),
    ],
)
def test_of_limits_of_a_continuous_joint_that_of_velocity_is_read(
    limit: str, velocity: float | None, tmp_path: Path
) -> None:
    [turn] = chain_of(tmp_path, robot(A, B, joint("ab", "a", "b", "continuous", limit))).joints
    assert turn.wraps
    assert turn.velocity == velocity


@pytest.mark.parametrize("kind", ["continuous", "revolute"])
def test_a_limit_of_velocity_that_is_no_number_is_refused(kind: str, tmp_path: Path) -> None:
    inside = '<limit lower="-1" upper="1" effort="1" velocity="${fast}"/>'
    said = refusal(tmp_path, robot(A, B, joint("ab", "a", "b", kind, inside)))
    assert "joint 'ab': velocity='${fast}' must be a number" in said
    assert "xacro" in said


@pytest.fixture
def told(caplog: pytest.LogCaptureFixture) -> Iterator[pytest.LogCaptureFixture]:
    tell_once.cache_clear()
    with caplog.at_level(logging.INFO):
        yield caplog


@pytest.mark.parametrize(
    ("safety", "said"),
    [
        ('soft_lower_limit="-1" soft_upper_limit="1" k_position="9" k_velocity="9"', True),
        ('soft_upper_limit="1.4" soft_lower_limit="-9"', True),
        ('soft_lower_limit="-1"', True),  # the other one is 0
        ('soft_lower_limit="-2" soft_upper_limit="1.5" k_velocity="9"', False),
        ('k_velocity="9"', False),
    ],
)
def test_soft_limits_are_not_used_and_that_is_said(
    safety: str, said: bool, tmp_path: Path, told: pytest.LogCaptureFixture
) -> None:
    text = robot(
        *(A, B, link("c"), AB.replace(LIMIT, f"{LIMIT}<safety_controller {safety}/>")),
        joint("bc", "b", "c", "continuous", f"<safety_controller {safety}/>"),
    )
    for _ in range(2):
        chain = chain_of(tmp_path, text)
        assert (chain.joints[0].lower, chain.joints[0].upper) == (-2, 1.5)
    lines = [
        f"{tmp_path / 'arm.urdf'}: <safety_controller>'s soft limits are not used, only <limit>: "
        "'ab'"
    ]
    assert told.messages == (lines if said else [])


def hand(*fingers: str) -> str:
    """An arm of one joint with a hand, and fingers."""
    links = (link(f"f{n}") for n in range(len(fingers)))
    held = joint("held", "b", "hand", "fixed", "")
    return robot(A, B, link("hand"), AB, held, *links, *fingers)


def finger(number: int, more: str = "", type: str = "prismatic") -> str:
    return joint(f"finger{number}", "hand", f"f{number}", type, FINGER + more)


MIMICS = '<mimic joint="finger0"/>'


def test_fingers_of_a_gripper_open_and_close(tmp_path: Path) -> None:
    chain = chain_of(tmp_path, hand(finger(0), finger(1), finger(2)))
    assert names(chain) == ["ab", "finger0", "finger1", "finger2"]
    assert chain.parents == (0, 1, 1, 1)
    assert chain.dimension == 4


def test_fingers_that_mimic_one_follow_it(tmp_path: Path) -> None:
    chain = chain_of(tmp_path, hand(finger(0), finger(1, MIMICS), finger(2, MIMICS)))
    assert names(chain) == ["ab", "finger0", "finger1", "finger2"]
    assert [one.name for one in chain.coordinates] == ["ab", "finger0"]
    assert chain.upper.tolist() == [1.5, 0.04]


def test_fingers_that_are_fixed_stand_still(tmp_path: Path) -> None:
    still = hand(finger(0, "", "fixed"), finger(1, MIMICS, "fixed"))
    assert names(chain_of(tmp_path, still)) == ["ab"]
    one = hand(finger(0), finger(1, MIMICS, "fixed"))
    assert names(chain_of(tmp_path, one)) == ["ab", "finger0"]
    first = hand(finger(0, "", "fixed"), finger(1, MIMICS.replace("/>", ' offset="0.01"/>')))
    chain = chain_of(tmp_path, first)
    assert names(chain) == ["ab"]
    assert chain.links[-1].name == "f1"
    assert chain.links[-1].offset[0, 3] == 0.01


@pytest.mark.parametrize("name", ["hand.fbx", "hand.FBX", "hand.gltf", "hand.step"])
def test_formats_that_are_not_read_have_a_remedy(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("...")
    said = refusal(tmp_path, with_shape(f'<mesh filename="{name}"/>'))
    assert f"link 'b': {tmp_path / name}: meshes are read from .obj" in said
    assert "convert it to .stl or .obj" in said


FRAMED = {
    "byte order mark": lambda text: b"\xef\xbb\xbf" + text,
    "line ends of Windows": lambda text: text.replace(b"\n", b"\r\n"),
    "empty lines first": lambda text: b"\n  \n" + text,
    "a mark and empty lines": lambda text: b"\xef\xbb\xbf\r\n" + text,
    "sixteen bits": lambda text: (
        text.decode().replace("?>", ' encoding="utf-16"?>').encode("utf-16")
    ),
    "comments": lambda text: text.replace(b"<joint", b"<!-- <joint/> --><joint"),
}


@pytest.mark.parametrize("name", FRAMED)
def test_files_may_be_written_in_many_ways(name: str, tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_bytes(FRAMED[name](robot(A, B, AB).encode()))
    assert names(read_urdf(file)[0]) == ["ab"]


def test_robots_may_stand_on_a_world_link(tmp_path: Path) -> None:
    """Without geometry or inertia, as may links between."""
    text = robot(
        *('<link name="world"/>', A, '<link name="flange"/>', B),
        joint("stands", "world", "a", "fixed", '<origin xyz="0 0 0.5"/>'),
        joint("af", "a", "flange", "fixed", ""),
        joint("ab", "flange", "b"),
    )
    tree = chain_of(tmp_path, text)
    assert names(tree) == ["ab"]
    assert [(one.name, one.body) for one in tree.links][:2] == [("world", 0), ("a", 0)]
    assert tree.links[1].offset[2, 3] == 0.5


@pytest.mark.parametrize(
    "ends", [("-1e+16", "1e16"), ("-inf", "inf"), ("-1.79769e+308", "1.79769e+308")]
)
def test_limits_that_are_none_let_a_joint_turn_for_ever(
    ends: tuple[str, str], tmp_path: Path
) -> None:
    """As files have them that were made from SDFormat's."""
    limit = '<limit lower="{}" upper="{}" effort="0" velocity="0"/>'.format(*ends)
    [turn] = chain_of(tmp_path, robot(A, B, joint("ab", "a", "b", inside=limit))).joints
    assert turn.wraps
    assert turn.velocity is None
    slides = robot(A, B, joint("ab", "a", "b", "prismatic", limit))
    assert "joint 'ab': lower=" in refusal(tmp_path, slides)
    half = robot(A, B, joint("ab", "a", "b", inside=limit.replace(ends[0], "-1")))
    assert "joint 'ab': upper=" in refusal(tmp_path, half)


@pytest.mark.parametrize("name", ["arm.urdf.xacro", "arm.xacro"])
@pytest.mark.parametrize("inside", ["", '<xacro:include filename="x"/>'])
def test_a_xacro_file_says_how_to_expand_it(name: str, inside: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_text(robot(A, B, AB, inside))
    with pytest.raises(InputError) as caught:
        read_urdf(file)
    said = f"{file}: is a xacro file; expand it first: xacro {name} > arm.urdf"
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (robot(A, B, AB.replace('"-2"', '"${-pi}"')), "lower='${-pi}' must hold 1 finite"),
        (
            robot(A, B, joint("j", "a", "b", inside='<origin xyz="0 0 ${h}"/>')),
            "xyz='0 0 ${h}' must hold 3 finite",
        ),
        (with_shape('<mesh filename="$(find arm)/b.stl"/>'), "no such mesh: $(find arm)/b.stl"),
    ],
)
def test_what_xacro_left_out_says_so(text: str, said: str, tmp_path: Path) -> None:
    message = refusal(tmp_path, text)
    assert said in message
    assert message.endswith("; this is xacro's, expand the file first: xacro IN > OUT")


@pytest.mark.parametrize("tag", ["macro", "include"])
def test_macros_of_old_xacro_are_known(tag: str, tmp_path: Path) -> None:
    assert "expand them first: xacro IN > OUT.urdf" in refusal(tmp_path, robot(A, f"<{tag}/>"))


def test_joints_that_cannot_move_may_be_left_out(tmp_path: Path) -> None:
    """Files have joints without limits, and such whose limits are 0 and 0."""
    for limit in ('<limit effort="1" velocity="1"/>', '<limit lower="0" upper="0"/>'):
        text = robot(A, B, link("c"), AB, joint("bc", "b", "c", inside=limit))
        assert "or say which joints move instead" in refusal(tmp_path, text)
        tree, _ = read_urdf(tmp_path / "arm.urdf", PlanningGroup(joints=("ab",)))
        assert names(tree) == ["ab"]


REFUSED = {
    "alex_psyonic_hands.urdf": "joint 'Left_index_q2' mimics 'index_q1', which is no joint",
    "alexander_v1.lowerBodyOnly.urdf": "take those it has: geometry=visual",
    "TwoDofs.urdf": "take those it has: geometry=visual",
    "human.urdf": "take those it has: geometry=visual",
    "centauro.urdf": "joint 'j_wheel_1' has no limits",
    "quadruped.urdf": "joint 'FL_KFE' has no limits",
    "double_pendulum.urdf": "its lower limit 0 must be below its upper 0",
    "double_pendulum_simple.urdf": "its lower limit 0 must be below its upper 0",
    "quadrotor_base.urdf": "has no joints",
    "iris_simple.urdf": "none of its joints moves",
    "simple_humanoid.urdf": "no link that moves has collision geometry; add",
    "simple_humanoid_classical.urdf": "no link that moves has collision geometry; add",
    "ur3.urdf": "its <robot> has no name",
}
"""Of the package example-robot-data, and why: each lacks something that it must have."""


@pytest.mark.slow
def test_robots_of_example_robot_data_are_read_or_refused_for_a_reason() -> None:
    robots = example_robot_data.robots()
    if robots[0].missing:
        pytest.skip('example-robot-data is not installed: pip install "plannerbench[robots]"')
    [folder] = {robot.urdf.parents[2] for robot in robots if robot.name == "panda"}
    files = sorted(folder.rglob("*.urdf"))
    refused = {file.name: said for file in files if (said := why_refused(file))}
    assert refused.keys() == REFUSED.keys()
    assert all(REFUSED[name] in said and "\n" not in said for name, said in refused.items())
    assert len(files) > len(refused) + 50
    srdfs = list(folder.rglob("*.srdf"))
    assert sum(len(read_srdf(file).groups) for file in srdfs) > len(srdfs) > 30


def why_refused(file: Path) -> str:
    """Empty where it is read."""
    try:
        read_urdf(file)
    except InputError as error:
        return str(error)
    return ""
