"""A small robot with Panda's joints and problems for it, in the form of robometrics' files."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

JOINTS = 7

_LINK = """<link name="{name}"><collision><origin xyz="0.05 0 0"/>
<geometry><box size="0.1 0.02 0.02"/></geometry></collision></link>"""

_JOINT = """<joint name="panda_joint{n}" type="revolute"><parent link="{before}"/>
<child link="panda_link{n}"/><origin xyz="0.1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"""

_FINGER = """<joint name="panda_finger_joint1" type="prismatic"><parent link="panda_link7"/>
<child link="panda_finger"/><origin xyz="0.1 0 0"/><axis xyz="0 1 0"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>"""

_TABLE = """<link name="table"/><joint name="mount" type="fixed"><parent link="table"/>
<child link="panda_link0"/><origin xyz="0 0 1"/></joint>"""


def urdf(backward: bool = False, on_table: bool = False) -> str:
    """A chain in a plane, perhaps on a table; or one whose joints are called the other way round,
    from the last to the first."""
    parts = ['<link name="panda_link0"/>', _TABLE if on_table else ""]
    before = "panda_link0"
    for n in range(JOINTS, 0, -1) if backward else range(1, JOINTS + 1):
        parts += [_LINK.format(name=f"panda_link{n}"), _JOINT.format(n=n, before=before)]
        before = f"panda_link{n}"
    finger = _FINGER if before == "panda_link7" else _FINGER.replace("panda_link7", before)
    return f'<robot name="p">{"".join(parts)}{_LINK.format(name="panda_finger")}{finger}</robot>'


def pose(x: float, y: float, z: float = 0.0) -> list[float]:
    return [x, y, z, 1.0, 0.0, 0.0, 0.0]


def obstacles(**cuboids: Sequence[float]) -> dict[str, Any]:
    """Cubes of side 0.1 at places."""
    named = {name: {"dims": [0.1] * 3, "pose": pose(*at)} for name, at in cuboids.items()}
    return {"cuboid": named, "cylinder": {}}


def problem(
    goals: Sequence[Sequence[float]], among: Mapping[str, Any] | None = None, **more: Any
) -> dict[str, Any]:
    return {
        "start": [0.0] * JOINTS,
        "goal_ik": [list(goal) for goal in goals],
        "goal_pose": {"frame": "panda_hand", "position_xyz": [0, 0, 0]},
        "collision_buffer_ik": 0,
        "obstacles": among if among is not None else obstacles(),
        "world_frame": "panda_link0",
        **more,
    }


def write(folder: Path, content: Any, name: str = "mb_set.yaml") -> Path:
    """A file of it, which is YAML, and the robot beside it as panda.urdf."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "panda.urdf").write_text(urdf())
    (folder / name).write_text(json.dumps(content))
    return folder / name
