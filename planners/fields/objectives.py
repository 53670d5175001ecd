"""What fields are trained on: each objective with the data that its method allows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from envs import Environment
from envs.problem import Array
from planners.fields.clearance_field import clearance_map_of
from planners.fields.labels import LabelPlan, make_labels
from planners.fields.networks import TimeField
from planners.fields.physics import (
    GroupPlan,
    GroupSampler,
    NearSurfaces,
    Space,
    in_balls,
    log_slowness_error,
    steepness_along,
    subsolution_loss,
    with_bounded_slack,
)
from planners.learning.training_loop import Batch, Objective, as_float32, ramp


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
        step = starts[:, :, None] - goals[:, None]
        offset = net.shape.circles.shortest(step) + 1e-6  # never zero
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
class LargestSubsolutionAround(LargestSubsolution):
    """`LargestSubsolution` where coordinates wrap.

    The distance of two places falls again beyond half a turn, and so does an untrained T, up to
    whatever is in the way: a subsolution there, but not the largest, which rises all the way round.
    Between the two are fields that do not rise at all, and equation 4 would have these cost
    without bound. So slack costs no more than 1, and T is pulled up by more.
    """

    pull: tuple[float, float] = (1.0, 0.07)

    def _errors(self, net: TimeField, batch: Batch) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        errors, log_speeds, stretch, distance = super()._errors(net, batch)
        return with_bounded_slack(errors), log_speeds, stretch, distance


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
        labels = self._labels
        source = rng.integers(len(labels.sources), size=self.sources)
        goal = rng.integers(labels.goals.shape[1], size=(self.sources, self.goals))
        pick = source[:, None], goal
        return as_float32(labels.sources[source], labels.goals[pick], labels.stretch[pick])

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


@dataclass
class LargestSubsolutionInRooms(LargestSubsolution):
    """`LargestSubsolution` among points that are free, bounded along straight lines as well.

    A network's T may jump between two places and still have the right slope wherever that is
    asked, as long as the jump is narrow; and to jump pays, since T is pulled up. But no field with
    |grad T| S* <= 1 can rise by more between two places than what it takes to go straight from one
    to the other. That holds however far apart they are if nothing is in the way, and it takes
    speeds only. So a group has starts close to each other, and goals.

    Pairs with something in between are pulled up with their full weight, however close they are.

    Attributes:
        straight_weight: of these bounds.
        slope_weight: of the Eikonal equation at points.
        same_ball: share of groups with starts and goals in one place.
    """

    plan: GroupPlan = field(
        default_factory=lambda: GroupPlan(
            groups=64, starts=4, goals=4, near=NearSurfaces(0.5, nearest=0.0, farthest=1.1)
        )
    )
    pull: tuple[float, float] = (0.3, 0.05)
    straight_weight: float = 1.0
    slope_weight: float = 0.3
    same_ball: float = 0.3

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        self._space = Space.of(env)
        self._clearances = clearance_map_of(env)
        return 0.0

    def draw(self, rng: np.random.Generator) -> Batch:
        """Points (g, s + t, d), their log speeds (g, s + t), and the times on straight lines
        between all points of a group (g, s + t, s + t)."""
        plan = self.plan
        one = self._one_ball(rng, round(self.same_ball * plan.groups), plan.points)
        apart = plan.groups - len(one[0])
        starts, goals = (
            self._one_ball(rng, apart, plan.starts),
            self._one_ball(rng, apart, plan.goals),
        )
        points, clearance = (
            np.concatenate([a, np.concatenate([b, c], axis=1)])
            for a, b, c in zip(one, starts, goals, strict=True)
        )
        times = self._clearances.straight_times(points[:, :, None], points[:, None])
        return as_float32(points, np.log(self._space.speed(clearance)), times)

    def loss(self, net: TimeField, batch: Batch, share: float) -> Tensor:
        points, log_speed, times = batch
        n = self.plan.starts
        errors, _, stretch, distance = self._errors(net, (points, log_speed))
        direct = times[:, :n, n:]
        pull, slack_weight = self.weights(share)
        reach = torch.where(direct.isinf(), torch.inf, distance)
        sloped = subsolution_loss(
            errors.clamp(-4, 8),
            stretch,
            reach,
            pull=pull / self.slope_weight,
            pull_distance=self.pull_distance,
            slack_weight=slack_weight,
        )
        arrival = stretch.exp() * distance
        rises = (
            (arrival[:, :, None] - arrival[:, None], times[:, :n, :n, None]),
            (arrival[:, :, :, None] - arrival[:, :, None], times[:, None, n:, n:]),
            (arrival, direct),
        )
        straight = sum((steepness_along(*rise) for rise in rises), torch.zeros(()))
        return self.slope_weight * sloped + self.straight_weight * straight

    def _one_ball(self, rng: np.random.Generator, groups: int, n: int) -> tuple[Array, Array]:
        """Free points (groups, n, d) in balls, some near surfaces, and their clearances."""
        plan, space = self.plan, self._space
        centers = space.uniform(rng, groups, 1)
        drawn = in_balls(rng, centers, plan, n * (1 + plan.candidates))
        drawn = np.clip(drawn, *space.limits)
        clearance = space.clearance(drawn.reshape(-1, drawn.shape[-1])).reshape(drawn.shape[:2])
        near = plan.near.holds(clearance) & (rng.random(clearance.shape) < plan.near.share)
        rank = rng.random(clearance.shape) - near + 2 * (clearance <= space.least_clearance)
        chosen = np.argsort(rank, axis=1)[:, :n]
        points = np.take_along_axis(drawn, chosen[..., None], axis=1)
        found = np.take_along_axis(clearance, chosen, axis=1)
        walled = found <= space.least_clearance  # too few free ones: the center is
        points = np.where(walled[..., None], centers, points)
        at_center = space.clearance(centers[:, 0])[:, None]
        return points, np.where(walled, at_center, found)
