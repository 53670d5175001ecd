"""MPNet's networks, and planning with them: neural expansion, lazy vertex contraction and neural
replanning on one problem.

Positions are in the learned planners' space, where the bounds' longest side is 1. The network plans
one query at a time, in NumPy: a call of PyTorch costs more than the arithmetic.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from envs.seeding import stream
from planners.base import Budget
from planners.learning.circles import NO_CIRCLES, Circles
from planners.learning.normalizer import Normalizer


@dataclass(frozen=True)
class PlannerShape:
    """What the networks are made of.

    Attributes:
        dimension: d.
        code: length of the encoding of the obstacles.
        point_widths: of the layers that see one point at a time.
        widths: of the planning network's hidden layers.
        dropout: share of the hidden units that are left out, while planning too.
        circles: which coordinates wrap.
    """

    dimension: int
    code: int = 128
    point_widths: tuple[int, ...] = (64, 128, 256)
    widths: tuple[int, ...] = (448, 448, 256)
    dropout: float = 0.1
    circles: Circles = NO_CIRCLES


class PointEncoder(nn.Module):
    """An order-free encoder of a cloud of points: the same layers for each point, the maximum over
    all of them, and a linear layer.

    It stands where the published method has a contractive autoencoder.
    """

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        widths = (3, *shape.point_widths)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.last = nn.Linear(widths[-1], shape.code)

    def forward(self, points: Tensor) -> Tensor:
        """Codes (s, c) of clouds (s, n, 3)."""
        x = 2 * points
        for layer in self.layers:
            x = functional.relu(layer(x))
        code: Tensor = self.last(x.amax(dim=1))
        return code


class PlanningNetwork(nn.Module):
    """The next configuration on the way."""

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        self.circles = shape.circles
        widths = (shape.code + 2 * self.circles.embedded_size(shape.dimension), *shape.widths)
        self.dropout = shape.dropout
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.last = nn.Linear(widths[-1], shape.dimension)

    def forward(self, code: Tensor, current: Tensor, goal: Tensor) -> Tensor:
        """The configuration (..., d) to go to, from `current` to `goal` (..., d) among obstacles of
        `code` (..., c). Coordinates that wrap may be beyond their bounds."""
        here, there = (self.circles.embedded_with_slopes(q)[0] for q in (current, goal))
        x = torch.cat([code, 2 * here, 2 * there], dim=-1)
        for layer in self.layers:
            x = functional.dropout(functional.relu(layer(x)), self.dropout)
        step: Tensor = self.last(x)
        return current + step


class Mpnet(nn.Module):
    """Both networks."""

    def __init__(self, shape: PlannerShape) -> None:
        super().__init__()
        self.shape = shape
        self.encoder = PointEncoder(shape)
        self.planner = PlanningNetwork(shape)


IsFree = Callable[[Array, Array], bool]
"""Whether the straight motion between two configurations (d,) is free."""


def contracted(path: Sequence[Array], is_free: IsFree) -> list[Array]:
    """A path without the waypoints that a free straight motion can skip.

    Goes from each waypoint to the last one that it sees. Neighbours are kept as they are, whether
    or not the motion between them is free.

    Args:
        path: waypoints (d,).
    """
    kept = [path[0]]
    here = 0
    while here < len(path) - 1:
        ahead = range(len(path) - 1, here + 1, -1)
        here = next((there for there in ahead if is_free(path[here], path[there])), here + 1)
        kept.append(path[here])
    return kept


Single = NDArray[np.float32]


class Expander:
    """The planning network among fixed obstacles.

    Args:
        net: with its weights.
        code: (c,) of the obstacles.
        scale: between the environment's configurations and the network's.

    Attributes:
        dropout: share of the hidden units that was left out while training.
    """

    def __init__(self, net: PlanningNetwork, code: Single, scale: Normalizer) -> None:
        self._scale = scale
        layers = [*net.layers, net.last]
        weights = [layer.weight.detach().cpu().numpy().T.copy() for layer in layers]
        biases = [layer.bias.detach().cpu().numpy() for layer in layers]
        # The obstacles' share of the first layer is the same for every query.
        biases[0] = biases[0] + code @ weights[0][: len(code)]
        weights[0] = weights[0][len(code) :].copy()
        self._layers = list(zip(weights, biases, strict=True))
        self.dropout = net.dropout
        self._circles = net.circles

    def next(self, current: Array, goal: Array, rng: np.random.Generator, dropout: float) -> Array:
        """The configuration (d,) to go to, in the environment's unit, with a share `dropout` of
        the hidden units left out at random. It may be out of bounds."""
        kept = 1 - dropout
        ends = (self._circles.embedded(self._scale.normalize(q)) for q in (current, goal))
        x = 2 * np.concatenate(list(ends)).astype(np.float32)
        *hidden, (last, bias) = self._layers
        for weight, offset in hidden:
            x = np.maximum(x @ weight + offset, 0)
            x *= (rng.random(len(x), dtype=np.float32) < kept) / np.float32(kept)
        step: Array = self._scale.extent * (x @ last + bias).astype(np.float64)
        return current + step


_MOST_STEPS = 8
"""Of one expansion. Most motions that can be joined at all are after two or three."""

_REPLANS = 3
"""Of one path, before a new one is begun."""

_MORE_DROPOUT, _MOST_DROPOUT = 0.05, 0.5
"""Added for each attempt, up to the published share: else attempts would be too much alike."""


Between = Callable[[Array, Array], list[Array]]
"""Makes a path of waypoints (d,) between two configurations, both included."""


class Search:
    """The search for one problem's path; the same for equal problems, as long as time allows.

    A path is a list of waypoints (d,) from start to goal whose motions may be infeasible: open.

    Attributes:
        attempts: paths begun.
        replans: motions replanned by the network.
    """

    def __init__(
        self,
        env: Environment,
        model: CollisionModel,
        expander: Expander,
        problem: Problem,
        budget: Budget,
    ) -> None:
        self._space = env.space
        self._model = model
        self._expander = expander
        self._problem = problem
        self._budget = budget
        self._rng = stream("mpnet dropout", problem.seed)
        self._dropout = expander.dropout
        self._known: dict[tuple[bytes, bytes], bool] = {}
        self.attempts = 0
        self.replans = 0

    def stats(self) -> dict[str, Any]:
        """JSON data on how it went."""
        return {"attempts": self.attempts, "replans": self.replans}

    def is_free(self, a: Array, b: Array) -> bool:
        """Whether the straight motion from a to b (d,) is proved free; asks once."""
        motion = a.tobytes(), b.tobytes()
        if motion not in self._known:
            self._known[motion] = self._model.segment_is_free(a, b)
        return self._known[motion]

    def is_open(self, path: Sequence[Array]) -> bool:
        """Whether a motion of the path is not proved free."""
        return not all(self.is_free(a, b) for a, b in pairwise(path))

    def attempt(self) -> list[Array]:
        """A new path, contracted, its infeasible motions replanned up to `_REPLANS` times."""
        self.attempts += 1
        more = _MORE_DROPOUT * (self.attempts - 1)
        self._dropout = min(self._expander.dropout + more, _MOST_DROPOUT)
        path = contracted(self._expanded(self._problem.start, self._problem.goal), self.is_free)
        for _ in range(_REPLANS):
            if self._budget.remaining() <= 0 or not self.is_open(path):
                break
            path = self.mended(path, self._replanned)
        return path

    def mended(self, path: Sequence[Array], between: Between) -> list[Array]:
        """A path without its waypoints in collision, with `between` instead of motions that are
        infeasible, contracted."""
        # Nearer to an obstacle than the tolerance, no motion to or from it would be accepted.
        safe = [q for q in path[1:-1] if self._model.clearance(q) > self._model.tolerance]
        beacons = [path[0], *safe, path[-1]]
        whole = [beacons[0]]
        for a, b in pairwise(beacons):
            whole.extend([b] if self.is_free(a, b) else between(a, b)[1:])
        return contracted(whole, self.is_free)

    def _expanded(self, start: Array, goal: Array) -> list[Array]:
        """Steps from both ends in turn, each towards the other's last, until a free motion joins
        them or there were too many."""
        trees = [start], [goal]
        for step in range(_MOST_STEPS):
            if self.is_free(trees[0][-1], trees[1][-1]):
                break
            grown, other = trees[step % 2], trees[1 - step % 2]
            grown.append(self._next(grown[-1], other[-1]))
            if self._budget.remaining() <= 0:
                break
        return [*trees[0], *reversed(trees[1])]

    def _replanned(self, a: Array, b: Array) -> list[Array]:
        self.replans += 1
        return self._expanded(a, b)

    def _next(self, current: Array, goal: Array) -> Array:
        ahead = self._expander.next(current, goal, self._rng, self._dropout)
        return np.clip(self._space.wrapped(ahead), self._space.lower, self._space.upper)
