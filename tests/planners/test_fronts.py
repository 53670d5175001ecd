"""Both solvers of arrival times, against analytic solutions of the Eikonal equation."""

from __future__ import annotations

import sys
from time import perf_counter
from typing import Any

import numpy as np
import pytest

import envs
import planners
from envs import InputError, Problem
from envs.robots.point import PointRobot
from envs.spaces import Coordinates, Space
from envs.speed_model import SpeedModel
from planners import Budget, Status
from planners.factored_fronts import carried
from planners.fast_marching import SpeedGrid
from planners.fronts import Medium, Source, solver_named

pytest.importorskip(
    "eikonalfm", reason='it is not installed: pip install "plannerbench[eikonalfm]"'
)

SOLVERS = ["skfmm", "eikonalfm"]


class Slope(envs.Environment):
    """Nothing is about, and the speed rises evenly along the first axis."""

    min_clearance = 0.1
    obstacles = ()
    robot = PointRobot(0.0)
    speed_model = SpeedModel(d_min=0.01, d_max=10.0, s_const=10.0)

    def __init__(self, dimension: int, rise: float) -> None:
        self.space = Space([Coordinates([0.0] * dimension, [3.0] * dimension)])
        self.lower, self.upper = self.space.lower, self.space.upper
        self.rise = rise

    def clearance(self, q: np.ndarray) -> np.ndarray:
        """Also the speed, as the model has it."""
        rising: np.ndarray = 1.0 + self.rise * q[:, 0]
        return rising

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        return []

    def definition(self) -> dict[str, Any]:
        return {}

    def time(self, source: np.ndarray, q: np.ndarray) -> np.ndarray:
        """From a source (d,) to places (n, d): rays are straight, or arcs of circles."""
        distance: np.ndarray = np.linalg.norm(q - source, axis=1)
        if self.rise == 0:
            return distance
        product = self.speed(source[None]) * self.speed(q)
        found: np.ndarray = np.arccosh(1 + (self.rise * distance) ** 2 / (2 * product)) / self.rise
        return found


def errors(env: Slope, resolution: int, solver: str, order: int = 2) -> np.ndarray:
    """Of times at the nodes (n,) outside the source's sphere, by the largest time."""
    grid = SpeedGrid(env, resolution, order, solver_named(solver))
    source = np.array([0.777, 1.234, 2.111])[: env.dimension]
    times = grid.arrival_times(source) + grid.radius / env.speed(source[None])[0]
    axes = [np.linspace(0, 3, n) for n in times.shape]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, env.dimension)
    exact = env.time(source, nodes)
    far = np.linalg.norm(nodes - source, axis=1) > grid.radius
    found: np.ndarray = np.abs(times.reshape(-1) - exact)[far] / exact.max()
    return found


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("solver", SOLVERS)
def test_at_one_speed_times_are_distances(solver: str, dimension: int) -> None:
    most = {"skfmm": 0.02, "eikonalfm": 1e-9}[solver]
    assert errors(Slope(dimension, 0.0), 41, solver).max() < most


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("solver", SOLVERS)
def test_where_speeds_rise_evenly(solver: str, dimension: int) -> None:
    most = {"skfmm": 0.02, "eikonalfm": 0.003}[solver]
    assert errors(Slope(dimension, 1.0), 41, solver).max() < most


def test_errors_of_factored_fronts_fall_with_the_square_of_the_spacing() -> None:
    env = Slope(2, 1.0)
    coarse, fine = (errors(env, n, "eikonalfm").mean() for n in (31, 121))
    assert fine < coarse / 12, "a quarter of the spacing"
    assert fine < errors(env, 121, "eikonalfm", order=1).mean() / 5


@pytest.mark.parametrize("place", [[0.0, 0.0], [0.0, 3.0], [1.5, 0.75], [0.001, 2.999]])
def test_sources_may_be_nodes_and_on_the_border(place: list[float]) -> None:
    """The slow one, from which all rays stay within the bounds."""
    env, source = Slope(2, 1.0), np.array(place)
    grid = SpeedGrid(env, 41, 2, solver_named("eikonalfm"))
    q = np.random.default_rng(0).uniform(0, 3, (200, 2))
    q = q[np.linalg.norm(q - source, axis=1) > 2 * grid.radius]
    times = grid.times_at(grid.arrival_times(source), source, q)
    assert times == pytest.approx(env.time(source, q), abs=0.005)


def test_a_thin_wall_is_crossed_at_its_own_speed() -> None:
    """One node thick, and half way between nodes where the grid is moved to."""
    speed = np.ones((41, 41))
    speed[20] = 0.01
    place = np.array([5.5, 20.5])
    axes = np.stack(np.meshgrid(np.arange(41), np.arange(41), indexing="ij"), axis=-1)
    distances = np.linalg.norm(axes - place, axis=-1)
    medium = Medium(speed, np.ones(2), (False, False), 2)
    [one, other] = (
        solver_named(name).arrival_times(medium, Source(place, 1.0, 1.5, distances - 1.5), np.inf)
        for name in SOLVERS
    )
    assert other[35, 20] == pytest.approx(one[35, 20], rel=0.2)
    assert other[35, 20] > 80
    assert other[:19] == pytest.approx(distances[:19] - 1.5, abs=0.01), "no waves before it"


def test_values_are_carried_to_other_nodes() -> None:
    """Exactly if they are cubic, but for the nodes at the border, and without overshoots."""
    x = np.arange(12.0)
    rising = x**3 + 2 * x
    at = x[:11] + 0.3
    found = carried(rising, np.array([0.3]), np.array([11]))
    assert found[1:-1] == pytest.approx((at**3 + 2 * at)[1:-1])
    assert carried(rising, np.array([-2.0]), np.array([4])).tolist() == [0.0, 0.0, 0.0, 3.0]
    step = carried(np.repeat([0.0, 1.0], 6), np.array([0.5]), np.array([11]))
    assert step.min() == 0
    assert step.max() == 1
    plane = np.add.outer(x, 10 * x)
    moved = carried(plane, np.array([0.25, 0.5]), np.array([11, 11]))
    assert moved[1:-1, 1:-1] == pytest.approx(plane[1:10, 1:10] + 5.25)


def test_paths_on_c3d_are_free_and_as_fast(c3d: envs.Environment) -> None:
    judge = c3d.collision_model()
    pair = [planners.make(f"fmm:resolution=50,solver={name}") for name in SOLVERS]
    for planner in pair:
        planner.setup(c3d, seed=1)
    for problem in c3d.sample_problems(6, 5):
        lengths = []
        for planner in pair:
            result = planner.solve(problem, Budget(perf_counter() + 60))
            assert result.status is Status.EXACT_SOLUTION
            path = np.asarray(result.path)
            assert (path[[0, -1]] == [problem.start, problem.goal]).all()
            assert judge.min_clearance(path) > judge.tolerance
            lengths.append(c3d.space.length(path))
        assert lengths[1] == pytest.approx(lengths[0], rel=0.05)


def test_wrong_names_get_the_nearest() -> None:
    with pytest.raises(InputError, match="unknown solver 'skfm'; did you mean 'skfmm'"):
        planners.make("fmm:solver=skfm")
    assert planners.make("fmm:solver=skfmm").unsupported(envs.make("c3d")) is None


def test_a_missing_package_is_told_of_in_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "eikonalfm", None)
    planners.make("fmm")
    with pytest.raises(InputError, match=r'pip install "plannerbench\[eikonalfm\]"'):
        planners.make("fmm:solver=eikonalfm")


def test_fronts_that_do_not_go_round_are_for_spaces_that_do_not_wrap() -> None:
    env = envs.make("rigid:space=se2")
    reason = planners.make("fmm:solver=eikonalfm").unsupported(env)
    assert reason is not None
    assert "wrap" in reason
    assert planners.make("fmm").unsupported(env) is None
