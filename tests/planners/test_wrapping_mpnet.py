"""The imitation planner on a robot with a joint that wraps, which is no point."""

from __future__ import annotations

import math
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
import torch
from turning_booms import BoomWorld, boom_world
from turning_cubes import Plane

import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from planners.base import Budget, Status
from planners.learning.normalizer import Normalizer
from planners.learning.training_loop import Recipe, Steps, TrainingState, train
from planners.mpnet.imitation import DemonstrationPlan, Imitation
from planners.mpnet.planner import METHOD, MpnetPlanner
from planners.mpnet.search import Expander, Mpnet, PlannerShape, Search

PLAN = DemonstrationPlan("rrtstar", seconds=0.04, problems=80)


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> BoomWorld:
    return boom_world(tmp_path_factory.mktemp("boom"))


def untrained(world: Environment) -> Mpnet:
    torch.manual_seed(0)
    circles = Normalizer.of(world).circles
    widths = {"point_widths": (16, 32), "widths": (64, 64)}
    return Mpnet(PlannerShape(2, code=16, circles=circles, **widths)).eval()


def a_turn(world: Environment) -> np.ndarray:
    return np.where(world.space.wraps, 2 * math.pi, 0.0)


def ready(world: Environment, net: Mpnet) -> MpnetPlanner:
    made = MpnetPlanner()
    made._use(world, net)
    return made


def test_it_is_for_joints_that_wrap_and_for_no_rotations(
    world: BoomWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("mpnet", "mpnet-hybrid"):
        assert planners.make(name).unsupported(world) is None
    assert METHOD.network(world).shape.circles == Normalizer.of(world).circles
    monkeypatch.setattr(Plane, "family", lambda env: [env, env])
    assert "in parts" in str(planners.make("mpnet").unsupported(Plane()))


def test_a_turn_further_the_step_is_the_same(world: BoomWorld) -> None:
    net = untrained(world)
    expander = Expander(net.planner, np.zeros(16, dtype=np.float32), Normalizer.of(world))
    rng = np.random.default_rng(0)
    turn = a_turn(world)
    for here, goal in rng.uniform(world.lower, world.upper, (20, 2, 2)):
        step = expander.next(here, goal, rng, 0.0) - here
        for a, b in ((here + turn, goal), (here, goal - turn)):
            assert expander.next(a, b, rng, 0.0) - a == pytest.approx(step, abs=1e-5)


def test_both_forms_of_the_planning_network_agree(world: BoomWorld) -> None:
    net, scale = untrained(world), Normalizer.of(world)
    net.planner.dropout = 0.0
    code = torch.randn(16)
    expander = Expander(net.planner, code.numpy(), scale)
    rng = np.random.default_rng(0)
    for here, goal in rng.uniform(world.lower, world.upper, (20, 2, 2)):
        a, b = (torch.from_numpy(scale.normalize(q)).float() for q in (here, goal))
        wanted = scale.extent * net.planner(code, a, b).detach().numpy() + scale.middle
        assert expander.next(here, goal, rng, 0.0) == pytest.approx(wanted, abs=1e-5)


def test_steps_across_half_a_turn_come_out_on_the_other_side(
    world: BoomWorld, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Expander, "next", lambda self, current, *others: current + 0.9)
    [problem] = world.sample_problems(1, 0)
    model, budget = world.collision_model(), Budget(perf_counter() + 1)
    planner = ready(world, untrained(world))
    search = Search(world, model, planner._expander, problem, budget)
    here = np.where(world.space.wraps, 3.0, 1.0)
    there = search._next(here, problem.goal)
    assert there == pytest.approx(np.where(world.space.wraps, 3.9 - 2 * math.pi, 1.5))
    assert world.contains(there[None]).all()


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.slow
def test_samples_go_along_the_short_way(world: BoomWorld, tmp_path: Path) -> None:
    """Places between two waypoints are between them the short way, where motions lead."""
    objective = Imitation(
        DemonstrationPlan("rrtconnect", 1.0, 30), scenes=2, samples=300, points=64
    )
    objective.prepare(world, 0, tmp_path / "kept.npz", lambda share: None)
    clouds, current, _, answer = objective.draw(np.random.default_rng(0))
    assert clouds.shape == (2, 64, 3)
    scale = Normalizer.of(world)
    scenes = [one.collision_model() for one in world.family()]
    a, b = (scale.denormalize(part.reshape(-1, 2).double().numpy()) for part in (current, answer))
    free = [any(one.segment_is_free(*ends) for one in scenes) for ends in zip(a, b, strict=True)]
    assert np.mean(free) > 0.98, "but for rounding"
    [turn] = np.flatnonzero(world.space.wraps)
    step = (answer - current)[..., turn].abs()
    assert step.max() <= scale.circles.period / 2 + 1e-5
    assert (np.abs(a - b)[:, turn] > math.pi).sum() > 10, "some cross half a turn"


@pytest.mark.training(minutes=1)
@pytest.mark.usefixtures("in_this_process")
def test_a_short_training_learns_which_way_round(world: BoomWorld, tmp_path: Path) -> None:
    """From one side of the wall to the other by way of half a turn, and with shorter paths than
    the search alone finds."""
    objective = Imitation(PLAN, scenes=2, samples=128, points=128)
    objective.prepare(world, 0, tmp_path / "kept.npz", lambda share: None)
    state = TrainingState.begin(untrained(world), Recipe())
    average = train(state, objective, Recipe(steps=1200, averaging=0.98), Steps(1200), seed=0)
    assert isinstance(average, Mpnet)
    assert len(solved(world, average.eval())) == 20
    found, by_search = (np.mean(solved(world, net)) for net in (average, untrained(world)))
    assert found < 0.9 * by_search
    expander = ready(world, average)._expander
    rng = np.random.default_rng(0)
    for here in (2.0, 2.4, 2.8):
        a, b = (np.where(world.space.wraps, side * here, 0.8) for side in (1, -1))
        steps = [expander.next(*ends, rng, 0.0) - ends[0] for ends in ((a, b), (b, a))]
        ahead, back = (step[world.space.wraps].item() for step in steps)
        assert back < 0 < ahead, "away from the wall"


def solved(world: Environment, net: Mpnet) -> list[float]:
    """The lengths of the paths, all of which the judge lets pass, at 20 problems with something
    in the way, by the distances of their ends."""
    planner, judge, model = ready(world, net), Judge(world), world.collision_model()
    problems = [p for p in world.sample_problems(60, 2**33) if not is_straight(model, p)][:20]
    lengths = []
    for problem in problems:
        result = planner.solve(problem, Budget(perf_counter() + 1))
        if result.status is Status.EXACT_SOLUTION:
            judged = judge(problem, result.path)
            assert judged.verdict is Verdict.VALID, judged.reason
            [apart] = world.space.distance(problem.start[None], problem.goal[None])
            lengths.append(world.space.length(result.path) / apart)
    return lengths


def is_straight(model: CollisionModel, problem: Problem) -> bool:
    return model.segment_is_free(problem.start, problem.goal)
