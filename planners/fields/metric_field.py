"""A time field that is a metric by construction, as NTRL has it.

Ni, Pan and Qureshi, "Physics-informed Temporal Difference Metric Learning for Robot Motion
Planning", ICLR 2025: T(a, b) = D(f(a), f(b)), where D is the sum, over groups of features, of the
largest absolute difference in a group. That is a metric of features, so that T is symmetric, 0 from
a place to itself, and never more than by way of a third place.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from planners.fields.computed_inputs import ComputedInputs
from planners.fields.layers import CSpaceEncoder, FieldShape, every_pair

GROUPS = 4
"""Of the features of a configuration. A group tells T exactly where one of its features grows all
along the fastest way, so it needs many; several groups are smoother than one."""


class MetricField(nn.Module):
    """Arrival times as distances of features; as `networks.TimeField`, the stretch
    log(T / |qs - qg|) between pairs of configurations, and its slopes at both ends.

    Args:
        shape: of the encoder; its features are parted into `GROUPS`.
        inputs: computed ones, for a shape that has such.

    Raises:
        ValueError: there are not as many features in each group; or there are computed inputs and
            the shape has none, or the other way round.
    """

    def __init__(self, shape: FieldShape, inputs: ComputedInputs | None = None) -> None:
        super().__init__()
        if shape.features % GROUPS:
            raise ValueError(f"{shape.features} features cannot be parted into {GROUPS} groups")
        if shape.computed != (0 if inputs is None else inputs.size):
            raise ValueError("computed inputs belong to a shape that has as many")
        self.shape = shape
        self.inputs = inputs
        self.encoder = CSpaceEncoder(shape)

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Stretch (n,) and its gradients (n, d) by starts and goals (n, d)."""
        n = len(start)
        features, jacobian = self.features(torch.cat([start, goal]))
        times = _times(features[:n], jacobian[:, :n], features[n:], jacobian[:, n:])
        return self._stretched(*times, start - goal)

    def times(self, starts: Tensor, goals: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """T between every start and every goal of a group, and its gradients by both ends.

        Args:
            starts, goals: (g, s, d) and (g, t, d).

        Returns:
            (g, s, t), (g, s, t, d) and (g, s, t, d).
        """
        groups, s, d = starts.shape
        features, jacobian = self.features(torch.cat([starts, goals], dim=1).reshape(-1, d))
        return _times(*every_pair(features, jacobian, groups, s))

    def time(self, a: Tensor, b: Tensor) -> Tensor:
        """T alone (...,) between configurations (..., d), each of which is encoded once however
        often it is repeated to fit the other."""
        apart = self._alone(a) - self._alone(b)
        largest: Tensor = _grouped(apart).abs().amax(-1).mean(-1)
        return largest

    def features(self, q: Tensor) -> tuple[Tensor, Tensor]:
        """Features (n, f) of configurations (n, d), and their Jacobian (d, n, f)."""
        return self._encoded(q, torch.eye(q.shape[-1], dtype=q.dtype, device=q.device))

    def _alone(self, q: Tensor) -> Tensor:
        """Features (..., f) of configurations (..., d), without their Jacobian."""
        flat = q.reshape(-1, q.shape[-1])
        features, _ = self._encoded(flat, flat.new_zeros(0, flat.shape[-1]))
        return features.reshape(*q.shape[:-1], -1)

    def _encoded(self, q: Tensor, directions: Tensor) -> tuple[Tensor, Tensor]:
        more = None if self.inputs is None else self.inputs(q, directions)
        found: tuple[Tensor, Tensor] = self.encoder(q, directions, more)
        return found

    def _stretched(
        self, time: Tensor, by_start: Tensor, by_goal: Tensor, offset: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        offset = self.shape.circles.shortest(offset)
        squared = (offset**2).sum(-1, keepdim=True).clamp_min(1e-12)
        time = time.clamp_min(1e-9)
        straight = offset / squared
        return (
            time.log() - squared.squeeze(-1).log() / 2,
            by_start / time[..., None] - straight,
            by_goal / time[..., None] + straight,
        )


def _grouped(features: Tensor) -> Tensor:
    """Features (..., f) as (..., groups, f / groups)."""
    return features.reshape(*features.shape[:-1], GROUPS, -1)


def _times(at_a: Tensor, by_a: Tensor, at_b: Tensor, by_b: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """T (...,) of features (..., f), and its gradients (..., d) by their Jacobians (d, ..., f): the
    mean over groups, which is the sum but for a factor."""
    difference = _grouped(at_a - at_b)
    largest = difference.abs().argmax(-1, keepdim=True)
    signed = difference.gather(-1, largest)
    sign = signed.sign() / GROUPS

    def along(jacobian: Tensor) -> Tensor:
        jacobian = jacobian.expand(-1, *difference.shape[:-2], -1)
        slopes = _grouped(jacobian).gather(-1, largest.expand(*jacobian.shape[:-1], GROUPS, 1))
        return (sign * slopes).sum((-2, -1)).movedim(0, -1)

    return signed.abs().mean((-2, -1)), along(by_a), -along(by_b)
