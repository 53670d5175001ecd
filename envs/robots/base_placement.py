"""Where a robot's base stands in the world, and between which bounds it moves if it does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from envs.collision.shapes import LARGEST
from envs.errors import InputError
from envs.problem import Array


@dataclass(frozen=True, eq=False)
class BasePlacement:
    """Where a base stands; by default at the origin of the world.

    Attributes:
        pose: (4, 4), from the frame of the base to the world; of a base that moves, from the frame
            in which it does.
        bounds: (2, 2) or (2, 3), the lower and the upper corner between which joints move that are
            planar or floating and have no limits of their own, each in its frame; None for none.
    """

    pose: Array = field(default_factory=lambda: np.eye(4))
    bounds: Array | None = None

    @classmethod
    def of_numbers(cls, base: Sequence[float], volume: Sequence[float]) -> BasePlacement:
        """That of x, y, z, or with roll, pitch, yaw (as in URDF) besides; and of the lower corner
        and then the upper, each x, y or x, y, z. Neither need be given.

        Raises:
            InputError: they are others.
        """
        if len(base) not in (0, 3, 6) or not _usable(base):
            wanted = "x,y,z or x,y,z,roll,pitch,yaw, finite numbers in metres and radians"
            raise InputError(f"base={_written(base)} must be {wanted}, with quotes about them")
        pose = np.eye(4)
        if base:
            # Lower case: about fixed axes, x first, as URDF has it.
            angles = base[3:] or (0.0, 0.0, 0.0)
            pose[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
            pose[:3, 3] = base[:3]
        return cls(pose, _corners(volume) if volume else None)

    def ends(self, axis: int) -> tuple[float, float] | None:
        """The bounds along an axis, if there are any."""
        if self.bounds is None or axis >= self.bounds.shape[1]:
            return None
        lower, upper = self.bounds[:, axis].tolist()
        return lower, upper


def _corners(volume: Sequence[float]) -> Array:
    corners = np.array(volume, dtype=float)
    if len(corners) not in (4, 6) or not _usable(volume):
        wanted = "two corners, X,Y,X,Y or X,Y,Z,X,Y,Z, of finite numbers in metres"
        raise InputError(f"volume={_written(volume)} must be {wanted}, with quotes about them")
    corners = corners.reshape(2, -1)
    if not (corners[0] < corners[1]).all():
        raise InputError(
            f"volume={_written(volume)}: the lower corner comes first, and each of its numbers is "
            "below that of the upper"
        )
    return corners


def _usable(numbers: Sequence[float]) -> bool:
    return all(abs(number) <= LARGEST for number in numbers)


def _written(numbers: Sequence[Any]) -> str:
    return ",".join(f"{number:g}" for number in numbers)
