"""An audit in words, tables and charts."""

from __future__ import annotations

from collections.abc import Callable
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
    "these. Times are medians over all claimed paths."
)


def text(run: RunResults, audit: Audit) -> str:
    """How the run came about, the table, and what its columns are."""
    rows = [_cells(row, audit.units[row["env"]]) for row in audit.summary.to_dict("records")]
    return "\n\n".join([run.caption, markdown.table(rows), NOTE]) + "\n"


def _cells(row: dict[Any, Any], unit: str) -> dict[str, str]:
    share, low, high = (
        f"{100 * row[f'refused_{which}']:.1f}" for which in ("share", "low", "high")
    )
    return {
        "env": row["env"],
        "planner": row["planner"],
        "claimed": f"{row['claimed']}",
        "refused": f"{row['refused']}",
        "refused %": f"{share} [{low}, {high}]",
        "touching": f"{row['touching']}",
        "deepest": _length(row["depth_max"], unit),
        "median depth": _length(row["depth_median"], unit),
        "of the path %": _percent(row["share_of_path_mean"]),
        "time s": seconds(row["time_median"], 3),
    }


def _length(value: float, unit: str) -> str:
    return NONE if pd.isna(value) else f"{value:.2g} {unit}"


def _percent(value: float) -> str:
    return NONE if pd.isna(value) else f"{100 * value:.2g}"


def write(run: RunResults, audit: Audit, folder: Path) -> list[str]:
    """Writes table and charts to a folder, and the worst path as a picture if any was refused.

    Returns:
        The names of the files.

    Raises:
        InputError: the folder cannot be written to.
    """
    worst = audit.worst
    files: dict[str, Callable[[Path], object]] = {
        "audit.md": lambda file: file.write_text(text(run, audit), encoding="utf-8"),
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
    """The share that was refused by planner; below, of each sweep, that and the time over its
    parameter."""
    import matplotlib.pyplot as plt

    table = audit.summary
    chosen = sweeps(list(dict.fromkeys(table["planner"])))
    sizes = [max(1.5, 0.3 * len(table) + 0.8), *(3.0 for _ in chosen)]
    figure, rows = plt.subplots(
        len(sizes),
        1,
        figsize=(8, sum(sizes)),
        height_ratios=sizes,
        layout="constrained",
        squeeze=False,
    )
    _draw_bars(table, rows[0, 0])
    for axes, sweep in zip(rows[1:, 0], chosen, strict=True):
        _draw_sweep(table, sweep, axes)
    figure.savefig(file, dpi=120)
    plt.close(figure)


def _draw_bars(table: pd.DataFrame, axes: Any) -> None:
    shares = 100 * table[["refused_share", "refused_low", "refused_high"]].to_numpy()
    whiskers = np.abs(shares[:, 1:] - shares[:, :1]).T
    names = [f"{env} {planner}" for env, planner in table[["env", "planner"]].to_numpy()]
    axes.barh(range(len(table)), shares[:, 0], xerr=whiskers, color="tab:red", alpha=0.7, capsize=2)
    axes.set_yticks(range(len(table)), names)
    axes.invert_yaxis()  # the first on top, as in the table
    axes.set(xlabel="claimed paths that the judge refuses %", xlim=(0, None))


def _draw_sweep(table: pd.DataFrame, sweep: Sweep, axes: Any) -> None:
    beside = axes.twinx()
    for env, rows in table.groupby("env", sort=False):
        of = rows.set_index("planner")
        known = [(value, id) for value, id in sweep.values if id in of.index]
        values = [value for value, _ in known]
        found = of.loc[[id for _, id in known]]
        [line] = axes.plot(values, 100 * found["refused_share"], "o-", label=str(env))
        beside.plot(values, found["time_median"], "s:", color=line.get_color(), alpha=0.6)
    axes.set(xscale="log", xlabel=sweep.parameter, ylabel="refused %", title=sweep.title)
    beside.set(yscale="log", ylabel="median time s (dotted)")
    axes.legend()


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
