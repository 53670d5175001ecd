"""URDFs as they are found: what is left over in them, grippers, and the robots that people have."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from bad_urdfs import BALL, LIMIT, joint, link, robot, with_shape

from envs import InputError
from envs.errors import tell_once
from envs.robots.kinematic_tree import KinematicTree
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
