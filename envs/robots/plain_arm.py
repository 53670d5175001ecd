"""Arms as plain data; see `envs.plain_scene`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from envs.plain_scene import PlainJoint, PlainLink, PlainRobot
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import Joint


def plain_arm(
    arm: Arm, name: str, obstacles: Sequence[str], may_touch: NDArray[np.bool_] | None
) -> PlainRobot:
    """An arm among obstacles.

    Solids of a base that is not checked against anything are left out, and one that is checked
    against other links may touch all obstacles. Links may touch each other where none of their
    solids is checked against one of the other's.

    Args:
        name: of the robot.
        obstacles: their names.
        may_touch: (moving, obstacles) which of the arm's solids may touch which; None for none.
    """
    alone = _alone(arm)
    touched = dict.fromkeys((link.name for link in arm.tree.links if link.body == 0), obstacles)
    for link, parts in _moving_parts(arm).items():
        each = np.zeros(len(obstacles), np.bool_) if may_touch is None else may_touch[parts].all(0)
        touched[link] = [obstacles[n] for n in np.flatnonzero(each).tolist()]
    links = (
        replace(link, touches_obstacles=tuple(touched.get(link.name, ()))) for link in alone.links
    )
    return replace(alone, name=name, links=tuple(links))


def _moving_parts(arm: Arm) -> Mapping[str, list[int]]:
    """The numbers of the solids of each link that moves."""
    found = defaultdict(list)
    for part in range(arm.moving):
        found[arm.links[part]].append(part)
    return found


@lru_cache(maxsize=8)
def _alone(arm: Arm) -> PlainRobot:
    """The arm with nothing about it; its meshes are looked at once."""
    frames = {link.name: link.offset for link in arm.tree.links}
    bodies = {link.name: link.body for link in arm.tree.links}
    roots = _roots(arm)
    solids = defaultdict(list)
    for link, part in zip(arm.links, arm.parts, strict=True):
        placed = part.placed.solid.plain(part.placed.pose)
        solids[link].append(placed.moved(_inverse(frames[link])))
    checked = {frozenset((arm.links[i], arm.links[j])) for i, j in arm.pairs}
    touches = {
        name: tuple(o for o in solids if o != name and frozenset((name, o)) not in checked)
        for name in solids
    }
    names = [*roots.values(), *(name for name in frames if name not in roots.values())]
    links = (PlainLink(name, tuple(solids.get(name, ())), touches.get(name, ())) for name in names)
    rigid = (
        PlainJoint(
            f"{roots[bodies[name]]}-{name}",
            *("fixed", roots[bodies[name]], name, frames[name], np.zeros(3), 0.0, 0.0),
        )
        for name in names
        if name not in roots.values()
    )
    return PlainRobot("", tuple(links), (*_moving(arm, roots), *rigid))


def _inverse(pose: Array) -> Array:
    """The pose (4, 4) that undoes one."""
    undone = np.eye(4)
    undone[:3, :3] = pose[:3, :3].T
    undone[:3, 3] = -pose[:3, :3].T @ pose[:3, 3]
    return undone


def _roots(arm: Arm) -> dict[int, str]:
    """Of each body, from the base on, the link whose frame is the body's: its first one, or one
    that is put there."""
    found: dict[int, str] = {}
    taken = {link.name for link in arm.tree.links}
    for link in arm.tree.links:
        if link.body not in found:
            own = np.array_equal(link.offset, np.eye(4))
            found[link.body] = link.name if own else _unlike(f"{link.name}-frame", taken)
    return dict(sorted(found.items()))


def _unlike(name: str, taken: set[str]) -> str:
    """A name that is not taken."""
    while name in taken:
        name += "-"
    return name


def _moving(arm: Arm, roots: Mapping[int, str]) -> list[PlainJoint]:
    """The joints that move, which join the bodies."""
    tree = arm.tree
    pairs = enumerate(zip(tree.joints, tree.parents, strict=True))
    return [
        PlainJoint(
            joint.name,
            _kind(joint),
            roots[parent],
            roots[number + 1],
            joint.origin,
            joint.axis,
            joint.lower,
            joint.upper,
            joint.velocity,
            *((tree.joints[joint.mimic.joint].name, *joint.mimic[1:]) if joint.mimic else ()),
        )
        for number, (joint, parent) in pairs
    ]


def _kind(joint: Joint) -> str:
    if joint.spherical:
        return "spherical"
    if joint.prismatic:
        return "prismatic"
    return "continuous" if joint.wraps else "revolute"
