"""Every registered planner on every kind of configuration space: it says why it does not plan
there, or plans, and claims no path that the judge refuses."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import pytest
from bad_urdfs import collision, joint, link, robot

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from planners import Budget, Planner, PlannerResult, Status
from planners.fields import objectives
from planners.fields.labels import LabelPlan, Labels, make_labels
from planners.learning import trainer
from planners.learning.learned_planner import LearnedPlanner, Training

LIMIT_S = 2.0
"""For a problem; planners stop at their first solution."""

QUICK = ("rrtconnect", "rrtconnect-fast", "straight-line")
"""Planners that fast tests let plan; learned ones have no weights here, and are only asked."""

ARGUMENTS = {"fmm": "fmm:resolution=30"}
"""Coarser than by default, for speed."""

ON_GRIDS = ("R^3", "wrapping", "SE(2)")
"""Spaces on which fast marching must plan."""

IN_ONE_PART = ("R^3", "7 joints", "two arms", "wrapping")
"""Spaces whose coordinates are measured together, on which fields must plan once they are trained;
`ief3d` where fast marching makes its labels, and variants about points on those of points only."""

EVERYWHERE = {
    *("rrtconnect", "rrtstar", "informedrrtstar", "prmstar", "lazyprmstar", "fmt"),
    *("bitstar", "aitstar", "eitstar", "straight-line", "random-detours"),
    *("rrtconnect-fast", "aorrtc"),
}
"""Planners that must plan on all spaces."""


def revolute(name: str, parent: str, child: str, axis: str, xyz: str, turn: float = 2.6) -> str:
    limit = f'<limit lower="-{turn}" upper="{turn}" effort="1" velocity="1"/>'
    return joint(name, parent, child, "revolute", f'<origin xyz="{xyz}"/>{limit}', axis)


def chain(name: str, joints: int, base: str, xyz: str) -> list[str]:
    """An arm of rods on a base, whose joints turn about z and y by turns."""
    rod = collision('<cylinder radius="0.03" length="0.12"/>', '<origin xyz="0 0 0.1"/>')
    links = [link(f"{name}{n}", rod) for n in range(joints)]
    parents = [base, *(f"{name}{n}" for n in range(joints))]
    places = [xyz, *["0 0 0.2"] * (joints - 1)]
    moving = [
        revolute(f"{name}_j{n}", parents[n], f"{name}{n}", ("0 0 1", "0 1 0")[n % 2], places[n])
        for n in range(joints)
    ]
    return [*links, *moving]


def arm(folder: Path, scene: str, *elements: str) -> Environment:
    (folder / "robot.urdf").write_text(robot(*elements))
    (folder / "scene.yaml").write_text(scene)
    return envs.make(f"arm:urdf={folder / 'robot.urdf'},scene={folder / 'scene.yaml'}")


def sampled(env: Environment) -> tuple[Environment, Problem]:
    [problem] = env.sample_problems(1, seed=3)
    return env, problem


TABLE = (
    "obstacles: [{box: [2, 2, 0.1], position: [0, 0, -0.2]}, "
    "{sphere: 0.15, position: [0.5, 0, 0.6]}]"
)


def seven_joints(folder: Path) -> tuple[Environment, Problem]:
    return sampled(arm(folder, TABLE, link("base", ""), *chain("l", 7, "base", "0 0 0")))


def two_arms(folder: Path) -> tuple[Environment, Problem]:
    """Of four joints each, near enough to meet."""
    torso = link("torso", collision('<box size="0.3 0.1 0.1"/>', '<origin xyz="0 0 -0.06"/>'))
    both = [*chain("left", 4, "torso", "-0.2 0 0"), *chain("right", 4, "torso", "0.2 0 0")]
    return sampled(arm(folder, TABLE, torso, *both))


def wrapping(folder: Path) -> tuple[Environment, Problem]:
    """A boom that turns for ever, with a hand that bends up and down. A wall keeps the boom from
    turning through 0; a ball is where the hand would pass pi unless it is bent."""
    boom = collision('<box size="0.5 0.05 0.05"/>', '<origin xyz="0.25 0 0"/>')
    hand = collision('<box size="0.16 0.04 0.04"/>', '<origin xyz="0.12 0 0"/>')
    scene = (
        "obstacles: [{box: [0.3, 0.06, 1], position: [0.35, 0, 0]}, "
        "{sphere: 0.05, position: [-0.65, 0, 0]}]"
    )
    env = arm(
        folder,
        scene,
        *(link("base", ""), link("boom", boom), link("hand", hand)),
        joint("turn", "base", "boom", "continuous", "", "0 0 1"),
        revolute("bend", "boom", "hand", "0 1 0", "0.5 0 0", 1.5),
    )
    return env, Problem(np.array([2.4, 0.3]), np.array([-2.4, -0.3]), seed=1)


def rigid(space: str) -> Callable[[Path], tuple[Environment, Problem]]:
    return lambda _: sampled(envs.make(f"rigid:space={space},body=l,boxes=8"))


SPACES: dict[str, Callable[[Path], tuple[Environment, Problem]]] = {
    "R^3": rigid("r3"),
    "7 joints": seven_joints,
    "two arms": two_arms,
    "wrapping": wrapping,
    "SE(2)": rigid("se2"),
    "SE(3)": rigid("se3"),
}

Place = tuple[str, Environment, Problem]


@pytest.fixture(params=SPACES, scope="module")
def place(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Place:
    """A name of a space, an environment with it, and a problem there that has a solution."""
    return request.param, *SPACES[request.param](tmp_path_factory.mktemp("space"))


SLOW = {"fmm", *EVERYWHERE} - set(QUICK)

IDS = [
    pytest.param(spec.id, marks=pytest.mark.slow if spec.id in SLOW else ())
    for spec in planners.REGISTRY.specs()
    if spec.id != "recorded"  # which gives what a file has
]


TRAINED = [
    spec.id for spec in planners.REGISTRY.specs() if spec.id not in EVERYWHERE | {"fmm", "recorded"}
]

MOMENT_S = 1.0
"""Of training."""


def assert_is_a_sentence(reason: str) -> None:
    """A line of words for people, without names of classes or attributes."""
    assert reason.isprintable()
    assert len(reason.split()) >= 6
    assert not re.search(r"[a-z]_[a-z]|[a-z][A-Z]|\bNone\b", reason)


def solve(planner: Planner, problem: Problem, seconds: float) -> PlannerResult:
    """Up to the first solution."""
    return planner.solve(problem, Budget(perf_counter() + seconds, stop_cost=math.inf))


@pytest.mark.parametrize("id", IDS)
def test_it_plans_or_says_why_not(id: str, place: Place) -> None:
    name, env, problem = place
    planner = planners.make(ARGUMENTS.get(id, id))
    reason = planner.unsupported(env)
    if reason is not None:
        assert id not in EVERYWHERE and (id != "fmm" or name not in ON_GRIDS)
        assert id not in ("ntfields", "eikonet") or name not in IN_ONE_PART
        assert_is_a_sentence(reason)
        return
    if isinstance(planner, LearnedPlanner) and not planner.weights_file(env):
        pytest.skip("it must be trained first, see below")
    planner.setup(env, seed=1)
    result = assert_it_plans(planner, name, env, problem)
    assert id not in ("rrtconnect", "rrtconnect-fast") or result.status is Status.EXACT_SOLUTION


def few_labels(env: Environment, plan: LabelPlan, *others: Any) -> tuple[Labels, float]:
    """Of a coarse grid, in place of minutes of labels of a fine one."""
    return make_labels(env, replace(plan, sources=4, goals=300, resolution=30), *others)


@pytest.mark.training
@pytest.mark.parametrize("id", TRAINED)
def test_it_plans_once_it_is_trained(
    id: str, place: Place, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For a moment, after which few problems are solved, but all that it does is done."""
    name, env, problem = place
    planner = planners.make(id)
    if planner.unsupported(env) is not None:
        pytest.skip("it says why it does not")
    assert isinstance(planner, LearnedPlanner)
    monkeypatch.setattr(trainer, "_VALIDATION_PROBLEMS", 2)
    monkeypatch.setattr(trainer, "_VALIDATED_AT", (1.0,))
    monkeypatch.setattr(objectives, "make_labels", few_labels)
    how = Training(seed=1, minutes=MOMENT_S / 60, device="cpu", checkpoint=tmp_path / "checkpoint")
    planner.load(env, planner.train(env, how).tensors)
    assert_it_plans(planner, name, env, problem)


def assert_it_plans(
    planner: Planner, name: str, env: Environment, problem: Problem
) -> PlannerResult:
    solve(planner, problem, LIMIT_S / 4)  # what compiles does so first, as in a run
    begin = perf_counter()
    result = solve(planner, problem, LIMIT_S)
    assert perf_counter() - begin < 1.25 * LIMIT_S
    assert result.status in (Status.EXACT_SOLUTION, Status.APPROXIMATE_SOLUTION, Status.TIMEOUT)
    if result.status is Status.EXACT_SOLUTION:
        path = np.asarray(result.path)
        judged = Judge(env)(problem, path)
        assert judged.verdict is Verdict.VALID, judged.reason
        if name == "wrapping":
            [turned, _] = env.space.unwrapped(path)[-1]
            assert turned == pytest.approx(2 * math.pi - 2.4), "the only way is across pi"
    return result
