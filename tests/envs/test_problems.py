"""Test problems: what they promise, and that they are the same everywhere."""

from __future__ import annotations

import numpy as np
import pytest

import envs
from envs import Environment, InputError, Problem
from envs.free_space import GridComponents
from envs.problem import Path
from envs.scenes.cluttered import Cluttered3D
from envs.seeding import derived_seed, stream


def test_problems_keep_their_promises(c3d: Environment) -> None:
    problems = c3d.sample_problems(500, 3)
    starts = np.array([p.start for p in problems])
    goals = np.array([p.goal for p in problems])
    assert [p.index for p in problems] == list(range(500))
    assert len({p.seed for p in problems}) == 500
    assert c3d.contains(starts).all()
    assert c3d.contains(goals).all()
    assert (c3d.clearance(starts) >= 0.4).all()
    assert (c3d.clearance(goals) >= 0.4).all()
    assert (np.linalg.norm(goals - starts, axis=1) >= 4).all()


def test_problems_of_a_seed_never_change() -> None:
    """Frozen values: other machines and later versions must find the same."""
    env = envs.make("c3d")
    [first, *_, last] = env.sample_problems(10, 7)
    assert env.fingerprint == FROZEN["fingerprint"]
    assert first.start.tolist() == FROZEN["start"]
    assert last.goal.tolist() == FROZEN["goal"]
    assert last.seed == FROZEN["seed"]


def test_more_problems_begin_with_the_fewer(c3d: Environment) -> None:
    few, many = c3d.sample_problems(5, 1), c3d.sample_problems(400, 1)
    for a, b in zip(few, many, strict=False):
        assert (a.start == b.start).all()
        assert (a.goal == b.goal).all()
        assert a.seed == b.seed


def test_seeds_and_scenes_have_their_own_problems() -> None:
    starts = [
        tuple(envs.make(f"c3d:scene={scene}").sample_problems(1, seed)[0].start)
        for scene in (0, 1)
        for seed in (0, 1)
    ]
    assert len(set(starts)) == 4


def test_purposes_share_no_random_numbers() -> None:
    """Training, warm-up and test problems may use equal seeds and still never overlap."""
    purposes = ["c3d", "c3d problems", "training", "warm-up"]
    numbers = {stream(purpose, 0).random() for purpose in purposes}
    assert len(numbers) == len(purposes)
    assert derived_seed("warm-up", 1) != derived_seed("warm-up", 2)


def test_too_little_free_space_is_one_clear_line() -> None:
    class Demanding(Cluttered3D):
        min_clearance = 15.0

    with pytest.raises(InputError, match="fewer boxes"):
        Demanding().sample_problems(10, 0)


def test_walls_separate_components() -> None:
    """A slab cuts the square in two; a gap wider than the spacing joins the halves again."""

    def slab(q: np.ndarray) -> np.ndarray:
        return np.abs(q[:, 0]) - 0.1

    def with_gap(q: np.ndarray) -> np.ndarray:
        return np.maximum(slab(q), 0.2 - np.abs(q[:, 1]))

    lower, upper = np.array([-1.0, -1.0]), np.array([1.0, 1.0])
    ends = np.array([[-0.8, 0.1], [0.8, -0.3], [0, 0.9]])
    left, right, inside = GridComponents(slab, lower, upper, 50).label(ends)
    assert left != right
    assert inside == 0
    left, right, _ = GridComponents(with_gap, lower, upper, 50).label(ends)
    assert left == right > 0


def test_fingerprints_tell_scenes_apart() -> None:
    texts = ["c3d", "c3d:scene=1", "c3d:boxes=9", "c3d:robot_radius=0.02"]
    assert len({envs.make(text).fingerprint for text in texts}) == len(texts)
    assert envs.make("c3d:scene=0,boxes=10").fingerprint == envs.make("c3d").fingerprint


def test_problems_and_paths_are_frozen() -> None:
    start = np.zeros(3)
    problem = Problem(start, np.ones(3))
    start[0] = 9
    assert problem.start[0] == 0, "a problem keeps its own copy"
    with pytest.raises(ValueError, match="read-only"):
        problem.start[0] = 1
    with pytest.raises(ValueError, match="read-only"):
        Path([[0, 0], [1, 1]]).waypoints[0, 0] = 5


@pytest.mark.parametrize(
    "bad", [[[0, 0]], [0, 0], [[0, 0], [np.nan, 1]], [[0, 0], [np.inf, 1]], "ab", None, [[], []]]
)
def test_bad_paths_are_refused(bad: object) -> None:
    with pytest.raises(ValueError, match="path"):
        Path(bad)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "text",
    ["c3d:boxes=0", "c3d:boxes=1e9", "c3d:scene=-1", "c3d:robot_radius=nan", "c3d:robot_radius=9"],
)
def test_arguments_out_of_range(text: str) -> None:
    with pytest.raises(InputError):
        envs.make(text)


FROZEN: dict[str, object] = {
    "fingerprint": "7e7d5e2ec55fe2d0",
    "start": [2.4223644725087077, 7.974481321526568, 6.741048449878853],
    "goal": [3.811721204335573, 5.848275342454253, 2.9599302593043753],
    "seed": 227397563,
}


def test_free_space_is_explored_once_for_each_world(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []
    clearance = Cluttered3D.clearance
    monkeypatch.setattr(
        Cluttered3D,
        "clearance",
        lambda world, q: asked.append(len(q)) or clearance(world, q),  # type: ignore[func-returns-value]
    )
    text = "c3d:boxes=3,robot_radius=0.123"
    first = envs.make(text).sample_problems(5, 1)
    explored = sum(n == 100**3 for n in asked)
    again = envs.make(text).sample_problems(5, 1)
    assert explored == 1
    assert sum(n == 100**3 for n in asked) == 1, "not for the same world, made again"
    assert [p.start.tolist() for p in first] == [p.start.tolist() for p in again]
    envs.make(f"{text},scene=1").sample_problems(5, 1)
    assert sum(n == 100**3 for n in asked) == 2, "for another one"
