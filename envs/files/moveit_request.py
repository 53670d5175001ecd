"""Motion requests as MoveIt's messages have them, in YAML, of which MotionBenchMaker's problems are
made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from envs.errors import InputError
from envs.files.yaml_text import list_of, mapping_of, name_of, number_of, parsed_yaml


@dataclass(frozen=True)
class MotionRequest:
    """What is to be planned.

    Attributes:
        group: the planning group.
        start: values of joints by name, in radians or metres; more than those of the group.
        goal: of the group's.
    """

    group: str
    start: Mapping[str, float]
    goal: Mapping[str, float]


def read_motion_request(text: bytes) -> MotionRequest:
    """Reads a request whose goal is one of joint values.

    Args:
        text: YAML.

    Raises:
        InputError: it is none, or has no such goal.
    """
    content = mapping_of(parsed_yaml(text), "a motion request")
    state = mapping_of(content.get("start_state") or {}, "start_state")
    joints = mapping_of(state.get("joint_state") or {}, "joint_state")
    names = list_of(joints.get("name") or [], "name")
    values = list_of(joints.get("position") or [], "position")
    if len(names) != len(values):
        raise InputError(f"the start has {len(names)} joints and {len(values)} values for them")
    start = {
        name_of(n): number_of(v, "a start's value") for n, v in zip(names, values, strict=True)
    }
    return MotionRequest(name_of(content.get("group_name", "")), start, _goal(content))


def _goal(content: Mapping[str, Any]) -> dict[str, float]:
    goals = list_of(content.get("goal_constraints") or [], "goal_constraints")
    if len(goals) != 1:
        raise InputError(f"it has {len(goals)} goals; one of joint values is read")
    found = {}
    for entry in list_of(mapping_of(goals[0], "a goal").get("joint_constraints") or [], "a goal"):
        one = mapping_of(entry, "a joint's constraint")
        found[name_of(one.get("joint_name"))] = number_of(one.get("position"), "a goal's position")
    if not found:
        raise InputError("its goal is none of joint values (joint_constraints)")
    return found
