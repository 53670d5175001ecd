"""Pictures of an environment and of paths in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from numpy.typing import NDArray

import planners
from bench.report.projection import faced, interior
from bench.storage.record import Verdict, decode_path
from envs import Environment, InputError
from envs.collision.fcl_model import Allowed
from envs.errors import suggestion
from envs.problem import Array

_OTHER_COLOURS = (
    *("tab:red", "tab:pink", "tab:brown", "tab:olive", "black", "tab:gray"),
    *("darkgreen", "navy", "salmon", "plum"),
)


_DPI = 150
_GREY = (0.62, 0.63, 0.68)
_ABOVE_PATHS = 1.0  # where a building is cut off, in workspace units


@dataclass(frozen=True)
class _View:
    """How a scene is looked at: angles in degrees, and the opacity of obstacles."""

    elevation: float
    azimuth: float
    opacity: float

    def toward_eye(self) -> Array:
        """The unit vector (3,) from the scene to who looks at it."""
        up, round_ = np.radians([self.elevation, self.azimuth])
        return np.array([np.cos(up) * np.cos(round_), np.cos(up) * np.sin(round_), np.sin(up)])


_FROM_ASIDE = _View(24, -62, 0.45)
_CUT_OPEN = _View(52, -68, 1.0)


@dataclass(frozen=True)
class Shown:
    """One problem's paths, each (k, d), by planner; those that the judge refused are dashed."""

    problem: int
    paths: Mapping[str, Array]
    refused: frozenset[str]


def of_planners(records: pd.DataFrame, text: str, folder: Path) -> pd.DataFrame:
    """The records of the planners that "P,Q" names, or "all"; those of files and plug-ins that are
    not known here go by their ids in the run.

    Raises:
        InputError: one of them is not in the run, which is in `folder`.
    """
    known = list(dict.fromkeys(records["planner"]))
    wanted = planners.REGISTRY.ids_among(text, known)
    for id in wanted:
        if known and id not in known:
            raise InputError(f"{folder} holds no path of {id!r}; {suggestion(id, known)}")
    chosen: pd.DataFrame = records[records["planner"].isin(wanted)]
    return chosen


def paths_of_problem(records: pd.DataFrame, fingerprint: str, problem: int | None) -> Shown:
    """The paths of a problem, by default of the one with the longest verified path.

    Raises:
        InputError: there are none.
    """
    first = records[records["repeat"] == 0]
    rows = first[(first["env_fingerprint"] == fingerprint) & first["path"].notna()]
    if problem is None and not rows["length"].dropna().empty:
        problem = int(rows.loc[rows["length"].astype(float).idxmax(), "problem"])
    rows = rows[rows["problem"] == problem]
    if problem is None or rows.empty:
        which = "problem" if problem is None else f"problem {problem}"
        raise InputError(f"the run holds no path for this environment's {which}")
    paths = {row.planner: decode_path(row.path) for row in rows.itertuples()}
    refused = rows.loc[rows["outcome"] != Verdict.VALID.value, "planner"]
    return Shown(problem, paths, frozenset(refused))


def colours(ids: Iterable[str]) -> dict[str, str]:
    """What each planner is drawn in: what its spec says, or one of the rest."""
    names = list(ids)
    specified = {spec.id: spec.colour for spec in planners.REGISTRY.known() if spec.colour}
    others = iter(_OTHER_COLOURS * (1 + len(names)))
    return {
        name: specified[name] if is_color_like(specified.get(name)) else next(others)
        for name in names
    }


def save(figure: Figure, file: Path) -> None:
    """Writes a picture.

    Raises:
        InputError: the file cannot be written as an image.
    """
    try:
        figure.savefig(file, dpi=_DPI)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write {file}: {error}") from error


def draw(env: Environment, name: str, shown: Shown | None, file: Path) -> None:
    """Draws the obstacles of a 3-D environment, and paths among them, into an image file.

    Buildings, which enclose free space, are cut open. `name` is that of the environment.

    Raises:
        InputError: the environment is not 3-D, or the file cannot be written as an image.
    """
    if env.dimension != 3:
        raise InputError(f"only arms and 3-D environments can be drawn, not {env.dimension}-D ones")
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(7, 6), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        within = interior(env)
        view = _FROM_ASIDE if within is None else _CUT_OPEN
        for obstacle in env.obstacles:
            faces = np.asarray(obstacle.triangulate().triangles)
            if within is not None:
                faces = faces[_seen_when_cut_open(within, faces, shown)]
            solid = Poly3DCollection(
                faces, facecolors=[_GREY] * len(faces), alpha=view.opacity, shade=True, linewidths=0
            )
            axes.add_collection3d(solid)
        lower, upper = env.free_bounds
        for axis, low, high in zip("xyz", lower, upper, strict=True):
            getattr(axes, f"set_{axis}lim")(low, high)
            getattr(axes, f"{axis}axis").set_major_locator(MaxNLocator(5))
        axes.set_box_aspect(upper - lower)
        axes.view_init(elev=view.elevation, azim=view.azimuth)
        axes.computed_zorder = False  # paths in front of obstacles
        axes.set_title(name if shown is None else f"{name}, problem {shown.problem}")
        if shown is not None:
            _draw_paths(axes, shown)
        save(figure, file)


def _seen_when_cut_open(within: Allowed, faces: Array, shown: Shown | None) -> NDArray[np.int64]:
    """Which of the faces (n, 3, 3) of a building are seen with its ceilings and near walls taken
    off: indices of those whose free side faces the eye, up to a little above the paths."""
    normals, before, behind = faced(within, faces)
    toward = normals @ _CUT_OPEN.toward_eye()
    seen = (before & (toward > 0)) | (behind & (toward < 0))
    if shown is not None:
        highest = max(float(path[:, 2].max()) for path in shown.paths.values())
        seen &= faces.mean(axis=1)[:, 2] < highest + _ABOVE_PATHS
    return np.flatnonzero(seen)


def _draw_paths(axes: object, shown: Shown) -> None:
    colour_of = colours(shown.paths)
    for planner, path in shown.paths.items():
        style = "--" if planner in shown.refused else "-"
        colour = colour_of[planner]
        axes.plot(*path.T, style, color=colour, label=planner, linewidth=1.8, zorder=3)  # type: ignore[attr-defined]
    ends = np.array([next(iter(shown.paths.values()))[i] for i in (0, -1)])
    axes.scatter(*ends.T, color="black", s=25, zorder=4)  # type: ignore[attr-defined]
    axes.legend(loc="upper left", fontsize=8)  # type: ignore[attr-defined]
