"""Fast marching against analytic solutions of the Eikonal equation."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
import trimesh

import envs
import planners
from bench.conformance.trials import WalledIn, unsolvable_problem
from bench.judging.path_numbers import pieces
from envs import InputError, Problem
from envs.grid import RegularGrid
from envs.scenes.mesh_world import MeshWorld
from envs.spaces import Coordinates, Space
from planners import Budget, Status
from planners.fmm import descend


def _solve(env: envs.Environment, problem: Problem, text: str) -> np.ndarray:
    planner = planners.make(text)
    planner.setup(env, seed=1)
    result = planner.solve(problem, Budget(perf_counter() + 10))
    assert result.status is Status.EXACT_SOLUTION
    return np.asarray(result.path)


def test_open_space_gives_a_straight_line_between_the_exact_ends() -> None:
    env = envs.make("c3d:boxes=1")
    corner = -9.0 * np.sign(env.obstacles[0].center)
    problem = Problem(corner, corner * [1, 1, -0.5] + [0.123, 0.456, 0.0])
    path = _solve(env, problem, "fmm:resolution=60")
    assert (path[0] == problem.start).all()
    assert (path[-1] == problem.goal).all()
    straight = float(np.linalg.norm(problem.goal - problem.start))
    assert env.space.length(path) == pytest.approx(straight, rel=0.01)


def test_where_there_is_no_way_round_none_is_claimed() -> None:
    planner, env = planners.make("fmm:resolution=40"), WalledIn()
    planner.setup(env, seed=1)
    result = planner.solve(unsolvable_problem(), Budget(perf_counter() + 10))
    assert result.status is Status.APPROXIMATE_SOLUTION
    assert result.path is not None
    assert not env.collision_model().segment_is_free(result.path[0], result.path[-1])
    inside = Problem(np.zeros(3), np.array([1.0, 1.2, -1.0]))
    assert planner.solve(inside, Budget(perf_counter() + 10)).status is Status.EXACT_SOLUTION


def test_descent_in_a_known_field() -> None:
    """T = |q - goal| on a grid: the gradient is a unit vector to the goal, the path straight."""
    axes = np.linspace(-1, 1, 41)
    x, y = np.meshgrid(axes, axes, indexing="ij")
    goal = np.array([0.31, -0.17])
    times = np.hypot(x - goal[0], y - goal[1])
    field = RegularGrid.between(times, np.full(2, -1.0), np.ones(2))
    q = np.array([-0.8, 0.9])
    away = (q - goal) / np.linalg.norm(q - goal)
    assert field.gradient(q) == pytest.approx(away, abs=1e-3)
    path = descend(field, q, goal, 0.1)
    assert path is not None
    whole = Space([Coordinates(field.lower, field.upper)]).length(path)
    assert whole == pytest.approx(np.linalg.norm(q - goal), rel=1e-3)


def test_a_flat_field_leads_nowhere() -> None:
    field = RegularGrid.between(np.zeros((5, 5)), np.zeros(2), np.full(2, 4.0))
    assert descend(field, np.array([1.0, 1.0]), np.array([3.0, 3.0]), 0.1) is None


@pytest.mark.slow
def test_it_goes_round_obstacles_and_near_the_optimal_time() -> None:
    """A finer grid finds paths that are no slower, and its time is close to the coarser one's."""
    env = envs.make("c3d")
    judge = env.collision_model()
    blocked = [p for p in env.sample_problems(40, 5) if not judge.segment_is_free(p.start, p.goal)]
    for problem in blocked[:3]:
        coarse, fine = (_solve(env, problem, f"fmm:resolution={n}") for n in (40, 80))
        assert judge.min_clearance(fine) > judge.tolerance
        times = []
        for path in (coarse, fine):
            places, lengths = pieces(env.space, path, 0.02)
            times.append(float((lengths / env.speed(places)).sum()))
        assert times[1] <= times[0] * 1.01
        assert times[1] >= times[0] * 0.9


@pytest.mark.parametrize("text", ["fmm:resolution=2", "fmm:order=3", "fmm:resolution=99999"])
def test_arguments_out_of_range(text: str) -> None:
    with pytest.raises(InputError):
        planners.make(text)


def test_too_large_a_grid_is_unsupported() -> None:
    reason = planners.make("fmm:resolution=500").unsupported(envs.make("c3d"))
    assert reason is not None
    assert "500^3" in reason


@pytest.mark.slow
def test_goals_near_thin_walls_are_reached(tmp_path: Path) -> None:
    """Nodes beyond a wall, slow ones, may be within the sphere that fronts start from."""
    room = trimesh.creation.box((8.0, 6.0, 3.0))
    room.invert()
    room.export(tmp_path / "room.ply")
    env = MeshWorld(str(tmp_path / "room.ply"))
    model = env.collision_model()
    for goal in (
        [2.739, -3.453, -3.443],
        [-4.006, -1.160, -3.538],
        [7.907, -4.105, -3.506],
        [5.384, -7.197, -1.978],
        [-9.705, -5.424, 2.311],
    ):
        path = _solve(env, Problem(np.zeros(3), np.array(goal)), "fmm")
        assert model.min_clearance(path) > model.tolerance
