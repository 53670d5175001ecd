"""Planners that hardly plan, on worlds where what they find is known."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest

import planners
from envs import Environment, Problem
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld
from planners import Budget, PlannerResult, Status


class Wall(BoxWorld):
    """One wall across the cube, open at the top or not at all."""

    kind_of_problems = "wall"

    def __init__(self, height: float) -> None:
        super().__init__([Box(np.array([0.0, 0.0, height / 2 - 10]), [1, 20, height])], 0.01)

    def definition(self) -> dict[str, object]:
        return {"class": "Wall", **self.point_definition()}


OPPOSITE = Problem(np.array([-5.0, 0.0, -5.0]), np.array([5.0, 0.0, -5.0]), 0, 1)
BESIDE = Problem(np.array([-5.0, 0.0, -5.0]), np.array([-5.0, 5.0, 5.0]), 1, 2)


def solved(id: str, env: Environment, problem: Problem, seconds: float = 5.0) -> PlannerResult:
    planner = planners.make(id)
    planner.setup(env, seed=0)
    return planner.solve(problem, Budget(perf_counter() + seconds))


@pytest.mark.parametrize("id", ["straight-line", "random-detours"])
def test_a_free_line_is_taken(id: str) -> None:
    result = solved(id, Wall(10.0), BESIDE)
    assert result.status is Status.EXACT_SOLUTION
    np.testing.assert_array_equal(result.path, [BESIDE.start, BESIDE.goal])
    assert result.stats["collision_checks"] > 0


def test_a_blocked_line_is_not_claimed() -> None:
    result = solved("straight-line", Wall(10.0), OPPOSITE)
    assert result.status is Status.APPROXIMATE_SOLUTION
    assert result.stats["collision_checks"] > 0


def test_detours_find_the_way_over_a_wall() -> None:
    world = Wall(10.0)
    result = solved("random-detours", world, OPPOSITE)
    assert result.status is Status.EXACT_SOLUTION
    assert 3 <= len(result.path) <= 5
    assert (result.path[0] == OPPOSITE.start).all() and (result.path[-1] == OPPOSITE.goal).all()
    assert world.collision_model().min_clearance(result.path) > 0


def test_detours_end_in_time_where_there_is_no_way() -> None:
    begin = perf_counter()
    result = solved("random-detours", Wall(20.0), OPPOSITE, seconds=0.2)
    assert result.status is Status.TIMEOUT and result.path is None
    assert perf_counter() - begin < 2.0


def test_they_are_among_all_planners_and_never_improve() -> None:
    ids = [entry.id for entry in planners.REGISTRY.entries("all")]
    assert {"straight-line", "random-detours"} <= set(ids)
    assert not any(planners.make(id).improves for id in ("straight-line", "random-detours"))
