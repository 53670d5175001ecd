"""An audit in words, tables and charts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import envs
from bench.analysis.audit import Audit
from bench.analysis.run_results import RunResults
from bench.analysis.sweeps import Sweep, sweeps
from bench.report import markdown
from bench.report.formatting import NONE, seconds
from bench.storage.record import decode_path
from envs import InputError
from envs.files.paths import atomic_write

NOTE = (
    "Claimed: paths with which planners say to have solved the problem. Refused: those that the "
    "judge does not prove free, with the 95 % interval of the share (Wilson). Touching: those of "
    "them in which something is in contact at a place that was looked at; the rest comes within "
    "the judge's tolerance. Depths, and the share of the path's length in contact, are over "
    "these. States apart: the longest gap between the states that the planner checks along its "
    "motions, where it says so. Times are medians over all claimed paths."
)

_EVERYWHERE = "all"


def text(run: RunResults, audit: Audit) -> str:
    """How the run came about, the tables, and what their columns are."""
    tables = [[_cells(row, audit.units[row["env"]]) for row in audit.summary.to_dict("records")]]
    if len(audit.units) > 1:
        units = _common_units(audit)
        everywhere = ({"env": _EVERYWHERE, **row} for row in audit.overall.to_dict("records"))
        tables.insert(0, [_cells(row, units) for row in everywhere])
    return "\n\n".join([run.caption, *map(markdown.table, tables), NOTE]) + "\n"


def _page(run: RunResults, audit: Audit) -> str:
    """The same with the pictures that stand beside it."""
    pictures = ["![Claimed paths that the judge refuses](audit.png)"]
    if audit.worst is not None:
        worst = audit.worst
        depth = _length(worst["depth"], audit.units[worst["env"]]["workspace"])
        which = f"problem {worst['problem']} of {worst['env']} by {worst['planner']}"
        pictures += [f"The deepest path, {depth}: {which}.", "![The deepest path](worst.png)"]
    return "\n".join([text(run, audit), *(f"{picture}\n" for picture in pictures)])


def _common_units(audit: Audit) -> dict[str, str]:
    """Those that all environments have; of a quantity of which they have several, no name."""
    return {
        of: _only({units[of] for units in audit.units.values()})
        for of in ("workspace", "configuration")
    }


def _only(names: set[str]) -> str:
    return names.pop() if len(names) == 1 else ""


def _cells(row: Mapping[Any, Any], units: Mapping[str, str]) -> dict[str, str]:
    share, low, high = (
        f"{100 * row[f'refused_{which}']:.1f}" for which in ("share", "low", "high")
    )
    return {
        "env": row["env"],
        "planner": row["planner"],
        "states apart": _length(row["checked_every"], units["configuration"]),
        "claimed": f"{row['claimed']}",
        "refused": f"{row['refused']}",
        "refused %": f"{share} [{low}, {high}]",
        "touching": f"{row['touching']}",
        "deepest": _length(row["depth_max"], units["workspace"]),
        "median depth": _length(row["depth_median"], units["workspace"]),
        "of the path %": _percent(row["share_of_path_mean"]),
        "time s": seconds(row["time_median"], 3),
    }


def _length(value: float, unit: str) -> str:
    """In a unit, or nothing where environments have several."""
    return NONE if pd.isna(value) or not unit else f"{value:.2g} {unit}"


def _percent(value: float) -> str:
    return NONE if pd.isna(value) else f"{100 * value:.2g}"


def write(run: RunResults, audit: Audit, folder: Path) -> list[str]:
    """Writes a page with table and charts to a folder, and the worst path as a picture if any was
    refused.

    Returns:
        The names of the files.

    Raises:
        InputError: the folder cannot be written to.
    """
    worst = audit.worst
    files: dict[str, Callable[[Path], object]] = {
        "audit.md": lambda file: file.write_text(_page(run, audit), encoding="utf-8"),
        "audit.csv": lambda file: audit.summary.to_csv(file, index=False),
        "audit_paths.csv": lambda file: audit.refused.to_csv(file, index=False),
        "audit.png": lambda file: _draw(audit, file),
    }
    if worst is not None:
        files["worst.png"] = lambda file: _draw_worst(run, worst, file)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, write_one in files.items():
            with atomic_write(folder / name) as part:
                write_one(part)
    except OSError as error:
        raise InputError(f"cannot write the audit to {folder}: {error}") from error
    return list(files)


def _draw(audit: Audit, file: Path) -> None:
    """The share that was refused by planner, and where there are several environments by these;
    below, of each sweep, that and the time over its parameter."""
    import matplotlib.pyplot as plt

    overall, chosen = audit.overall, sweeps(list(audit.overall["planner"]))
    several = len(audit.units) > 1
    sizes = [
        max(1.5, 0.3 * len(overall) + 0.8),
        *([0.22 * len(audit.units) + 2.5] if several else []),
        *(3.0 for _ in chosen),
    ]
    figure, rows = plt.subplots(
        len(sizes),
        1,
        figsize=(9, sum(sizes)),
        height_ratios=sizes,
        layout="constrained",
        squeeze=False,
    )
    _draw_bars(overall, rows[0, 0])
    if several:
        _draw_by_environment(audit.summary, rows[1, 0])
    for axes, sweep in zip(rows[len(rows) - len(chosen) :, 0], chosen, strict=True):
        _draw_sweep(audit, sweep, axes)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def _draw_bars(table: pd.DataFrame, axes: Any) -> None:
    shares = 100 * table[["refused_share", "refused_low", "refused_high"]].to_numpy()
    whiskers = np.abs(shares[:, 1:] - shares[:, :1]).T
    axes.barh(range(len(table)), shares[:, 0], xerr=whiskers, color="tab:red", alpha=0.7, capsize=2)
    axes.set_yticks(range(len(table)), table["planner"])
    axes.invert_yaxis()  # the first on top, as in the table
    axes.set(xlabel="claimed paths that the judge refuses %", xlim=(0, None))


def _draw_by_environment(table: pd.DataFrame, axes: Any) -> None:
    """A cell for each environment and planner; empty where nothing was claimed."""
    planners, environments = (list(dict.fromkeys(table[name])) for name in ("planner", "env"))
    shares = (
        100
        * table.pivot(index="env", columns="planner", values="refused_share").loc[
            environments, planners
        ]
    )
    axes.imshow(shares, cmap="Reds", vmin=0, vmax=100, aspect="auto")
    for (row, column), share in np.ndenumerate(shares):
        if np.isfinite(share):
            colour = "white" if share > 60 else "black"
            axes.text(column, row, f"{share:.0f}", ha="center", va="center", color=colour, size=7)
    axes.set_xticks(range(len(planners)), planners, rotation=30, ha="right", size=7)
    axes.set_yticks(range(len(environments)), environments, size=7)
    axes.set_title("of each environment %")


def _draw_sweep(audit: Audit, sweep: Sweep, axes: Any) -> None:
    """Of all environments together, and of each."""
    beside = axes.twinx()
    parts = dict(iter(audit.summary.groupby("env", sort=False)))
    if len(parts) > 1:
        for rows in parts.values():
            _draw_line(rows, sweep, axes, beside, {"color": "grey", "alpha": 0.25, "ms": 3})
    name = _EVERYWHERE if len(parts) > 1 else str(next(iter(parts)))
    _draw_line(audit.overall, sweep, axes, beside, {"color": "tab:red", "label": name})
    axes.set(xscale="log", xlabel=sweep.parameter, ylabel="refused %", title=sweep.title)
    beside.set(yscale="log", ylabel="median time s (dotted)")
    axes.legend()


def _draw_line(
    rows: pd.DataFrame, sweep: Sweep, axes: Any, beside: Any, style: Mapping[str, Any]
) -> None:
    of = rows.set_index("planner")
    known = [(value, id) for value, id in sweep.values if id in of.index]
    values, found = [value for value, _ in known], of.loc[[id for _, id in known]]
    axes.plot(values, 100 * found["refused_share"], "o-", **style)
    beside.plot(values, found["time_median"], "s:", **style)


def _draw_worst(run: RunResults, worst: Any, file: Path) -> None:
    from bench.report import scene
    from bench.report.chosen_paths import Shown

    records = run.records
    [row] = records[
        (records["env"] == worst["env"])
        & (records["planner"] == worst["planner"])
        & (records["problem"] == worst["problem"])
        & (records["repeat"] == worst["repeat"])
    ].to_dict("records")
    env = envs.make(worst["env"])
    if env.scenes_differ:
        [problem] = env.problems_at([worst["problem"]], int(row["problems_seed"]))
        env = env.scene_of(problem)
    path = {worst["planner"]: decode_path(row["path"])}
    scene.draw(env, worst["env"], Shown(worst["problem"], path, frozenset(path)), file)
