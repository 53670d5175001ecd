"""The certified checks: against closed forms, and against sampling 1000 times finer."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import envs
from envs.collision.continuous import (
    UndecidedError,
    compiled_is_covered,
    is_covered,
    path_min_clearance,
    segment_is_free,
)
from envs.collision.fcl_model import CollisionModel
from envs.collision.margin_search import FIRST_QUERIES
from envs.collision.shapes import Box
from envs.robots.point import PointRobot

TOLERANCE = 1e-3


def one_box(radius: float = 0.0, tolerance: float = TOLERANCE) -> CollisionModel:
    """A point robot and a box of side 2 at the origin."""
    return CollisionModel(PointRobot(radius), [Box([0, 0, 0], [2, 2, 2])], tolerance)


@pytest.mark.parametrize(
    ("waypoints", "clearance"),
    [
        ([[-5, 1.5, 0], [5, 1.5, 0]], 0.5),  # past a face
        ([[-5, 0, 5], [5, 0, 5]], 4),
        ([[0, 4, 0], [4, 0, 0]], 2**0.5),  # across an edge: |x + y| = 4, edge at (1, 1)
        ([[3, 0, 0], [5, 0, 0]], 2),  # away from it: the start is nearest
        ([[5, 5, 5], [5, 5, 5]], 4 * 3**0.5),  # no motion
        ([[-5, 3, 0], [5, 3, 0], [5, 1.25, 0], [5, -5, 0]], 2),
        ([[-5, 3, 0], [0, 3, 0], [0, 1.25, 0], [0, 3, 0]], 0.25),  # nearest at a waypoint
    ],
)
def test_least_clearance_of_a_path(waypoints: list[list[float]], clearance: float) -> None:
    found = one_box().min_clearance(np.array(waypoints, float))
    assert clearance <= found <= clearance + TOLERANCE


def test_the_tolerance_is_kept_where_asked_for() -> None:
    path = np.array([[-5, 1.3, 0.2], [5, 1.9, -0.7]])
    exact = one_box(tolerance=1e-7).min_clearance(path)
    for tolerance in (1e-1, 1e-2, 1e-4):
        found = one_box(tolerance=tolerance).min_clearance(path)
        assert exact - 1e-7 <= found <= exact + tolerance


@pytest.mark.parametrize("gap", [-0.5, -1e-6, 0, 1e-6])
def test_touching_is_never_free(gap: float) -> None:
    a, b = np.array([-5, 1 + gap, 0]), np.array([5, 1 + gap, 0])
    assert not one_box().segment_is_free(a, b)
    assert one_box().min_clearance(np.array([a, b])) <= TOLERANCE


@pytest.mark.parametrize("gap", [1.01e-3, 2e-3, 0.1])
def test_more_than_the_tolerance_is_free(gap: float) -> None:
    a, b = np.array([-5, 1 + gap, 0]), np.array([5, 1 + gap, 0])
    assert one_box().segment_is_free(a, b)
    assert one_box().min_clearance(np.array([a, b])) > TOLERANCE


def test_a_thin_wall_is_not_jumped() -> None:
    wall = CollisionModel(PointRobot(0.0), [Box([0, 0, 0], [1e-6, 20, 20])])
    a, b = np.array([-9.0, 0.1, 0.2]), np.array([9.0, 0.3, -0.1])
    assert not wall.segment_is_free(a, b)
    assert wall.min_clearance(np.array([a, b])) <= TOLERANCE


def test_a_robot_moved_by_its_bound_only() -> None:
    """A bound above the true speed costs queries, never correctness."""
    model = one_box()
    a, b = np.array([-5, 1.5, 0]), np.array([5, 1.5, 0])
    for factor in (1, 3, 10):
        bound = 10.0 * factor
        assert segment_is_free(model.clearance, a, b, bound, TOLERANCE)
        found = path_min_clearance(model.clearance, np.array([a, b]), [bound], TOLERANCE)
        assert found == pytest.approx(0.5, abs=TOLERANCE)


def dense(path: np.ndarray, number: int) -> np.ndarray:
    """A path (k, d) by so many waypoints."""
    t = np.linspace(0, len(path) - 1, number)
    return np.column_stack([np.interp(t, np.arange(len(path)), axis) for axis in path.T])


@pytest.mark.parametrize("number", [FIRST_QUERIES, FIRST_QUERIES + 1, 45_678, 300_000])
def test_very_many_waypoints_need_not_all_be_asked_about(number: int) -> None:
    rng = np.random.default_rng(4)
    for _ in range(3):
        path = rng.uniform(-5, 5, (6, 3))
        model, thin = one_box(), one_box().min_clearance(path)
        found = model.min_clearance(dense(path, number))
        assert (found > TOLERANCE) == (thin > TOLERANCE)
        assert model.checks < 2 * FIRST_QUERIES
        if thin > TOLERANCE:
            assert found == pytest.approx(thin, abs=2 * TOLERANCE)


def test_one_waypoint_in_collision_among_very_many_is_found() -> None:
    for where in (1, 12_345, 99_998):
        path = dense(np.array([[-5.0, 2, 0], [5, 2, 0]]), 100_000)
        path[where] = 0.9, 0.9, 0.9
        assert one_box().min_clearance(path) <= TOLERANCE


def along_a_wall(gap: float, most_queries: float) -> float:
    """What is found of a kilometre along a wall, in metres."""
    path = np.array([[0.0, gap], [1000.0, gap]])
    return path_min_clearance(lambda q, _: float(q[1]), path, [1000.0], TOLERANCE, most_queries)


def test_far_from_obstacles_even_a_long_path_is_proved_free_with_few_queries() -> None:
    for gap in (0.5, 1.0, 20.0):
        found = along_a_wall(gap, 3000)
        assert TOLERANCE < found <= gap + TOLERANCE


def test_what_cannot_be_decided_with_few_queries_is_said_not_to_be() -> None:
    for gap in (1.01e-3, 0.01):
        with pytest.raises(UndecidedError):
            along_a_wall(gap, 3000)
    with pytest.raises(UndecidedError):
        one_box().min_clearance(np.full((100, 3), 3.0), 99)
    assert one_box().min_clearance(np.full((100, 3), 3.0), 100) > 1
    assert one_box().min_clearance(np.full((1, 3), 3.0), 1) > 1


def test_what_decides_is_in_proportion_to_the_reach() -> None:
    """With the number that the docstring gives, whatever keeps more than the tolerance is
    accepted."""
    for gap in (1.0001e-3, 1.5e-3, 2e-3, 4e-3, 0.1):
        path = np.array([[0.0, gap], [7.3, gap + 1e-3]])
        most = 100 + 2 * 7.3 / TOLERANCE
        found = path_min_clearance(lambda q, _: float(q[1]), path, [7.3001], TOLERANCE, most)
        assert found == pytest.approx(gap, abs=TOLERANCE)


def test_the_tolerance_must_be_positive() -> None:
    for tolerance in (0, -1, np.nan, np.inf):
        with pytest.raises(ValueError, match="tolerance"):
            one_box(tolerance=tolerance)


@pytest.mark.slow
def test_never_accepts_what_finer_sampling_refutes() -> None:
    """20,000 segments, far and near obstacles: whatever is accepted is sampled with 1000 times
    as many configurations as the check itself asked for; what is refused comes within the
    tolerance."""
    env = envs.make("c3d:robot_radius=0.3")
    model = env.collision_model()
    accepted = refused = 0
    for a, b in _segments(env, 20_000):
        before = model.checks
        free = model.segment_is_free(a, b)
        length = float(np.linalg.norm(b - a))
        samples = 1000 * (model.checks - before)
        t = np.linspace(0, 1, samples)[:, None]
        if free:
            accepted += 1
            assert env.clearance(a + t * (b - a)).min() > 0
        else:
            refused += 1
            reached = env.clearance(a + t[:: max(1, samples // 20_000)] * (b - a)).min()
            assert reached <= model.tolerance + length / min(samples, 20_000)
    assert accepted > 5000
    assert refused > 5000


def _segments(env: envs.Environment, n: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Half across the whole cube, half short ones close to the surface of a box."""
    rng = np.random.default_rng(5)
    wide = rng.uniform(env.lower, env.upper, (n // 2, 2, 3))
    boxes = rng.choice(len(env.obstacles), n - n // 2)
    centers = np.array([env.obstacles[i].center for i in boxes])
    halves = np.array([env.obstacles[i].sides / 2 for i in boxes]) + env.robot.radius
    corner = rng.choice([-1, 1], (len(boxes), 3)) * np.where(
        rng.random((len(boxes), 3)) < 0.5, 1, rng.random((len(boxes), 3))
    )
    middle = centers + corner * halves + rng.normal(0, 0.05, (len(boxes), 3))
    step = rng.normal(0, 1, (len(boxes), 3)) * 10 ** rng.uniform(-3, 0, (len(boxes), 1))
    near = np.stack([middle - step, middle + step], axis=1)
    return [(a, b) for a, b in np.concatenate([wide, near])]


@pytest.mark.slow
def test_both_checks_agree() -> None:
    env = envs.make("c3d:robot_radius=0.3")
    model = env.collision_model()
    for a, b in _segments(env, 1000):
        least = model.min_clearance(np.array([a, b]))
        free = model.segment_is_free(a, b)
        if free:
            assert least > TOLERANCE / 2
        else:
            assert least <= 2 * TOLERANCE


@pytest.mark.slow
def test_the_judge_refuses_no_motion_that_planners_find_free() -> None:
    """Past an edge of a box at about the tolerance, where checks at the same tolerance disagree."""
    judge, planner = one_box(), one_box(tolerance=2e-3)
    rng = np.random.default_rng(0)
    disagreed = 0
    for _ in range(3000):
        gap, around = rng.uniform(0.5e-3, 1.1e-3), rng.uniform(0, np.pi / 2)
        outward = np.array([np.cos(around), np.sin(around), 0])
        along = np.array([-outward[1], outward[0], 0]) * rng.uniform(0.5, 2)
        along[2] = rng.uniform(-0.3, 0.3)
        near = np.array([1, 1, 0]) + gap * outward
        a, b = near - rng.uniform(0.3, 1.5) * along, near + rng.uniform(0.3, 1.5) * along
        refused = judge.min_clearance(np.array([a, b])) <= TOLERANCE
        disagreed += refused and judge.segment_is_free(a, b)
        assert not (refused and planner.segment_is_free(a, b))
    assert disagreed > 0


@numba.njit
def room_beside(places: Any, t: float) -> Any:
    """Obstacles at places (n,) on a line, which the robot moves along; a tenth is kept."""
    return np.abs(places - t).min() - 0.1


@numba.njit
def compiled_covering(places: Any, bound: float) -> Any:
    return compiled_is_covered(room_beside, places, bound)


@settings(deadline=None)  # compiled on the first call
@given(
    st.lists(st.floats(-3, -0.2) | st.floats(0, 1) | st.floats(1.2, 4), min_size=1, max_size=5),
    st.floats(1, 50),
)
def test_a_motion_is_covered_exactly_if_nothing_is_on_it(places: list[float], bound: float) -> None:
    obstacles = np.array(places)
    on_it = bool(((obstacles >= 0) & (obstacles <= 1)).any())
    covered = is_covered(room_beside.py_func, obstacles, bound)
    assert covered == (not on_it)
    assert compiled_covering(obstacles, bound) == covered


def test_the_first_place_that_is_asked_is_the_middle() -> None:
    asked: list[float] = []

    def room(_: None, t: float) -> float:
        asked.append(t)
        return 0.25

    assert is_covered(room, None, 1.0)
    assert asked == [0.5, 0.125, 0.875]


def test_what_does_not_move_is_asked_once() -> None:
    assert is_covered(lambda _, t: 0.0, None, 0.0)
    assert not is_covered(lambda _, t: -1e-300, None, 0.0)
