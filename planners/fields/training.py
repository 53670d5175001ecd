"""Training a time field as the largest subsolution of the Eikonal equation."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from planners.fields.networks import TimeField
from planners.fields.physics import log_slowness_error, subsolution_loss
from planners.fields.sampling import GroupPlan, GroupSampler


@dataclass(frozen=True)
class Recipe:
    """How a field is trained. Shares are of the training's steps.

    `pull` and `slack_weight` (see `subsolution_loss`) go from their first to their last value
    between `anneal_from` and `anneal_to`, the latter in log scale; neither ever becomes neutral,
    or the field would settle on one of the many lesser solutions.
    """

    steps: int = 3000
    learning_rate: float = 2e-3
    warm_up_steps: int = 200
    last_rate_share: float = 0.02
    gradient_limit: float = 1.0
    averaging: float = 0.999
    pull: tuple[float, float] = (0.3, 0.1)
    slack_weight: tuple[float, float] = (0.1, 0.2)
    anneal_from: float = 0.3
    anneal_to: float = 0.8

    def rate(self, step: int) -> float:
        """The learning rate of a step: linear warm-up, then cosine decay."""
        cosine = 0.5 * (1 + math.cos(math.pi * step / self.steps))
        decay = self.last_rate_share + (1 - self.last_rate_share) * cosine
        return self.learning_rate * min(1.0, (step + 1) / self.warm_up_steps) * decay

    def weights(self, step: int) -> tuple[float, float]:
        """`pull` and `slack_weight` of a step."""
        span = self.anneal_to - self.anneal_from
        u = min(max((step / self.steps - self.anneal_from) / span, 0.0), 1.0)
        pull = self.pull[0] + u * (self.pull[1] - self.pull[0])
        slack = self.slack_weight[0] * (self.slack_weight[1] / self.slack_weight[0]) ** u
        return pull, slack


def group_loss(
    net: TimeField, points: Tensor, log_speed: Tensor, plan: GroupPlan, pull: float, slack: float
) -> Tensor:
    """The loss over all pairs of starts and goals of each group, at both ends.

    Args:
        points: (g, starts + goals, d), in the networks' space.
        log_speed: (g, starts + goals).
    """
    starts, goals = points[:, : plan.starts], points[:, plan.starts :]
    stretch, at_start, at_goal = net.all_pairs(starts, goals)
    offset = starts[:, :, None] - goals[:, None] + 1e-6  # never zero
    errors = [
        log_slowness_error(log_speed[:, : plan.starts, None], stretch, offset, at_start),
        log_slowness_error(log_speed[:, None, plan.starts :], stretch, -offset, at_goal),
    ]
    return subsolution_loss(torch.stack(errors), stretch, pull, slack)


def train(
    net: TimeField,
    sampler: GroupSampler,
    plan: GroupPlan,
    recipe: Recipe,
    seed: int,
    report: Callable[[int, float], None] = lambda step, loss: None,
) -> TimeField:
    """Trains `net` in place and gives the average of its weights over the later steps.

    Args:
        report: is told the step and its loss.
    """
    rng = np.random.default_rng([seed, 1])
    average = deepcopy(net)
    optimiser = torch.optim.AdamW(net.parameters(), betas=(0.9, 0.99), weight_decay=0.0)
    for step in range(recipe.steps):
        points, log_speed = (torch.from_numpy(a.astype(np.float32)) for a in sampler.draw(rng))
        for group in optimiser.param_groups:
            group["lr"] = recipe.rate(step)
        optimiser.zero_grad()
        loss = group_loss(net, points, log_speed, plan, *recipe.weights(step))
        loss.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(net.parameters(), recipe.gradient_limit)
        optimiser.step()
        keep = min(recipe.averaging, (step + 1) / (step + 10))
        with torch.no_grad():
            for mean, now in zip(average.parameters(), net.parameters(), strict=True):
                mean.lerp_(now, 1 - keep)
        report(step, loss.item())
    return average
