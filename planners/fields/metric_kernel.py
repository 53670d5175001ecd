"""The arithmetic of a metric field for one pair, compiled: see `metric_field`, whose features come
from the same encoder as those of `network_kernel.Network`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_cached_quick
from planners.fields.clearance_field import ClearanceField
from planners.fields.laplacian_eigenmaps import ModeArrays
from planners.fields.robot_features import ArmClearanceField
from planners.fields.wrapping import CircleArrays, apart


class MetricNetwork(NamedTuple):
    """Weights of an encoder as they are multiplied from the right, blocks stacked along the first
    axis, and into how many groups its features are parted. The last layer's bias cancels. `modes`
    and `field` are for computed inputs, as in `network_kernel.Network`."""

    waves: NDArray[np.float32]
    first: NDArray[np.float32]
    first_bias: NDArray[np.float32]
    hidden: NDArray[np.float32]
    hidden_bias: NDArray[np.float32]
    last: NDArray[np.float32]
    groups: int
    modes: ModeArrays
    field: ClearanceField | ArmClearanceField
    circles: CircleArrays | None


@njit_cached_quick
def metric_stretch(ends: Any, features: Any, gradients: Any, net: Any) -> float:
    """Stretch between both ends (2, d), of their features and Jacobians (2 + 2d, f); its gradients
    are written to `gradients` (2, d)."""
    d = ends.shape[1]
    goal = 1 + d  # the row of the goal's features; those of each Jacobian follow
    size = features.shape[1] // net.groups
    total = 0.0
    gradients[:] = 0
    for group in range(net.groups):
        at = group * size
        for j in range(at, at + size):
            if abs(features[0, j] - features[goal, j]) > abs(features[0, at] - features[goal, at]):
                at = j
        difference = features[0, at] - features[goal, at]
        total += abs(difference)
        sign = np.sign(difference)
        for k in range(d):
            gradients[0, k] += sign * features[1 + k, at]
            gradients[1, k] -= sign * features[goal + 1 + k, at]
    time = max(total / net.groups, 1e-9)
    squared = 0.0
    for k in range(d):
        squared += apart(net.circles, ends[0], ends[1], k) ** 2
    squared = max(squared, 1e-12)
    for k in range(d):
        straight = apart(net.circles, ends[0], ends[1], k) / squared
        gradients[0, k] = gradients[0, k] / (net.groups * time) - straight
        gradients[1, k] = gradients[1, k] / (net.groups * time) + straight
    return math.log(time) - math.log(squared) / 2
