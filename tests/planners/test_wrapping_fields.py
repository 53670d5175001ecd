"""Time fields where coordinates wrap: the same place is the same to them, and they go the short
way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor, nn
from turning_booms import BoomWorld, boom_world, turntable
from turning_cubes import OnePart

import envs
import planners
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Problem
from planners.fields import methods
from planners.fields.labels import LabelPlan, make_labels
from planners.fields.layers import FieldShape
from planners.fields.networks import TimeField
from planners.fields.objectives import LargestSubsolution, LargestSubsolutionAround
from planners.fields.path_extraction import Descent, descend, gradients
from planners.fields.physics import GroupPlan, GroupSampler, Space
from planners.fields.planner import FieldPlanner
from planners.fields.single_query import CompiledField, _without_loops
from planners.fields.wrapping import CircleArrays
from planners.learning.circles import Circles
from planners.learning.training_loop import Recipe, Steps, TrainingState, train

CIRCLES = Circles((1, 2), 0.9)
LOWER, UPPER = np.array([[-0.5, -np.inf, -np.inf], [0.5, np.inf, np.inf]], dtype=np.float32)
TURNS = torch.tensor([0.0, 0.9, -1.8], dtype=torch.float64)


@pytest.fixture
def net() -> TimeField:
    torch.manual_seed(4)
    return TimeField(FieldShape(3, frequencies=8, width=32, circles=CIRCLES)).eval()


def ends(n: int, seed: int = 0) -> tuple[Tensor, Tensor]:
    """Of pairs anywhere, some of which are nearer across the bounds."""
    drawn = np.random.default_rng(seed).uniform(-0.45, 0.45, (2, n, 3))
    starts, goals = torch.from_numpy(drawn)
    assert 10 < int(crosses(starts, goals).sum()) < n
    return starts, goals


def crosses(starts: Tensor, goals: Tensor) -> Tensor:
    return ((starts - goals).abs()[:, 1:] > 0.45).any(dim=1)


class Constant(nn.Module):
    """The field of speed 1: T is the distance."""

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return torch.zeros(len(start)), torch.zeros_like(start), torch.zeros_like(goal)


def test_a_turn_further_the_field_is_the_same(net: TimeField) -> None:
    net = net.double()
    starts, goals = ends(40)
    for turned in ((starts + TURNS, goals), (starts, goals + TURNS), (starts - TURNS, goals)):
        found = gradients(net, *turned, CIRCLES)
        for a, b in zip(gradients(net, starts, goals, CIRCLES), found, strict=True):
            assert torch.allclose(a, b, atol=1e-9)
    straight = starts + 0.9 * torch.tensor([1.0, 0, 0], dtype=torch.float64)
    assert not torch.allclose(net(starts, goals)[0], net(straight, goals)[0], atol=1e-2)


def test_times_are_symmetric_and_zero_from_a_place_to_itself(net: TimeField) -> None:
    net = net.double()
    starts, goals = ends(40)
    there, at_start, at_goal = gradients(net, starts, goals, CIRCLES)
    back, at_goal_back, at_start_back = gradients(net, goals, starts, CIRCLES)
    assert torch.equal(there, back)
    assert torch.allclose(at_start, at_start_back)
    assert torch.allclose(at_goal, at_goal_back)
    assert (there > 0).all()
    for same in (starts, starts + TURNS):
        assert gradients(net, starts, same, CIRCLES)[0].abs().max() < 1e-12


def test_gradients_of_times_are_those_of_finite_differences(net: TimeField) -> None:
    net = net.double()
    starts, goals = ends(40)
    _, *found = gradients(net, starts, goals, CIRCLES)
    for axis in range(3):
        h = 1e-6 * torch.eye(3, dtype=torch.float64)[axis]
        at_start = (
            gradients(net, starts + h, goals, CIRCLES)[0]
            - gradients(net, starts - h, goals, CIRCLES)[0]
        )
        at_goal = (
            gradients(net, starts, goals + h, CIRCLES)[0]
            - gradients(net, starts, goals - h, CIRCLES)[0]
        )
        for rise, slope in zip((at_start, at_goal), found, strict=True):
            assert torch.allclose(rise / 2e-6, slope[:, axis], atol=1e-6)


def test_at_constant_speed_paths_are_the_short_way() -> None:
    starts, goals = (end.float() for end in ends(30))
    low, high = torch.from_numpy(LOWER), torch.from_numpy(UPPER)
    paths = descend(Constant(), starts, goals, low, high, Descent(), CIRCLES)
    for path, start, goal in zip(paths, starts, goals, strict=True):
        assert path is not None
        assert torch.equal(path[0], start)
        assert torch.equal(path[-1], goal)
        length = CIRCLES.shortest(path.diff(dim=0)).norm(dim=-1).sum()
        assert length.item() == pytest.approx(CIRCLES.shortest(goal - start).norm().item(), 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("descent", [Descent(), Descent(step=0.01, moves=(True, False))])
def test_the_compiled_field_is_the_networks(net: TimeField, descent: Descent) -> None:
    starts, goals = (end.float() for end in ends(30))
    starts = starts + TURNS.float()
    compiled = CompiledField(net)
    with torch.no_grad():
        stretch, *slopes = net(starts, goals)
    low, high = torch.from_numpy(LOWER), torch.from_numpy(UPPER)
    together = descend(net, starts, goals, low, high, descent, CIRCLES)
    met = 0
    for n, wanted in enumerate(together):
        found, slope = compiled.pair(starts[n].numpy(), goals[n].numpy())
        assert found == pytest.approx(float(stretch[n]), abs=1e-5)
        assert slope == pytest.approx(np.stack([s[n].numpy() for s in slopes]), abs=1e-4)
        path = compiled.descend(starts[n].numpy(), goals[n].numpy(), LOWER, UPPER, descent)
        assert (path is None) == (wanted is None)
        if path is not None and wanted is not None:
            met += 1
            apart = CIRCLES.shortest(torch.from_numpy(path) - wanted)
            assert apart.abs().max() < 1e-4
    assert met > 20


@pytest.mark.slow
def test_loops_round_a_circle_are_cut_out() -> None:
    """A path that goes round once and a half goes on from where it comes by again."""
    arrays = CircleArrays.of(CIRCLES, 3)
    path = np.zeros((46, 3), dtype=np.float32)
    path[:, 1] = np.arange(46) * 0.03
    kept = _without_loops(path, 0.015, arrays)
    assert kept.tolist() == [0, *range(30, 46)]
    assert len(_without_loops(path, 0.015, None)) == 46, "where nothing wraps there is no loop"


def test_training_pairs_are_drawn_across_the_bounds() -> None:
    env = OnePart()
    space = Space.of(env)
    plan = GroupPlan(groups=12, candidates=1)
    points, log_speeds = GroupSampler(space, plan).draw(np.random.default_rng(0))
    beyond = np.abs(points) > np.array([0.5, 0.5, space.circles.period / 2]) + 1e-9
    assert not beyond[..., :2].any(), "the others are kept within"
    assert beyond[..., 2].any()
    q = points.reshape(-1, 3) * 8.0  # in the environment's unit, the same place a turn further
    assert np.exp(log_speeds).ravel() == pytest.approx(env.speed(q), rel=1e-6)


def test_losses_measure_the_short_way() -> None:
    """With the field of speed 1, T from one side of the bounds to the other is the way between."""
    period = 0.7
    points = torch.zeros(1, 6, 3)
    points[0, :3, 2], points[0, 3:, 2] = 0.49 * period, -0.49 * period

    class Flat(nn.Module):
        shape = FieldShape(3, circles=Circles((2,), period))

        def all_pairs(self, starts: Tensor, goals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
            shape = (len(starts), starts.shape[1], goals.shape[1])
            return torch.zeros(shape), torch.zeros(*shape, 3), torch.zeros(*shape, 3)

    batch = points, torch.zeros(1, 6)
    errors, _, _, distance = LargestSubsolution()._errors(Flat(), batch)  # type: ignore[arg-type]
    assert distance.numpy() == pytest.approx(0.02 * period, abs=1e-5)
    assert errors.abs().max() < 1e-5


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_labels_are_relative_to_the_short_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the same speed everywhere T is the distance by that, also across the bounds."""
    monkeypatch.setattr(OnePart, "clearance", lambda env, q: np.full(len(q), 0.5))
    plan = LabelPlan(sources=3, goals=300, resolution=40)
    env = OnePart()
    made, _ = make_labels(env, plan, 1, tmp_path / "kept.npz")
    half = Space.of(env).circles.period / 2
    across = np.abs(made.goals - made.sources[:, None])[..., 2] > half
    assert 50 < across.sum() < across.size / 2
    speed = float(env.speed_model(np.array([0.5]))[0])
    assert np.exp(made.stretch[across]) == pytest.approx(1 / speed, rel=0.05)


@pytest.mark.parametrize("name", methods.METHODS)
def test_fields_are_for_joints_that_wrap_and_for_no_rotations(name: str, tmp_path: Path) -> None:
    planner = planners.make(name)
    for space in ("se2", "se3"):
        reason = str(planner.unsupported(envs.make(f"rigid:space={space}")))
        assert "yet" in reason
    of_points = "point" in str(planner.unsupported(envs.make("rigid:space=r3")))
    assert of_points == (name in ("ntfields-wenc", "ntfields-wenc-early", "ntfields-paper"))
    assert (planner.unsupported(boom_world(tmp_path)) is None) != of_points
    assert (planner.unsupported(OnePart()) is None) != of_points


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> BoomWorld:
    return boom_world(tmp_path_factory.mktemp("boom"))


@pytest.mark.slow
def test_the_field_of_an_arm_does_not_jump_where_a_joint_wraps(world: BoomWorld) -> None:
    torch.manual_seed(0)
    net = methods.method("ntfields", world).network(world).eval()
    compiled = CompiledField(net)
    [turn] = np.flatnonzero(world.space.wraps)
    starts = np.random.default_rng(0).uniform(-0.2, 0.2, (10, 2)).astype(np.float32)
    goal = np.array([0.1, 0.1], dtype=np.float32)
    starts[:, turn] = 0.5
    for start in starts:
        other = start.copy()
        other[turn] = -0.5
        for a, b in zip(compiled.pair(start, goal), compiled.pair(other, goal), strict=True):
            assert a == pytest.approx(b, abs=1e-5)


@pytest.mark.training(minutes=1)
def test_a_short_training_solves_most_problems_the_right_way_round(
    world: BoomWorld, tmp_path: Path
) -> None:
    """Past the wall there is no way through 0, so that many have to cross half a turn."""
    planner = trained(world, tmp_path, steps=400, groups=64)
    problems = world.sample_problems(20, 2**33)
    paths = judged_paths(planner, world, problems)
    [turn] = np.flatnonzero(world.space.wraps)
    nearer_across = [n for n, p in enumerate(problems) if abs(p.goal - p.start)[turn] > math.pi]
    assert len(paths) >= 16
    assert len(paths.keys() & nearer_across) >= 4
    for n, path in paths.items():
        across = (np.abs(np.diff(path[:, turn])) > math.pi).any()
        assert across == (problems[n].start[turn] * problems[n].goal[turn] < 0)


@pytest.mark.training
def test_one_joint_alone_learns_to_go_the_long_way_round(tmp_path: Path) -> None:
    world = turntable(tmp_path)
    planner = trained(world, tmp_path, steps=500, groups=32)
    problems = world.sample_problems(20, 2**33)
    long = [
        n for n, p in enumerate(problems) if p.start * p.goal < 0 < math.pi - abs(p.goal - p.start)
    ]
    paths = judged_paths(planner, world, problems)
    assert len(long) >= 3
    assert paths.keys() >= set(long)


def trained(world: BoomWorld, folder: Path, steps: int, groups: int) -> FieldPlanner:
    """A planner after a short training on batches of so many groups."""
    method = methods.method("ntfields", world)
    assert method.objective is LargestSubsolutionAround
    torch.manual_seed(0)
    state = TrainingState.begin(method.network(world), method.recipe)
    objective = LargestSubsolutionAround(GroupPlan(groups=groups))
    objective.prepare(world, 0, folder, lambda share: None)
    average = train(state, objective, Recipe(steps=steps, averaging=0.98), Steps(steps), seed=0)
    planner = FieldPlanner("ntfields")
    planner._use(world, average)
    return planner


def judged_paths(
    planner: FieldPlanner, world: BoomWorld, problems: Sequence[Problem]
) -> dict[int, np.ndarray]:
    """The paths of those that it solves, all of which the judge lets pass."""
    judge = Judge(world)
    found = {}
    for n, result in enumerate(planner.solve_batch(problems)):
        if result.status is planners.Status.EXACT_SOLUTION:
            found[n] = np.asarray(result.path)
            judged = judge(problems[n], found[n])
            assert judged.verdict is Verdict.VALID, judged.reason
    return found
