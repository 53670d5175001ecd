"""Fast marching against analytic solutions of the Eikonal equation."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest
import trimesh

import envs
import planners
from bench.conformance.trials import WalledIn, unsolvable_problem
from bench.judging.path_numbers import pieces
from envs import InputError, Problem
from envs.grid import RegularGrid
from envs.robots.point import PointRobot
from envs.scenes.mesh_world import MeshWorld
from envs.spaces import Coordinates, Space
from envs.speed_model import SpeedModel
from planners import Budget, Status
from planners.fast_marching import SpeedGrid
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
    space = Space([Coordinates(field.lower, field.upper)])
    path = descend(field, space, q, goal, 0.1, 1.0)
    assert path is not None
    whole = space.length(path)
    assert whole == pytest.approx(np.linalg.norm(q - goal), rel=1e-3)


def test_a_flat_field_leads_nowhere() -> None:
    field = RegularGrid.between(np.zeros((5, 5)), np.zeros(2), np.full(2, 4.0))
    space = Space([Coordinates(field.lower, field.upper)])
    assert descend(field, space, np.array([1.0, 1.0]), np.array([3.0, 3.0]), 0.1, 1.0) is None


class Cylinder(envs.Environment):
    """Nothing is about: a place along an axis, and an angle that counts twice."""

    space = Space([Coordinates([0], [6]), Coordinates([-np.pi], [np.pi], [True], weight=2.0)])
    lower, upper = space.lower, space.upper
    min_clearance = 0.1
    obstacles = ()
    robot = PointRobot(0.0)
    speed_model = SpeedModel(d_min=0.1, d_max=1.0)

    def clearance(self, q: np.ndarray) -> np.ndarray:
        return np.ones(len(q))

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return []

    def definition(self) -> dict[str, Any]:
        return {}


def test_on_a_cylinder_fronts_go_round_and_paths_take_the_short_way() -> None:
    """Unrolled it is a plane: T = |difference| of the shorter way, and geodesics are straight."""
    env = Cylinder()
    grid = SpeedGrid(env, 120, order=2)
    goal = np.array([3.1, 2.9])
    times = grid.arrival_times(goal)
    assert (times[:, 0] == times[:, -1]).all()
    q = env.space.sample(np.random.default_rng(0), 300)
    exact = np.linalg.norm(env.space.difference(np.repeat(goal[None], 300, 0), q) * [1, 2], axis=1)
    far = exact > 2 * grid.radius
    assert grid.times_at(times, goal, q)[far] == pytest.approx(exact[far], abs=grid.radius / 2)

    field = RegularGrid.between(times, grid.lower, grid.upper)
    start = np.array([1.0, -2.5])
    path = descend(field, env.space, start, goal, grid.radius, grid.fastest)
    assert path is not None
    straight = np.hypot(2.1, 2 * (2 * np.pi - 5.4))
    steps = env.space.difference(path[:-1], path[1:]) * [1, 2]
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(straight, rel=0.02)
    assert env.contains(path).all()
    assert np.abs(path[:, 1]).min() > 2.4, "never by way of 0"


@pytest.mark.parametrize("until", [0.5, 2.0, 9.0])
def test_a_front_that_is_not_followed_to_its_end_was_where_it_is_known(until: float) -> None:
    grid = SpeedGrid(envs.make("c3d"), 30, order=2)
    goal = np.array([4.0, -3.0, 6.5])
    whole, part = grid.arrival_times(goal), grid.arrival_times(goal, until)
    known = ~np.isnan(part)
    assert (part[known] == whole[known]).all()
    # Of second order, a node may be earlier than one that was reached before it.
    assert known[whole <= until].mean() > 0.99
    assert not known.all()


class Marches:
    """How far fronts were followed, in place of `SpeedGrid.arrival_times`."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.until: list[float] = []
        whole = SpeedGrid.arrival_times

        def noted(grid: SpeedGrid, goal: np.ndarray, until: float = np.inf) -> np.ndarray:
            self.until.append(until)
            return whole(grid, goal, until)

        monkeypatch.setattr(SpeedGrid, "arrival_times", noted)


@pytest.mark.parametrize("make", [lambda: envs.make("c3d"), lambda: envs.make("box"), Cylinder])
def test_paths_are_those_of_the_whole_field(
    make: Callable[[], envs.Environment], monkeypatch: pytest.MonkeyPatch
) -> None:
    env, marches = make(), Marches(monkeypatch)
    grid, planner = SpeedGrid(env, 40, order=2), planners.make("fmm:resolution=40")
    planner.setup(env, seed=1)
    for start, goal in env.sampling_space.sample(np.random.default_rng(3), 24).reshape(12, 2, -1):
        path = planner.solve(Problem(start, goal), Budget(np.inf)).path
        field = RegularGrid.between(grid.arrival_times(goal), grid.lower, grid.upper)
        whole = descend(field, env.space, start, goal, grid.radius, grid.fastest)
        assert (path is None) == (whole is None)
        assert path is None or (path == whole).all()
    assert sum(until < np.inf for until in marches.until) >= 12


def test_long_detours_take_a_longer_front(monkeypatch: pytest.MonkeyPatch) -> None:
    """From one side of a wall to the other, all the way round it."""
    marches, planner = Marches(monkeypatch), planners.make("fmm:resolution=40")
    planner.setup(WalledIn(), seed=1)
    planner.solve(unsolvable_problem(), Budget(np.inf))
    assert len(marches.until) > 1, "by way of the wall, which is slow"
    marches.until.clear()
    planner.solve(Problem(np.zeros(3), np.array([1.0, 1.2, -1.0])), Budget(np.inf))
    assert marches.until[-1] < np.inf


def test_rotations_in_space_have_no_grid() -> None:
    planner = planners.make("fmm")
    assert "SO(3)" in str(planner.unsupported(envs.make("rigid:space=se3")))
    assert planner.unsupported(envs.make("rigid:space=se2")) is None


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


def test_a_way_may_be_many_times_as_long_as_the_world() -> None:
    """Through all rooms of a maze in space: up to thirteen times its side."""
    env = envs.make("maze:rooms=5,dimension=3")
    planner = planners.make("fmm")
    planner.setup(env, seed=0)
    lengths = []
    for problem in env.problems_at([5, 14], 0):
        result = planner.solve(problem, Budget(perf_counter() + 60))
        assert result.status is Status.EXACT_SOLUTION
        lengths.append(env.space.length(np.asarray(result.path)))
    assert max(lengths) > 200
