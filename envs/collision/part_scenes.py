"""What each part of a robot must not touch, for compiled code that goes through the parts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.collision.primitive_sdf import SceneArrays, mesh_grid, solid_rows
from envs.collision.shapes import Mesh, Obstacle
from envs.compiled import njit_inline
from envs.grid import RegularGrid
from envs.problem import Array


class PartScenes(NamedTuple):
    """Scenes, of which each part of a robot has one: the obstacles that it must not touch. Where
    no part may touch any, all have the same.

    Attributes:
        numbers: (p,) of the parts' scenes.
        solids: (b, ROW) those of one scene after those of another, see `SceneArrays`.
        first_solids: (s + 1,) where each scene's begin.
        values: (s, n0, n1, n2) of the scenes' grids, which have the same nodes; infinite where a
            scene has no meshes and another has.
        lower, spacing, per_unit: (3,) of the grids, see `RegularGrid`.
    """

    numbers: NDArray[np.int64]
    solids: Array
    first_solids: NDArray[np.int64]
    values: NDArray[np.float32]
    lower: Array
    spacing: Array
    per_unit: Array


def part_scenes(
    obstacles: Sequence[Obstacle],
    lower: Array,
    upper: Array,
    parts: int,
    may_touch: NDArray[np.bool_] | None = None,
) -> PartScenes:
    """What compiled code is given of obstacles, asked between two corners (3,).

    Args:
        parts: of the robot, how many meet the obstacles.
        may_touch: (parts, obstacles) of bool, see `Environment.may_touch`.
    """
    scenes, numbers = [list(obstacles)], np.zeros(parts, dtype=np.int64)
    if may_touch is not None:
        kinds, numbers = np.unique(may_touch, axis=0, return_inverse=True)
        scenes = [list(compress(obstacles, ~kind)) for kind in kinds]
    rows = [solid_rows(scene) for scene in scenes]
    values, nodes = _grids(scenes, lower, upper)
    return PartScenes(
        numbers.reshape(-1),
        np.concatenate(rows),
        np.cumsum([0, *map(len, rows)]),
        values,
        nodes.lower,
        nodes.spacing,
        nodes.per_unit,
    )


def _grids(
    scenes: Sequence[Sequence[Obstacle]], lower: Array, upper: Array
) -> tuple[NDArray[np.float32], RegularGrid]:
    """The values of the scenes' grids, and a grid with their nodes. One that scenes with the same
    meshes share is made once."""
    made: dict[tuple[int, ...], RegularGrid] = {}
    keys = [tuple(id(one) for one in scene if isinstance(one.solid, Mesh)) for scene in scenes]
    for key, scene in zip(keys, scenes, strict=True):
        if key not in made:
            made[key] = mesh_grid(scene, lower, upper)
    nodes = made[max(keys, key=len)]
    none = np.full_like(nodes.values, np.inf)
    return np.array([made[key].values if key or not any(keys) else none for key in keys]), nodes


@njit_inline  # so that references to its arrays are counted, or not, as where it is called
def scene_of(scenes: Any, part: int) -> Any:
    """The scene of a part, `SceneArrays`, in which obstacles have numbers of their own."""
    number = scenes.numbers[part]
    begin, end = scenes.first_solids[number], scenes.first_solids[number + 1]
    grid = RegularGrid(scenes.values[number], scenes.lower, scenes.spacing, scenes.per_unit)
    return SceneArrays(scenes.solids[begin:end], grid)
