"""The equations of time fields against automatic differentiation and closed forms."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from planners.fields.physics import (
    eikonal_loss,
    log_slowness_error,
    predicted_speed,
    subsolution_loss,
    with_bounded_slack,
)


def wavy_tau(start: Tensor, goal: Tensor) -> Tensor:
    """Any smooth positive symmetric function."""
    return 0.6 + 0.3 * torch.sin(3 * start).prod(-1) * torch.sin(3 * goal).prod(-1)


@pytest.fixture
def pairs() -> tuple[Tensor, Tensor]:
    torch.manual_seed(0)
    ends = torch.rand(2, 100, 3, dtype=torch.float64) - 0.5
    return ends[0].requires_grad_(), ends[1].requires_grad_()


def test_equation_2_is_the_gradient_of_equation_1(pairs: tuple[Tensor, Tensor]) -> None:
    start, goal = pairs
    tau = wavy_tau(start, goal)
    time = (start - goal).norm(dim=-1) / tau  # equation 1
    for end, offset in ((start, start - goal), (goal, goal - start)):
        [of_time] = torch.autograd.grad(time.sum(), end, retain_graph=True)
        [of_tau] = torch.autograd.grad(tau.sum(), end, retain_graph=True)
        found = predicted_speed(tau, offset, of_tau)
        assert torch.allclose(found, 1 / of_time.norm(dim=-1), rtol=1e-9)


def test_the_error_is_the_log_of_slowness(pairs: tuple[Tensor, Tensor]) -> None:
    start, goal = pairs
    stretch = -wavy_tau(start, goal).log()
    time = (start - goal).norm(dim=-1) * stretch.exp()
    [of_time] = torch.autograd.grad(time.sum(), start, retain_graph=True)
    [slope] = torch.autograd.grad(stretch.sum(), start)
    log_speed = torch.linspace(-2, 0, 100, dtype=torch.float64)
    found = log_slowness_error(log_speed, stretch, start - goal, slope)
    assert torch.allclose(found, log_speed + of_time.norm(dim=-1).log(), atol=1e-9)


def test_constant_speed_gives_distance_over_speed(pairs: tuple[Tensor, Tensor]) -> None:
    start, goal = pairs
    for speed in (1.0, 0.25):
        tau = torch.full((100,), speed, dtype=torch.float64)
        distance = (start - goal).norm(dim=-1)
        time = distance / tau
        assert torch.allclose(time, distance / speed)
        [gradient] = torch.autograd.grad(time.sum(), start, retain_graph=True)
        assert torch.allclose(gradient.norm(dim=-1), torch.full_like(distance, 1 / speed))
        flat = torch.zeros(100, 3, dtype=torch.float64)
        assert torch.allclose(predicted_speed(tau, start - goal, flat), tau)
        error = log_slowness_error(tau.log(), -tau.log(), start - goal, flat)
        assert torch.allclose(error, torch.zeros_like(error), atol=1e-12)


def test_equation_4_is_zero_where_speeds_agree_and_the_same_both_ways() -> None:
    speed = torch.tensor([0.1, 0.5, 1.0], dtype=torch.float64)
    other = torch.tensor([0.2, 0.3, 0.4], dtype=torch.float64)
    assert torch.equal(eikonal_loss(speed, speed), torch.zeros(3, dtype=torch.float64))
    assert torch.allclose(eikonal_loss(speed, other), eikonal_loss(other, speed))
    # |1 - sqrt(4)| + |1 - sqrt(1 / 4)|
    assert eikonal_loss(torch.tensor(4.0), torch.tensor(1.0)).item() == pytest.approx(1.5)


def loss(error: Tensor, stretch: Tensor, distance: Tensor, pull: float, slack: float) -> float:
    return subsolution_loss(
        error, stretch, distance, pull=pull, pull_distance=0.25, slack_weight=slack
    ).item()


def test_equation_4_in_terms_of_the_error() -> None:
    error = torch.linspace(-3, 3, 101, dtype=torch.float64)
    by_speeds = eikonal_loss(error.exp(), torch.ones_like(error))
    assert torch.allclose(by_speeds, 2 * torch.sinh(error.abs() / 2))
    nothing = torch.zeros_like(error)
    both_ways = loss(error, nothing, nothing, pull=0.0, slack=1.0)
    assert both_ways == pytest.approx(by_speeds.mean().item())


def test_the_subsolution_loss_prefers_the_largest_time() -> None:
    """At constant speed every T = k |qs - qg| with k <= 1 / S is a subsolution: the loss falls up
    to k = 1 / S and rises beyond."""
    speed, far = 0.5, torch.ones(1, dtype=torch.float64)
    stretch = torch.linspace(0, 2 * math.log(1 / speed), 201, dtype=torch.float64)
    error = math.log(speed) + stretch  # |grad T| = k
    losses = [
        loss(e[None], c[None], far, pull=0.3, slack=0.1)
        for e, c in zip(error, stretch, strict=True)
    ]
    best = stretch[int(torch.tensor(losses).argmin())]
    assert best.item() == pytest.approx(math.log(1 / speed), abs=0.01)


def test_near_pairs_are_pulled_in_proportion_to_their_distance() -> None:
    stretch, no_error = torch.ones(1), torch.zeros(1)
    pulled = [
        -loss(no_error, stretch, torch.tensor([d]), pull=1.0, slack=0.1) for d in (0.125, 0.25, 1)
    ]
    assert pulled == pytest.approx([0.5, 1, 1])


def test_bounded_slack_costs_at_most_1_and_steepness_what_it_did() -> None:
    slow = torch.tensor([1.0, 0.9, 0.5, 0.01, 0.0], dtype=torch.float64)  # S* |grad T|
    nothing = torch.zeros(1, dtype=torch.float64)
    for steepness in slow:
        error = with_bounded_slack(steepness.clamp_min(1e-12).log())[None]
        cost = loss(error, nothing, nothing, pull=0.0, slack=1.0)
        assert cost == pytest.approx(1 - steepness.item(), abs=1e-9)
    steep = torch.linspace(0.01, 3, 50, dtype=torch.float64)
    assert torch.equal(with_bounded_slack(steep), steep)
