"""A point robot in an occupancy grid, of squares in the plane or of cubes in space."""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.errors import InputError, tell_once
from envs.files.map_file import read_map, read_problems
from envs.files.map_formats.cells import OCCUPIED, Cells
from envs.problem import Problem
from envs.scenes.cell_world import CellWorld, digest
from envs.seeding import TEST_SEEDS, derived_seed
from envs.speed_model import SpeedModel

_SLOWER, _CELLS = 20, 10
"""The speed falls nearer to obstacles than a 20th of the map's longest side, as in houses, but than
ten cells at most, in which the ways through large maps are wide."""

_SLOWEST, _DETOUR, _LEAST = 7, 3, 0.002
"""The least speed by the highest, as in houses, which holds to half a cell from obstacles at most:
ways may be a cell wide. At contact the speed is such that to cross a wall of one cell takes as long
as a detour of three times the map's longest side, but no less than the last number."""

_NEAREST = 0.02
"""By the side of a cell: what ends of problems in files must keep clear, at least."""

_FINEST, _COARSEST = 1e-3, 1e3
"""Between which the side of a cell is: to a quarter of it paths are judged, at least."""


class GridMap(CellWorld):
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
        side = _side(cells, resolution, file)
        dimension = cells.occupied.ndim
        origin = np.zeros(dimension) if cells.origin is None else cells.origin
        speeds = _speed_model(side, side * max(cells.occupied.shape))
        super().__init__(f"grid:file={file}", cells.occupied, side, origin, radius, speeds)
        unit = "m" if resolution else cells.unit
        self.units = {"configuration": unit, "workspace": unit}
        self._ends, self._lengths = np.zeros((0, 2, dimension)), np.zeros(0)
        if scen:
            self._take_problems(scen, file, cells)
            self.problem_count = len(self._ends)
        self._tell(file, cells)

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
            **({"ends": digest(self._ends)} if len(self._ends) else {}),
            **self.cells_definition(),
        }


def _speed_model(side: float, extent: float) -> SpeedModel:
    d_max = min(extent / _SLOWER, _CELLS * side)
    d_min = min(d_max / _SLOWEST, side / 2)
    return SpeedModel(d_min, d_max, contact=max(side / (_DETOUR * extent), _LEAST))


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
