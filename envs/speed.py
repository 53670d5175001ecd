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
    """

    d_min: float
    d_max: float
    s_const: float = 1.0

    def __call__(self, clearance: Array) -> Array:
        """Speeds for clearances of any shape."""
        return self.s_const / self.d_max * np.clip(clearance, self.d_min, self.d_max)
