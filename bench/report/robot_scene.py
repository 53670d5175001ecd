"""Pictures of a robot along the paths of planners, a panel each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import Normal, Stroke

from bench.report.chosen_paths import Shown, colours
from bench.report.picture_file import save
from bench.report.picture_title import picture_title
from bench.report.postures import RobotShape, along, drawable, free_posture, triangles_of
from bench.report.projection import (
    CUT_OPEN,
    Projection,
    most_telling,
    region_about,
    seen_when_cut_open,
)
from bench.report.raster import Layer, paint
from envs import Environment
from envs.collision.fcl_model import Allowed
from envs.collision.shapes import Obstacle
from envs.problem import Array

_START, _GOAL, _ALONE = "#34507a", "#1f8a5b", "#3b6ea5"
_BASE, _GREY = "#6d7078", "#a9abb5"
_OBSTACLE_OPACITY = 0.42
_GHOSTS = 6
_GHOST_OPACITY = (0.25, 0.45)  # from start to goal, so that one sees which way it goes
_TRACE_POINTS = 400
_INCHES = 4.8  # of a panel's width
_TITLE_POINTS, _TITLE_INCHES = 12.0, 0.2  # and the height of a further line
_PAD = 0.08  # about panels and titles, in inches
_PIXELS_PER_INCH = 300  # twice the file's, which smooths edges
_BORDER = 0.02  # about all that is drawn, by the side of a box about where the robot comes to
_SCALES = (1, 2, 5)  # lengths, by powers of ten
_SCALE_SHARE = 0.3  # its length by a panel's width, at most
_SCALE_STRIP = 0.07  # of that width, kept clear below what is drawn
_LOOKED_AT = 2000  # faces of the robot of which it is asked whether they are hidden
_TIE = 5e-4  # by that side
_ABOVE_PATHS = 0.05  # where a building is cut off, by that side
_TALLEST, _FLATTEST = 1.2, 0.4  # panels, height by width


@dataclass(frozen=True)
class _Panel:
    """A planner's path (k, d); None where what it gave is no path of this robot."""

    title: str
    colour: str
    refused: bool
    path: Array | None


@dataclass(frozen=True)
class _Stage:
    """What all panels share.

    Attributes:
        env: the environment.
        robot: its surfaces.
        side: of a box about where it comes to, the longest.
        still: what does not move.
        view: from where all is seen.
        lower, upper: (2,) corners of the pictures, in workspace units to the right and up.
    """

    env: Environment
    robot: RobotShape
    side: float
    still: list[Layer]
    view: Projection
    lower: Array
    upper: Array

    def trace(self, path: Array, count: int) -> Array:
        """The ways (k, count, 3) of the points that are traced along a path."""
        q = along(self.env.space, path, np.linspace(0, 1, count))
        ways: Array = self.env.robot.trace(q).swapaxes(0, 1)
        return ways


def draw(env: Environment, name: str, shown: Shown | None, file: Path) -> None:
    """Draws a robot among its obstacles into an image file: along each planner's path, or without
    paths in a posture free of collision. `name` is that of the environment.

    Raises:
        InputError: the file cannot be written as an image.
    """
    if shown is None:
        panels = [_Panel("", _ALONE, False, free_posture(env)[None])]
    else:
        panels = _panels(env, shown)
    drawn = [panel.path for panel in panels if panel.path is not None]
    stage = _stage(env, drawn or [free_posture(env)[None]])
    columns = 3 if len(panels) == 3 else math.ceil(math.sqrt(len(panels)))
    rows = math.ceil(len(panels) / columns)
    wide, high = stage.upper - stage.lower
    with mpl.rc_context({"font.size": 10}):
        title = picture_title(name, shown, _INCHES * columns, _TITLE_POINTS)
        above = 0.5 + _TITLE_INCHES * title.count("\n")
        size = (_INCHES * columns, (_INCHES * high / wide + 0.4) * rows + above)
        figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(h_pad=_PAD))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for axes, panel in zip(grid.flat, panels, strict=False):
            _draw_panel(axes, stage, panel)
        _draw_scale(grid.flat[0], stage)
        figure.suptitle(title, fontsize=_TITLE_POINTS)
        if shown is not None:
            _draw_legend(figure, env.trace_label, any(panel.refused for panel in panels))
        save(figure, file)


def _panels(env: Environment, shown: Shown) -> list[_Panel]:
    """One a planner."""
    colour_of = colours(shown.paths)
    panels = []
    for planner, path in shown.paths.items():
        refused = planner in shown.refused
        title = f"{planner} (refused)" if refused else planner
        seen = path if drawable(env, path) else None
        panels.append(_Panel(title, colour_of[planner], refused, seen))
    return panels


def _stage(env: Environment, paths: Sequence[Array]) -> _Stage:
    """`paths` are those that are to be seen."""
    robot = RobotShape(env, env.drawn_robot)
    shares = np.linspace(0, 1, _GHOSTS + 2)
    postures = np.concatenate([along(env.space, path, shares) for path in paths])
    moving = np.concatenate([robot.triangles(q) for q in postures])
    ways = [along(env.space, path, np.linspace(0, 1, 100)) for path in paths]
    traces = env.robot.trace(np.concatenate(ways)).reshape(-1, 3)
    corners = np.concatenate([moving.reshape(-1, 3), robot.still.reshape(-1, 3), traces])
    side = float(np.subtract(*robot.bounds[::-1]).max())
    if env.rooms is None:
        surfaces = _about(env, robot, corners)
        looked_at = moving.mean(axis=1)[:: len(moving) // _LOOKED_AT + 1]
        view = most_telling(looked_at, traces, np.concatenate([np.zeros((0, 3, 3)), *surfaces]))
        opacity = _OBSTACLE_OPACITY
    else:
        height = float(traces[:, 2].max()) + _ABOVE_PATHS * side
        surfaces = _cut_open(env.rooms, env.obstacles, height)
        view, opacity = CUT_OPEN, 1.0
    still = [_layer(view, surface, _GREY, opacity) for surface in surfaces]
    still.append(_layer(view, robot.still, _BASE, 1.0))
    flat = np.concatenate([view(corners), *(layer.triangles.reshape(-1, 3) for layer in still)])
    lower, upper = _framed(flat[:, :2], _BORDER * side)
    return _Stage(env, robot, side, still, view, lower, upper)


def _about(env: Environment, robot: RobotShape, corners: Array) -> list[Array]:
    """The surfaces (n, 3, 3) of the obstacles, as far as they are near what is drawn (m, 3)."""
    surfaces = [triangles_of([obstacle]) for obstacle in env.obstacles]
    region = region_about(corners, robot.bounds, surfaces)
    return [region.cropped(surface) for surface in surfaces]


def _cut_open(rooms: Allowed, obstacles: Sequence[Obstacle], height: float) -> list[Array]:
    """The surfaces (n, 3, 3) of a building, up to a height."""
    surfaces = [triangles_of([obstacle]) for obstacle in obstacles]
    return [faces[seen_when_cut_open(rooms, faces, height)] for faces in surfaces]


def _framed(flat: Array, border: float) -> tuple[Array, Array]:
    """Corners (2,) of a picture about points (n, 2), neither too tall nor too flat, with a strip
    below them for the scale."""
    lower, upper = flat.min(axis=0) - border, flat.max(axis=0) + border
    wide, high = upper - lower
    missing = np.array([max(high / _TALLEST - wide, 0.0), max(wide * _FLATTEST - high, 0.0)])
    lower, upper = lower - missing / 2, upper + missing / 2
    lower[1] -= _SCALE_STRIP * (upper[0] - lower[0])
    return lower, upper


def _layer(view: Projection, triangles: Array, colour: str, opacity: float) -> Layer:
    return Layer(view(triangles), np.array(to_rgb(colour)), opacity)


def _draw_panel(axes: Axes, stage: _Stage, panel: _Panel) -> None:
    robot = []
    for n, (q, colour, opacity) in enumerate(_postures(stage.env, panel)):
        # Links that turn in place share their surface in several postures: the last is in front.
        nearer = n * _TIE * stage.side * stage.view.axes[2]
        robot.append(_layer(stage.view, stage.robot.triangles(q) + nearer, colour, opacity))
    wide, high = stage.upper - stage.lower
    pixel = wide / (_INCHES * _PIXELS_PER_INCH)
    picture = paint(
        [*stage.still, *robot], stage.lower, pixel, (int(high / pixel), int(wide / pixel))
    )
    (left, bottom), (right, top) = stage.lower, stage.upper
    axes.imshow(picture, extent=(left, right, bottom, top))
    if panel.path is not None and len(panel.path) > 1:
        _draw_trace(axes, stage, panel, panel.path)
    if panel.title:
        chip = {"boxstyle": "round,pad=0.3", "facecolor": panel.colour, "alpha": 0.35, "lw": 0}
        axes.set_title(panel.title, bbox=chip, fontsize=11)


def _postures(env: Environment, panel: _Panel) -> list[tuple[Array, str, float]]:
    """Configurations (d,) to draw, each with its colour and opacity."""
    if panel.path is None:
        return []
    if len(panel.path) == 1:
        return [(panel.path[0], panel.colour, 1.0)]
    between = along(env.space, panel.path, np.linspace(0, 1, _GHOSTS + 2)[1:-1])
    fading = np.linspace(*_GHOST_OPACITY, _GHOSTS)
    return [
        *((q, panel.colour, float(o)) for q, o in zip(between, fading, strict=True)),
        (panel.path[0], _START, 1.0),
        (panel.path[-1], _GOAL, 1.0),
    ]


def _draw_trace(axes: Axes, stage: _Stage, panel: _Panel, path: Array) -> None:
    """The ways of the points that are traced."""
    style = (0, (4, 2)) if panel.refused else "-"
    halo = [Stroke(linewidth=3.4, foreground="white", alpha=0.8), Normal()]
    for way in stage.trace(path, _TRACE_POINTS):
        flat = stage.view(way)[:, :2]
        axes.plot(*flat.T, linestyle=style, color=panel.colour, linewidth=1.8, path_effects=halo)
        for end, colour in ((flat[0], _START), (flat[-1], _GOAL)):
            axes.plot(*end, "o", color=colour, markeredgecolor="white", markersize=6)


def _draw_scale(axes: Axes, stage: _Stage) -> None:
    """A length, which holds across the line of sight, in the left lower corner."""
    wide = stage.upper[0] - stage.lower[0]
    most = _SCALE_SHARE * wide
    decade = 10.0 ** math.floor(math.log10(most))
    length = max(decade * x for x in _SCALES if decade * x <= most * (1 + 1e-9))
    x, y = stage.lower[0] + _BORDER * stage.side, stage.lower[1] + _SCALE_STRIP / 4 * wide
    axes.plot([x, x + length], [y, y], "|-", color="black", linewidth=1, markersize=6)
    text = f"{length:g} {stage.env.units['workspace']}"
    axes.annotate(text, (x + length / 2, y), (0, 4), textcoords="offset points", ha="center")


def _draw_legend(figure: Figure, followed: str, refused: bool) -> None:
    keys = [
        Patch(color=_START, label="start"),
        Patch(color=_GOAL, label="goal, or end of a refused path" if refused else "goal"),
        Patch(color="tab:gray", alpha=0.4, label="on the way"),
        Line2D([], [], color="tab:gray", linewidth=1.8, label=followed),
    ]
    if refused:
        dashed = Line2D([], [], color="tab:gray", linestyle="--", label="refused by the judge")
        keys.append(dashed)
    ncols = len(keys) if figure.get_figwidth() > _INCHES else 2
    figure.legend(handles=keys, loc="outside lower center", ncols=ncols, frameon=False)
