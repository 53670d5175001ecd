"""Pictures of time fields as the paper draws them, and their error against fast marching."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from numpy.typing import NDArray

from envs import Environment, InputError
from envs.problem import Array
from planners.base import TimeFieldPlanner

PER_AXIS = 200
"""Nodes of a slice along its longer side."""

_COLUMNS = 4  # as wide as a picture may be for strips to stand beside each other
_CONTOURS = 24
_FULL = 0.45  # a plane that is fuller has little of a field to show
_COLOURS = "viridis"  # blue where it is slow, yellow where it is fast


@dataclass(frozen=True)
class Slice:
    """The plane of the first two coordinates through a source.

    Attributes:
        source: (d,) from where arrival times are counted.
        axes: nodes along the two coordinates.
        q: (rows * columns, d), the nodes, row by row.
        free: (rows * columns,) of bool, those in free space.
        distances: (rows * columns,) from the source, as the environment's space measures them.
    """

    source: Array
    axes: tuple[Array, Array]
    q: Array
    free: NDArray[np.bool_]
    distances: Array

    @staticmethod
    def through(env: Environment, source: Array | None = None) -> Slice:
        """The slice through a source, by default one near a corner of a plane that shows much.

        Raises:
            InputError: the source has another dimension, is out of bounds or in collision; or
                configurations have no two coordinates.
        """
        _check_coordinates(env)
        chosen = _near_corner(env, _in_telling_plane(env)) if source is None else source
        _check_source(env, chosen)
        lower, upper = env.free_bounds
        spacing = (upper - lower)[:2].max() / (PER_AXIS - 1)
        x, y = (
            np.arange(low, high + spacing / 2, spacing).clip(max=high)
            for low, high in zip(lower[:2], upper[:2], strict=True)
        )
        q = _plane(chosen, x, y)
        distances = env.space.distance(q, np.broadcast_to(chosen, q.shape))
        return Slice(chosen, (x, y), q, env.clearance(q) > 0, distances)


@dataclass(frozen=True)
class Field:
    """A planner's field on a slice: arrival times and speeds, both (n,)."""

    times: Array
    speeds: Array


def field_of(planner: object, name: str, where: Slice) -> Field:
    """The field of a planner that is set up.

    Raises:
        InputError: it has none.
    """
    if not isinstance(planner, TimeFieldPlanner):
        raise InputError(f"{name} has no time field to draw")
    return Field(*planner.times_and_speeds(where.source, where.q))


def errors(fields: Mapping[str, Field], reference: Field, where: Slice) -> pd.DataFrame:
    """Relative errors of the arrival times in free space: a row a planner.

    Nodes closer to the source than three spacings of a 100-per-axis grid are left out, where the
    reference is coarse itself.
    """
    extent = max(float(np.ptp(axis)) for axis in where.axes)
    counted = where.free & (where.distances > 3 * extent / 99)
    rows = []
    for name, field in fields.items():
        error = np.abs(field.times[counted] / reference.times[counted] - 1)
        rows.append(
            {
                "planner": name,
                "T error median": np.median(error),
                "T error 90th percentile": np.quantile(error, 0.9),
            }
        )
    table: pd.DataFrame = pd.DataFrame(rows)
    return table


@dataclass(frozen=True)
class Strip:
    """A row of pictures: the fields of planners, by name, on a slice of an environment.

    Attributes:
        errors: as `errors` makes them, in the order of the fields.
    """

    title: str
    where: Slice
    fields: Mapping[str, Field]
    errors: pd.DataFrame


def draw(strips: Sequence[Strip], file: Path) -> None:
    """One strip an environment, one column of it a planner: colour is the predicted speed, lines
    are arrival times in free space. Short strips stand beside each other.

    Raises:
        InputError: the file cannot be written as an image.
    """
    columns = max(len(strip.fields) for strip in strips)
    beside = min(len(strips), max(1, _COLUMNS // columns))
    rows = math.ceil(len(strips) / beside)
    with mpl.rc_context({"font.size": 9}):
        size = (3.2 * columns * beside + 0.8, 3.6 * rows)
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(rows, columns * beside, squeeze=False)
        for axes in grid.flat:
            axes.set_axis_off()
        for axes, strip in zip(grid.reshape(-1, columns), strips, strict=False):
            image = _draw_strip(axes, strip, named=len(strips) > 1)
        figure.colorbar(image, ax=grid, label="predicted speed", shrink=0.7 / rows)
        try:
            figure.savefig(file, dpi=150 if len(strips) == 1 else 100, bbox_inches="tight")
        except (OSError, ValueError) as error:
            raise InputError(f"cannot write {file}: {error}") from error


def _draw_strip(row: Iterable[Axes], strip: Strip, named: bool) -> QuadMesh:
    where = strip.where
    shape = len(where.axes[1]), len(where.axes[0])
    finite = [f.times[where.free & np.isfinite(f.times)] for f in strip.fields.values()]
    levels = np.linspace(0, max(float(np.quantile(t, 0.99)) for t in finite), _CONTOURS)
    for axes, (name, field), error in zip(
        row, strip.fields.items(), strip.errors.to_dict("records"), strict=False
    ):
        image = axes.pcolormesh(
            *where.axes,
            field.speeds.reshape(shape),
            cmap=_COLOURS,
            vmin=0,
            vmax=1,
            shading="nearest",
            rasterized=True,
        )
        times = np.where(where.free, field.times, np.nan).reshape(shape)
        axes.contour(*where.axes, times, levels, colors="white", linewidths=0.7)
        axes.contour(*where.axes, where.free.reshape(shape), [0.5], colors="black", linewidths=0.9)
        axes.plot(*where.source[:2], "r*", markersize=9)
        axes.set_axis_on()
        axes.set_title(f"{strip.title}, {name}" if named else name)
        axes.set_aspect("equal")
        axes.set_xlabel(
            f"T error: median {100 * error['T error median']:.1f} %,\n"
            f"90th percentile {100 * error['T error 90th percentile']:.1f} %"
        )
    return image


def _in_telling_plane(env: Environment) -> Array:
    """The middle (d,) of free space, its third coordinate moved to where much is to be seen: in
    rooms where there is most room, as in a floor plan, elsewhere where obstacles fill most."""
    lower, upper = env.free_bounds
    middle: Array = (lower + upper) / 2
    if env.dimension < 3:
        return middle
    x, y = (np.linspace(lower[i], upper[i], 41) for i in (0, 1))
    heights = np.linspace(lower[2], upper[2], 41)[4:-4]
    planes = np.repeat(middle[None], len(heights), axis=0)
    planes[:, 2] = heights
    shown = _room if env.is_interior else _fullness
    score = np.array([shown(env, env.clearance(_plane(through, x, y))) for through in planes])
    best = np.flatnonzero(score == score.max())
    telling: Array = planes[best[(len(best) - 1) // 2]]  # the middle one of a box's
    return telling


def _room(env: Environment, clearance: Array) -> float:
    """The mean of clearances (n,), as far as they count for the speed."""
    return float(clearance.clip(0, env.speed_model.d_max).mean())


def _fullness(env: Environment, clearance: Array) -> float:
    """The share of clearances (n,) in collision, if it leaves something to see."""
    filled = float((clearance <= 0).mean())
    return filled if filled <= _FULL else -filled


def _near_corner(env: Environment, middle: Array) -> Array:
    """The point of a plane with enough clearance that is nearest to the lower corner."""
    lower, upper = env.free_bounds
    x, y = (
        np.linspace(low, high, 81)[4:-4] for low, high in zip(lower[:2], upper[:2], strict=True)
    )
    q = _plane(middle, x, y)
    roomy = q[env.clearance(q) >= env.speed_model.d_max / 4]
    if len(roomy) == 0:
        raise InputError("the plane has no roomy place for a source; choose one by --source")
    nearest: Array = roomy[np.argmin((roomy - lower).sum(axis=1))]
    return nearest


def _check_coordinates(env: Environment) -> None:
    if not 2 <= env.space.size == env.space.dimension:
        raise InputError(
            "fields are drawn in the plane of the first two coordinates, and configurations here "
            "are rotations, or have one coordinate; choose another environment"
        )


def _check_source(env: Environment, source: Array) -> None:
    text = ",".join(f"{x:g}" for x in source)
    if source.shape != (env.dimension,) or not np.isfinite(source).all():
        raise InputError(f"--source {text}: {env.dimension} finite numbers are needed")
    if not env.contains(source[None])[0]:
        raise InputError(f"--source {text} is out of bounds")
    if env.clearance(source[None])[0] <= 0:
        raise InputError(f"--source {text} is in collision")


def _plane(through: Array, x: Array, y: Array) -> Array:
    """Nodes (rows * columns, d) over two axes, with the other coordinates of `through`."""
    columns, rows = np.meshgrid(x, y)
    q = np.repeat(through[None], columns.size, axis=0)
    q[:, 0], q[:, 1] = columns.ravel(), rows.ravel()
    return q
