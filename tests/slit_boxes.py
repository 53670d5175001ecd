"""Boxes with a slit in two opposite sides, of which rooms and solids with cracks are made."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import trimesh

SLIT = 0.03
"""Half the width of slits."""


def slit_box(low: tuple[float, float, float], high: tuple[float, float, float]) -> trimesh.Trimesh:
    """A box wound outward whose sides across x each have a slit at y = 0, from below to above."""
    ys = low[1], -SLIT, SLIT, high[1]
    squares = []
    for strip, side in itertools.product(range(3), range(2)):
        y, further = ys[strip], ys[strip + 1]
        if strip != 1:
            x = (low[0], high[0])[side]
            square = (x, y, low[2]), (x, further, low[2]), (x, further, high[2]), (x, y, high[2])
            squares.append(square if side else square[::-1])
        z = (low[2], high[2])[side]
        square = (low[0], y, z), (high[0], y, z), (high[0], further, z), (low[0], further, z)
        squares.append(square if side else square[::-1])
    for side, y in enumerate((high[1], low[1])):
        square = (
            (low[0], y, low[2]),
            (low[0], y, high[2]),
            (high[0], y, high[2]),
            (high[0], y, low[2]),
        )
        squares.append(square if side == 0 else square[::-1])
    vertices = np.array(squares).reshape(-1, 3)
    corners = 4 * np.arange(len(squares))[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    made = trimesh.Trimesh(vertices, corners.reshape(-1, 3), process=False)
    made.merge_vertices()
    return made


def cracked_room(file: Path) -> Path:
    """A room of 10 x 8 x 4 with slits in two walls, and in its middle a hollow pillar with two."""
    walls = slit_box((-5, -4, -2), (5, 4, 2))
    walls.invert()
    trimesh.util.concatenate([walls, slit_box((-0.5, -0.5, -1.5), (0.5, 0.5, 1.5))]).export(file)
    return file


def cracked_solid(file: Path) -> Path:
    """A hollow box with two slits."""
    slit_box((-3, -2, -2), (3, 2, 2)).export(file)
    return file
