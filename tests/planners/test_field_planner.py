"""Planning with shipped weights: one problem, many, and what it refuses."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, InputError, Problem
from envs.seeding import derived_seed, stream
from planners import Budget, Status
from planners.base import TimeFieldPlanner
from planners.fields import planner as module
from planners.fields.methods import METHODS
from planners.fields.path_extraction import Descent
from planners.fields.physics import GroupPlan, GroupSampler, Space
from planners.fields.planner import ATTEMPTS, FieldPlanner
from planners.learning import weight_files
from planners.learning.learned_planner import LearnedPlanner
from planners.learning.trainer import described


def ready(name: str, c3d: Environment) -> FieldPlanner:
    made = planners.make(name)
    assert isinstance(made, FieldPlanner)
    made.setup(c3d, seed=1)
    return made


@pytest.fixture(scope="module", params=["ntfields", "ief3d", "ntrl"])
def planner(request: pytest.FixtureRequest, c3d: Environment) -> FieldPlanner:
    return ready(request.param, c3d)


@pytest.fixture(scope="module", params=["ntfields", "ief3d"])
def smooth(request: pytest.FixtureRequest, c3d: Environment) -> FieldPlanner:
    """Whose field has no kinks, at which rounding decides."""
    return ready(request.param, c3d)


def budget(seconds: float = 5.0) -> Budget:
    return Budget(time.perf_counter() + seconds)


def test_fresh_problems_are_solved_and_the_judge_agrees(
    planner: FieldPlanner, c3d: Environment
) -> None:
    judge = Judge(c3d)
    problems = c3d.sample_problems(300, seed=4321)
    results = planner.solve_batch(problems)
    solved = 0
    for problem, result in zip(problems, results, strict=True):
        if result.status is Status.EXACT_SOLUTION:
            solved += 1
            assert judge(problem, np.asarray(result.path)).verdict is Verdict.VALID
        else:
            assert result.status is Status.APPROXIMATE_SOLUTION
            assert result.path is None
    assert solved >= 0.97 * len(problems)


def test_one_at_a_time_is_the_same_as_together(smooth: FieldPlanner, c3d: Environment) -> None:
    problems = c3d.sample_problems(30, seed=77)
    together = smooth.solve_batch(problems)
    for problem, wanted in zip(problems, together, strict=True):
        found = smooth.solve(problem, budget())
        assert found.status is wanted.status
        assert found.stats == wanted.stats
        if wanted.path is not None:
            assert np.asarray(found.path) == pytest.approx(np.asarray(wanted.path), abs=0.02)


def test_ends_are_exactly_those_asked_for(planner: FieldPlanner, c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, seed=3)
    path = planner.solve(problem, budget()).path
    assert (path[0] == problem.start).all()
    assert (path[-1] == problem.goal).all()
    assert c3d.contains(path).all()


def test_the_way_back_is_the_way_there(planner: FieldPlanner, c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, seed=5)
    there = planner.solve(problem, budget()).path
    back = planner.solve(Problem(problem.goal, problem.start), budget()).path
    assert there == pytest.approx(back[::-1], abs=0.02)


def test_times_are_symmetric_and_near_the_truth_close_by(
    smooth: FieldPlanner, c3d: Environment
) -> None:
    assert isinstance(smooth, TimeFieldPlanner)
    rng = np.random.default_rng(0)
    q = rng.uniform(-9, 9, (50, 3))
    source = np.full(3, -9.0)
    times, speeds = smooth.times_and_speeds(source, q)
    back = np.array([smooth.times_and_speeds(x, source[None])[0][0] for x in q])
    assert times == pytest.approx(back, rel=1e-4)
    assert (times > 0.9 * np.linalg.norm(q - source, axis=1)).all()
    assert ((speeds > 0) & (speeds < 3)).all()


def test_ends_that_cannot_be_are_said_so(planner: FieldPlanner, c3d: Environment) -> None:
    inside = c3d.obstacles[0].center
    [problem] = c3d.sample_problems(1, seed=6)
    cases = [
        (Problem(inside, problem.goal), Status.INVALID_START),
        (Problem(problem.start, inside), Status.INVALID_GOAL),
        (Problem(np.full(3, 11.0), problem.goal), Status.INVALID_START),
        (problem, Status.EXACT_SOLUTION),
    ]
    together = planner.solve_batch([case for case, _ in cases])
    for (case, wanted), result in zip(cases, together, strict=True):
        assert planner.solve(case, budget()).status is wanted
        assert result.status is wanted


def test_no_time_is_a_timeout(planner: FieldPlanner, c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, seed=6)
    assert planner.solve(problem, budget(0.0)).status is Status.TIMEOUT


def test_a_path_that_comes_too_late_is_a_timeout(
    planner: FieldPlanner, c3d: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    [problem] = c3d.sample_problems(1, seed=6)
    path = planner.solve(problem, budget()).path

    def slow(start: np.ndarray, goal: np.ndarray, descent: Descent) -> np.ndarray:
        time.sleep(0.05)
        return np.asarray(path)

    monkeypatch.setattr(planner, "_one", slow)
    assert planner.solve(problem, budget(0.04)).status is Status.TIMEOUT
    monkeypatch.setattr(planner, "_attempts", ATTEMPTS[:1])
    assert planner.solve(problem, budget(0.04)).status is Status.TIMEOUT


def test_start_and_goal_in_one_place(planner: FieldPlanner, c3d: Environment) -> None:
    [problem] = c3d.sample_problems(1, seed=6)
    result = planner.solve(Problem(problem.start, problem.start), budget())
    assert result.status is Status.EXACT_SOLUTION
    assert planner.solve_batch([]) == []


def test_it_tries_again_and_never_returns_what_it_knows_to_collide(
    c3d: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = planners.make("ntfields")
    assert isinstance(made, FieldPlanner)
    made.setup(c3d, seed=1)
    tried: list[Descent] = []

    def colliding(start: np.ndarray, goal: np.ndarray, descent: Descent) -> np.ndarray:
        tried.append(descent)
        return np.array([start, c3d.obstacles[0].center, goal])

    def together(problems: Sequence[Problem], descent: Descent) -> list[np.ndarray]:
        return [colliding(p.start, p.goal, descent) for p in problems]

    monkeypatch.setattr(made, "_one", colliding)
    monkeypatch.setattr(made, "_many", together)
    [problem] = c3d.sample_problems(1, seed=6)
    for result in (made.solve(problem, budget()), *made.solve_batch([problem])):
        assert result.status is Status.APPROXIMATE_SOLUTION
        assert result.path is None
    assert tuple(tried) == 2 * ATTEMPTS
    tried.clear()
    once = planners.make("ntfields:attempts=1")
    assert isinstance(once, FieldPlanner)
    once.setup(c3d, seed=1)
    monkeypatch.setattr(once, "_one", colliding)
    assert once.solve(problem, budget()).status is Status.APPROXIMATE_SOLUTION
    assert tuple(tried) == ATTEMPTS[:1]
    assert ATTEMPTS[0].step == 0.03  # the paper's


def test_weights_of_another_scene_are_refused(c3d: Environment) -> None:
    file = weight_files.find("ntfields", c3d.fingerprint)
    made = planners.make(f"ntfields:weights={file}")
    with pytest.raises(InputError, match="these weights are for environment"):
        made.setup(envs.make("c3d:scene=1"), seed=0)


def test_weights_of_another_shape_are_refused(c3d: Environment, tmp_path: Path) -> None:
    file = weight_files.find("ntfields", c3d.fingerprint)
    assert file is not None
    tensors, manifest = weight_files.read(file, "ntfields", c3d.fingerprint)
    tensors["encoder.first.weight"] = tensors["encoder.first.weight"][:, :-1]
    weight_files.write(tmp_path / "w", tensors, manifest)
    made = planners.make(f"ntfields:weights={tmp_path / 'w'}")
    with pytest.raises(InputError, match="does not hold weights of ntfields") as caught:
        made.setup(c3d, seed=0)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("ntfields:attempts=0", "attempts must be between"),
        ("ntfields:device=gpu", "no device is called 'gpu'"),
        ("ntfields:weight=x", "did you mean 'weights'"),
    ],
)
def test_wrong_arguments_are_refused(text: str, what: str) -> None:
    with pytest.raises(InputError, match=what):
        planners.make(text)


def test_cuda_is_refused_where_there_is_none() -> None:
    if torch.cuda.is_available():
        pytest.skip("there is one")
    with pytest.raises(InputError, match="no CUDA device"):
        planners.make("ntfields:device=cuda")


def test_every_method_has_a_spec_and_describes_its_training() -> None:
    named = {
        spec.arguments["method"]
        for spec in planners.REGISTRY.specs()
        if issubclass(spec.load(), FieldPlanner)
    }
    assert named == set(METHODS)
    for method in METHODS.values():
        assert described(method.objective())["class"]
        assert method.settings()["recipe"]["steps"] > 0
    with pytest.raises(InputError, match="no time field is called"):
        module.method("none", envs.make("c3d"))


def test_only_labelled_methods_see_fast_marching() -> None:
    """NTFields and its kin see configurations and their speeds, nothing else."""
    for name, method in METHODS.items():
        text = str(described(method.objective()))
        assert ("LabelPlan" in text) == (name == "ief3d"), name


def test_test_problems_never_touch_training(
    c3d: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Training points, validation problems and test problems come from different streams."""
    seeds = [0, 7, 11, 99]
    ends = {
        tuple(end)
        for seed in seeds
        for problem in c3d.sample_problems(50, seed)
        for end in (problem.start, problem.goal)
    }
    sampler = GroupSampler(Space.of(c3d), GroupPlan())
    for seed in seeds:
        points, _ = sampler.draw(stream("training", seed, 0))
        assert not ends & {tuple(20 * x) for x in points.reshape(-1, 3)}
        validation = c3d.sample_problems(50, derived_seed("validation", seed))
        assert not ends & {tuple(p.start) for p in validation}
        assert derived_seed("validation", seed) > 10**6


def test_time_fields_name_their_weights() -> None:
    for spec in planners.REGISTRY.specs():
        if issubclass(spec.load(), FieldPlanner):
            made = planners.make(spec.id)
            assert isinstance(made, LearnedPlanner)
            assert made.name in METHODS
