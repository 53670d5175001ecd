"""Compiled checks of motions: what they take is free, and they refuse little else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
import trimesh
from map_files import write_ros

import envs
from envs import Environment
from envs.collision.motion_check import motion_is_free
from envs.compiled import njit_cached


@njit_cached
def asked(check: Any, a: Any, b: Any) -> bool:
    return bool(motion_is_free(check, a, b))


def room(folder: Path) -> Environment:
    file = folder / "room.ply"
    trimesh.creation.box((10, 8, 4)).export(file)
    return envs.make(f"mesh:file={file},kind=interior")


def plan(folder: Path) -> Environment:
    return envs.make(f"grid:file={write_ros(folder)},radius=0.02")


def ball(folder: Path) -> Environment:
    file = folder / "ball.ply"
    trimesh.creation.icosphere(subdivisions=2).export(file)
    return envs.make(f"mesh:file={file}")


WORLDS: dict[str, Callable[[Path], Environment]] = {
    **{
        text: lambda _, text=text: envs.make(text)  # type: ignore[misc]
        for text in (
            *("c3d", "box:robot_radius=0.5", "arm4", "arm6", "arm5:self_collision=true"),
            *(f"rigid:body=l,space={space}" for space in ("r3", "se2", "se3")),
        )
    },
    "room": room,
    "ball": ball,
    "plan": plan,
}


@pytest.mark.parametrize("name", WORLDS)
def test_what_is_taken_is_free_and_little_else_is_refused(name: str, tmp_path: Path) -> None:
    env = WORLDS[name](tmp_path)
    tolerance = env.planning_tolerance
    check, model = env.motion_check(tolerance), env.collision_model(tolerance / 2)
    planners_model = env.collision_model(tolerance)
    rng = np.random.default_rng(5)
    taken = refused = 0
    for a in env.space.sample(rng, 400):
        if not model.is_valid(a):
            continue
        [b] = env.space.sample(rng, 1)
        b = env.space.between(a, b, rng.uniform(0.05, 0.6))
        places = env.space.interpolate(
            *(np.repeat([x], 60, 0) for x in (a, b)), np.linspace(0, 1, 60)
        )
        least = min(model.clearance(q) for q in places)
        is_free = asked(check, a, b)
        if env.prover is None:
            assert planners_model.stays_free(a, b) == is_free
        if is_free:
            taken += 1
            assert least > tolerance / 2
        elif least > 0:
            refused += 1
            finer = np.linspace(0, 1, 4000)
            ends = (np.repeat([x], len(finer), 0) for x in (a, b))
            found = (model.clearance(q) for q in env.space.interpolate(*ends, finer))
            assert min(found) <= 2 * tolerance
    assert taken > 40


def test_it_may_only_be_asked_in_compiled_code() -> None:
    env = envs.make("c3d")
    with pytest.raises(TypeError, match="compiled"):
        motion_is_free(env.motion_check(0.1), env.lower, env.upper)


def test_what_is_no_check_does_not_compile() -> None:
    with pytest.raises(numba.TypingError):
        asked((1.0, 2.0), np.zeros(3), np.ones(3))
