"""A small robot and problems for it, in the form of MotionBenchMaker's files."""

from __future__ import annotations

import io
import json
import tarfile
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

URDF = """<robot name="two">
  <link name="base"/>
  <link name="upper"><collision><origin xyz="0.25 0 0"/>
    <geometry><box size="0.5 0.04 0.04"/></geometry></collision></link>
  <link name="lower"><collision><origin xyz="0.25 0 0"/>
    <geometry><box size="0.5 0.04 0.04"/></geometry></collision></link>
  <link name="finger"><collision><geometry><sphere radius="0.03"/></geometry></collision></link>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/>
    <origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="grip" type="prismatic"><parent link="lower"/><child link="finger"/>
    <origin xyz="0.5 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>
</robot>
"""

SRDF = """<robot name="two"><group name="arm"><joint name="shoulder"/><joint name="elbow"/></group>
<disable_collisions link1="lower" link2="finger" reason="Adjacent"/></robot>
"""


def pose(x: float, y: float, z: float = 0.0) -> dict[str, Any]:
    return {"position": [x, y, z], "orientation": [0, 0, 0, 1]}


def box(name: str, place: Mapping[str, Any], *sides: float) -> dict[str, Any]:
    primitive = {"type": "box", "dimensions": list(sides)}
    return {"id": name, "primitives": [primitive], "primitive_poses": [place]}


def scene(*objects: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    return {"robot_model_name": "two", "world": {"collision_objects": list(objects)}, **more}


def request(start: Sequence[float], goal: Sequence[float], grip: float = 0.05) -> dict[str, Any]:
    names = ["shoulder", "elbow", "grip"]
    constraints = [
        {"joint_name": name, "position": value} for name, value in zip(names, goal, strict=False)
    ]
    return {
        "group_name": "arm",
        "start_state": {"joint_state": {"name": names, "position": [*start, grip]}},
        "goal_constraints": [{"joint_constraints": constraints}],
    }


def write(
    folder: Path,
    problems: Mapping[str, Sequence[tuple[dict[str, Any], dict[str, Any]]]],
    first: int = 1,
) -> None:
    """The files of a robot into the folder of its name: pairs of scene and request, by set. The
    number of the first may be another, and every second is left out then."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{folder.name}.urdf").write_text(URDF)
    (folder / f"{folder.name}.srdf").write_text(SRDF)
    with tarfile.open(folder / "problems.tar.bz2", "w:bz2") as archive:
        for name, pairs in problems.items():
            step = 1 if first == 1 else 2
            for number, (scene, request) in zip(count(first, step), pairs, strict=False):
                for kind, content in (("scene", scene), ("request", request)):
                    text = json.dumps(content).encode()  # which is YAML
                    member = tarfile.TarInfo(f"problems/{name}/{kind}{number:04d}.yaml")
                    member.size = len(text)
                    archive.addfile(member, io.BytesIO(text))
