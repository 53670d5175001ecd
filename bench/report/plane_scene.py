"""Maps of a point robot's world in the plane, with the paths of all planners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from bench.report.chosen_paths import Shown, colours
from bench.report.picture_file import save
from bench.report.picture_title import picture_title
from bench.report.postures import drawable, triangles_of
from envs import Environment
from envs.collision.shapes import Obstacle
from envs.problem import Array

_GREY = (0.42, 0.43, 0.48)
_SIDE = 7.0  # of the longer side of the map, in inches
_NARROWEST = 2.5
_TITLE_POINTS = 10.8
_FLAT = 1e-3  # the cosine of how steep a face may be that is seen from above


def draw(env: Environment, name: str, shown: Shown | None, file: Path) -> None:
    """Draws what stands about a robot in the plane, seen from above, and paths among it, into an
    image file. `name` is that of the environment.

    Raises:
        InputError: the file cannot be written as an image.
    """
    paths = {} if shown is None else shown.paths
    paths = {planner: path for planner, path in paths.items() if drawable(env, path)}
    lower, upper = env.free_bounds
    _, radius = env.robot.shapes[0].bounding_sphere()
    wide, high = _SIDE * (upper - lower) / (upper - lower).max()
    with mpl.rc_context({"font.size": 9}):
        size = (max(wide, _NARROWEST), max(high, _NARROWEST) + 0.3)
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.add_subplot()
        seen = _seen_from_above(env.obstacles)
        # Smooth edges would leave seams between faces that meet.
        axes.add_collection(PolyCollection(list(seen), facecolor=_GREY, antialiased=False))
        axes.set_xlim(lower[0] - radius, upper[0] + radius)
        axes.set_ylim(lower[1] - radius, upper[1] + radius)
        axes.set_aspect("equal")
        axes.set_xlabel(env.units["workspace"])
        axes.set_title(picture_title(name, shown, size[0], _TITLE_POINTS), fontsize=_TITLE_POINTS)
        if shown is not None and paths:
            _draw_paths(axes, radius, paths, shown)
        save(figure, file)


def _seen_from_above(obstacles: Sequence[Obstacle]) -> Array:
    """The faces (n, 3, 2) of obstacles that look up."""
    faces = triangles_of(obstacles)
    one, other = faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]
    normals = np.cross(one, other)
    up = normals[:, 2] > _FLAT * np.linalg.norm(normals, axis=1)
    seen: Array = faces[up, :, :2]
    return seen


def _draw_paths(axes: Axes, radius: float, paths: Mapping[str, Array], shown: Shown) -> None:
    """With the robot, a disc, at both ends."""
    colour_of = colours(shown.paths)
    for planner, path in paths.items():
        style = "--" if planner in shown.refused else "-"
        axes.plot(*path.T, style, color=colour_of[planner], label=planner, linewidth=1.8, zorder=3)
    ends = np.array([next(iter(paths.values()))[i] for i in (0, -1)])
    axes.scatter(ends[:, 0], ends[:, 1], color="black", s=25, zorder=4)
    for end in ends:
        axes.add_patch(Circle(end, radius, fill=False, color="black", linewidth=0.9, zorder=4))
    axes.legend(loc="best", fontsize=8)
