"""Arms as plain data; see `envs.plain_scene`."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from envs.plain_scene import PlainJoint, PlainLink, PlainRobot
from envs.robots.arm import Arm
from envs.robots.kinematic_tree import Joint


def plain_arm(
    arm: Arm, name: str, obstacles: Sequence[str], may_touch: NDArray[np.bool_] | None
) -> PlainRobot:
    """An arm among obstacles.

    A base whose solids are not checked at all has none. Links may touch each other where none of
    their solids is checked against one of the other's.

    Args:
        name: of the robot.
        obstacles: their names.
        may_touch: (moving, obstacles) which of the arm's solids may touch which; None for none.
    """
    alone = _alone(arm)
    of_links = defaultdict(list)
    for part in range(arm.moving):
        of_links[arm.links[part]].append(part)
    touched = {_still(arm): tuple(obstacles)}  # the base may touch all
    for link, parts in of_links.items():
        each = np.zeros(len(obstacles), np.bool_) if may_touch is None else may_touch[parts].all(0)
        touched[link] = tuple(obstacles[n] for n in np.flatnonzero(each).tolist())
    still = {arm.links[part] for part in range(arm.moving, len(arm.parts))}
    touched |= dict.fromkeys(still, tuple(obstacles))
    links = (replace(link, touches_obstacles=touched.get(link.name, ())) for link in alone.links)
    return replace(alone, name=name, links=tuple(links))


def _still(arm: Arm) -> str:
    """The name of the first link of the base."""
    return _first_links(arm)[0]


def _first_links(arm: Arm) -> dict[int, str]:
    """Of each body the first link's name."""
    return {link.body: link.name for link in reversed(arm.tree.links)}


@lru_cache(maxsize=8)
def _alone(arm: Arm) -> PlainRobot:
    """The arm with nothing about it; its meshes are looked at once."""
    first = _first_links(arm)
    bodies = {name: body for body, name in first.items()}
    bodies |= {link: part.body for link, part in zip(arm.links, arm.parts, strict=True)}
    solids = defaultdict(list)
    for link, part in zip(arm.links, arm.parts, strict=True):
        solids[link].append(part.placed.solid.plain(part.placed.pose))
    checked = {frozenset((arm.links[i], arm.links[j])) for i, j in arm.pairs}
    solid = list(solids)
    touches = {
        name: tuple(o for o in solid if o != name and frozenset((name, o)) not in checked)
        for name in solid
    }
    links = tuple(
        PlainLink(name, tuple(solids[name]), touches.get(name, ()))
        for name in sorted(bodies, key=lambda name: (bodies[name], name != first[bodies[name]]))
    )
    return PlainRobot("", links, (*_moving(arm, first), *_rigid(bodies, first)))


def _moving(arm: Arm, first: dict[int, str]) -> list[PlainJoint]:
    """The joints that move, which join the first links of the bodies."""
    tree = arm.tree
    pairs = enumerate(zip(tree.joints, tree.parents, strict=True))
    return [
        PlainJoint(
            joint.name,
            _kind(joint),
            first[parent],
            first[number + 1],
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


def _rigid(bodies: dict[str, int], first: dict[int, str]) -> list[PlainJoint]:
    """Joins the other links of each body to its first one, in whose frame they are."""
    return [
        PlainJoint(
            f"{first[body]}-{name}", "fixed", first[body], name, np.eye(4), np.zeros(3), 0.0, 0.0
        )
        for name, body in bodies.items()
        if name != first[body]
    ]
