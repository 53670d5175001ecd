"""Real robots with the joints outside of one planning group fixed, from a folder of theirs."""

from __future__ import annotations

import shutil
from pathlib import Path
from xml.etree import ElementTree

ROBOTS = {
    "ur5": [f"{n}_joint" for n in ("shoulder_pan", "shoulder_lift", "elbow")]
    + [f"wrist_{n}_joint" for n in (1, 2, 3)],
    "panda": [f"panda_joint{n}" for n in range(1, 8)],
    "fetch": [
        *("torso_lift_joint", "shoulder_pan_joint", "shoulder_lift_joint", "upperarm_roll_joint"),
        *("elbow_flex_joint", "forearm_roll_joint", "wrist_flex_joint", "wrist_roll_joint"),
    ],
}
"""Joints that move."""


def real_arm(data: Path, folder: Path, name: str) -> str:
    """Writes such an arm and a scene into a folder; returns the environment's text."""
    shutil.copytree(data / name, folder, dirs_exist_ok=True)
    tree = ElementTree.parse(folder / f"{name}.urdf")
    root = tree.getroot()
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
        if joint.attrib["name"] not in ROBOTS[name]:
            joint.attrib["type"] = "fixed"
    tree.write(folder / "arm.urdf")
    (folder / "scene.yaml").write_text(
        "obstacles:\n"
        "  - {box: [0.3, 0.6, 0.05], position: [0.75, 0, 0.5]}\n"
        "  - {cylinder: [0.05, 1.2], position: [0.1, 0.6, 0.6]}\n"
        "  - {sphere: 0.15, position: [0.4, -0.5, 1.0]}\n"
    )
    return f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}"
