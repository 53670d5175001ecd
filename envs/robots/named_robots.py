"""Robots by name: those of example-robot-data, and those that other packages announce.

A package announces robots by an entry point of the group `bench.robots`, which loads to a mapping
as `envs.robots.robot_description.described` takes it, or to a function that gives one. No URDF is
read before a robot is asked for.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from envs.errors import InputError, UnknownNameError
from envs.registry.plugins import announced, entry_points, origin_of
from envs.robots import example_robot_data
from envs.robots.robot_description import RobotDescription, described

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "bench.robots"
"""Of the entry points by which packages announce robots."""


def known_robots() -> list[RobotDescription]:
    """All robots that have a name, ours first. A package that is broken, or has a name that is
    taken, is named in a warning and left out."""
    known = {robot.name: robot for robot in example_robot_data.robots()}

    def of_package(point: EntryPoint) -> list[RobotDescription]:
        robots = _robots_at(point)
        for robot in robots:
            if robot.name in known:
                raise InputError(f"there is a robot called {robot.name!r} already")
        return robots

    for robots in announced("robot", entry_points(GROUP), of_package):
        known.update((robot.name, robot) for robot in robots)
    return list(known.values())


def robot_named(name: str) -> RobotDescription:
    """The robot of a name, whose files are there.

    Raises:
        InputError: there is none, or its package is not installed.
    """
    known = {robot.name: robot for robot in known_robots()}
    if name not in known:
        raise UnknownNameError("robot", name, known)
    robot = known[name]
    if robot.missing:
        raise InputError(f"robot {name!r} is in {robot.origin}, which is not here; {robot.missing}")
    return robot


def _robots_at(point: EntryPoint) -> list[RobotDescription]:
    said = point.load()
    folder = Path(sys.modules[point.module].__file__ or "").parent
    return described(said() if callable(said) else said, folder, origin_of(point))
