"""A robot by name: its files, and which of its joints move unless somebody says otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from envs.errors import InputError, UnknownNameError, brief
from envs.registry.spec import check_name


@dataclass(frozen=True)
class RobotDescription:
    """What `robot=NAME` stands for.

    Attributes:
        name: of the robot.
        urdf: its file.
        srdf: its SRDF file, if it has one.
        group, tip, joints: which joints move, as in `envs.robots.planning_group.PlanningGroup`; at
            most one of them is given, and without any all do.
        state: the name of the SRDF's group states where the others stand.
        dof: how many joints move, for lists; 0 if nobody says.
        description: in a few words, for lists.
        origin: the distribution that has it.
        missing: what to do to have its files, if they are not there.
    """

    name: str
    urdf: Path
    srdf: Path | None = None
    group: str = ""
    tip: str = ""
    joints: tuple[str, ...] = ()
    state: str = ""
    dof: int = 0
    description: str = ""
    origin: str = ""
    missing: str = ""


def described(
    robots: Mapping[str, Mapping[str, Any]], folder: Path, origin: str, missing: str = ""
) -> list[RobotDescription]:
    """The robots that a package announces.

    Args:
        robots: by name, some of the fields of each: "urdf", and what there is of "srdf", "group",
            "tip", "joints", "state", "dof" and "description". Files are relative to `folder`.
        folder: of the package.
        origin, missing: as in `RobotDescription`.

    Raises:
        InputError: a name is not well formed, or a field is unknown or missing.
        TypeError: something is of another type.
    """
    _check_type("robots", robots, Mapping)
    return [_described(name, said, folder, origin, missing) for name, said in robots.items()]


_SAID: Mapping[str, type | tuple[type, ...]] = {
    "urdf": (str, Path),
    "srdf": (str, Path),
    **dict.fromkeys(("group", "tip", "state", "description"), str),
    "joints": (list, tuple),
    "dof": int,
}
"""What packages may say of a robot, and the types."""


def _described(
    name: str, said: Mapping[str, Any], folder: Path, origin: str, missing: str
) -> RobotDescription:
    check_name("robot", name)
    _check_type(name, said, Mapping)
    for key, value in said.items():
        if key not in _SAID:
            raise UnknownNameError(f"field of robot {name!r}", str(key), _SAID)
        _check_type(f"{name}: {key}", value, _SAID[key])
    if "urdf" not in said:
        raise InputError(f"robot {name!r} has no urdf; say which file that is")
    files = {key: folder / said[key] for key in ("urdf", "srdf") if key in said}
    joints = tuple(said.get("joints", ()))
    more = {"dof": len(joints), **said, **files, "joints": joints}
    return RobotDescription(name, origin=origin, missing=missing, **more)


def _check_type(what: str, value: object, wanted: type | tuple[type, ...]) -> None:
    if not isinstance(value, wanted):
        named = wanted[0] if isinstance(wanted, tuple) else wanted
        raise TypeError(f"{what} is {brief(value)}, not a {named.__name__}")
