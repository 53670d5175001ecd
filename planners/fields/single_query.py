"""Following a time field one problem at a time, compiled.

The same as `path_extraction.descend`, and what is done in rooms only: steps at the true speed, ends
pushed out of walls, escapes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from envs.compiled import njit_cached_quick
from envs.problem import Array
from envs.seeding import stream
from envs.speed_model import speed_at
from planners.fields.clearance_field import ClearanceField, straight_times
from planners.fields.dispatch import clearance_of, outward
from planners.fields.laplacian_eigenmaps import ModeArrays
from planners.fields.layers import Bound, CSpaceEncoder, SineBlock, SmoothSymmetric
from planners.fields.metric_field import GROUPS, MetricField
from planners.fields.metric_kernel import MetricNetwork
from planners.fields.network_kernel import Network, Single, pair
from planners.fields.networks import TimeField
from planners.fields.path_extraction import Descent
from planners.fields.wrapping import CircleArrays, apart, between, squared_distance


class CompiledField:
    """A time field for one pair at a time.

    Args:
        net: of the default shape, see `fits`.
    """

    def __init__(self, net: TimeField | MetricField) -> None:
        self._network = _metric(net) if isinstance(net, MetricField) else _generated(net)

    @staticmethod
    def fits(net: object) -> bool:
        """Whether a network has the shape that is compiled here."""
        return isinstance(net, MetricField) or (
            isinstance(net, TimeField)
            and isinstance(net.operator, SmoothSymmetric)
            and net.shape.bounded
            and not net.shape.workspace
        )

    def pair(self, start: Single, goal: Single) -> tuple[float, Single]:
        """Stretch, and its gradients (2, d) at start and goal (d,)."""
        ends = np.stack([start, goal]).astype(np.float32)
        gradients = np.empty_like(ends)
        return float(pair(ends, gradients, self._network)), gradients

    def descend(
        self, start: Single, goal: Single, lower: Single, upper: Single, descent: Descent
    ) -> Single | None:
        """See `path_extraction.descend`, for one pair (d,). Loops are cut out of the path: an end
        that is stuck goes round and round until the other one comes."""
        ends: Single | None = np.stack([start, goal])
        legs = []
        for number in range(descent.escapes + 1):
            if ends is None:
                break
            there, met = self._walk(ends, lower, upper, descent)
            if met >= 0:
                legs.append(there[: met + 1])
                whole = np.concatenate(legs)
                path: Single = np.concatenate([whole[:, 0], whole[::-1, 1]])
                kept = _without_loops(path, 0.5 * descent.step, self._network.circles)
                found: Single = path[kept]
                return found
            legs.append(there)
            ends = self.escaped(there[-1], number) if descent.escapes else None
        return None

    def escaped(self, ends: Single, number: int) -> Single | None:
        """Where an attempt that is stuck at `ends` (2, 3) goes on, see `Descent`, if anywhere; its
        `number` decides which places are tried."""
        ends = ends.astype(np.float32)
        places = _PLACES[number % len(_PLACES)]
        return ends if _escape(ends, places, self._network) else None

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


def _places_to_escape_to() -> Array:
    rng = stream("places to escape to")
    direction = rng.normal(size=(32, 64, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    length: Array = np.exp(rng.uniform(math.log(0.4), math.log(5.0), (32, 64, 1)))
    return direction * length


_PLACES = _places_to_escape_to()
"""About an end, by d_max: 32 times (64, 3)."""


def _single(weights: Any) -> Single:
    return np.ascontiguousarray(weights.detach().cpu().numpy(), dtype=np.float32)


def _encoding(encoder: CSpaceEncoder) -> dict[str, Single]:
    """What a compiled network has of its encoder."""
    sine_blocks = [block for block in encoder.blocks if isinstance(block, SineBlock)]
    hidden = [layer for block in sine_blocks for layer in (block.first, block.second)]
    return {
        "waves": _single(encoder.waves),
        "first": _single(encoder.first.weight.T),
        "first_bias": _single(encoder.first.bias),
        "hidden": np.stack([_single(layer.weight.T) for layer in hidden]),
        "hidden_bias": np.stack([_single(layer.bias) for layer in hidden]),
        "last": _single(encoder.last.weight.T),
    }


def _generated(net: TimeField) -> Network:
    generator = net.generator
    assert isinstance(generator.head, Bound)
    blocks = list(generator.blocks)
    return Network(
        **_encoding(net.encoder),
        last_bias=_single(net.encoder.last.bias),
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
        modes=ModeArrays.none() if net.inputs is None else net.inputs.mode_arrays,
        field=ClearanceField.none() if net.inputs is None else net.inputs.field,
        circles=CircleArrays.of(net.shape.circles, net.shape.dimension),
    )


def _metric(net: MetricField) -> MetricNetwork:
    return MetricNetwork(
        **_encoding(net.encoder),
        groups=GROUPS,
        modes=ModeArrays.none() if net.inputs is None else net.inputs.mode_arrays,
        field=ClearanceField.none() if net.inputs is None else net.inputs.field,
        circles=CircleArrays.of(net.shape.circles, net.shape.dimension),
    )


@njit_cached_quick
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
            distance += apart(network.circles, ends[0], ends[1], k) ** 2
        distance = math.sqrt(distance)
        # Ends in one place have met, however near a wall: there is no direction between them.
        if distance == 0:
            return step
        if distance <= meeting and (margin == 0 or _joined(ends, network)):
            return step
        ratio = math.exp(pair(ends, gradients, network))
        square = np.zeros(2, dtype=np.float32)
        for k in range(d):
            toward = apart(network.circles, ends[0], ends[1], k) / distance
            gradients[0, k] = ratio * (toward + distance * gradients[0, k])
            gradients[1, k] = ratio * (-toward + distance * gradients[1, k])
            square[0] += gradients[0, k] ** 2
            square[1] += gradients[1, k] ** 2
        for end in range(2):
            if moves[end]:
                by = alpha / max(square[end], 1e-12)
                if true_speed:
                    speed = network.field.speed
                    clearance = clearance_of(network.field, ends[end])
                    pace = max(speed_at(speed, clearance), speed.least)
                    by = alpha * pace / max(math.sqrt(square[end]), 1e-6)
                for k in range(d):
                    moved = ends[end, k] - by * gradients[end, k]
                    ends[end, k] = min(max(moved, lower[k]), upper[k])
                if margin > 0:
                    _push_out(ends[end], margin, network.field)
                    for k in range(d):
                        ends[end, k] = min(max(ends[end, k], lower[k]), upper[k])
    return -1


@njit_cached_quick
def _without_loops(path: Any, near: float, circles: Any) -> Any:
    """The places (m,) on a path (k, d) that are left without its loops: where it comes back to
    within `near` of a place after a way of more than six times that, what lies between goes."""
    lengths = np.zeros(len(path))
    for n in range(1, len(path)):
        lengths[n] = lengths[n - 1] + math.sqrt(squared_distance(circles, path[n], path[n - 1]))
    kept = [0]
    while kept[-1] < len(path) - 1:
        here = kept[-1]
        there = here + 1
        for n in range(len(path) - 1, here, -1):
            if lengths[n] - lengths[here] <= 6 * near:
                break
            if squared_distance(circles, path[n], path[here]) <= near * near:
                there = n
                break
        kept.append(there)
    return np.array(kept)


@njit_cached_quick
def _joined(ends: Any, network: Any) -> bool:
    """Whether nothing is in the way between two ends (2, d)."""
    for s in range(9):
        place = between(network.circles, ends[0], ends[1], np.float32(s / 8))
        if clearance_of(network.field, place) < 0.02:
            return False
    return True


@njit_cached_quick
def _push_out(x: Any, margin: float, field: Any) -> None:
    """Moves (d,) uphill until its clearance is about `margin`, as far as three steps allow."""
    step = np.empty(len(x))
    for _ in range(3):
        missing = margin - clearance_of(field, x)
        if missing <= 0:
            return
        outward(field, x, missing, step)
        for k in range(len(x)):
            x[k] += step[k]


@njit_cached_quick
def _escape(ends: Any, places: Any, network: Any) -> bool:
    """Moves one of two ends (2, 3) that are stuck to the best of the places about them, see
    `Descent`; whether there is one. In rooms, where nothing wraps."""
    field = network.field
    gradients = np.empty_like(ends)
    least = _arrival(ends, gradients, network)
    best = np.inf
    moved = ends.copy()
    a, b = np.empty((1, 3)), np.empty((1, 3))
    for end in range(2):
        trial = ends.copy()
        a[0] = ends[end]
        for n in range(len(places)):
            b[0] = a[0] + field.reach * places[n]
            time = straight_times(field, a, b)[0]
            if time > 1e6:
                continue
            trial[end] = b[0]
            arrival = _arrival(trial, gradients, network)
            if arrival < least and arrival + time < best:
                best = arrival + time
                moved[:] = trial
    ends[:] = moved
    return best < 1e6


@njit_cached_quick
def _arrival(ends: Any, gradients: Any, network: Any) -> float:
    """T between two ends (2, d)."""
    distance = math.sqrt(((ends[0] - ends[1]) ** 2).sum())
    return distance * math.exp(pair(ends, gradients, network))
