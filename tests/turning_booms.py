"""A boom that turns for ever, past a wall that it must go round the other way, with a hand that
bends up and down; a family of such scenes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from bad_urdfs import collision, joint, link, robot

from envs.collision.shapes import Box, PlacedShape, Sphere
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld

WALLS_AT = (0.0, 2.0)
"""Angles at which the boom cannot pass, one a scene."""


class BoomWorld(ArmWorld):
    """Scene `scene` of the family, in which a ball is where the hand passes unless it is bent, half
    a turn from the wall."""

    def __init__(self, arm: Arm, scene: int) -> None:
        wall = PlacedShape(Box(np.zeros(3), np.array([0.3, 0.06, 1.0])), _at(WALLS_AT[scene], 0.35))
        ball = PlacedShape(Sphere(0.05), _at(WALLS_AT[scene] + np.pi, 0.65))
        super().__init__(arm, [wall, ball], "boom", (scene,))

    def family(self) -> list[BoomWorld]:
        return [BoomWorld(self.robot, scene) for scene in range(len(WALLS_AT))]

    def family_definition(self) -> dict[str, Any]:
        return {"class": "BoomWorld", "version": 1}


def boom_world(folder: Path, scene: int = 0) -> BoomWorld:
    """A scene, whose robot is written to a folder."""
    hand = collision('<box size="0.16 0.04 0.04"/>', '<origin xyz="0.12 0 0"/>')
    bent = '<origin xyz="0.5 0 0"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/>'
    bends = joint("bend", "boom", "hand", "revolute", bent, "0 1 0")
    return BoomWorld(_boom(folder, link("hand", hand), bends), scene)


def turntable(folder: Path) -> BoomWorld:
    """The same without a hand: one joint."""
    return BoomWorld(_boom(folder), 0)


def _boom(folder: Path, *more: str) -> Arm:
    boom = collision('<box size="0.5 0.05 0.05"/>', '<origin xyz="0.25 0 0"/>')
    turns = joint("turn", "base", "boom", "continuous", "", "0 0 1")
    (folder / "boom.urdf").write_text(robot(link("base", ""), link("boom", boom), turns, *more))
    tree, parts = read_urdf(folder / "boom.urdf")
    return Arm(tree, parts, True)


def _at(angle: float, out: float) -> np.ndarray:
    """The pose of what lies `out` from the axis of the boom in a direction."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, out * c], [s, c, 0, out * s], [0, 0, 1, 0], [0, 0, 0, 1]])
