"""Solids as compiled code sees them: a row of 17 numbers each.

Their axes (3, 3), row by row; their centre (3,); their size (3,), which is half the sides of a box,
radius, half length and 0 of a cylinder, radius, 0 and 0 of a sphere; the radius of a sphere about
the centre that holds them; and what they are.
"""

from __future__ import annotations

import numpy as np

from envs.problem import Array

BOX, CYLINDER, SPHERE, TRIANGLE, MESH = 0.0, 1.0, 2.0, 3.0, -1.0
"""What a row says that it is; the last of them stands for a mesh. A triangle's has its corners from
its centre in place of axes, and size 0."""


def make_row(kind: float, turn: Array, center: Array, size: Array) -> Array:
    """The row (17,) of a solid about a centre (3,), after a rotation (3, 3)."""
    return np.concatenate([turn.T.ravel(), center, size, [np.linalg.norm(size), kind]])
