"""The manipulators in the package example-robot-data, under the names that its own loader has for
them, where it has one."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from envs.robots.robot_description import RobotDescription, described

_DISTRIBUTION = "example-robot-data"

_FOLDERS = ("cmeel.prefix/share/example-robot-data/robots", "share/example-robot-data/robots")
"""Where its robots are: in wheels, and under the prefix of other installations, as of conda."""


def robots() -> list[RobotDescription]:
    """Its robots, whether or not it is installed."""
    folder = _folder()
    missing = "" if folder else 'pip install "plannerbench[robots]"'
    return described(_ROBOTS, folder or Path(), _DISTRIBUTION, missing)


def _folder() -> Path | None:
    from importlib import metadata  # not for help and version

    prefix = Path(sys.prefix) / _FOLDERS[1]
    try:
        wheel = Path(str(metadata.distribution(_DISTRIBUTION).locate_file(_FOLDERS[0])))
    except metadata.PackageNotFoundError:
        wheel = prefix
    return next((folder for folder in (wheel, prefix) if folder.is_dir()), None)


def _ur(model: str, urdf: str, srdf: str, description: str) -> dict[str, Any]:
    """An arm of Universal Robots, of which all six joints move. The UR10 has no SRDF there, and
    that of another will not do: its forearm and second wrist do touch."""
    files = {"urdf": f"ur_description/urdf/{urdf}.urdf"}
    if srdf:
        files["srdf"] = f"ur_description/srdf/{srdf}.srdf"
    return {**files, "dof": 6, "description": f"Universal Robots {model}{description}"}


_GRIPPER, _LIMITED = " with a gripper", ", joints within half a turn"

_ARM = tuple(f"joint{n}" for n in range(1, 7))
"""Of the Z1, whose group in the SRDF has the jaw of the gripper as well."""

_BAXTER = {
    "urdf": "baxter_description/urdf/baxter.urdf",
    "srdf": "baxter_description/srdf/baxter_manipulation.srdf",
}
_BAXTERS_JOINTS = ("s0", "s1", "e0", "e1", "w0", "w1", "w2")
_PR2 = {"urdf": "pr2_description/urdf/pr2.urdf", "srdf": "pr2_description/srdf/pr2.srdf"}
_TALOS = {"urdf": "talos_data/robots/talos_full_v2.urdf", "srdf": "talos_data/srdf/talos.srdf"}

_ROBOTS: Mapping[str, Mapping[str, Any]] = {
    "panda": {
        "urdf": "panda_description/urdf/panda.urdf",
        "srdf": "panda_description/srdf/panda.srdf",
        "group": "arm",
        "dof": 7,
        "description": "Franka Emika Panda with its hand",
    },
    "ur3": _ur("UR3", "ur3_robot", "ur3_gripper", ""),
    "ur3_limited": _ur("UR3", "ur3_joint_limited_robot", "ur3_gripper", _LIMITED),
    "ur3_gripper": _ur("UR3", "ur3_gripper", "ur3_gripper", _GRIPPER),
    "ur5": _ur("UR5", "ur5_robot", "ur5", ""),
    "ur5_limited": _ur("UR5", "ur5_joint_limited_robot", "ur5_joint_limited_robot", _LIMITED),
    "ur5_gripper": _ur("UR5", "ur5_gripper", "ur5_gripper", _GRIPPER),
    "ur10": _ur("UR10", "ur10_robot", "", ""),
    "ur10_limited": _ur("UR10", "ur10_joint_limited_robot", "", _LIMITED),
    "kinova": {
        "urdf": "kinova_description/robots/kinova.urdf",
        "srdf": "kinova_description/srdf/kinova.srdf",
        "tip": "j2s6s200_end_effector",
        "dof": 6,
        "description": "Kinova Jaco 2 of six joints, three of which wrap",
    },
    "xarm7": {
        "urdf": "xarm_description/urdf/xarm7.urdf",
        "srdf": "xarm_description/srdf/xarm7.srdf",
        "group": "xarm7",
        "dof": 7,
        "description": "UFACTORY xArm7",
    },
    "z1": {
        "urdf": "z1_description/urdf/z1.urdf",
        "srdf": "z1_description/srdf/z1.srdf",
        "joints": _ARM,
        "description": "Unitree Z1 with its gripper",
    },
    "so100": {
        "urdf": "so_arm_description/urdf/so100.urdf",
        "tip": "gripper",
        "dof": 5,
        "description": "SO-ARM100",
    },
    "so101": {
        "urdf": "so_arm_description/urdf/so101.urdf",
        "tip": "gripper_link",
        "dof": 5,
        "description": "SO-ARM101",
    },
    "tiago": {
        "urdf": "tiago_description/robots/tiago.urdf",
        "tip": "arm_tool_link",
        "dof": 8,
        "description": "PAL Robotics TIAGo with a hand: torso and arm",
    },
    "tiago_no_hand": {
        "urdf": "tiago_description/robots/tiago_no_hand.urdf",
        "tip": "arm_tool_link",
        "dof": 8,
        "description": "PAL Robotics TIAGo: torso and arm",
    },
    **{
        f"tiago_{side}": {
            "urdf": "tiago_description/robots/tiago_dual.urdf",
            "tip": f"arm_{side}_tool_link",
            "dof": 8,
            "description": f"PAL Robotics TIAGo of two arms: torso and {side} arm",
        }
        for side in ("left", "right")
    },
    "baxter": {
        **_BAXTER,
        "joints": tuple(
            f"{side}_{joint}" for side in ("left", "right") for joint in _BAXTERS_JOINTS
        ),
        "description": "Rethink Robotics Baxter: both arms",
    },
    **{
        f"baxter_{side}": {
            **_BAXTER,
            "tip": f"{side}_gripper",
            "dof": 7,
            "description": f"Rethink Robotics Baxter: {side} arm",
        }
        for side in ("left", "right")
    },
    "pr2": {**_PR2, "group": "arms", "dof": 14, "description": "Willow Garage PR2: both arms"},
    **{
        f"pr2_{side}": {
            **_PR2,
            "group": f"{side}_arm",
            "dof": 7,
            "description": f"Willow Garage PR2: {side} arm",
        }
        for side in ("left", "right")
    },
    "talos": {
        **_TALOS,
        "group": "all_arms",
        "dof": 14,
        "description": "PAL Robotics TALOS: both arms",
    },
    **{
        f"talos_{side}": {
            **_TALOS,
            "group": f"{side[0]}_arm",
            "dof": 7,
            "description": f"PAL Robotics TALOS: {side} arm",
        }
        for side in ("left", "right")
    },
}
