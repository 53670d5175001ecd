"""The paper's speed model (equation 3), for arrays and for compiled code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from envs.compiled import njit_quick
from envs.problem import Array


@dataclass(frozen=True)
class SpeedModel:
    """S*(q) = s_const / d_max * clip(clearance(q), d_min, d_max)  (equation 3).

    Distances are in the environment's workspace unit. The speed is `s_const` in the open and
    falls linearly to `s_const * d_min / d_max` near and inside obstacles.

    Where obstacles are thin, that is too fast for walls: to cross one may take less time than
    the way round through a door. So there `contact`, if not 0, is the speed at contact and inside
    obstacles, to which it goes on falling below d_min, linearly in log scale.
    """

    d_min: float
    d_max: float
    s_const: float = 1.0
    contact: float = 0.0

    def __call__(self, clearance: Array) -> Array:
        """Speeds for clearances of any shape."""
        speed: Array = self.s_const / self.d_max * np.clip(clearance, self.d_min, self.d_max)
        if self.contact:
            depth = 1 - np.clip(clearance / self.d_min, 0, 1)
            speed *= (self.contact * self.d_max / (self.s_const * self.d_min)) ** depth
        return speed

    @property
    def ratio(self) -> float:
        """The highest speed by the lowest."""
        return self.s_const / self.contact if self.contact else self.d_max / self.d_min

    @property
    def normalized(self) -> NormalizedSpeed:
        """What compiled code is given of one whose `s_const` is 1."""
        least = self.d_min / self.d_max
        return NormalizedSpeed(least, self.contact or least)


class NormalizedSpeed(NamedTuple):
    """A speed model whose distances are by d_max, and whose speed is 1 in the open.

    Attributes:
        least: that at d_min.
        contact: that at contact.
    """

    least: float
    contact: float


@njit_quick
def speed_at(model: Any, clearance: float) -> float:
    """The speed of a `NormalizedSpeed` at a clearance by d_max; see `SpeedModel`."""
    speed: float = min(max(clearance, model.least), 1.0)
    if clearance < model.least and model.contact < model.least:
        depth = 1 - max(clearance, 0.0) / model.least
        speed *= (model.contact / model.least) ** depth
    return speed
