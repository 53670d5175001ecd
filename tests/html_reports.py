"""Runs for tests of the HTML report, and what is read back from it."""

from __future__ import annotations

import base64
import json
from typing import Any

import numpy as np
from records import recorded, row

from bench.analysis.run_results import RunResults
from envs import Environment
from envs.collision.shapes import Box
from envs.problem import Array

PLANNERS = ("ntfields", "ief3d", "fmm", "mpnet", "rrtstar", "lazyprmstar")
PROBLEMS = 100

HOSTILE = (
    "</script><script>document.hacked = 1</script><!-- <img src=x onerror='document.hacked = 1'>"
)


def unpacked(data: dict[str, Any], *shape: int) -> Array:
    """What `packed` was given, to a step."""
    kind = {"Int16Array": "<i2", "Int32Array": "<i4"}[data["type"]]
    whole = np.frombuffer(base64.b64decode(data["data"]), kind)
    return (whole * data["step"]).reshape(shape)


def through(box: Box, c3d: Environment) -> Array:
    """A straight path (2, 3) across the cube, through a box."""
    path = np.array([box.center, box.center])
    path[:, 0] = c3d.lower[0], c3d.upper[0]
    return path


def run_in_c3d(c3d: Environment, *rows: dict[str, Any]) -> RunResults:
    """Rows made for a stand-in of c3d, as of c3d itself."""
    here = c3d.fingerprint
    made = [{**one, "env_fingerprint": here} for one in rows]
    return recorded(made, envs=[{"id": "c3d", "fingerprint": here}])


ACROSS = np.array([[-1.0, 0.0, 3.0], [1.0, 0.0, -3.0]])
"""Turns by 0.28 across pi, and is free."""

THROUGH = np.array([[-3.0, 3.0, 0.0], [3.0, 3.0, 0.0]])
"""Both cubes go through the obstacle."""


def run_in_cubes(world: Environment) -> RunResults:
    """In `turning_cubes.Plane`, which is registered as "cubes": a path in a problem, another that
    collides in the next, and one that is none."""
    there = {"env": "cubes", "env_fingerprint": world.fingerprint, "solve_s": 1.0}
    return recorded(
        [
            row("good", 0, "VALID", path=ACROSS, length=2.0, **there),
            row("bad", 1, "COLLISION", path=THROUGH, **there),
            row("odd", 0, "MALFORMED", path=np.zeros((2, 5)), **there),
        ]
    )


def wandering_path(
    world: Environment, problem: int, draw: np.random.Generator, waypoints: int
) -> Array:
    """A path (waypoints, 3) between a problem's ends, as smooth as planners' are."""
    ends = np.random.default_rng(problem).uniform(world.lower, world.upper, (2, 3))
    shares = np.linspace(0, 1, waypoints)[:, None]
    waves = np.sin(np.pi * shares * np.arange(1, 4)) @ draw.normal(0, 1.5, (3, 3))
    path: Array = (ends[0] + shares * (ends[1] - ends[0]) + waves).clip(world.lower, world.upper)
    return path


def attempt(world: Environment, number: int, planner: str, problem: int) -> dict[str, Any]:
    """Every tenth attempt times out and the next collides: the path goes through a box."""
    draw = np.random.default_rng([number, problem])
    kind = (number + problem) % 10
    took = 10 ** draw.uniform(-3, 0.5)
    if kind == 0:
        return row(planner, problem, "TIMEOUT", solve_s=5.0, error="no path in 5 s")
    path = wandering_path(world, problem, draw, 100)
    outcome = "COLLISION" if kind == 1 else "VALID"
    if outcome == "COLLISION":
        path[50] = world.obstacles[0].center  # type: ignore[union-attr]
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    history = [[took * share, length * (2 - share)] for share in (0.2, 0.5, 1.0)]
    stats = json.dumps({"cost_history": history} if planner == "rrtstar" else {})
    found = {"path": path, "waypoints": 100, "length": length, "stats": stats}
    margin = draw.uniform(0, 2) if outcome == "VALID" else None
    return row(planner, problem, outcome, solve_s=took, safety_margin=margin, **found)


def six_by_hundred(c3d: Environment) -> RunResults:
    """Six planners on a hundred problems."""
    rows = [
        attempt(c3d, number, planner, problem)
        for number, planner in enumerate(PLANNERS)
        for problem in range(PROBLEMS)
    ]
    return run_in_c3d(c3d, *rows)
