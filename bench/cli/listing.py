"""`bench list`: what is registered. Nothing numerical is imported for planners, environments and
robots."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import envs
import planners
from bench.cli.terminal import tell
from envs.errors import printable, tell_once
from envs.registry import Registry
from envs.robots.robot_description import RobotDescription


def list_(chosen: SimpleNamespace) -> int:
    """`bench list`."""
    listed = _LISTS[chosen.what]() if chosen.what in _LISTS else _registered(chosen.what)
    if chosen.json:
        tell(json.dumps(listed, indent=2))
        return 0
    for what, entries in listed.items():
        tell(f"{what}:")
        for entry in entries:
            tell(f"  {entry['id']:<20} {printable(str(entry['description']))}")
    return 0


def _metrics() -> dict[str, list[dict[str, Any]]]:
    from bench.judging import metrics, user_metrics

    with user_metrics.registered(()):
        known = metrics.known_metrics()
    return {
        "metrics": [
            {
                "id": metric.name,
                "description": f"{metric.heading()}, better {metric.better}",
                **{key: getattr(metric, key) for key in ("title", "unit", "better", "effect")},
                **{key: getattr(metric, key) for key in ("timed", "primary", "version", "origin")},
            }
            for metric in known
        ]
    }


def _robots() -> dict[str, list[dict[str, Any]]]:
    from envs.robots.named_robots import known_robots

    robots = known_robots()
    for origin, missing in {robot.origin: robot.missing for robot in robots}.items():
        if missing:
            tell_once(f"{origin} is not installed; to have its robots: {missing}")
    return {
        "robots": [
            {
                "id": robot.name,
                "description": _in_words(robot),
                "origin": robot.origin,
                "dof": robot.dof or None,
                "installed": not robot.missing,
                "urdf": str(robot.urdf),
                "srdf": str(robot.srdf) if robot.srdf else None,
                "group": robot.group,
                "tip": robot.tip,
                "joints": robot.joints,
                "state": robot.state,
            }
            for robot in robots
        ]
    }


def _in_words(robot: RobotDescription) -> str:
    joints = f"{robot.dof} joints" if robot.dof else ""
    said = filter(None, (robot.description, joints, robot.origin))
    return ", ".join(said) if not robot.missing else f"{', '.join(said)} (not installed)"


_LISTS = {"metrics": _metrics, "robots": _robots}
"""What is in no registry."""


def _registered(what: str | None) -> dict[str, list[dict[str, Any]]]:
    wanted: dict[str, Registry[Any]] = {"planners": planners.REGISTRY, "envs": envs.REGISTRY}
    if what is not None:
        wanted = {what: wanted[what]}
    return {
        kind: [
            {
                "id": spec.id,
                "description": spec.description,
                "version": spec.version,
                "aliases": list(spec.aliases),
                "groups": list(spec.groups),
                "not_repeatable": spec.not_repeatable,
                "origin": spec.origin,
            }
            for spec in registry.specs()
        ]
        for kind, registry in wanted.items()
    }
