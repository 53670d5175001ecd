"""Time fields that are metrics, and what they are trained on."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import envs
from envs import Environment
from planners.fields.layers import FieldShape
from planners.fields.metric_field import MetricField
from planners.fields.physics import GroupPlan, Space
from planners.fields.temporal_difference import (
    TemporalDifference,
    after,
    free_groups,
    surroundings,
)
from planners.learning.normalizer import Normalizer
from planners.learning.training_loop import Batch


@pytest.fixture(scope="module", params=[2, 3, 6])
def net(request: pytest.FixtureRequest) -> MetricField:
    torch.manual_seed(1)
    made = MetricField(FieldShape(request.param, width=32))
    return made.double()


def places(net: MetricField, *shape: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(3)
    d = net.shape.dimension
    return torch.rand(*shape, d, generator=generator, dtype=torch.float64) - 0.5


def test_times_are_those_of_a_metric(net: MetricField) -> None:
    a, b, c = places(net, 3, 200)
    there, back = net.time(a, b), net.time(b, a)
    assert (there > 0).all()
    assert torch.equal(there, back)
    assert torch.equal(net.time(a, a), torch.zeros(200, dtype=torch.float64))
    assert (net.time(a, c) <= there + net.time(b, c) + 1e-12).all()


def test_slopes_are_those_of_the_times(net: MetricField) -> None:
    """By differences; where two features of a group are nearly as far apart, the slope jumps."""
    a, b = places(net, 2, 64)
    stretch, at_a, at_b = net(a, b)
    distance = (a - b).norm(dim=-1)
    assert torch.allclose(stretch, (net.time(a, b) / distance).log())
    step = 1e-6
    for axis in range(a.shape[1]):
        aside = torch.zeros_like(a)
        aside[:, axis] = step
        for slope, more, less in (
            (at_a, (a + aside, b), (a - aside, b)),
            (at_b, (a, b + aside), (a, b - aside)),
        ):
            found = (net(*more)[0] - net(*less)[0]) / (2 * step)
            near = (found - slope[:, axis]).abs() < 1e-5
            assert near.double().mean() > 0.95


def test_all_pairs_are_as_one_by_one(net: MetricField) -> None:
    starts, goals = places(net, 2, 5, 3)
    time, *slopes = net.times(starts, goals)
    assert torch.allclose(time, net.time(starts[:, :, None], goals[:, None]))
    one, *single = net.times(
        starts[:, :, None].expand(-1, -1, 3, -1).reshape(45, 1, -1),
        goals[:, None].expand(-1, 3, -1, -1).reshape(45, 1, -1),
    )
    assert torch.allclose(one.reshape(time.shape), time)
    for many, alone in zip(slopes, single, strict=True):
        assert torch.allclose(alone.reshape(many.shape), many)


class Straight:
    """T = |a - b| / S: what it is where the speed is the same everywhere."""

    def __init__(self, speed: float) -> None:
        self.speed = speed

    def time(self, a: Any, b: Any) -> Any:
        return (a - b).norm(dim=-1) / self.speed

    def times(self, starts: Any, goals: Any) -> Any:
        offset = starts[:, :, None] - goals[:, None]
        slope = offset / offset.norm(dim=-1, keepdim=True) / self.speed
        return offset.norm(dim=-1) / self.speed, slope, -slope


def batch_of(points: torch.Tensor, speed: float) -> Batch:
    """Points (g, s + t, d) where the speed is the same everywhere, and nothing is near."""
    nothing = torch.zeros_like(points)
    return points, torch.full(points.shape[:2], float(np.log(speed))).double(), nothing, nothing


def objective_in(env: Environment, kept: Path, **weights: float) -> TemporalDifference:
    objective = TemporalDifference(GroupPlan(groups=4), **weights)
    objective.prepare(env, 1, kept, lambda share: None)
    return objective


@pytest.mark.parametrize("speed", [1.0, 0.3])
def test_the_true_field_of_open_space_costs_nothing(
    speed: float, c3d: Environment, tmp_path: Path
) -> None:
    points = torch.rand(4, 6, 3, dtype=torch.float64)
    batch = batch_of(points, speed)
    plain = objective_in(c3d, tmp_path, normal_weight=0.0)
    assert plain.loss(Straight(speed), batch, 0.5).item() == pytest.approx(0, abs=1e-12)
    assert plain.loss(Straight(2 * speed), batch, 0.5).item() > 0.01
    objective = objective_in(c3d, tmp_path)
    share = objective.loss(Straight(speed), batch, 0.5).item() / objective.normal_weight
    # |flow + 0|^2 is 1 everywhere, and by Jensen causality leaves at least exp(-l_C) of the mean.
    assert share <= (1 - speed) + 1e-9
    assert share >= np.exp(-objective.causality) * (1 - speed) - 1e-9


def test_each_term_is_told_apart(c3d: Environment, tmp_path: Path) -> None:
    """In open space, of a field that is twice what it should be: sqrt(2) - 1 too steep, and a step
    takes half of what the field falls by."""
    points = torch.rand(4, 6, 3, dtype=torch.float64)
    batch = batch_of(points, 1.0)
    none = {"eikonal_weight": 0.0, "difference_weight": 0.0, "normal_weight": 0.0, "causality": 0.0}
    for term, cost in (
        ({"eikonal_weight": 1.0}, (2**0.5 - 1) ** 2),
        ({"difference_weight": 1.0}, 1.0),
        ({"eikonal_weight": 1.0, "causality": 20.0}, None),
    ):
        objective = objective_in(c3d, tmp_path, **(none | term))
        found = objective.loss(Straight(0.5), batch, 0.5).item()
        if cost is None:
            assert 0 < found < 0.1 * (2**0.5 - 1) ** 2, "far pairs hardly count"
        else:
            assert found == pytest.approx(cost, rel=1e-6)


def test_a_step_takes_longer_where_it_gets_slower() -> None:
    """Against the integral of 1 / S for S = exp(3 x), and of no change."""
    here = torch.tensor([[0.2, 0.1], [0.2, 0.1]], dtype=torch.float64)
    slope = torch.tensor([[3.0, 0.0], [0.0, 0.0]], dtype=torch.float64)
    log_speed = torch.tensor([0.6, 0.0], dtype=torch.float64)
    toward = torch.tensor([[1.0, 0.0], [1.0, 0.0]], dtype=torch.float64)
    step = torch.full((2,), 0.05, dtype=torch.float64)
    there, spent = after(step, toward, (here, log_speed, slope, slope))
    x = np.linspace(there[0, 0].item(), 0.2, 10_001)
    assert there[0, 0] == pytest.approx(0.2 - 0.05 * np.exp(0.6))
    assert spent[0].item() == pytest.approx(np.trapezoid(np.exp(-3 * x), x), rel=1e-6)
    assert spent[1].item() == pytest.approx(0.05)
    assert (there[:, 1] == 0.1).all()


def test_what_is_around_a_box() -> None:
    """The normal leads away from it, and the log speed grows that way by 1 / clearance."""
    env = envs.make("box")
    space = Space.of(env)
    beside = np.array([[0.25, 0.0, 0.0], [0.0, -0.28, 0.05], [0.21, 0.21, 0.0]])
    slope, normal = surroundings(space, beside)
    assert normal[0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert normal[1] == pytest.approx([0, -1, 0], abs=1e-6)
    assert np.linalg.norm(normal, axis=-1) == pytest.approx(np.ones(3))
    clearance = space.clearance(beside) * env.speed_model.d_max / Normalizer.of(env).extent
    reached = clearance < env.speed_model.d_max / Normalizer.of(env).extent
    assert reached.any()
    length = np.linalg.norm(slope, axis=-1)
    assert length[reached] == pytest.approx(1 / clearance[reached], rel=1e-2)
    assert length[~reached] == pytest.approx(0)


def trained(
    env: Environment, steps: int, kept: Path
) -> tuple[MetricField, MetricField, list[float]]:
    """A network before and after some steps, and the loss at each."""
    torch.manual_seed(0)
    net = MetricField(FieldShape(env.dimension, width=32))
    before = deepcopy(net)
    objective = TemporalDifference(GroupPlan(groups=32))
    objective.prepare(env, 1, kept, lambda share: None)
    optimiser = torch.optim.Adam(net.parameters(), lr=3e-3)
    rng = np.random.default_rng(0)
    losses = []
    for _ in range(steps):
        optimiser.zero_grad()
        loss = objective.loss(net, objective.draw(rng), 0.5)
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        losses.append(loss.item())
    return before, net, losses


@pytest.mark.parametrize("env", ["c3d", "arm4"])
def test_training_lowers_the_loss(env: str, tmp_path: Path) -> None:
    _, _, losses = trained(envs.make(env), 60, tmp_path)
    assert np.isfinite(losses).all()
    assert np.mean(losses[-10:]) < 0.7 * np.mean(losses[:5])


def test_training_brings_times_near_the_truth(tmp_path: Path) -> None:
    """Where nothing is in the way, T is the distance by the speed, which is 1 far from the box."""
    env = envs.make("box")
    before, after_it, _ = trained(env, 150, tmp_path)
    a = torch.rand(300, 3, generator=torch.Generator().manual_seed(1)) * 0.9 - 0.45
    a[:, 2] = 0.35 + 0.1 * torch.rand(300, generator=torch.Generator().manual_seed(2))
    a, b = a[:150], a[150:]
    assert (Space.of(env).speed(Space.of(env).clearance(a.double().numpy())) == 1).all()

    def error(net: MetricField) -> float:
        with torch.no_grad():
            return float((net.time(a, b) / (a - b).norm(dim=-1) - 1).abs().median())

    assert error(after_it) < 0.15
    assert error(after_it) < 0.5 * error(before)


def test_free_groups_are_free_and_near_surfaces() -> None:
    """In a maze whose walls fill much; the rest of the groups lie in balls, half by half."""
    env = envs.make("maze")
    space, plan = Space.of(env), GroupPlan(groups=60)
    points, clearance = free_groups(space, plan, np.random.default_rng(1))
    assert points.shape == (60, plan.points, 2)
    assert clearance == pytest.approx(space.clearance(points.reshape(-1, 2)).reshape(60, -1))
    assert (clearance > 0).mean() > 0.99
    spread = np.ptp(points, axis=1).max(axis=-1)
    assert np.median(spread[:30]) < 0.3 < np.median(spread[30:])
    again, _ = free_groups(space, plan, np.random.default_rng(1))
    assert (again == points).all()


def test_computed_inputs_belong_to_a_shape_that_has_as_many() -> None:
    with pytest.raises(ValueError, match="as many"):
        MetricField(FieldShape(3, width=32, computed=5))
    with pytest.raises(ValueError, match="groups"):
        MetricField(FieldShape(3, width=33))
