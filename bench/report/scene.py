"""Pictures of an environment and of paths in it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from bench.record import Verdict, decode_path
from envs import Environment, InputError
from envs.collision.surface import triangulated
from envs.problem import Array

COLOURS = {
    "ntfields": "tab:orange",
    "ief3d": "tab:purple",
    "fmm": "tab:green",
    "mpnet": "tab:blue",
    "rrtstar": "tab:cyan",
    "lazyprmstar": "gold",
}
"""The paper's; other planners take the rest of the colour cycle."""

_OTHER_COLOURS = (
    *("tab:red", "tab:pink", "tab:brown", "tab:olive", "black", "tab:gray"),
    *("darkgreen", "navy", "salmon", "plum"),
)


_GREY = (0.62, 0.63, 0.68)


@dataclass(frozen=True)
class Shown:
    """One problem's paths, each (k, d), by planner; those that the judge refused are dashed."""

    problem: int
    paths: Mapping[str, Array]
    refused: frozenset[str]


def paths_of_problem(records: pd.DataFrame, fingerprint: str, problem: int | None) -> Shown:
    """The paths of a problem, by default of the one with the longest verified path.

    Raises:
        InputError: there are none.
    """
    rows = records[(records["env_fingerprint"] == fingerprint) & records["path"].notna()]
    if problem is None and not rows["length"].dropna().empty:
        problem = int(rows.loc[rows["length"].astype(float).idxmax(), "problem"])
    rows = rows[rows["problem"] == problem]
    if problem is None or rows.empty:
        which = "problem" if problem is None else f"problem {problem}"
        raise InputError(f"the run holds no path for this environment's {which}")
    paths = {row.planner: decode_path(row.path) for row in rows.itertuples()}
    refused = rows.loc[rows["outcome"] != Verdict.VALID.value, "planner"]
    return Shown(problem, paths, frozenset(refused))


def draw(env: Environment, shown: Shown | None, file: Path) -> None:
    """Draws the obstacles of a 3-D environment, and paths among them, into an image file.

    Raises:
        InputError: the environment is not 3-D, or the file cannot be written as an image.
    """
    if env.dimension != 3:
        raise InputError(f"only 3-D environments can be drawn so far, not {env.dimension}-D")
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(7, 6), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        for obstacle in env.obstacles:
            faces = np.asarray(triangulated(obstacle).triangles)
            solid = Poly3DCollection(
                faces, facecolors=[_GREY] * len(faces), alpha=0.45, shade=True, linewidths=0
            )
            axes.add_collection3d(solid)
        for axis, low, high in zip("xyz", env.lower, env.upper, strict=True):
            getattr(axes, f"set_{axis}lim")(low, high)
            getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(5))
        axes.set_box_aspect(env.upper - env.lower)
        axes.view_init(elev=24, azim=-62)
        if shown is not None:
            _draw_paths(axes, shown)
        try:
            figure.savefig(file, dpi=150)
        except (OSError, ValueError) as error:
            raise InputError(f"cannot write {file}: {error}") from error


def _draw_paths(axes: object, shown: Shown) -> None:
    others = iter(_OTHER_COLOURS * (1 + len(shown.paths)))
    for planner, path in shown.paths.items():
        style = "--" if planner in shown.refused else "-"
        colour = COLOURS.get(planner) or next(others)
        axes.plot(*path.T, style, color=colour, label=planner, linewidth=1.8)  # type: ignore[attr-defined]
    ends = np.array([next(iter(shown.paths.values()))[i] for i in (0, -1)])
    axes.scatter(*ends.T, color="black", s=25)  # type: ignore[attr-defined]
    axes.legend(loc="upper left", fontsize=8)  # type: ignore[attr-defined]
    axes.set_title(f"problem {shown.problem}")  # type: ignore[attr-defined]
