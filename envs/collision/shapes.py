"""Solid shapes that scenes and robots are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from envs.problem import Array, frozen_array


@dataclass(frozen=True, eq=False)
class Box:
    """A solid axis-aligned box: `center` (3,), full `sides` (3,), in the workspace frame."""

    center: Array
    sides: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", frozen_array(self.center, 1, "box centre"))
        object.__setattr__(self, "sides", frozen_array(self.sides, 1, "box sides"))
        if (self.sides <= 0).any():
            raise ValueError(f"box sides must be positive, not {self.sides.tolist()}")


@dataclass(frozen=True)
class Sphere:
    """A solid sphere about the origin of the frame it is placed in."""

    radius: float

    def __post_init__(self) -> None:
        if not (self.radius >= 0 and np.isfinite(self.radius)):
            raise ValueError(f"a sphere's radius must be finite and >= 0, not {self.radius}")
