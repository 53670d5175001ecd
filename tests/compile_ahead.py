"""Compiles what tests need, once and before they begin.

Processes share by files what Numba has compiled, but compile the same at the same time where there
is nothing yet: on a fresh checkout that took every test process, and every worker that tests start,
up to a minute. `compile_all` does it in two processes, whose parts have little in common.
"""

from __future__ import annotations

import gc
import platform
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numba
import numpy as np
import trimesh

import envs
import planners
from envs import Environment, Problem
from envs.compiled import cache_folder

PARTS: tuple[dict[str, Callable[[], None]], ...]
"""For each process what it compiles, by name; see the end of the file."""


def compile_all(names: set[str]) -> None:
    """Compiles some of the parts, in a process for each entry of `PARTS` that lacks any."""
    if not cache_folder():
        return  # Numba keeps it beside the sources, if anywhere
    wanted = [[n for n in parts if n in names and not _mark(n).exists()] for parts in PARTS]
    started = [subprocess.Popen([sys.executable, __file__, *some]) for some in wanted if some]
    for process in started:
        process.wait()  # if it fails, so will tests, which say why


def _mark(name: str) -> Path:
    """The file, beside what is compiled from these sources, that says that a part of it is."""
    return Path(cache_folder()) / f"{name}, Python {platform.python_version()}, {numba.__version__}"


def _meshes() -> None:
    with _ball() as file:
        _ask_all(envs.make(f"mesh:file={file}"))


# Trees are arms whose links must not touch, with nothing that is compiled for them alone.
_ARMS = ("arm5:self_collision=true", "arm4")


def _models_of_arms() -> None:
    for text in _ARMS:
        _ask_model(envs.make(text))


def _motions_of_arms() -> None:
    for text in _ARMS:
        world = envs.make(text)
        _ask_motions(world)
        _ask_check(world)
    assert envs.make("arm4").sample_problems(1, 0)


def _searches() -> None:
    """Compiled planners, which are so once for all environments."""
    for name in ("rrtconnect-fast", "aorrtc"):
        planners.make(name).setup(envs.make("c3d"), seed=0)


def _ask_check(world: Environment) -> None:
    """What compiled planners ask, and others."""
    check = world.motion_check(world.planning_tolerance)
    assert check is not None
    check.is_free(world.lower, world.lower)
    world.collision_model(world.planning_tolerance).stays_free(world.lower, world.lower)


def _bodies() -> None:
    _ask_all(envs.make("rigid"))
    with _ball() as file:
        _ask_all(envs.make(f"rigid:size=1,body={file}"))


@contextmanager
def _ball() -> Iterator[Path]:
    """A mesh file."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "ball.ply"
        trimesh.creation.icosphere(subdivisions=1).export(file)
        yield file


def _ask_all(world: Environment) -> None:
    """All that is asked of a world."""
    _ask_motions(world)
    _ask_model(world)


def _ask_motions(world: Environment) -> None:
    """What planners and pictures ask of a world."""
    ends = world.space.sample(np.random.default_rng(0), 2)
    world.approximate_clearance(ends)
    world.paths_are_free([ends], world.planning_tolerance)
    world.robot.trace(ends)


def _ask_model(world: Environment) -> None:
    """What planners and judge ask of its model, of arrays that may be written to and of others, as
    those of problems are."""
    ends = world.space.sample(np.random.default_rng(0), 2)
    model, problem = world.collision_model(), Problem(*ends)
    for start, goal in (ends, (problem.start, problem.goal)):
        model.clearance(start)
        model.segment_is_free(start, goal)
    model.first_contact(ends)
    model.min_clearance(ends)
    world.clearance(ends)
    assert world.fingerprint


def _field_in(env: str, *names: str) -> Callable[[], None]:
    def set_up() -> None:
        world = envs.make(env)
        middle = (world.lower + world.upper) / 2
        for name in names:
            planner = planners.make(name)
            planner.setup(world, seed=0)
            planner.solve(Problem(middle, middle + 0.1), planners.Budget(np.inf))

    return set_up


PARTS = (
    {
        "models of arms": _models_of_arms,
        "searches": _searches,
        "fields of arms": _field_in("arm4", "ntfields"),
    },
    {
        "fields": _field_in("c3d", "ntfields", "ntrl"),
        "bodies": _bodies,
        "meshes": _meshes,
        # Last, as much of it is what models ask, too, which the other process has compiled.
        "motions of arms": _motions_of_arms,
        "fields in rooms": _field_in("gibson-generated", "ntfields", "ntrl"),
    },
)

QUICK = {"models of arms", "fields", "searches", "bodies", "meshes", "motions of arms"}
"""What tests need that are not slow."""

ALL = {name for parts in PARTS for name in parts}

if __name__ == "__main__":
    gc.disable()  # the compiler makes many objects and keeps them: a tenth of the time
    for parts in PARTS:
        for name, compile_part in parts.items():
            if name in sys.argv[1:]:
                compile_part()
                _mark(name).touch()
