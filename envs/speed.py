"""The speed model of the paper (equation 3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
