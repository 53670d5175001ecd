"""The planning network for one query at a time, in NumPy: a call of PyTorch costs more than the
arithmetic."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from planners.mpnet.networks import PlanningNetwork
from planners.scale import Scale

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

    def __init__(self, net: PlanningNetwork, code: Single, scale: Scale) -> None:
        self._scale = scale
        layers = [*net.layers, net.last]
        weights = [layer.weight.detach().cpu().numpy().T.copy() for layer in layers]
        biases = [layer.bias.detach().cpu().numpy() for layer in layers]
        # The obstacles' share of the first layer is the same for every query.
        biases[0] = biases[0] + code @ weights[0][: len(code)]
        weights[0] = weights[0][len(code) :].copy()
        self._layers = list(zip(weights, biases, strict=True))
        self.dropout = net.dropout

    def next(self, current: Array, goal: Array, rng: np.random.Generator, dropout: float) -> Array:
        """The configuration (d,) to go to, in the environment's unit, with a share `dropout` of
        the hidden units left out at random."""
        kept = 1 - dropout
        ends = np.concatenate([self._scale.shrink(current), self._scale.shrink(goal)])
        x = 2 * ends.astype(np.float32)
        *hidden, (last, bias) = self._layers
        for weight, offset in hidden:
            x = np.maximum(x @ weight + offset, 0)
            x *= (rng.random(len(x), dtype=np.float32) < kept) / np.float32(kept)
        step: Array = self._scale.extent * (x @ last + bias).astype(np.float64)
        return current + step
