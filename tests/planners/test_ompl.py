"""OMPL's planners behind our contract."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest
import trimesh

import envs
import planners
from envs import Environment, InputError, Problem
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld
from planners import Budget, PlannerResult, Status
from planners.ompl import parameters
from planners.ompl.planner import OmplPlanner

OMPL = [
    s.id for s in planners.REGISTRY.specs() if s.entry_point.startswith("planners.ompl.planner:")
]
IMPROVING = ["rrtstar", "lazyprmstar", "informedrrtstar", "bitstar", "aitstar", "eitstar"]
"""Those that expose their best cost as they go."""


def blocked_problem(env: Environment) -> Problem:
    """One whose straight line is not free."""
    model = env.collision_model()
    return next(p for p in env.sample_problems(50, 2) if not model.segment_is_free(p.start, p.goal))


def solve(env: Environment, problem: Problem, text: str, stop: float, s: float) -> PlannerResult:
    planner = planners.make(text)
    planner.setup(env, seed=1)
    return planner.solve(problem, Budget(perf_counter() + s, stop))


@pytest.mark.parametrize("name", OMPL)
def test_paths_are_certified(name: str, c3d: Environment) -> None:
    planner = planners.make(name)
    planner.setup(c3d, seed=1)
    judge = c3d.collision_model()
    for problem in c3d.sample_problems(8, 4):
        result = planner.solve(problem, Budget(perf_counter() + 5))
        assert result.status is Status.EXACT_SOLUTION
        path = np.asarray(result.path)
        assert np.allclose(path[[0, -1]], [problem.start, problem.goal], atol=1e-6)
        assert judge.min_clearance(path) > judge.tolerance
        assert result.stats["collision_checks"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", IMPROVING)
def test_best_cost_falls_over_time(name: str, c3d: Environment) -> None:
    problem = blocked_problem(c3d)
    result = solve(c3d, problem, name, 0.0, 1.5)
    history = np.array(result.stats["cost_history"])
    assert len(history) >= 1
    assert (np.diff(history[:, 0]) > 0).all()
    assert (np.diff(history[:, 1]) < 0).all()
    assert 0 <= history[0, 0] <= history[-1, 0] <= 1.5
    assert history[-1, 1] == pytest.approx(c3d.space.length(np.asarray(result.path)), rel=1e-4)


@pytest.mark.parametrize("name", ["rrtstar", "lazyprmstar", "bitstar"])
def test_it_stops_at_the_cost_asked_for(name: str, c3d: Environment) -> None:
    problem = blocked_problem(c3d)
    straight = float(np.linalg.norm(problem.goal - problem.start))
    begin = perf_counter()
    result = solve(c3d, problem, name, 1.25 * straight, 20)
    assert c3d.space.length(np.asarray(result.path)) <= 1.25 * straight
    assert perf_counter() - begin < 15


@pytest.mark.parametrize("name", ["rrtstar", "prmstar", "fmt"])
def test_the_deadline_is_kept(name: str, c3d: Environment) -> None:
    planner = planners.make(name)
    planner.setup(c3d, seed=1)
    begin = perf_counter()
    planner.solve(blocked_problem(c3d), Budget(begin + 1, 0.0))
    assert perf_counter() - begin < 1.5


def test_no_way_out_is_no_solution() -> None:
    """The goal lies inside a box."""
    env = envs.make("c3d")
    problem = Problem(env.sample_problems(1, 0)[0].start, env.obstacles[0].center)
    for name in ("rrtstar", "rrtconnect", "lazyprmstar"):
        result = solve(env, problem, name, math.inf, 0.3)
        assert result.status is not Status.EXACT_SOLUTION


@pytest.mark.parametrize("name", ["rrtstar", "rrtconnect", "lazyprmstar", "bitstar", "fmt"])
def test_a_seed_gives_the_same_path(name: str, c3d: Environment) -> None:
    problem = blocked_problem(c3d)
    first, second = (np.asarray(solve(c3d, problem, name, math.inf, 5).path) for _ in range(2))
    assert first.shape == second.shape
    assert (first == second).all()


@pytest.mark.parametrize("name", OMPL)
def test_a_path_to_where_it_is_has_two_ends(name: str, c3d: Environment) -> None:
    start = c3d.sample_problems(1, 4)[0].start
    result = solve(c3d, Problem(start, start.copy()), name, math.inf, 3)
    assert result.status is Status.EXACT_SOLUTION
    path = np.asarray(result.path)
    assert len(path) >= 2
    assert (path[[0, -1]] == start).all()


def test_simplification_shortens_and_stays_certified(c3d: Environment) -> None:
    problem = blocked_problem(c3d)
    raw = np.asarray(solve(c3d, problem, "rrtconnect", math.inf, 5).path)
    short = np.asarray(solve(c3d, problem, "rrtconnect:simplify=true", math.inf, 5).path)
    assert c3d.space.length(short) < c3d.space.length(raw)
    assert c3d.collision_model().min_clearance(short) > 1e-3


def milestones(planner: planners.Planner) -> int:
    """Of the roadmap that an OMPL planner keeps."""
    assert isinstance(planner, OmplPlanner)
    if planner._kept is None:
        return 0
    base, _, _ = parameters.load()
    data = base.PlannerData(planner._si)
    planner._kept.getPlannerData(data)
    return int(data.numVertices())


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lazyprmstar", "prmstar"])
def test_a_roadmap_is_kept_between_problems(name: str, c3d: Environment) -> None:
    planner = planners.make(f"{name}:roadmap_s=1")
    begin = perf_counter()
    planner.setup(c3d, seed=1)
    assert perf_counter() - begin < 2
    assert milestones(planner) > 20, "grown offline"
    judge = c3d.collision_model()
    for problem in c3d.sample_problems(10, 6):
        result = planner.solve(problem, Budget(perf_counter() + 5))
        assert result.status is Status.EXACT_SOLUTION
        assert judge.min_clearance(np.asarray(result.path)) > judge.tolerance


@pytest.mark.slow
def test_among_meshes_lazy_prm_has_the_papers_roadmap(
    c3d: Environment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("planners.ompl.planner._PAPERS_ROADMAP_S", 1.0)
    trimesh.creation.icosphere(radius=2.0).export(tmp_path / "ball.ply")
    ball = envs.make(f"mesh:file={tmp_path / 'ball.ply'}")
    # Loads what is compiled, which takes longer than the 0.02 s in which this roadmap grows.
    ball.collision_model().clearance(ball.lower)
    grown = []
    for name, env in (
        ("lazyprmstar", ball),
        ("lazyprmstar", c3d),
        ("prmstar", ball),
        ("lazyprmstar:roadmap_s=0", ball),
    ):
        planner = planners.make(name)
        planner.setup(env, seed=1)
        grown.append(milestones(planner) > 20)
    assert grown == [True, False, False, False]


def test_parameters_reach_the_planner(c3d: Environment) -> None:
    problem = blocked_problem(c3d)
    path = np.asarray(solve(c3d, problem, "rrtconnect:range=0.5", math.inf, 5).path)
    longest = np.linalg.norm(np.diff(path, axis=0), axis=1).max()
    assert longest <= 0.5 + 1e-9


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rrtstar:goal_bais=0.1", "did you mean 'goal_bias'"),
        ("rrtstar:simplfy=true", "did you mean 'simplify'"),
        ("fmt:nonsense=1", "num_samples"),
        ("rrtstar:range=wide", "refuses range=wide"),
        ("rrtstar:roadmap_s=1", "keeps no roadmap"),
        ("rrtstar:range=-1", "refuses range=-1"),
        ("rrtstar:range=nan", "refuses range=nan"),
        ("rrtstar:focus_search=off", "refuses focus_search=off"),
        ("rrtstar:self=1", "no argument 'self'"),
        ("fmt:num_samples=-1", "refuses num_samples=-1"),
        ("fmt:num_samples=5.7", "refuses num_samples=5.7"),
        ("fmt:num_samples=99999999999999999999", "refuses num_samples"),
        ("prmstar:roadmap_s=-1", "between 0 and 86400"),
        ("prmstar:roadmap_s=inf", "between 0 and 86400"),
        ("rrtstar:validator=sample", "did you mean 'sampled'"),
        ("rrtstar:resolution=0.1", "resolution is for validator=sampled"),
        ("rrtstar:validator=sampled,resolution=0", "above 0 and at most 1, not 0"),
        ("rrtstar:validator=sampled,resolution=nan", "not of type float"),
        ("rrtstar:validator=sampled,resolution=2", "above 0 and at most 1, not 2"),
        ("rrtstar:valdator=sampled", "did you mean 'validator'"),
    ],
)
def test_misspelt_parameters_are_errors(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        planners.make(text)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.slow
def test_processes_that_used_ompl_exit_with_0() -> None:
    code = (
        "import math, time, envs, planners\n"
        "env = envs.make('c3d')\n"
        "[problem] = env.sample_problems(1, 0)\n"
        "for spec in planners.REGISTRY.group('all'):\n"
        "    planner = spec.load()(**spec.arguments)\n"
        "    planner.setup(env, seed=1)\n"
        "    planner.solve(problem, planners.Budget(time.perf_counter() + 1))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == ""


class ThinWalls(BoxWorld):
    """Twenty walls, each a thousandth of the cube, that leave no way but around."""

    min_clearance = 0.2
    kind_of_problems, advice = "thin walls", ""

    def __init__(self) -> None:
        places = np.linspace(-8, 8, 20)
        walls = [Box(np.array([x, -1.0, 0.0]), np.array([0.02, 18.0, 20.0])) for x in places]
        super().__init__(walls, 0.01)

    def definition(self) -> dict[str, Any]:
        return {"class": "ThinWalls"}


@pytest.mark.parametrize("name", ["rrtconnect", "lazyprmstar", "bitstar", "eitstar"])
def test_states_along_motions_miss_thin_walls_which_proofs_do_not(name: str) -> None:
    env = ThinWalls()
    problem = Problem(np.array([-9.0, 0.0, 0.0]), np.array([9.0, 0.0, 0.0]), 0, 5)
    judge = env.collision_model()
    sampled = solve(env, problem, f"{name}:validator=sampled,resolution=0.2", math.inf, 5)
    assert sampled.status is Status.EXACT_SOLUTION
    assert judge.min_clearance(np.asarray(sampled.path)) <= 0
    proved = solve(env, problem, name, math.inf, 0.5)  # whether it is solved or not
    if proved.status is Status.EXACT_SOLUTION:
        assert judge.min_clearance(np.asarray(proved.path)) > judge.tolerance


def test_the_resolution_is_a_share_of_the_extent() -> None:
    """A motion over a tenth of the extent is asked at as many states as its gaps make."""
    env = ThinWalls()
    asked = []
    for share in (0.05, 0.01, 0.002):
        planner = planners.make(f"rrtconnect:validator=sampled,resolution={share}")
        assert isinstance(planner, OmplPlanner)
        planner.setup(env, seed=1)
        low, high = np.array([-9.0, 9.5, 0.0]), np.array([9.0, 9.5, 0.0])
        high = low + (high - low) * 0.1 * env.space.extent / 18.0
        before = planner._model.checks
        assert planner._validity.of_edge(low, high)
        asked.append(planner._model.checks - before)
    assert asked == pytest.approx([2, 10, 50], abs=2)


@pytest.mark.parametrize(("name", "gaps"), [("rrtconnect", 1), ("prmstar", 1), ("eitstar", 2)])
def test_attempts_say_how_far_apart_states_were_checked(name: str, gaps: int) -> None:
    """EIT* skips every other state, those of an earlier pass."""
    env = ThinWalls()
    problem = Problem(np.array([-9.0, 9.5, 0.0]), np.array([9.0, 9.5, 0.0]), 0, 5)
    sampled = solve(env, problem, f"{name}:validator=sampled,resolution=0.02", math.inf, 5)
    assert sampled.stats["checked_every"] == pytest.approx(gaps * 0.02 * env.space.extent)
    assert "checked_every" not in solve(env, problem, name, math.inf, 0.5).stats
