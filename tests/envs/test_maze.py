"""Mazes between thin walls."""

from __future__ import annotations

import math
from time import perf_counter
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import envs
import planners
from envs import InputError
from envs.scenes.maze import longest_way, walk, walls
from envs.scenes.point_world import PointWorld
from planners import Budget, Status


def open_pairs(solid: Any, rooms: int) -> int:
    """How many walls between rooms are open, all of each."""
    pitch = (len(solid) - 1) // rooms
    middles = np.arange(rooms) * pitch + pitch // 2 + 1
    count = 0
    for axis in range(solid.ndim):
        places = [middles] * solid.ndim
        places[axis] = np.arange(1, rooms) * pitch
        count += int((~solid[np.ix_(*places)]).sum())
    return count


@settings(max_examples=30, deadline=None)
@given(
    st.sampled_from([(2, 2), (2, 5), (2, 9), (3, 2), (3, 4)]),
    st.integers(2, 6),
    st.integers(0, 2**32 - 1),
)
def test_each_room_is_reached_by_exactly_one_way(
    size: tuple[int, int], corridor: int, seed: int
) -> None:
    """A tree on so many rooms has one edge fewer, and joins them all."""
    dimension, rooms = size
    doors = walk(dimension, rooms, np.random.default_rng(seed))
    solid = walls(dimension, rooms, corridor, doors)
    assert len(set(doors)) == rooms**dimension - 1 >= longest_way(rooms, doors)
    assert solid.shape == (rooms * (corridor + 1) + 1,) * dimension
    assert open_pairs(solid, rooms) == rooms**dimension - 1
    assert ndimage.label(~solid)[1] == 1
    for axis in range(dimension):
        assert solid.take([0, -1], axis=axis).all()


def test_loops_open_a_share_of_what_is_left() -> None:
    def solid(loops: float) -> Any:
        env: Any = envs.make(f"maze:scene=3,loops={loops}")
        return env._cells

    all_walls, tree = 2 * 7 * 8, 63
    opened = [open_pairs(solid(loops), 8) for loops in (0.0, 0.5, 1.0)]
    assert opened == [tree, tree + round(0.5 * (all_walls - tree)), all_walls]
    assert not (solid(0.5) & ~solid(0.0)).any()  # the same maze, with some walls gone


def test_the_longest_way_is_that_of_the_farthest_rooms() -> None:
    """Of a comb with five teeth of five rooms, and of a snake through all of them."""
    teeth = [((k, n), 1) for k in range(5) for n in range(4)]
    assert longest_way(5, [*teeth, *(((k, 0), 0) for k in range(4))]) == 4 + 4 + 4
    assert longest_way(5, [*teeth, *(((k, 4 * (k % 2)), 0) for k in range(4))]) == 24


@pytest.mark.parametrize("text", ["maze", "maze:dimension=3", "maze:scene=5,loops=0.2,rooms=5"])
def test_a_scene_is_the_same_each_time_and_lies_about_the_origin(text: str) -> None:
    env, again = (cast(PointWorld, envs.make(text)) for _ in range(2))
    assert env.fingerprint == again.fingerprint
    assert env.fingerprint != envs.make(f"{text.partition(':')[0]}:scene=77").fingerprint
    dimension = 3 if "dimension=3" in text else 2
    assert env.lower.tolist() == [-9.99] * dimension
    assert env.upper == pytest.approx(np.full(dimension, 9.99))
    ends = env.sample_problems(20, 0)
    for problem in ends:
        assert np.linalg.norm(problem.goal - problem.start) >= env.min_separation
    other = envs.make(f"maze:scene=77,dimension={dimension}").sample_problems(1, 0)
    assert not np.allclose(ends[0].start, other[0].start)


def test_the_speed_is_highest_in_the_middle_of_corridors() -> None:
    env: Any = envs.make("maze:rooms=4,corridor=3,robot_radius=0")
    side = 20 / 17
    middle = np.array([[-10 + side * 2.5, -10 + side * 2.5]])
    assert env.clearance(middle) == pytest.approx([1.5 * side])
    assert env.speed_model(env.clearance(middle)) == pytest.approx([1.0])


@pytest.mark.parametrize("text", ["maze:scene=1", "maze:scene=1,dimension=3"])
def test_marching_finds_the_way_that_straight_lines_do_not(text: str) -> None:
    env = envs.make(text)
    planner, judge = planners.make("fmm"), env.collision_model()
    planner.setup(env, seed=0)
    found = []
    for problem in env.sample_problems(10, 0):
        result = planner.solve(problem, Budget(perf_counter() + 20, math.inf))
        assert result.status is Status.EXACT_SOLUTION
        path = np.asarray(result.path)
        assert judge.min_clearance(path) > 0
        found.append(env.space.length(path) / np.linalg.norm(problem.goal - problem.start))
    assert np.median(found) > 1.5


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("dimension=4", "dimension must be 2 or 3, not 4"),
        ("scene=-1", "scene must be between 0"),
        ("rooms=1", "rooms must be between 2 and 60, not 1"),
        ("dimension=3,rooms=17", "rooms must be between 2 and 16, not 17"),
        ("loops=1.5", "loops must be between 0 and 1, not 1.5"),
        ("loops=nan", "loops"),
        ("corridor=1", "corridor must be between 2 and 20, not 1"),
        ("robot_radius=1.1", "less than half of a corridor's width, 1.02041, not 1.1"),
        ("robot_radius=-1", "robot_radius must be from 0"),
        ("boxes=3", "boxes"),
    ],
)
def test_what_makes_no_maze_is_refused(arguments: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        envs.make(f"maze:{arguments}")


def test_bodies_turn_in_mazes_in_space_alone() -> None:
    env = envs.make("rigid:world=maze,dimension=3,body=cross,size=0.5")
    assert len(env.sample_problems(2, 0)) == 2
    with pytest.raises(InputError, match="plane"):
        envs.make("rigid:world=maze,body=cross")
