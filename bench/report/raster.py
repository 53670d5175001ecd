"""Translucent solids, painted with exact occlusion.

Matplotlib paints triangles one upon another in the order of their middles, so that solids which
reach into each other come out wrong and translucent ones show every edge of their triangles. Here
each layer, such as the arm in one posture, keeps the surface nearest to the eye at each pixel, and
layers are blended from the farthest to the nearest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.compiled import njit_cached
from envs.problem import Array

_CELLS = 4_000_000
"""Pixels of layers that are held at a time, in bands of a picture's rows: 64 MB."""

_CREASE = 0.8
"""Neighbouring faces with a smaller cosine between their normals are outlined."""

_OUTLINE = 0.6
"""The brightness of outlines by that of the faces about them."""

_OUTLINE_WIDTH = 2
"""In pixels, inward of where a surface ends; half of it where it bends."""

_OUTLINE_OPACITY = 0.4
"""By how much outlines are more opaque than their faces."""

_DARKEST, _GLOSS = 0.48, 0.3
"""The brightness of faces turned from the light; how far faces that are turned to it are white."""

_LIGHT = np.array([-0.41, 0.72, 0.56])
"""Toward where light comes from: to the right, up, toward the eye."""


@dataclass(frozen=True)
class Layer:
    """What hides itself but is blended with what is behind it.

    Attributes:
        triangles: (n, 3, 3) in metres: to the right, up, toward the eye.
        colour: (3,) of 0 to 1.
        opacity: from 0 to 1.
    """

    triangles: Array
    colour: Array
    opacity: float


def paint(layers: list[Layer], lower: Array, pixel: float, shape: tuple[int, int]) -> Array:
    """A picture (rows, columns, 3) on white, the top row first.

    Args:
        layers: to paint, at least one.
        lower: (2,) the picture's left lower corner.
        pixel: metres a pixel.
        shape: rows and columns.
    """
    triangles, owners = _joined(layers, lower, pixel)
    normals = _toward_eye(triangles)
    bright = (1 + normals @ (_LIGHT / np.linalg.norm(_LIGHT)))[:, None] / 2
    shades = np.array([layer.colour for layer in layers]).reshape(-1, 3)[owners]
    shades = shades * (_DARKEST + (1 - _DARKEST) * bright)
    shades += _GLOSS * bright**6 * (1 - shades)
    opacities = np.array([layer.opacity for layer in layers])
    picture = np.ones((*shape, 3))
    band = max(_CELLS // (shape[1] * len(layers)) - 2 * _OUTLINE_WIDTH, 1)
    for begin in range(0, shape[0], band):
        rows = min(band, shape[0] - begin)
        # Some rows more on either side, whose faces tell where outlines are.
        first, more = begin - _OUTLINE_WIDTH, rows + 2 * _OUTLINE_WIDTH
        depth, face = _surfaces(triangles, owners, len(layers), first, more, shape[1])
        _blend(depth, face, normals, shades, opacities, picture[begin : begin + rows])
    return picture[::-1]


def depths(triangles: Array, lower: Array, pixel: float, shape: tuple[int, int]) -> Array:
    """How far toward the eye the nearest of triangles (n, 3, 3) is at each pixel, in pixels, the
    bottom row first; -inf where there is none. Other arguments are as those of `paint`."""
    scaled, owners = _joined([Layer(triangles, np.zeros(3), 1.0)], lower, pixel)
    found: Array = _surfaces(scaled, owners, 1, 0, *shape)[0][:, :, 0]
    return found


def _joined(layers: list[Layer], lower: Array, pixel: float) -> tuple[Array, NDArray[np.int64]]:
    """All triangles, in pixels, and the numbers of their layers."""
    triangles = np.concatenate([np.zeros((0, 3, 3)), *(layer.triangles for layer in layers)])
    owners = np.repeat(np.arange(len(layers)), [len(layer.triangles) for layer in layers])
    return (triangles - np.append(lower, 0.0)) / pixel, owners


def _toward_eye(triangles: Array) -> Array:
    """The faces' normals (n, 3), on the side that is seen; 0 for those of no area."""
    across = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(across, axis=1, keepdims=True)
    across *= np.where(across[:, 2:] < 0, -1, 1)
    found: Array = across / np.maximum(lengths, 1e-12)
    return found


@njit_cached
def _surfaces(
    triangles: Any, owners: Any, layers: int, first: int, rows: int, columns: int
) -> tuple[Any, Any]:
    """Of each layer at each pixel of rows from `first` on: how near the nearest surface is to the
    eye, -inf without one, and the number of its triangle, or -1; both (rows, columns, layers)."""
    depth = np.full((rows, columns, layers), -np.inf)
    face = np.full((rows, columns, layers), -1)
    for n in range(len(triangles)):
        ax, ay, az = triangles[n, 0]
        bx, by, bz = triangles[n, 1]
        cx, cy, cz = triangles[n, 2]
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0.0:
            continue
        # A pixel is looked at in its middle.
        left = max(math.ceil(min(ax, bx, cx) - 0.5), 0)
        right = min(int(max(ax, bx, cx) + 0.5), columns)
        below = max(math.ceil(min(ay, by, cy) - 0.5), first)
        above = min(int(max(ay, by, cy) + 0.5), first + rows)
        for row in range(below, above):
            y = row + 0.5 - ay
            for column in range(left, right):
                x = column + 0.5 - ax
                b = (x * (cy - ay) - (cx - ax) * y) / area
                c = ((bx - ax) * y - x * (by - ay)) / area
                if b < 0.0 or c < 0.0 or b + c > 1.0:
                    continue
                z = az + b * (bz - az) + c * (cz - az)
                if z > depth[row - first, column, owners[n]]:
                    depth[row - first, column, owners[n]] = z
                    face[row - first, column, owners[n]] = n
    return depth, face


@njit_cached
def _blend(depth: Any, face: Any, normals: Any, shades: Any, opacities: Any, picture: Any) -> None:
    """Blends layers into rows of a picture, of which `depth` and `face` have some more on either
    side; see `_surfaces`."""
    rows, columns, layers = depth.shape
    order = np.empty(layers, dtype=np.int64)
    for row in range(_OUTLINE_WIDTH, rows - _OUTLINE_WIDTH):
        for column in range(columns):
            count = 0
            for layer in range(layers):  # sorted by insertion, the farthest first
                if face[row, column, layer] < 0:
                    continue
                place = count
                while place > 0 and (
                    depth[row, column, order[place - 1]] > depth[row, column, layer]
                ):
                    order[place] = order[place - 1]
                    place -= 1
                order[place] = layer
                count += 1
            for layer in order[:count]:
                opacity, light = opacities[layer], 1.0
                if _outlined(face[:, :, layer], normals, row, column):
                    opacity, light = min(opacity + _OUTLINE_OPACITY, 1.0), _OUTLINE
                shade = shades[face[row, column, layer]]
                for k in range(3):
                    behind = picture[row - _OUTLINE_WIDTH, column, k]
                    picture[row - _OUTLINE_WIDTH, column, k] += opacity * (
                        light * shade[k] - behind
                    )


@njit_cached
def _outlined(face: Any, normals: Any, row: int, column: int) -> bool:
    """Whether a layer's surface ends or bends at a pixel."""
    normal = normals[face[row, column]]
    for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        far = column + _OUTLINE_WIDTH * right
        if 0 <= far < face.shape[1] and face[row + _OUTLINE_WIDTH * down, far] < 0:
            return True
        beside = column + right
        if 0 <= beside < face.shape[1]:
            other = face[row + down, beside]
            if other < 0:
                return True
            x, y, z = normals[other]
            if normal[0] * x + normal[1] * y + normal[2] * z < _CREASE:
                return True
    return False
