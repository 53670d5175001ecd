"""Time fields that are metrics, and what they are trained on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import envs
from planners.fields.layers import FieldShape
from planners.fields.metric_field import MetricField
from planners.fields.physics import GroupPlan, Space
from planners.fields.temporal_difference import TemporalDifference, normals


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
    found = net.all_pairs(starts, goals)
    one = net(
        starts[:, :, None].expand(-1, -1, 3, -1).reshape(45, -1),
        goals[:, None].expand(-1, 3, -1, -1).reshape(45, -1),
    )
    for many, single in zip(found, one, strict=True):
        assert torch.allclose(many.reshape(single.shape), single)


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


@pytest.mark.parametrize("speed", [1.0, 0.3])
def test_the_true_field_of_open_space_costs_nothing(speed: float) -> None:
    objective = TemporalDifference(GroupPlan(groups=4))
    points = torch.rand(4, 6, 3, dtype=torch.float64)
    offset = points[:, 0] - points[:, 3]
    normal = torch.zeros(4, 6, 3, dtype=torch.float64)
    batch = points, torch.full((4, 6), float(np.log(speed)), dtype=torch.float64), normal
    assert offset.norm(dim=-1).min() > 0.02
    plain = TemporalDifference(GroupPlan(groups=4), normal_weight=0.0)
    assert plain.loss(Straight(speed), batch, 0.5).item() == pytest.approx(0, abs=1e-12)  # type: ignore[arg-type]
    wrong = plain.loss(Straight(2 * speed), batch, 0.5)  # type: ignore[arg-type]
    assert wrong.item() > 0.01
    against = objective.loss(Straight(speed), batch, 0.5)  # type: ignore[arg-type]
    share = (against / objective.normal_weight).item()
    # |flow + 0|^2 is 1 everywhere, and causality takes away at most 1 - exp(-T / 2).
    assert 0 < share <= (1 - speed) or (speed == 1.0 and share == pytest.approx(0, abs=1e-12))


def test_normals_lead_away_from_a_box(tmp_path: Path) -> None:
    env = envs.make("box")
    space = Space.of(env)
    beside = np.array([[0.25, 0.0, 0.0], [0.0, -0.3, 0.05], [0.21, 0.21, 0.0]])
    found = normals(space, beside)
    assert found[0] == pytest.approx([1, 0, 0], abs=1e-6)
    assert found[1] == pytest.approx([0, -1, 0], abs=1e-6)
    assert np.linalg.norm(found, axis=-1) == pytest.approx(np.ones(3))


@pytest.mark.parametrize("env", ["c3d", "maze", "arm4"])
def test_training_lowers_the_loss(env: str, tmp_path: Path) -> None:
    made = envs.make(env)
    torch.manual_seed(0)
    net = MetricField(FieldShape(made.dimension, width=32))
    objective = TemporalDifference(GroupPlan(groups=32))
    objective.prepare(made, 1, tmp_path / "kept", lambda share: None)
    optimiser = torch.optim.Adam(net.parameters(), lr=3e-3)
    rng = np.random.default_rng(0)
    losses = []
    for _ in range(40):
        optimiser.zero_grad()
        loss = objective.loss(net, objective.draw(rng), 0.5)
        loss.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        losses.append(loss.item())
    assert np.mean(losses[-10:]) < 0.7 * np.mean(losses[:5])
