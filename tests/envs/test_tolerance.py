"""To what the judge decides, and that planners keep to more, from small worlds to wide ones."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
from bad_urdfs import collision, joint, link, robot

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from planners import Budget

BALL = 0.15


@pytest.mark.parametrize("env", ["c3d", "box", "arm4", "arm6"])
def test_of_what_ships_it_is_a_thousandth_of_a_unit(env: str) -> None:
    world = envs.make(env)
    assert world.tolerance == world.collision_model().tolerance == 1e-3
    assert world.planning_tolerance == 2e-3


def gantry(folder: Path, side: float) -> Environment:
    """A ball on two rails that cover a square, with a block in its middle, a tenth as wide."""
    limit = f'<limit lower="{-side / 2}" upper="{side / 2}" effort="1" velocity="1"/>'
    ball = collision(f'<sphere radius="{BALL}"/>')
    rails = [
        joint("x", "floor", "bridge", "prismatic", limit, axis="1 0 0"),
        joint("y", "bridge", "trolley", "prismatic", limit, axis="0 1 0"),
    ]
    links = [link("floor", ""), link("bridge", ""), link("trolley", ball)]
    (folder / "gantry.urdf").write_text(robot(*links, *rails))
    (folder / "block.yaml").write_text(f"obstacles:\n- box: [{side / 10}, {side / 10}, 2]\n")
    return envs.make(f"arm:urdf={folder / 'gantry.urdf'},scene={folder / 'block.yaml'}")


@pytest.mark.parametrize(
    ("side", "tolerance"), [(2, 1e-3), (20, 1e-3), (100, 4e-3), (1000, 5e-3), (1900, 5e-3)]
)
def test_it_grows_with_what_is_reached_and_stays_below_what_ends_keep(
    side: float, tolerance: float, tmp_path: Path
) -> None:
    world = gantry(tmp_path, side)
    assert side <= world.extent <= 2.5 * side + 1
    assert world.tolerance == pytest.approx(tolerance, rel=0.25)
    assert world.planning_tolerance <= world.min_clearance / 2


@pytest.mark.parametrize("side", [20, 1000])
def test_a_motion_along_a_wall_is_decided_in_a_wide_world_too(side: float, tmp_path: Path) -> None:
    """It keeps twice the tolerance from the block all along, which is what costs most."""
    world = gantry(tmp_path, side)
    away = side / 20 + BALL + 2 * world.tolerance
    along = np.array([[away, -0.04 * side], [away, 0.04 * side]])
    judge, model = Judge(world), world.collision_model()
    assert judge(Problem(along[0], along[1], 0, 0), along).verdict is Verdict.VALID
    assert model.segment_is_free(*along)
    assert model.checks < 10_000  # 32,767 at a thousandth of a unit in 1000
    into = along - [2.5 * world.tolerance, 0]
    assert judge(Problem(into[0], into[1], 0, 0), into).verdict is Verdict.COLLISION


@pytest.mark.parametrize("planner", ["rrtconnect", "random-detours"])
def test_planners_paths_are_accepted_in_a_wide_world(planner: str, tmp_path: Path) -> None:
    world = gantry(tmp_path, 1000)
    judge, tried = Judge(world), planners.make(planner)
    tried.setup(world, seed=1)
    for problem in world.sample_problems(3, 0):
        path = tried.solve(problem, Budget(perf_counter() + 20)).path
        assert judge(problem, path).verdict is Verdict.VALID
