"""The physics of time fields: what a network's output means, when it is right, and the training
points, configurations with their speeds, never a path or a travel time.

Equation numbers are those of Ni and Qureshi, "NTFields: Neural Time Fields for Physics-Informed
Robot Motion Planning", ICLR 2023. Configurations are in the normalised space of the networks;
leading axes are free, the last one of vectors is d.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from envs import Environment
from envs.problem import Array
from planners.fields.clearance_field import normalized_clearance
from planners.learning.circles import NO_CIRCLES, Circles
from planners.learning.normalizer import Normalizer


def predicted_speed(tau: Tensor, offset: Tensor, gradient: Tensor) -> Tensor:
    """The speed at one end that a factorised time field implies  (equation 2).

    Args:
        tau: (...).
        offset: (..., d), this end minus the other.
        gradient: (..., d), of tau with respect to this end.
    """
    squared = (
        tau**2 + (offset**2).sum(-1) * (gradient**2).sum(-1) - 2 * tau * (offset * gradient).sum(-1)
    )
    return tau**2 / squared.clamp_min(torch.finfo(tau.dtype).tiny).sqrt()


def eikonal_loss(speed: Tensor, predicted: Tensor) -> Tensor:
    """|1 - sqrt(S* / S)| + |1 - sqrt(S / S*)| at one end  (equation 4)."""
    ratio = (speed / predicted).sqrt()
    return (1 - ratio).abs() + (1 - 1 / ratio).abs()


def log_slowness_error(log_speed: Tensor, stretch: Tensor, offset: Tensor, slope: Tensor) -> Tensor:
    """r = log(S* |grad T|) at one end, for T = |qs - qg| exp(stretch).

    0 where the Eikonal equation holds, positive where T rises too steeply (T would be above the
    true time) and negative where it is slack. In these terms equation 4 is 2 sinh(|r| / 2).

    Args:
        log_speed: (...), log S* at this end.
        stretch: (...), -log tau.
        offset: (..., d), this end minus the other; not zero.
        slope: (..., d), gradient of stretch with respect to this end.
    """
    distance = offset.norm(dim=-1, keepdim=True)
    steepness: Tensor = (offset / distance + distance * slope).norm(dim=-1)
    return log_speed + stretch + steepness.clamp_min(1e-12).log()


def with_bounded_slack(error: Tensor) -> Tensor:
    """Errors as of `log_slowness_error`, of which those below 0 are so much nearer to it that in
    equation 4 they cost 1 - S* |grad T|: as much where T is hardly slack, and at most 1.
    """
    slack = 1 - error.clamp_max(0.0).exp()
    return torch.where(error > 0, error, -2 * torch.asinh(slack / 2))


def steepness_along(rise: Tensor, time: Tensor) -> Tensor:
    """The mean cost of rises of T that are steeper than the speeds on the way allow.

    For a subsolution |T(a, g) - T(b, g)| is at most the integral of 1 / S* along any way from a to
    b. The cost is 2 sinh(r / 2), r = log(|rise| / time), as in `log_slowness_error`; what rises
    less costs nothing.

    Args:
        rise: (...), T at one place minus T at another.
        time: (...), of going from one to the other straight; infinite, and left out, if something
            is in the way. Places so close that it is hardly above 0 are left out as well.
    """
    rise = rise.abs()
    time = time.expand_as(rise)
    counts = time.isfinite() & (time > 1e-4)
    # log(1) where it does not count, as the gradient of what is masked must be finite
    ratio = torch.where(counts, rise, 1.0) / torch.where(counts, time, 1.0)
    excess = ratio.clamp_min(1.0).log().clamp_max(6.0)
    return 2 * torch.sinh(excess / 2).sum() / counts.sum().clamp_min(1)


def subsolution_loss(
    error: Tensor,
    stretch: Tensor,
    distance: Tensor,
    *,
    pull: float,
    pull_distance: float,
    slack_weight: float,
) -> Tensor:
    """The loss that has the *largest* subsolution of the Eikonal equation as its minimum.

    Many fields satisfy |grad T| S* = 1 almost everywhere; every one of them is at most the true
    travel time, which is the largest field with |grad T| S* <= 1 (the viscosity solution). So
    steepness above 1 costs as in equation 4, slack costs `slack_weight` times that, and
    `stretch` = log(T / |qs - qg|) is pulled up.

    Near pairs are pulled in proportion to their distance. Else a jump of T close to the goal would
    pay: it costs in a small ball only, but raises the stretch of all near pairs a lot.

    Args:
        error: (..., n), `log_slowness_error` at any ends.
        stretch: (n) of the same pairs.
        distance: (n) |qs - qg|.
        pull: weight of the mean stretch.
        pull_distance: beyond which pairs are pulled with their full weight.
        slack_weight: in 0..1.
    """
    weight = torch.where(error > 0, 1.0, slack_weight)
    pulled = (distance / pull_distance).clamp(max=1) * stretch
    return (weight * 2 * torch.sinh(error.abs() / 2)).mean() - pull * pulled.mean()


@dataclass(frozen=True)
class NearSurfaces:
    """Which points count as near the surface of obstacles, and how many are drawn there.

    Attributes:
        share: of all points.
        nearest, farthest: clearances, by d_max of the speed model.
    """

    share: float = 0.3
    nearest: float = -0.1
    farthest: float = 0.9

    def holds(self, clearance: Array) -> NDArray[np.bool_]:
        """Which clearances, by d_max, are near, in their shape."""
        near: NDArray[np.bool_] = (clearance > self.nearest) & (clearance < self.farthest)
        return near


@dataclass(frozen=True)
class Space:
    """What samplers see of an environment.

    Attributes:
        lower, upper: (d,) corners of what holds all of free space, in the networks' space.
        clearance: (n, d) in the networks' space -> (n,), by d_max of the speed model.
        speed: clearances of any shape, by d_max, to speeds in 0..1.
        least_clearance: by d_max, of points that are drawn at all. In rooms 0: what a field would
            be within walls matters to no path, and is hard to learn.
        circles: which coordinates wrap.
    """

    lower: Array
    upper: Array
    clearance: Callable[[Array], Array]
    speed: Callable[[Array], Array]
    least_clearance: float = -math.inf
    circles: Circles = NO_CIRCLES

    @staticmethod
    def of(env: Environment) -> Space:
        """That of an environment."""
        scale = Normalizer.of(env)
        d_max = env.speed_model.d_max
        free = env.sampling_space
        return Space(
            scale.normalize(free.lower),
            scale.normalize(free.upper),
            normalized_clearance(env),
            lambda clearance: env.speed_model(clearance * d_max),
            0.0 if env.is_interior else -math.inf,
            scale.circles,
        )

    @property
    def limits(self) -> tuple[Array, Array]:
        """Between which points are kept, (d,) each: the corners, but where coordinates wrap."""
        return self.circles.limits(self.lower, self.upper)

    def uniform(self, rng: np.random.Generator, *shape: int) -> Array:
        """Points (*shape, d) anywhere between the corners where they may be drawn."""
        points = rng.uniform(self.lower, self.upper, (math.prod(shape), len(self.lower)))
        if self.least_clearance > -math.inf:
            left = np.flatnonzero(self.clearance(points) <= self.least_clearance)
            while len(left) > 0:
                points[left] = rng.uniform(self.lower, self.upper, (len(left), len(self.lower)))
                left = left[self.clearance(points[left]) <= self.least_clearance]
        return points.reshape(*shape, len(self.lower))


@dataclass(frozen=True)
class GroupPlan:
    """How groups of points are drawn.

    A group is trained on all pairs of its starts and goals: more pairs for nearly the same cost, as
    long as groups are small. Half of the groups lie in balls of log-uniform radius round a point,
    so that near and far pairs count alike; the others spread over the whole space. Lengths are in
    the networks' space.
    """

    groups: int = 128
    starts: int = 3
    goals: int = 3
    local_share: float = 0.5
    least_radius: float = 0.01
    greatest_radius: float = 0.5
    near: NearSurfaces = NearSurfaces(0.5, farthest=1.1)
    candidates: int = 3
    """Further points drawn for each, among which those near a surface are sought."""

    @property
    def points(self) -> int:
        """In a group."""
        return self.starts + self.goals


class PointSampler:
    """Draws configurations, some of them near surfaces."""

    _CANDIDATES = 8  # drawn for each near point, among which near ones are sought

    def __init__(self, space: Space, near: NearSurfaces = NearSurfaces()) -> None:
        self._space = space
        self._near = near

    def draw(self, rng: np.random.Generator, n: int) -> Array:
        """Points (n, d) in random order, in the networks' space."""
        wanted = round(self._near.share * n)
        candidates = self._space.uniform(rng, self._CANDIDATES * wanted)
        near = candidates[self._near.holds(self._space.clearance(candidates))][:wanted]
        return rng.permutation(np.concatenate([near, self._space.uniform(rng, n - len(near))]))


def in_balls(rng: np.random.Generator, centers: Array, plan: GroupPlan, n: int) -> Array:
    """Points (g, n, d), uniform in balls of log-uniform radius about `centers` (g, 1, d)."""
    groups, _, d = centers.shape
    ends = math.log(plan.least_radius), math.log(plan.greatest_radius)
    radii = np.exp(rng.uniform(*ends, (groups, 1, 1)))
    direction = rng.normal(size=(groups, n, d))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    points: Array = centers + radii * direction * rng.random((groups, n, 1)) ** (1 / d)
    return points


class GroupSampler:
    """Draws groups of configurations with the speed at each."""

    def __init__(self, space: Space, plan: GroupPlan) -> None:
        self._space = space
        self._plan = plan

    def draw(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Points (groups, starts + goals, d) and their log speeds (groups, starts + goals)."""
        plan = self._plan
        drawn = self._candidates(rng, plan.points * (1 + plan.candidates))
        flat = drawn.reshape(-1, drawn.shape[-1])
        clearance = self._space.clearance(flat).reshape(drawn.shape[:2])
        chosen = self._choose(rng, clearance)
        points = np.take_along_axis(drawn, chosen[..., None], axis=1)
        speeds = self._space.speed(np.take_along_axis(clearance, chosen, axis=1))
        return points, np.log(speeds)

    def _candidates(self, rng: np.random.Generator, n: int) -> Array:
        plan, space = self._plan, self._space
        local = round(plan.local_share * plan.groups)
        centers = space.uniform(rng, local, 1)
        balls = in_balls(rng, centers, plan, n)
        spread = space.uniform(rng, plan.groups - local, n)
        return np.concatenate([np.clip(balls, *space.limits), spread])

    def _choose(self, rng: np.random.Generator, clearance: Array) -> NDArray[np.int64]:
        """Indices (groups, points): the first candidates, some replaced by ones near a surface."""
        plan = self._plan
        spare = clearance[:, plan.points :]
        near = plan.near.holds(spare)
        order = np.argsort(np.where(near, rng.random(near.shape), 2.0), axis=1)[:, : plan.points]
        order = rng.permuted(order, axis=1)  # else starts would get more of the near ones
        replace = rng.random(order.shape) < plan.near.share
        replace &= np.take_along_axis(near, order, axis=1)
        own = np.broadcast_to(np.arange(plan.points), order.shape)
        replaced: NDArray[np.int64] = np.where(replace, order + plan.points, own)
        return replaced
