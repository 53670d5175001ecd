"""The published network, loss and data."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from envs import Environment
from planners.fields.methods import METHODS, occupancy_of
from planners.fields.paper import PaperField, PublishedPhysics, sample_pairs
from planners.learning.training_loop import Steps, TrainingState, train


@pytest.fixture(scope="module")
def net(c3d: Environment) -> PaperField:
    torch.manual_seed(0)
    return PaperField(3, occupancy_of(c3d))


def test_it_has_the_papers_size(net: PaperField) -> None:
    def weights(module: torch.nn.Module) -> int:
        return sum(p.numel() for p in module.parameters())

    assert weights(net.workspace.convolution) == 16 * 27 + 16
    assert net.workspace.first.in_features == 7 * 17
    assert weights(net.generator) > 6 * 2 * 512**2
    assert 3_000_000 < weights(net) < 5_000_000


def test_it_is_symmetric_bounded_and_knows_its_slopes(net: PaperField) -> None:
    torch.manual_seed(1)
    start, goal = (torch.rand(20, 3) - 0.5 for _ in range(2))
    tau, at_start, at_goal = net.eval().with_slopes(start, goal)
    back, at_goal_back, at_start_back = net.with_slopes(goal, start)
    assert torch.equal(tau, back)
    assert torch.equal(at_start, at_start_back)
    assert torch.equal(at_goal, at_goal_back)
    assert ((tau > 0) & (tau < 1)).all()
    stretch, slope, _ = net(start, goal)
    assert torch.allclose(stretch, -tau.log())
    moved = start.double().requires_grad_()
    as_double = PaperField.tau(net.double(), moved, goal.double())
    [wanted] = torch.autograd.grad((-as_double.log()).sum(), moved)
    net.float()
    assert torch.allclose(slope, wanted.float(), atol=1e-4)


def test_starts_lie_where_speed_changes_and_goals_anywhere(c3d: Environment) -> None:
    starts, goals, clearance = sample_pairs(c3d, np.random.default_rng(2), 5000)
    assert starts.shape == goals.shape == (5000, 3)
    assert clearance == pytest.approx(c3d.clearance(starts))
    assert ((clearance >= 0.2) & (clearance <= 2)).all()
    assert c3d.contains(goals).all()
    assert (c3d.clearance(goals) > 2).any()
    assert (c3d.clearance(goals) < 0).any()


def test_near_pairs_are_drawn_more_often(c3d: Environment, tmp_path: Path) -> None:
    objective = PublishedPhysics(pairs=20_000, batch=20_000)
    objective.prepare(c3d, 0, tmp_path / "kept", lambda share: None)
    all_starts, all_goals, *_ = objective._samples
    starts, goals, at_start, _ = objective.draw(np.random.default_rng(3))
    distance, drawn = ((a - b).norm(dim=-1) for a, b in ((all_starts, all_goals), (starts, goals)))
    weight = 1 / distance.clamp(min=0.01)
    wanted_mean = ((distance * weight).sum() / weight.sum()).item()
    assert drawn.mean().item() == pytest.approx(wanted_mean, rel=0.03)
    assert drawn.mean() < 0.7 * distance.mean()
    wanted = c3d.speed(20 * starts[:100].double().numpy())
    assert at_start[:100].numpy() == pytest.approx(wanted, abs=1e-4)


@pytest.mark.training
def test_its_loss_falls(c3d: Environment, tmp_path: Path) -> None:
    """On a few pairs, seen again and again; on all it takes hours."""
    method = METHODS["ntfields-paper"]
    recipe = replace(method.recipe, warm_up_steps=10, learning_rate=1e-3)
    objective = PublishedPhysics(pairs=64, batch=128, lambda_from=0.0, lambda_to=0.0)
    objective.prepare(c3d, 0, tmp_path / "kept", lambda share: None)
    torch.manual_seed(4)
    state = TrainingState.begin(method.network(c3d), recipe)
    losses: list[float] = []
    train(
        state,
        objective,
        recipe,
        Steps(60),
        seed=0,
        report=lambda state: losses.append(state.latest_loss or 0.0),
    )
    assert np.mean(losses[-5:]) < 0.8 * np.mean(losses[:5])


def test_its_recipe_is_two_thousand_epochs_of_a_million() -> None:
    recipe, objective = METHODS["ntfields-paper"].recipe, METHODS["ntfields-paper"].objective()
    assert isinstance(objective, PublishedPhysics)
    assert recipe.steps * objective.batch == 2000 * objective.pairs
    assert (objective.lambda_from, objective.lambda_to) == (500 / 2000, 1000 / 2000)
    assert recipe.weight_decay == 0.1
