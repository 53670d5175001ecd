"""A network's arithmetic for one pair, compiled: forward pass, Jacobian and reverse pass.

The same mathematics as `networks.TimeField`, for the default shape: smooth symmetric operator,
bounded stretch, no learned w-space encoder; or as `metric_field.MetricField`. A call of PyTorch
costs more than the arithmetic of a small network for two points, and an attempt makes thousands.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import types
from numba.extending import overload
from numpy.typing import NDArray

from envs.compiled import njit_cached_quick
from planners.fields.clearance_field import ClearanceField
from planners.fields.dispatch import inputs_at
from planners.fields.laplacian_eigenmaps import ModeArrays
from planners.fields.metric_kernel import MetricNetwork, metric_stretch
from planners.fields.robot_features import ArmClearanceField
from planners.fields.wrapping import CircleArrays, embed

Single = NDArray[np.float32]


class Network(NamedTuple):
    """Weights as they are multiplied from the right; blocks stacked along the first axis. Besides
    the weights what else is asked: modes and clearances, and which coordinates wrap, if any."""

    waves: Single
    first: Single
    first_bias: Single
    hidden: Single
    hidden_bias: Single
    last: Single
    last_bias: Single
    into: Single
    into_bias: Single
    blocks: Single
    blocks_bias: Single
    out: Single
    out_bias: float
    scale: float
    below: float
    opening: float
    smoothing: float
    modes: ModeArrays
    field: ClearanceField | ArmClearanceField
    circles: CircleArrays | None


@njit_cached_quick
def _sine(rows: Any, bias: Any, per_end: int) -> None:
    """In place: sine of each end's row of values, and the chain rule on its Jacobian's rows."""
    for end in range(2):
        at = end * per_end
        for j in range(rows.shape[1]):
            value = rows[at, j] + bias[j]
            rows[at, j] = math.sin(value)
            slope = math.cos(value)
            for k in range(1, per_end):
                rows[at + k, j] *= slope


@njit_cached_quick
def inputs_of_numbers(ends: Any, waves: Any, rows: Any) -> None:
    """Linear and Fourier inputs of both ends (2, d) and their Jacobians, see `CSpaceEncoder`."""
    d = ends.shape[1]
    frequencies = waves.shape[0]
    rows[:] = 0
    # Of each end a row of values, and then one for each coordinate with their derivatives by it:
    # of 2 x they are 2, of sin(2 pi w x) they are 2 pi w cos(2 pi w x).
    for end in range(2):
        at = end * (1 + d)
        for k in range(d):
            rows[at, k] = 2 * ends[end, k]
            rows[at + 1 + k, k] = 2
        for f in range(frequencies):
            phase = np.float32(0)
            for k in range(d):
                phase += waves[f, k] * ends[end, k]
            phase *= np.float32(2 * math.pi)
            sine, cosine = math.sin(phase), math.cos(phase)
            rows[at, d + f] = sine
            rows[at, d + frequencies + f] = cosine
            for k in range(d):
                turn = np.float32(2 * math.pi) * waves[f, k]
                rows[at + 1 + k, d + f] = cosine * turn
                rows[at + 1 + k, d + frequencies + f] = -sine * turn


@njit_cached_quick
def inputs_of_circles(circles: Any, ends: Any, waves: Any, rows: Any) -> None:
    """The same where coordinates wrap: those of the numbers that tell the ends, whose derivatives
    become those by the coordinates by the chain rule."""
    d, e = ends.shape[1], len(circles.told)
    numbers = np.empty((2, e), dtype=np.float32)
    slopes = np.empty_like(numbers)
    for end in range(2):
        embed(circles, ends[end], numbers[end], slopes[end])
    plain = np.empty((2 * (1 + e), e + 2 * len(waves)), dtype=np.float32)
    inputs_of_numbers(numbers, waves, plain)
    rows[:] = 0
    direct = plain.shape[1]
    for end in range(2):
        at, at_plain = end * (1 + d), end * (1 + e)
        rows[at, :direct] = plain[at_plain]
        for j in range(e):
            row = at + 1 + circles.told[j]
            for i in range(direct):
                rows[row, i] += slopes[end, j] * plain[at_plain + 1 + j, i]


def direct_inputs(circles: Any, ends: Any, waves: Any, rows: Any) -> Any:
    """Writes the inputs that are not computed to the first columns, and 0 to the others; how many
    the former are."""


@overload(direct_inputs, inline="always")
def _direct_inputs(circles: Any, ends: Any, waves: Any, rows: Any) -> Any:
    def of_numbers(circles: Any, ends: Any, waves: Any, rows: Any) -> Any:
        inputs_of_numbers(ends, waves, rows)
        return ends.shape[1] + 2 * waves.shape[0]

    def of_circles(circles: Any, ends: Any, waves: Any, rows: Any) -> Any:
        inputs_of_circles(circles, ends, waves, rows)
        return len(circles.told) + 2 * waves.shape[0]

    return of_numbers if isinstance(circles, types.NoneType) else of_circles


@njit_cached_quick
def _inputs(ends: Any, net: Any, rows: Any) -> None:
    """Inputs of both ends and their Jacobians."""
    d = ends.shape[1]
    direct = direct_inputs(net.circles, ends, net.waves, rows)
    if rows.shape[1] > direct:
        more = np.empty((1 + d, rows.shape[1] - direct))
        for end in range(2):
            at = end * (1 + d)
            inputs_at(net.modes, net.field, ends[end].astype(np.float64), more)
            rows[at : at + 1 + d, direct:] = more


@njit_cached_quick
def _squareplus(z: Any, slope: Any) -> None:
    """In place, with the slope."""
    for j in range(len(z)):
        root = math.sqrt(z[j] * z[j] + 1)
        slope[j] = (1 + z[j] / root) / 2
        z[j] = (z[j] + root) / 2


@njit_cached_quick
def pair(ends: Any, gradients: Any, net: Any) -> float:
    """Stretch; its gradients at both ends are written to `gradients` (2, d)."""
    d = ends.shape[1]
    per_end = 1 + d
    inputs = np.empty((2 * per_end, net.first.shape[0]), dtype=np.float32)
    _inputs(ends, net, inputs)
    x = np.dot(inputs, net.first)
    _sine(x, net.first_bias, per_end)
    for block in range(len(net.hidden) // 2):
        y = np.dot(x, net.hidden[2 * block])
        _sine(y, net.hidden_bias[2 * block], per_end)
        y = np.dot(y, net.hidden[2 * block + 1])
        _sine(y, net.hidden_bias[2 * block + 1], per_end)
        x += y
    stretch: float = joined(ends, inputs, np.dot(x, net.last), gradients, net)
    return stretch


def joined(ends: Any, inputs: Any, features: Any, gradients: Any, net: Any) -> Any:
    """Stretch, of both ends' features and Jacobians (2 + 2d, f); gradients as of `pair`."""


@overload(joined)
def _joined(ends: Any, inputs: Any, features: Any, gradients: Any, net: Any) -> Any:
    def generated(ends: Any, inputs: Any, features: Any, gradients: Any, net: Any) -> Any:
        return generated_stretch(ends, inputs, features, gradients, net)

    def measured(ends: Any, inputs: Any, features: Any, gradients: Any, net: Any) -> Any:
        return metric_stretch(ends, features, gradients, net)

    return measured if net.instance_class is MetricNetwork else generated


@njit_cached_quick
def generated_stretch(ends: Any, inputs: Any, features: Any, gradients: Any, net: Any) -> float:
    """See `joined`: that of the generator."""
    d = ends.shape[1]
    per_end = 1 + d
    width = features.shape[1] // 2
    combined = np.empty(2 * width, dtype=np.float32)
    bend = np.empty(width, dtype=np.float32)
    for j in range(width):  # the bias of phi cancels
        difference = features[0, j] - features[per_end, j]
        size = math.sqrt(difference * difference + net.smoothing * net.smoothing)
        combined[j] = size
        bend[j] = difference / size
        psi = width + j
        combined[psi] = features[0, psi] + features[per_end, psi] + 2 * net.last_bias[psi]

    z = np.dot(combined, net.into) + net.into_bias
    slope = np.empty_like(z)
    _squareplus(z, slope)
    slopes = np.empty_like(net.blocks_bias)
    for block in range(len(net.blocks)):
        y = np.dot(z, net.blocks[block]) + net.blocks_bias[block]
        _squareplus(y, slopes[block])
        z += y
    gate = 1 / (1 + math.exp(-(np.dot(z, net.out) + net.out_bias + net.opening)))
    back = net.out * np.float32(net.scale * gate * (1 - gate))
    for block in range(len(net.blocks) - 1, -1, -1):
        back += np.dot(net.blocks[block], back * slopes[block])
    by_combined = np.dot(net.into, back * slope)

    for k in range(d):
        at_start, at_goal = np.float32(0), np.float32(0)
        for j in range(width):
            by_phi = by_combined[j] * bend[j]
            by_psi = by_combined[width + j]
            psi = width + j
            at_start += by_phi * features[1 + k, j] + by_psi * features[1 + k, psi]
            goal_row = per_end + 1 + k
            at_goal += by_psi * features[goal_row, psi] - by_phi * features[goal_row, j]
        gradients[0, k] = at_start
        gradients[1, k] = at_goal
    modes = inputs[:, inputs.shape[1] - net.modes.values.shape[1] :]
    stretch: float = net.scale * gate - net.below + _resistance(ends, modes, gradients)
    return stretch


@njit_cached_quick
def _resistance(ends: Any, modes: Any, gradients: Any) -> float:
    """What modes (2 + 2d, m) add to the stretch, see `networks.TimeField`; and to its gradients."""
    d, count = ends.shape[1], modes.shape[1]
    if count == 0:
        return 0.0
    distance, resistance = 0.0, 0.0
    for k in range(d):
        distance += (ends[0, k] - ends[1, k]) ** 2
    distance = max(math.sqrt(distance), 1e-6)
    for m in range(count):
        resistance += ((modes[0, m] - modes[1 + d, m]) / 2) ** 2
    whole = distance + resistance
    for k in range(d):
        toward = (ends[0, k] - ends[1, k]) / distance
        at_start, at_goal = toward, -toward
        for m in range(count):
            apart = modes[0, m] - modes[1 + d, m]
            at_start += apart * modes[1 + k, m] / 2
            at_goal -= apart * modes[2 + d + k, m] / 2
        gradients[0, k] += at_start / whole - toward / distance
        gradients[1, k] += at_goal / whole + toward / distance
    return math.log(whole / distance)
