"""The imitation planner's parts: contraction, demonstrations, networks, search."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
import torch
from counted_checks import counted_checks
from hypothesis import given
from hypothesis import strategies as st

from envs import Environment, Problem
from envs.scenes import cluttered
from envs.scenes.cluttered import Cluttered3D
from envs.seeding import TEST_SEEDS
from planners.base import Budget, PlannerResult, Status
from planners.learning.normalizer import Normalizer
from planners.mpnet import planner as mpnet
from planners.mpnet.imitation import DemonstrationPlan, Imitation, make_demonstrations, problems_of
from planners.mpnet.planner import MpnetPlanner
from planners.mpnet.search import Expander, Mpnet, PlannerShape, contracted

PLAN = DemonstrationPlan(planner="rrtconnect", seconds=0.2, problems=6)
SMALL = PlannerShape(3, code=8, point_widths=(8, 16), widths=(32, 32), dropout=0.25)


@pytest.fixture
def net() -> Mpnet:
    torch.manual_seed(0)
    return Mpnet(SMALL)


def test_contraction_keeps_what_it_must() -> None:
    """On the number line, with motions over an even number and longer than 3 blocked."""
    line = [np.array([float(x)]) for x in (1, 2, 3, 5, 6, 9)]

    def is_free(a: np.ndarray, b: np.ndarray) -> bool:
        return bool(abs(b - a)[0] <= 2)

    assert [int(q[0]) for q in contracted(line, is_free)] == [1, 3, 5, 6, 9]
    assert [int(q[0]) for q in contracted(line, lambda a, b: True)] == [1, 9]
    assert [int(q[0]) for q in contracted(line, lambda a, b: False)] == [1, 2, 3, 5, 6, 9]
    assert [int(q[0]) for q in contracted(line[:1], is_free)] == [1]


@given(st.lists(st.integers(0, 30), min_size=2, max_size=12), st.integers(1, 10))
def test_contraction_never_breaks_a_path(places: list[int], reach: int) -> None:
    path = [np.array([float(x)]) for x in places]

    def is_free(a: np.ndarray, b: np.ndarray) -> bool:
        return bool(abs(b - a)[0] <= reach)

    short = contracted(path, is_free)
    assert short[0] is path[0]
    assert short[-1] is path[-1]
    whole = {(a.tobytes(), b.tobytes()) for a, b in pairwise(path)}
    assert all(is_free(a, b) or (a.tobytes(), b.tobytes()) in whole for a, b in pairwise(short))
    lengths = [sum(abs(b - a)[0] for a, b in pairwise(p)) for p in (short, path)]
    assert lengths[0] <= lengths[1]


@pytest.mark.usefixtures("in_this_process")
def test_demonstrations_are_free_and_go_on_where_they_stopped(tmp_path: Path) -> None:
    scenes = [Cluttered3D(0), Cluttered3D(20_000)]
    kept = tmp_path / "kept.npz"

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_demonstrations([*scenes, *scenes, *scenes], PLAN, 3, kept, report=stop)
    before = np.load(kept)
    done = len(before["tried"])
    assert 1 <= done < 6
    made, seconds = make_demonstrations([*scenes, *scenes, *scenes], PLAN, 3, kept)
    assert made.tried.tolist() == [6] * 6
    assert seconds > before["seconds"]
    assert (made.waypoints[: len(before["waypoints"])] == before["waypoints"]).all()
    assert made.lengths.sum() == len(made.waypoints)
    assert len(made.lengths) == len(made.scenes) > 20
    models = [scene.collision_model() for scene in scenes]
    paths = np.split(made.waypoints, np.cumsum(made.lengths)[:-1])
    wanted = {tuple(p.start) for scene in scenes for p in problems_of(scene, PLAN, 3)}
    for path, scene in zip(paths, made.scenes, strict=True):
        model = models[scene % 2]
        assert tuple(path[0]) in wanted
        assert model.min_clearance(path) > model.tolerance
        assert len(contracted(list(path), model.segment_is_free)) == len(path)


def test_problems_of_demonstrations_belong_to_no_test_seed(
    c3d: Environment, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Test seeds are below 2^32 (`bench run --seed` refuses others), these are not."""
    seeds: list[int] = []

    def noted(self: Environment, n: int, seed: int) -> list[Problem]:
        seeds.append(seed)
        return []

    with monkeypatch.context() as patched:
        patched.setattr(Cluttered3D, "sample_problems", noted)
        for seed in (0, 7, 2**32 - 1):
            for scene in c3d.family():
                problems_of(scene, PLAN, seed)
    assert min(seeds) >= TEST_SEEDS == 2**32
    demonstrated = {tuple(p.start) for p in problems_of(c3d, PLAN, 0)}
    for seed in (0, 7, 11, *set(seeds)):
        tested = {tuple(p.start) for p in c3d.sample_problems(50, seed % TEST_SEEDS)}
        assert not demonstrated & tested


def test_a_family_is_the_same_for_all_its_scenes() -> None:
    one, other = Cluttered3D(3), Cluttered3D(99)
    assert one.fingerprint != other.fingerprint
    assert one.family_fingerprint == other.family_fingerprint
    assert one.family_fingerprint != Cluttered3D(3, boxes=9).family_fingerprint
    scenes = [scene.fingerprint for scene in other.family()]
    assert len(set(scenes)) == len(cluttered.FAMILY) >= 28
    assert {Cluttered3D(k).fingerprint for k in range(8)} <= set(scenes)
    assert other.fingerprint not in scenes
    assert all(k >= 10_000 for k in cluttered.FAMILY[8:]), "not where tables and checks look"


def test_symmetries_turn_scenes_into_scenes(c3d: Environment) -> None:
    turns = c3d.symmetries()
    assert len({turn.tobytes() for turn in turns}) == 48
    for turn in turns:
        assert turn @ turn.T == pytest.approx(np.eye(3))
        assert sorted(np.abs(turn).ravel().tolist()) == [0.0] * 6 + [1.0] * 3


def test_codes_do_not_depend_on_the_order_of_points(net: Mpnet) -> None:
    points = torch.rand(2, 50, 3) - 0.5
    code = net.encoder(points)
    assert code.shape == (2, 8)
    assert torch.equal(code, net.encoder(points[:, torch.randperm(50)]))
    assert not torch.allclose(code[0], code[1])


def test_both_forms_of_the_planning_network_agree(net: Mpnet, c3d: Environment) -> None:
    code = torch.randn(8)
    expander = Expander(net.planner, code.numpy(), Normalizer.of(c3d))
    net.planner.dropout = 0.0
    here, goal = np.array([3.0, -4.0, 5.0]), np.array([-9.0, 1.0, 0.0])
    a, b = (torch.from_numpy(q / 20).float() for q in (here, goal))
    wanted = 20 * net.planner(code, a, b).detach().numpy()
    assert expander.next(here, goal, np.random.default_rng(0), 0.0) == pytest.approx(
        wanted, abs=1e-4
    )


def test_units_are_left_out_while_planning(net: Mpnet, c3d: Environment) -> None:
    expander = Expander(net.planner, np.zeros(8, dtype=np.float32), Normalizer.of(c3d))
    rng = np.random.default_rng(0)
    here, goal = np.zeros(3), np.ones(3)
    steps = np.array([expander.next(here, goal, rng, 0.25) for _ in range(400)])
    assert steps.std(axis=0).min() > 0
    again = expander.next(here, goal, np.random.default_rng(0), 0.25)
    assert (again == steps[0]).all()


@pytest.mark.training
@pytest.mark.usefixtures("in_this_process")
def test_a_network_learns_its_demonstrations(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two scenes, 12 paths: the error of the next waypoint falls to a fraction."""
    monkeypatch.setattr(cluttered, "FAMILY", (0, 20_000))
    objective = Imitation(PLAN, scenes=2, samples=64, points=128, along=0.0)
    env = Cluttered3D()
    objective.prepare(env, 0, tmp_path / "kept.npz", lambda share: None)
    torch.manual_seed(0)
    made = Mpnet(PlannerShape(3, code=8, point_widths=(16, 32), widths=(64, 64), dropout=0.0))
    optimiser = torch.optim.Adam(made.parameters(), 2e-3)
    losses = []
    rng = np.random.default_rng(0)
    for _ in range(300):
        batch = objective.draw(rng)
        assert all(part.dtype == torch.float32 for part in batch)
        assert max(part.abs().max() for part in batch) <= 0.5 + 1e-6
        loss = objective.loss(made, batch, 0.0)
        optimiser.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        losses.append(loss.item())
    assert np.mean(losses[-20:]) < 0.5 * np.mean(losses[:20])


def ready(env: Environment, net: Mpnet, fallback: str = "") -> MpnetPlanner:
    made = MpnetPlanner(fallback)
    made._use(env, net)
    if made._fallback is not None:
        made._fallback.setup(env, seed=0)
    return made


def blocked(env: Environment) -> Problem:
    """A problem whose straight line is not free."""
    model = env.collision_model()
    problems = env.sample_problems(50, 4)
    return next(p for p in problems if not model.segment_is_free(p.start, p.goal))


def test_even_an_untrained_network_claims_only_free_paths(c3d: Environment, net: Mpnet) -> None:
    planner = ready(c3d, net)
    model = c3d.collision_model()
    claimed = 0
    for problem in c3d.sample_problems(10, 4):
        result = planner.solve(problem, Budget(perf_counter() + 0.2))
        assert result.stats["collision_checks"] > 0
        if result.status is Status.EXACT_SOLUTION:
            claimed += 1
            path = result.path
            assert (path[0] == problem.start).all()
            assert (path[-1] == problem.goal).all()
            assert model.min_clearance(path) > model.tolerance
        else:
            assert result.status is Status.TIMEOUT
            assert result.path is None
    assert claimed > 0


def test_the_same_seed_gives_the_same_path(c3d: Environment, net: Mpnet) -> None:
    planner = ready(c3d, net)
    for problem in c3d.sample_problems(6, 4):
        a, b = (planner.solve(problem, Budget(perf_counter() + 2)) for _ in range(2))
        if a.status is b.status is Status.EXACT_SOLUTION:
            assert a.stats == b.stats
            assert (a.path == b.path).all()


def test_the_fallback_mends_what_the_network_cannot(
    c3d: Environment, net: Mpnet, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Expander, "next", lambda self, current, *others: current)
    problem = blocked(c3d)
    alone = ready(c3d, net).solve(problem, Budget(perf_counter() + 0.3))
    assert alone.status is Status.TIMEOUT
    helped = ready(c3d, net, "rrtconnect").solve(problem, Budget(perf_counter() + 3))
    assert helped.status is Status.EXACT_SOLUTION
    assert helped.stats["fallbacks"] == 1
    assert helped.stats["attempts"] == mpnet._ATTEMPTS


@pytest.mark.parametrize(
    ("fallback", "told"), [("rrtconnect", True), ("rrtstar", True), ("fmm", False)]
)
def test_checks_are_those_of_both_planners(
    c3d: Environment, net: Mpnet, monkeypatch: pytest.MonkeyPatch, fallback: str, told: bool
) -> None:
    """Where the other does not say how many it made, nothing is said."""
    planner = ready(c3d, net, f"{fallback}:resolution=30" if fallback == "fmm" else fallback)
    problem = blocked(c3d)
    monkeypatch.setattr(Expander, "next", lambda self, current, *others: current)
    asked = counted_checks(monkeypatch)
    result = planner.solve(problem, Budget(perf_counter() + 5))
    assert result.stats.get("fallbacks") == 1
    assert result.stats.get("collision_checks") == (len(asked) if told else None)


def test_a_fallback_that_finds_nothing_leaves_time_for_another_try(
    c3d: Environment, net: Mpnet, monkeypatch: pytest.MonkeyPatch
) -> None:
    planner = ready(c3d, net, "rrtconnect")
    asked: list[float] = []

    def hopeless(problem: Problem, budget: Budget) -> PlannerResult:
        asked.append(budget.remaining())
        return PlannerResult(Status.TIMEOUT)

    monkeypatch.setattr(Expander, "next", lambda self, current, *others: current)
    monkeypatch.setattr(planner._fallback, "solve", hopeless)
    problem = blocked(c3d)
    result = planner.solve(problem, Budget(perf_counter() + 0.5))
    assert result.status is Status.TIMEOUT
    assert len(asked) > 3
    assert max(asked) <= 0.1


def test_ends_in_collision_or_outside_are_said_so(c3d: Environment, net: Mpnet) -> None:
    planner = ready(c3d, net)
    free = c3d.sample_problems(1, 0)[0].start
    inside, outside = np.array(c3d.obstacles[0].center), np.array([11.0, 0.0, 0.0])
    for bad in (inside, outside):
        for problem, status in (
            (Problem(bad, free), Status.INVALID_START),
            (Problem(free, bad), Status.INVALID_GOAL),
        ):
            result = planner.solve(problem, Budget(perf_counter() + 1))
            assert (result.status, result.path) == (status, None)
