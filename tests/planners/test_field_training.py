"""Training points and training, on problems with known answers."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from envs import Environment
from planners.fields.networks import FieldShape, TimeField
from planners.fields.sampling import GroupPlan, GroupSampler, Scale
from planners.fields.training import Recipe, train


def test_scale_is_the_unit_cube_and_back(c3d: Environment) -> None:
    scale = Scale.of(c3d)
    q = np.random.default_rng(0).uniform(c3d.lower, c3d.upper, (100, 3))
    assert np.abs(scale.shrink(q)).max() <= 0.5
    assert scale.grow(scale.shrink(q)) == pytest.approx(q)


def test_points_are_inside_and_know_their_speed(c3d: Environment) -> None:
    plan = GroupPlan(groups=40)
    points, log_speed = GroupSampler.of(c3d, plan).draw(np.random.default_rng(1))
    assert points.shape == (40, 24, 3)
    assert log_speed.shape == (40, 24)
    assert np.abs(points).max() <= 0.5
    wanted = np.log(c3d.speed(20 * points.reshape(-1, 3)))
    assert log_speed.ravel() == pytest.approx(wanted)


def test_groups_are_local_or_spread_and_partly_near_surfaces(c3d: Environment) -> None:
    def near_share(share: float) -> float:
        plan = GroupPlan(groups=400, near_share=share, candidates=8)
        points, _ = GroupSampler.of(c3d, plan).draw(np.random.default_rng(2))
        clearance = c3d.clearance(20 * points[200:].reshape(-1, 3)) / 20
        return float(((clearance > plan.nearest) & (clearance < plan.farthest)).mean())

    plain, more = near_share(0.0), near_share(0.5)
    assert more == pytest.approx(0.5 + 0.5 * plain, abs=0.05)
    points, _ = GroupSampler.of(c3d, GroupPlan(groups=400)).draw(np.random.default_rng(3))
    reach = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=-1).max(axis=1)
    assert np.median(reach[:200]) < 0.2 < reach[200:].min()


def test_starts_and_goals_are_drawn_alike(c3d: Environment) -> None:
    plan = GroupPlan(groups=2000, near_share=0.6)
    _, log_speed = GroupSampler.of(c3d, plan).draw(np.random.default_rng(4))
    starts, goals = log_speed[:, : plan.starts], log_speed[:, plan.starts :]
    assert starts.mean() == pytest.approx(goals.mean(), abs=0.02)


def test_schedules() -> None:
    recipe = Recipe(steps=1000)
    assert recipe.rate(0) == pytest.approx(recipe.learning_rate / 200)
    assert recipe.rate(1000) == pytest.approx(0.02 * recipe.learning_rate)
    assert recipe.weights(0) == (0.3, 0.1)
    assert recipe.weights(550) == pytest.approx((0.2, 0.02**0.5))
    assert recipe.weights(1000) == pytest.approx((0.1, 0.2))


def test_a_ramp_of_speed_is_learned() -> None:
    """S = 0.55 + 0.9 x on [-0.5, 0.5]: T(a, b) = |log(S(b) / S(a))| / 0.9, to 2 %."""

    def speed(x: np.ndarray) -> np.ndarray:
        return 0.55 + 0.9 * x

    plan = GroupPlan(near_share=0.0)
    bounds = np.full(1, -0.5), np.full(1, 0.5)
    sampler = GroupSampler(*bounds, lambda x: x[:, 0], speed, plan)
    torch.manual_seed(0)
    net = TimeField(FieldShape(1, frequencies=8, width=32))
    losses = []
    field = train(
        net, sampler, plan, Recipe(steps=800), seed=0, report=lambda _, loss: losses.append(loss)
    )
    assert len(losses) == 800
    ends = torch.linspace(-0.48, 0.48, 60)
    a, b = (x.reshape(-1, 1) for x in torch.meshgrid(ends, ends, indexing="ij"))
    apart = (a - b).abs().squeeze() > 0.05
    a, b = a[apart], b[apart]
    with torch.no_grad():
        stretch, _, _ = field(a, b)
    found = ((a - b).norm(dim=-1) * stretch.exp()).numpy()
    wanted = np.abs(np.log(speed(b.numpy()) / speed(a.numpy()))).squeeze() / 0.9
    error = np.abs(found / wanted - 1)
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.9) < 0.04


def test_training_is_repeatable() -> None:
    def trained() -> list[torch.Tensor]:
        plan = GroupPlan(groups=4, near_share=0.0)
        sampler = GroupSampler(
            np.full(2, -0.5), np.full(2, 0.5), lambda x: x[:, 0], np.ones_like, plan
        )
        torch.manual_seed(5)
        net = TimeField(FieldShape(2, frequencies=4, width=16))
        return list(train(net, sampler, plan, Recipe(steps=5), seed=7).parameters())

    for a, b in zip(trained(), trained(), strict=True):
        assert torch.equal(a, b)
