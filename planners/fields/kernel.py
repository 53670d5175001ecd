"""One problem at a time, compiled: forward pass, Jacobian, reverse pass and steps in one routine.

The same mathematics as `networks.TimeField` and `execution.descend`, for the default shape: smooth
symmetric operator, bounded stretch, no learned w-space encoder. A call of PyTorch costs more than
the arithmetic of a small network for two points, and an attempt makes thousands.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from planners.fields.execution import Descent
from planners.fields.modes import NO_MODES, Held
from planners.fields.networks import Bound, SineBlock, TimeField
from planners.fields.operators import SmoothSymmetric
from planners.fields.rooms import CLEARANCES, room_inputs
from planners.fields.surroundings import NOWHERE, View, clearance_at, speed_at, uphill

Single = NDArray[np.float32]


class _Network(NamedTuple):
    """Weights as they are multiplied from the right; blocks stacked along the first axis."""

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
    held: Held
    about: View


class CompiledField:
    """A time field for one pair at a time.

    Args:
        net: of the default shape, see `fits`.
    """

    def __init__(self, net: TimeField) -> None:
        encoder, generator = net.encoder, net.generator
        assert isinstance(generator.head, Bound)
        sine_blocks = [block for block in encoder.blocks if isinstance(block, SineBlock)]
        hidden = [layer for block in sine_blocks for layer in (block.first, block.second)]
        blocks = list(generator.blocks)
        self._network = _Network(
            waves=_single(encoder.waves),
            first=_single(encoder.first.weight.T),
            first_bias=_single(encoder.first.bias),
            hidden=np.stack([_single(layer.weight.T) for layer in hidden]),
            hidden_bias=np.stack([_single(layer.bias) for layer in hidden]),
            last=_single(encoder.last.weight.T),
            last_bias=_single(encoder.last.bias),
            into=_single(generator.first.weight.T),
            into_bias=_single(generator.first.bias),
            blocks=np.stack([_single(layer.weight.T) for layer in blocks]),
            blocks_bias=np.stack([_single(layer.bias) for layer in blocks]),
            out=_single(generator.last.weight[0]),
            out_bias=float(generator.last.bias.item()),
            scale=generator.head.scale,
            below=generator.head.below,
            opening=generator.head.opening,
            smoothing=SmoothSymmetric.smoothing,
            held=NO_MODES if net.rooms is None else net.rooms.modes.view,
            about=NOWHERE if net.rooms is None else net.rooms.surroundings.view,
        )

    @staticmethod
    def fits(net: object) -> bool:
        """Whether a network has the shape that is compiled here."""
        return (
            isinstance(net, TimeField)
            and isinstance(net.operator, SmoothSymmetric)
            and net.shape.bounded
            and not net.shape.workspace
        )

    def pair(self, start: Single, goal: Single) -> tuple[float, Single]:
        """Stretch, and its gradients (2, d) at start and goal (d,)."""
        ends = np.stack([start, goal]).astype(np.float32)
        gradients = np.empty_like(ends)
        return float(_pair(ends, gradients, self._network)), gradients

    def descend(
        self, start: Single, goal: Single, lower: Single, upper: Single, descent: Descent
    ) -> Single | None:
        """See `execution.descend`, for one pair (d,)."""
        there, met = self._walk(np.stack([start, goal]), lower, upper, descent)
        if met < 0:
            return None
        return np.concatenate([there[: met + 1, 0], there[met::-1, 1]])

    def after(self, ends: Single, lower: Single, upper: Single, descent: Descent) -> Single:
        """Where both ends (2, d) are in the end, whether they met or not."""
        there, met = self._walk(ends, lower, upper, descent)
        last: Single = there[met]
        return last

    def _walk(
        self, ends: Single, lower: Single, upper: Single, descent: Descent
    ) -> tuple[Single, int]:
        moves = np.array(descent.moves)
        there = np.empty((descent.most_steps + 1, *ends.shape), dtype=np.float32)
        how = (
            *(descent.step, descent.meeting, descent.most_steps),
            *(descent.true_speed, descent.margin),
        )
        ends = ends.astype(np.float32)
        return there, _descend(ends, moves, lower, upper, there, how, self._network)


def _single(weights: Any) -> Single:
    return np.ascontiguousarray(weights.detach().cpu().numpy(), dtype=np.float32)


_jit = numba.njit(cache=True, fastmath=True)


@_jit
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


@_jit
def _inputs(ends: Any, net: Any, rows: Any) -> None:
    """Inputs of both ends and their Jacobians, see `CSpaceEncoder`."""
    d = ends.shape[1]
    waves = net.waves
    frequencies = waves.shape[0]
    direct = d + 2 * frequencies
    rows[:] = 0
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
        if rows.shape[1] > direct:
            more = np.empty((4, rows.shape[1] - direct))
            room_inputs(net.held, net.about, ends[end].astype(np.float64), True, more)
            rows[at : at + 4, direct:] = more


@_jit
def _squareplus(z: Any, slope: Any) -> None:
    """In place, with the slope."""
    for j in range(len(z)):
        root = math.sqrt(z[j] * z[j] + 1)
        slope[j] = (1 + z[j] / root) / 2
        z[j] = (z[j] + root) / 2


@_jit
def _pair(ends: Any, gradients: Any, net: Any) -> float:
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
    features = np.dot(x, net.last)

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
    modes = inputs[:, d + 2 * len(net.waves) + CLEARANCES :]
    stretch: float = net.scale * gate - net.below + _resistance(ends, modes, gradients)
    return stretch


@_jit
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


@_jit
def _descend(
    ends: Any, moves: Any, lower: Any, upper: Any, there: Any, how: Any, network: Any
) -> int:
    """Fills `there` (steps + 1, 2, d) with the ends' positions; the step at which they met, or
    -1."""
    alpha, meeting, most_steps, true_speed, margin = how
    d = ends.shape[1]
    gradients = np.empty_like(ends)
    for step in range(most_steps + 1):
        there[step] = ends
        distance = np.float32(0)
        for k in range(d):
            distance += (ends[0, k] - ends[1, k]) ** 2
        distance = math.sqrt(distance)
        if distance <= meeting and (margin == 0 or _joined(ends, network.about)):
            return step
        ratio = math.exp(_pair(ends, gradients, network))
        square = np.zeros(2, dtype=np.float32)
        for k in range(d):
            toward = (ends[0, k] - ends[1, k]) / distance
            gradients[0, k] = ratio * (toward + distance * gradients[0, k])
            gradients[1, k] = ratio * (-toward + distance * gradients[1, k])
            square[0] += gradients[0, k] ** 2
            square[1] += gradients[1, k] ** 2
        for end in range(2):
            if moves[end]:
                by = alpha / max(square[end], 1e-12)
                if true_speed:
                    about = network.about
                    here = clearance_at(about, ends[end, 0], ends[end, 1], ends[end, 2])
                    pace = max(speed_at(about, here), about.least_speed)
                    by = alpha * pace / max(math.sqrt(square[end]), 1e-6)
                for k in range(d):
                    moved = ends[end, k] - by * gradients[end, k]
                    ends[end, k] = min(max(moved, lower[k]), upper[k])
                if margin > 0:
                    _push_out(ends[end], margin, network.about)
    return -1


@_jit
def _joined(ends: Any, about: Any) -> bool:
    """Whether nothing is in the way between two ends (2, 3)."""
    for s in range(9):
        t = s / 8
        x, y, z = ends[0] + np.float32(t) * (ends[1] - ends[0])
        if clearance_at(about, x, y, z) < 0.02:
            return False
    return True


@_jit
def _push_out(x: Any, margin: float, about: Any) -> None:
    """Moves (3,) uphill until its clearance is about `margin`, as far as three steps allow."""
    slope = np.empty(3)
    for _ in range(3):
        missing = margin - clearance_at(about, x[0], x[1], x[2])
        if missing <= 0:
            return
        uphill(about, x, slope)
        steepness = max(math.sqrt((slope**2).sum()), 1e-3 / about.reach)
        for k in range(3):
            x[k] += missing * about.reach * slope[k] / steepness
