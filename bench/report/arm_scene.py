"""Pictures of an arm along the paths of planners, a panel each."""

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

from bench.report import scene
from bench.report.configurations import ArmShape, along, free_posture, triangles_of
from bench.report.projection import Projection, most_telling, region_about
from bench.report.raster import Layer, paint
from envs.problem import Array
from envs.scenes.arm_world import ArmWorld

_START, _GOAL, _ALONE = "#34507a", "#1f8a5b", "#3b6ea5"
_BASE, _GREY = "#6d7078", "#a9abb5"
_OBSTACLE_OPACITY = 0.42
_GHOSTS = 6
_GHOST_OPACITY = (0.25, 0.45)  # from start to goal, so that one sees which way it goes
_TRACE_POINTS = 400
_INCHES = 4.8  # of a panel's width
_PAD = 0.08  # about panels and titles, in inches
_PIXELS_PER_INCH = 300  # twice the file's, which smooths edges
_BORDER = 0.04  # about all that is drawn, in metres
_SCALES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # metres
_SCALE_SHARE = 0.3  # its length by a panel's width, at most
_LOOKED_AT = 2000  # faces of the arm of which it is asked whether they are hidden
_TIE = 1e-3  # metres
_TALLEST, _FLATTEST = 1.2, 0.4  # panels, height by width
_FAR_OUT = 10  # a configuration, by the extent of the bounds


@dataclass(frozen=True)
class _Panel:
    """A planner's path (k, d); None where what it gave is no path of this arm."""

    title: str
    colour: str
    refused: bool
    path: Array | None


@dataclass(frozen=True)
class _Stage:
    """What all panels share.

    Attributes:
        arm: its surfaces.
        still: what does not move.
        view: from where all is seen.
        lower, upper: (2,) corners of the pictures, in metres to the right and up.
    """

    arm: ArmShape
    still: list[Layer]
    view: Projection
    lower: Array
    upper: Array


def draw(env: ArmWorld, name: str, shown: scene.Shown | None, file: Path) -> None:
    """Draws an arm among its obstacles into an image file: along each planner's path, or without
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
        size = (_INCHES * columns, (_INCHES * high / wide + 0.4) * rows + 0.5)
        figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(h_pad=_PAD))
        grid = figure.subplots(rows, columns, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for axes, panel in zip(grid.flat, panels, strict=False):
            _draw_panel(axes, stage, panel)
        _draw_scale(grid.flat[0], stage)
        title = name if shown is None else f"{name}, problem {shown.problem}"
        figure.suptitle(title, fontsize=min(12.0, 110 * size[0] / len(title)))
        if shown is not None:
            _draw_legend(figure, any(panel.refused for panel in panels))
        scene.save(figure, file)


def _panels(env: ArmWorld, shown: scene.Shown) -> list[_Panel]:
    """One a planner."""
    colours = scene.colours(shown.paths)
    extent = env.upper - env.lower
    panels = []
    for planner, path in shown.paths.items():
        ours = len(path) > 0 and path.shape[1] == env.dimension
        # What is far out of bounds, or not a number, is nowhere near the scene.
        ours = ours and bool((np.abs(path - env.lower) <= _FAR_OUT * extent).all())
        refused = planner in shown.refused
        title = f"{planner} (refused)" if refused else planner
        panels.append(_Panel(title, colours[planner], refused, path if ours else None))
    return panels


def _stage(env: ArmWorld, paths: Sequence[Array]) -> _Stage:
    """`paths` are those that are to be seen."""
    arm = ArmShape(env.robot)
    shares = np.linspace(0, 1, _GHOSTS + 2)
    moving = np.concatenate([arm.triangles(q) for path in paths for q in along(path, shares)])
    traces = np.concatenate([arm.tips(along(path, np.linspace(0, 1, 100))) for path in paths])
    surfaces = [triangles_of([obstacle]) for obstacle in env.obstacles]
    corners = np.concatenate([moving.reshape(-1, 3), arm.base.reshape(-1, 3), traces])
    region = region_about(corners, env.robot, surfaces)
    cut = [region.cropped(surface) for surface in surfaces]
    looked_at = moving.mean(axis=1)[:: len(moving) // _LOOKED_AT + 1]
    view = most_telling(looked_at, traces, np.concatenate([np.zeros((0, 3, 3)), *cut]))
    still = [_layer(view, surface, _GREY, _OBSTACLE_OPACITY) for surface in cut]
    still.append(_layer(view, arm.base, _BASE, 1.0))
    flat = np.concatenate([view(corners), *(layer.triangles.reshape(-1, 3) for layer in still)])
    lower, upper = flat[:, :2].min(axis=0) - _BORDER, flat[:, :2].max(axis=0) + _BORDER
    wide, high = upper - lower
    missing = np.array([max(high / _TALLEST - wide, 0.0), max(wide * _FLATTEST - high, 0.0)])
    return _Stage(arm, still, view, lower - missing / 2, upper + missing / 2)


def _layer(view: Projection, triangles: Array, colour: str, opacity: float) -> Layer:
    return Layer(view(triangles), np.array(to_rgb(colour)), opacity)


def _draw_panel(axes: Axes, stage: _Stage, panel: _Panel) -> None:
    arm = []
    for n, (q, colour, opacity) in enumerate(_postures(panel)):
        # Links that turn in place share their surface in several postures: the last is in front.
        nearer = n * _TIE * stage.view.axes[2]
        arm.append(_layer(stage.view, stage.arm.triangles(q) + nearer, colour, opacity))
    wide, high = stage.upper - stage.lower
    pixel = wide / (_INCHES * _PIXELS_PER_INCH)
    picture = paint(
        [*stage.still, *arm], stage.lower, pixel, (int(high / pixel), int(wide / pixel))
    )
    (left, bottom), (right, top) = stage.lower, stage.upper
    axes.imshow(picture, extent=(left, right, bottom, top))
    if panel.path is not None and len(panel.path) > 1:
        _draw_trace(axes, stage, panel, panel.path)
    if panel.title:
        chip = {"boxstyle": "round,pad=0.3", "facecolor": panel.colour, "alpha": 0.35, "lw": 0}
        axes.set_title(panel.title, bbox=chip, fontsize=11)


def _postures(panel: _Panel) -> list[tuple[Array, str, float]]:
    """Configurations (d,) to draw, each with its colour and opacity."""
    if panel.path is None:
        return []
    if len(panel.path) == 1:
        return [(panel.path[0], panel.colour, 1.0)]
    between = along(panel.path, np.linspace(0, 1, _GHOSTS + 2)[1:-1])
    fading = np.linspace(*_GHOST_OPACITY, _GHOSTS)
    return [
        *((q, panel.colour, float(o)) for q, o in zip(between, fading, strict=True)),
        (panel.path[0], _START, 1.0),
        (panel.path[-1], _GOAL, 1.0),
    ]


def _draw_trace(axes: Axes, stage: _Stage, panel: _Panel, path: Array) -> None:
    """The way of the tool's tip."""
    tips = stage.arm.tips(along(path, np.linspace(0, 1, _TRACE_POINTS)))
    style = (0, (4, 2)) if panel.refused else "-"
    halo = [Stroke(linewidth=3.4, foreground="white", alpha=0.8), Normal()]
    flat = stage.view(tips)[:, :2]
    axes.plot(*flat.T, linestyle=style, color=panel.colour, linewidth=1.8, path_effects=halo)
    for end, colour in ((flat[0], _START), (flat[-1], _GOAL)):
        axes.plot(*end, "o", color=colour, markeredgecolor="white", markersize=6)


def _draw_scale(axes: Axes, stage: _Stage) -> None:
    """A length in metres, which holds across the line of sight, in the left lower corner."""
    wide = stage.upper[0] - stage.lower[0]
    length = max(x for x in _SCALES if x <= max(_SCALE_SHARE * wide, _SCALES[0]))
    x, y = stage.lower + _BORDER
    axes.plot([x, x + length], [y, y], "|-", color="black", linewidth=1, markersize=6)
    axes.annotate(
        f"{length:g} m", (x + length / 2, y), (0, 4), textcoords="offset points", ha="center"
    )


def _draw_legend(figure: Figure, refused: bool) -> None:
    keys = [
        Patch(color=_START, label="start"),
        Patch(color=_GOAL, label="goal"),
        Patch(color="tab:gray", alpha=0.4, label="on the way"),
        Line2D([], [], color="tab:gray", linewidth=1.8, label="tip of the tool"),
    ]
    if refused:
        dashed = Line2D([], [], color="tab:gray", linestyle="--", label="refused by the judge")
        keys.append(dashed)
    figure.legend(handles=keys, loc="outside lower center", ncols=len(keys), frameon=False)
