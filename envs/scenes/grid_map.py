"""A point robot in an occupancy grid, of squares in the plane or of cubes in space."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.collision.ball_motions import BallAmongCells
from envs.collision.motion_check import MotionCheck
from envs.collision.occupancy import CellDistances, covering_boxes
from envs.collision.shapes import Box
from envs.errors import InputError, tell_once
from envs.files.map_file import read_map, read_problems
from envs.files.map_formats.cells import OCCUPIED, Cells
from envs.free_space import GridComponents
from envs.grid import node_counts
from envs.problem import Array, Problem
from envs.scenes.point_world import PointWorld
from envs.seeding import TEST_SEEDS, derived_seed
from envs.speed_model import SpeedModel

_SLOWER, _CELLS = 20, 10
"""The speed falls nearer to obstacles than a 20th of the map's longest side, as in houses, but than
ten cells at most, in which the ways through large maps are wide."""

_SLOWEST, _DETOUR, _LEAST = 7, 3, 0.002
"""The least speed by the highest, as in houses, which holds to half a cell from obstacles at most:
ways may be a cell wide. At contact the speed is such that to cross a wall of one cell takes as long
as a detour of three times the map's longest side, but no less than the last number."""

_APART = 5
"""Ends of problems are a fifth of the longest side apart."""

_MOST_NODES = 10_000_000
"""Of the grid on which free space is explored."""

_TO_A_NODE = 0.9
"""By the spacing of such a grid: from no place its nearest node is farther, also in space."""

_NEAREST = 0.02
"""By the side of a cell: what ends of problems in files must keep clear, at least."""

_MOST_BOXES = 200_000
"""Each takes a few kilobytes, with what FCL keeps of it."""

_FINEST, _COARSEST = 1e-3, 1e3
"""Between which the side of a cell is: to a quarter of it paths are judged, at least."""

_TALL = 50
"""What stands in the plane is a 50th as tall as the map is long, in pictures."""


class GridMap(PointWorld):
    """A disc among the occupied squares of a map, or a ball among cubes, in metres, or in cells of
    Moving AI's maps.

    Cells are solid, and where two meet at a corner nothing passes. The robot is on the map as a
    whole: what is outside is out of bounds. Without a file of problems their ends are uniform in
    free space, a fifth of the map's longest side apart, and connected.

    Args:
        file: YAML of ROS, PGM, PNG or BMP, NPY (2-D or 3-D), or Moving AI's `.map` or `.3dmap`.
        scen: its `.scen` or `.3dscen`; the problems, of any seed, are then those of the file.
        radius: of the robot; 0 for a point.
        resolution: the side of a cell, where the file does not say it; 0 for 0.05 (metres), of
            Moving AI's maps 1.
        unknown: "occupied" or "free", what cells count as that are not known to be either.

    Raises:
        InputError: a file or an argument cannot be used.
    """

    kind_of_problems = "grid"
    advice = "the robot has too little room; make it smaller (radius), or give a larger map"

    def __init__(
        self,
        file: str = "",
        scen: str = "",
        radius: float = 0.0,
        resolution: float = 0.0,
        unknown: str = OCCUPIED,
    ) -> None:
        if not file:
            raise InputError("grid: say which map, as in grid:file=map.yaml")
        cells = read_map(file, unknown)
        self._cells = cells.occupied
        self._side = _side(cells, resolution, file)
        dimension = self._cells.ndim
        self._origin = np.zeros(dimension) if cells.origin is None else cells.origin
        sides = self._side * np.array(self._cells.shape)
        if not 0 <= 2 * radius < sides.min():
            raise InputError(
                f"grid: radius must be from 0 to less than half of the map's shortest side, "
                f"{sides.min() / 2:g}, not {radius:g}"
            )
        extent = float(sides.max())
        super().__init__(radius, self._speed_model(extent))
        self.lower, self.upper = self._origin + radius, self._origin + sides - radius
        unit = "m" if resolution else cells.unit
        self.units = {"configuration": unit, "workspace": unit}
        self.min_separation = extent / _APART
        boxes = covering_boxes(self._cells)
        if len(boxes) > _MOST_BOXES:
            raise InputError(
                f"grid: {file} is too ragged: it takes {len(boxes)} boxes to cover what is "
                f"occupied, more than {_MOST_BOXES}; smooth it, scale it down, or cut out a part"
            )
        self._boxes = [self._box(*corners) for corners in boxes]
        self.obstacles = self._boxes
        self._distances = CellDistances(self._cells)
        self.min_clearance = _TO_A_NODE * self._spacing
        self._ends, self._lengths = np.zeros((0, 2, dimension)), np.zeros(0)
        if scen:
            self._take_problems(scen, file, cells)
            self.problem_count = len(self._ends)
        self._tell(file, cells)

    def _speed_model(self, extent: float) -> SpeedModel:
        d_max = min(extent / _SLOWER, _CELLS * self._side)
        d_min = min(d_max / _SLOWEST, self._side / 2)
        return SpeedModel(d_min, d_max, contact=max(self._side / (_DETOUR * extent), _LEAST))

    def _box(self, begin: NDArray[np.int64], end: NDArray[np.int64]) -> Box:
        """What stands on some cells."""
        middle, sides = np.zeros(3), np.full(3, self._side * max(self._cells.shape) / _TALL)
        middle[: len(begin)] = self._origin + self._side * (begin + end) / 2
        sides[: len(begin)] = self._side * (end - begin)
        return Box(middle, sides)

    def _take_problems(self, scen: str, file: str, cells: Cells) -> None:
        problems = read_problems(scen, file, cells)
        self._ends = self._origin + self._side * (problems.ends + 0.5)
        self._lengths = self._side * problems.lengths
        clearances = self.clearance(self._ends.reshape(-1, self._cells.ndim)).reshape(-1, 2)
        least = np.where(self.contains(self._ends).all(axis=1), clearances.min(axis=1), -np.inf)
        near = np.flatnonzero(least < _NEAREST * self._side)
        if len(near):
            raise InputError(
                f"{scen}: line {problems.lines[near[0]]}: its start or goal leaves no room for a "
                f"robot of radius {self.robot.radius:g}; make it smaller, or correct the line"
            )
        self.min_clearance = min(self.min_clearance, float(least.min()))

    def _tell(self, file: str, cells: Cells) -> None:
        size = " x ".join(map(str, self._cells.shape))
        unit = self.units["workspace"]
        said = [
            f"{file}: {size} cells" + (f" of {self._side:g} m" if unit == "m" else ""),
            f"{self._cells.mean():.0%} occupied, by {len(self.obstacles)} boxes",
        ]
        if cells.unknown:
            said.append(f"{cells.unknown:.0%} not known (see unknown=)")
        tell_once(", ".join([*said, *cells.notes]))

    @cached_property
    def _spacing(self) -> float:
        """Between nodes that prove connections: half a cell, so that a way a cell wide counts as
        open; twice that, and so on, where these were too many."""
        spacing = self._side / 2
        while np.prod(self._node_counts(spacing), dtype=np.float64) > _MOST_NODES:
            spacing *= 2
        return spacing

    def _node_counts(self, spacing: float) -> NDArray[np.int64]:
        # No more for rounding: nodes are in the middles of cells and of their sides.
        return np.maximum(node_counts(self.lower, self.upper, spacing * (1 + 1e-9)), 2)

    def explored(self) -> GridComponents:
        counts = self._node_counts(self._spacing)
        return GridComponents(self.clearance, self.lower, self.upper, counts)

    @property
    def obstacle_names(self) -> Sequence[str]:
        """By the cells, as the boxes are no parts that a user knows."""
        return [
            f"occupied cells about {_text(box.center[: self.dimension])}" for box in self._boxes
        ]

    def clearance(self, q: Array) -> Array:
        there = (self.configurations(q) - self._origin) / self._side
        return self._side * self._distances(there) - self.robot.radius

    def motion_check(self, tolerance: float) -> MotionCheck:
        known = self._distances.occupied, self._origin, float(self._side)
        check = BallAmongCells(*known, float(self.robot.radius), float(tolerance))
        return MotionCheck(check)

    def sample_problems(self, n: int, seed: int) -> list[Problem]:
        """See `Environment.sample_problems`. Where a file has the problems, they are the same of
        all seeds; those to train with and to warm up are sampled."""
        if not len(self._ends) or seed >= TEST_SEEDS:
            return super().sample_problems(n, seed)
        if n > len(self._ends):
            raise InputError(
                f"grid: its file has {len(self._ends)} problems, not {n}; ask for fewer "
                "(--problems)"
            )
        return [
            Problem(start, goal, index, derived_seed("grid planner", seed, index))
            for index, (start, goal) in enumerate(self._ends[:n])
        ]

    def known_length(self, problem: Problem) -> float | None:
        """That of the file, of paths between the middles of cells to 8 neighbours, or 26, that cut
        no corner. Others may be shorter."""
        if problem.index >= len(self._ends):
            return None
        known = self._ends[problem.index]
        is_of_file = (known[0] == problem.start).all() and (known[1] == problem.goal).all()
        return float(self._lengths[problem.index]) if is_of_file else None

    def definition(self) -> dict[str, Any]:
        return {
            "class": "GridMap",
            "version": 1,
            "cells": [list(self._cells.shape), _digest(np.packbits(self._cells))],
            "side": self._side,
            "origin": self._origin.tolist(),
            **({"ends": _digest(self._ends)} if len(self._ends) else {}),
            **self.point_definition(),
        }


def _side(cells: Cells, resolution: float, file: str) -> float:
    """Of a cell."""
    if cells.resolution and resolution:
        raise InputError(f"grid: {file} says its resolution itself, {cells.resolution:g}")
    side = cells.resolution or resolution or cells.default_resolution
    if not _FINEST <= side <= _COARSEST:
        raise InputError(
            f"grid: {file}: a resolution must be from {_FINEST:g} to {_COARSEST:g}, not {side:g}"
        )
    return side


def _text(place: Array) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in place) + ")"


def _digest(numbers: NDArray[Any]) -> str:
    return sha256(np.ascontiguousarray(numbers).tobytes()).hexdigest()[:16]
