"""What fields are trained on, each objective with the data that its method allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from envs import Environment
from planners.fields.labels import LabelPlan, make_labels
from planners.fields.networks import TimeField
from planners.fields.physics import log_slowness_error, subsolution_loss
from planners.fields.sampling import GroupPlan, GroupSampler, Space
from planners.training import Batch, Objective, as_float32, ramp


@dataclass
class _Groups:
    """Groups of points with their log speeds: what physics-informed objectives see."""

    plan: GroupPlan = field(default_factory=GroupPlan)

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._sampler = GroupSampler(Space.of(env), self.plan)
        return 0.0

    def draw(self, rng: np.random.Generator) -> Batch:
        return as_float32(*self._sampler.draw(rng))

    def _errors(self, net: TimeField, batch: Batch) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Errors (2, g, s, t) and log speeds (2, g, s, t) at both ends of all pairs, and their
        stretch and distance (g, s, t)."""
        points, log_speed = batch
        n = self.plan.starts
        starts, goals = points[:, :n], points[:, n:]
        stretch, at_start, at_goal = net.all_pairs(starts, goals)
        offset = starts[:, :, None] - goals[:, None] + 1e-6  # never zero
        speeds = torch.stack(
            [
                log_speed[:, :n, None].expand_as(stretch),
                log_speed[:, None, n:].expand_as(stretch),
            ]
        )
        errors = torch.stack(
            [
                log_slowness_error(speeds[0], stretch, offset, at_start),
                log_slowness_error(speeds[1], stretch, -offset, at_goal),
            ]
        )
        return errors, speeds, stretch, offset.norm(dim=-1)


@dataclass
class LargestSubsolution(_Groups):
    """NTFields' physics, with the travel time as the largest subsolution.

    `pull` and `slack_weight` (see `subsolution_loss`) go from their first to their last value
    between the shares `anneal_from` and `anneal_to` of the training, the latter in log scale. By
    then the field is near the largest solution, and slack costs as much as steepness: if it stayed
    cheap, the field would be too fast near obstacles, and paths would keep less clearance.
    """

    pull: tuple[float, float] = (0.3, 0.07)
    pull_distance: float = 0.25
    slack_weight: tuple[float, float] = (0.1, 1.0)
    anneal_from: float = 0.3
    anneal_to: float = 0.8

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        errors, _, stretch, distance = self._errors(net, batch)
        pull, slack_weight = self.weights(share)
        return subsolution_loss(
            errors,
            stretch,
            distance,
            pull=pull,
            pull_distance=self.pull_distance,
            slack_weight=slack_weight,
        )

    def weights(self, share: float) -> tuple[float, float]:
        """`pull` and `slack_weight` at a share of the training."""
        u = ramp(share, self.anneal_from, self.anneal_to)
        pull = self.pull[0] + u * (self.pull[1] - self.pull[0])
        slack = self.slack_weight[0] * (self.slack_weight[1] / self.slack_weight[0]) ** u
        return pull, slack


@dataclass
class SpeedRegression(_Groups):
    """EikoNet's loss: the mean squared error of the predicted speed."""

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        errors, log_speeds, _, _ = self._errors(net, batch)
        # error = log(S* |grad T|) = log S* - log S; speeds far too high would drown the rest.
        predicted = (log_speeds - errors).clamp(max=1.0).exp()
        return ((predicted - log_speeds.exp()) ** 2).mean()


@dataclass
class Regression:
    """IEF3D's: arrival times by fast marching, as relative errors (L1 of log T)."""

    plan: LabelPlan = field(default_factory=LabelPlan)
    sources: int = 64
    goals: int = 32

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._labels, seconds = make_labels(env, self.plan, seed, kept, report)
        return seconds

    def draw(self, rng: np.random.Generator) -> Batch:
        held = self._labels
        source = rng.integers(len(held.sources), size=self.sources)
        goal = rng.integers(held.goals.shape[1], size=(self.sources, self.goals))
        pick = source[:, None], goal
        return as_float32(held.sources[source], held.goals[pick], held.stretch[pick])

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        sources, goals, wanted = batch
        return functional.l1_loss(net.stretch(sources, goals), wanted)


@dataclass
class WithWorkspace:
    """An objective with a schedule of lambda, which brings in the w-space encoder.

    lambda rises from 0 to 1 between two shares of the training; the paper's are 500 and 1000 of
    2000 epochs.
    """

    objective: Objective
    lambda_from: float = 0.25
    lambda_to: float = 0.5

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        return self.objective.prepare(env, seed, kept, report)

    def draw(self, rng: np.random.Generator) -> Batch:
        return self.objective.draw(rng)

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        net.workspace_weight.fill_(ramp(share, self.lambda_from, self.lambda_to))
        return self.objective.loss(net, batch, share)
