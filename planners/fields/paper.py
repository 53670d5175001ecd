"""NTFields as published: network, data, loss and schedule of Ni and Qureshi (ICLR 2023).

Where the text is silent: the learning rate is ours, and residual blocks are two ELU layers. The
batch size, the shares near obstacles, sigmoid(0.1 y) and the rollback are the released program's,
whose batch norm in the w-space encoder is left out, as in the text.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from envs import Environment
from envs.problem import Array
from envs.seeding import stream
from planners.fields.layers import MaxMin, elu
from planners.fields.networks import WSpaceEncoder
from planners.fields.physics import eikonal_loss, predicted_speed
from planners.learning.normalizer import Normalizer
from planners.learning.training_loop import Batch, as_float32, ramp

_C_WIDTH, _W_WIDTH, _WIDTH = 256, 128, 512
_CHUNK = 2**17  # candidates for pairs drawn at once
_NEAREST = 0.01  # closer pairs, by extent, weigh no more: else a handful would fill the batches


class PaperField(nn.Module):
    """c-space encoder, w-space encoder, max and min, time field generator (appendix B).

    Derivatives by the configurations are PyTorch's own; training through them takes a second
    backward pass.

    Args:
        dimension: d.
        grid: occupancy (v, v, v) of the workspace.

    Attributes:
        workspace_weight: lambda, by which the w-space encoder's features count.
    """

    def __init__(self, dimension: int, grid: Tensor) -> None:
        super().__init__()
        self.workspace_weight: Tensor
        self.register_buffer("workspace_weight", torch.ones(()), persistent=False)
        self.encoder = nn.Sequential(
            nn.Linear(dimension, 32),
            nn.ELU(),
            nn.Linear(32, _C_WIDTH),
            nn.ELU(),
            *(_Residual(_C_WIDTH) for _ in range(4)),
            nn.Linear(_C_WIDTH, _C_WIDTH),
        )
        self.workspace = WSpaceEncoder(_W_WIDTH, grid, elu)
        self.operator = MaxMin()
        self.generator = nn.Sequential(
            nn.Linear(2 * (_C_WIDTH + _W_WIDTH), _WIDTH),
            nn.ELU(),
            *(_Residual(_WIDTH) for _ in range(6)),
            nn.Linear(_WIDTH, 32),
            nn.ELU(),
            nn.Linear(32, 1),
        )

    def tau(self, start: Tensor, goal: Tensor) -> Tensor:
        """tau (n,) in 0..1 between starts and goals (n, d)."""
        combined, _ = self.operator.combine(self._features(start), self._features(goal))
        return torch.sigmoid(0.1 * self.generator(combined)).squeeze(-1)

    def with_slopes(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """tau (n,) and its gradients (n, d) at both ends."""
        with torch.enable_grad():
            ends = [q.detach().requires_grad_() for q in (start, goal)]
            tau = self.tau(*ends)
            at_start, at_goal = torch.autograd.grad(tau.sum(), ends, create_graph=self.training)
        return tau, at_start, at_goal

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Stretch -log tau (n,) and its gradients (n, d), as `networks.TimeField`."""
        tau, *slopes = self.with_slopes(start, goal)
        at_start, at_goal = (-slope / tau[:, None] for slope in slopes)
        return -tau.log(), at_start, at_goal

    def _features(self, q: Tensor) -> Tensor:
        local, _ = self.workspace(q, q.new_zeros(0, 3))
        return torch.cat([self.encoder(q), self.workspace_weight * local], dim=-1)


class _Residual(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Linear(width, width)
        self.second = nn.Linear(width, width)

    def forward(self, x: Tensor) -> Tensor:
        return functional.elu(x + self.second(functional.elu(self.first(x))))


@dataclass
class PublishedPhysics:
    """Equation 4 on a fixed set of pairs, drawn with weights inverse to their distance.

    Starts lie where the speed model changes (d_min <= clearance <= d_max), goals anywhere. lambda
    rises from 0 to 1 between two shares of the training: epochs 500 and 1000 of 2000.
    """

    pairs: int = 1_000_000
    batch: int = 10_000
    lambda_from: float = 0.25
    lambda_to: float = 0.5

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        begin = monotonic()
        starts, goals, clearance = sample_pairs(env, stream("field pairs", seed), self.pairs)
        scale = Normalizer.of(env)
        speeds = env.speed_model(clearance), env.speed(goals)
        self._samples = as_float32(scale.normalize(starts), scale.normalize(goals), *speeds)
        distance = np.linalg.norm(goals - starts, axis=1)
        weight = 1 / np.maximum(distance, _NEAREST * scale.extent)
        self._cumulative = np.cumsum(weight / weight.sum())
        return monotonic() - begin

    def draw(self, rng: np.random.Generator) -> Batch:
        picked = np.searchsorted(self._cumulative, rng.random(self.batch))
        chosen = torch.from_numpy(picked.clip(max=self.pairs - 1))
        return tuple(part[chosen] for part in self._samples)

    def loss(self, net: PaperField, batch: Batch, share: float) -> Tensor:
        starts, goals, at_start, at_goal = batch
        net.workspace_weight.fill_(ramp(share, self.lambda_from, self.lambda_to))
        tau, by_start, by_goal = net.with_slopes(starts, goals)
        offset = starts - goals
        return (
            eikonal_loss(at_start, predicted_speed(tau, offset, by_start))
            + eikonal_loss(at_goal, predicted_speed(tau, -offset, by_goal))
        ).mean()


def sample_pairs(env: Environment, rng: np.random.Generator, n: int) -> tuple[Array, Array, Array]:
    """Starts and goals (n, d) within the bounds, and the starts' clearances (n,): starts uniform
    where d_min <= clearance <= d_max, goals at a uniform random length in a random direction."""
    reach = float(np.linalg.norm(env.upper - env.lower))
    model = env.speed_model
    found: list[tuple[Array, Array, Array]] = []
    while sum(len(starts) for starts, *_ in found) < n:
        starts = rng.uniform(env.lower, env.upper, (_CHUNK, env.dimension))
        direction = rng.normal(size=starts.shape)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        goals = starts + reach * rng.random((_CHUNK, 1)) * direction
        inside = env.contains(goals)
        starts, goals = starts[inside], goals[inside]
        clearance = env.clearance(starts)
        near = (clearance >= model.d_min) & (clearance <= model.d_max)
        found.append((starts[near], goals[near], clearance[near]))
    starts, goals, clearance = (np.concatenate(part)[:n] for part in zip(*found, strict=True))
    return starts, goals, clearance
