"""Pictures of a point robot's world, with the paths of all planners."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from bench.report.chosen_paths import Shown, colours
from bench.report.picture_file import save
from bench.report.picture_title import picture_title
from bench.report.postures import drawable, triangles_of
from bench.report.projection import CUT_OPEN, Projection, seen_when_cut_open
from envs import Environment
from envs.problem import Array

_GREY = (0.62, 0.63, 0.68)
_FROM_ASIDE = Projection(24, -62)
_OPACITY = 0.45  # of obstacles about which there is free space
_ABOVE_PATHS = 1.0  # where a building is cut off, in workspace units
_TITLE_POINTS = 10.8


def draw(env: Environment, name: str, shown: Shown | None, file: Path) -> None:
    """Draws the obstacles about a point robot, and paths among them, into an image file.

    Buildings, which enclose free space, are cut open. `name` is that of the environment.

    Raises:
        InputError: the file cannot be written as an image.
    """
    paths = {} if shown is None else shown.paths
    paths = {planner: path for planner, path in paths.items() if drawable(env, path)}
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(7, 6), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        view, opacity = (_FROM_ASIDE, _OPACITY) if env.rooms is None else (CUT_OPEN, 1.0)
        for obstacle in env.obstacles:
            faces = triangles_of([obstacle])
            if env.rooms is not None:
                faces = faces[seen_when_cut_open(env.rooms, faces, _height(paths))]
            solid = Poly3DCollection(
                faces, facecolors=[_GREY] * len(faces), alpha=opacity, shade=True, linewidths=0
            )
            axes.add_collection3d(solid)
        lower, upper = env.free_bounds
        for axis, low, high in zip("xyz", lower, upper, strict=True):
            getattr(axes, f"set_{axis}lim")(low, high)
            getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(5))
        axes.set_box_aspect(upper - lower)
        axes.view_init(elev=view.elevation, azim=view.azimuth)
        axes.computed_zorder = False  # paths in front of obstacles
        axes.set_title(
            picture_title(name, shown, figure.get_figwidth(), _TITLE_POINTS), fontsize=_TITLE_POINTS
        )
        if shown is not None and paths:
            _draw_paths(axes, paths, shown)
        save(figure, file)


def _height(paths: Mapping[str, Array]) -> float:
    """Above which a building is cut off."""
    return max((float(path[:, 2].max()) + _ABOVE_PATHS for path in paths.values()), default=np.inf)


def _draw_paths(axes: Any, paths: Mapping[str, Array], shown: Shown) -> None:
    colour_of = colours(shown.paths)
    for planner, path in paths.items():
        style = "--" if planner in shown.refused else "-"
        colour = colour_of[planner]
        axes.plot(*path.T, style, color=colour, label=planner, linewidth=1.8, zorder=3)
    ends = np.array([next(iter(paths.values()))[i] for i in (0, -1)])
    axes.scatter(*ends.T, color="black", s=25, zorder=4)
    axes.legend(loc="upper left", fontsize=8)
