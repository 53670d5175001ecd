"""A comparison as Markdown, and as CSV with all digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from bench.analysis.comparison.table import CONFIDENCE, SUCCESS
from bench.analysis.run_results import RunResults
from bench.analysis.statistics import effects
from bench.judging.metric import Metric
from bench.report import markdown
from envs import InputError

_NOTE = (
    "Verdicts are of B, by A: better is {better}; "
    "same means that no difference was shown, not that there is none; cannot tell that the "
    "problems are too few to show any. Success is of the n problems "
    "that both were measured on, with McNemar's exact test; the rest are medians over the n that "
    "both solved, with Wilcoxon's signed-rank test. B / A is Hodges and Lehmann's estimate of B by "
    "A on a problem, and B - A of margins and where a value is not positive, "
    f"with the {100 * CONFIDENCE:.0f} % interval that goes with the test; where both are the same "
    "on some problems, it is about the others, whose number stands there. Corrected p are Holm's "
    f"for all tests of the table. A difference is shown if that is at most {1 - CONFIDENCE:.2g}."
)

_LEAST_P = 1e-4  # smaller ones are printed as such


def text(
    a: RunResults,
    b: RunResults,
    table: pd.DataFrame,
    left_out: Sequence[str],
    metrics: Sequence[Metric],
) -> str:
    """How the runs came about, the table of `compare` by some metrics, and notes on what it means,
    on what does not compare, and on what was left out."""
    labels = {SUCCESS: SUCCESS, **{metric.name: a.heading(metric) for metric in metrics}}
    names = [f"{side}: {_folders(run)}. {run.caption}" for side, run in (("A", a), ("B", b))]
    heading = names if a is not b else [f"A and B: {names[0].removeprefix('A: ')}"]
    rows = [_cells(row, labels) for row in table.to_dict("records")]
    parts = [*heading, markdown.table(rows), _NOTE.format(better=_better(metrics))]
    remarks = [*_reasons(table, labels), *(f"Left out: {reason}." for reason in left_out)]
    if remarks:
        parts.append("\n".join(f"- {remark}" for remark in remarks))
    return "\n\n".join(parts) + "\n"


def _better(metrics: Sequence[Metric]) -> str:
    directions = [f"a {metric.better} {metric.title}" for metric in metrics]
    return ", ".join(["more success", *directions])


def write_csv(table: pd.DataFrame, file: Path) -> None:
    """Writes the table of `compare`, unrounded.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        table.to_csv(file, index=False)
    except OSError as error:
        raise InputError(f"cannot write {file}: {error}") from error


def _folders(run: RunResults) -> str:
    return ", ".join(f"`{folder}`" for folder in run.folders)


def _cells(row: dict[Any, Any], labels: Mapping[str, str]) -> dict[str, str]:
    success = row["measure"] == SUCCESS
    return {
        "env": row["env"],
        "A": row["planner_a"],
        "B": row["planner_b"],
        "measure": labels[row["measure"]],
        "n": f"{row['n']}",
        "of A": _value(row["value_a"], success),
        "of B": _value(row["value_b"], success),
        "B / A": _against(row),
        "p": _p(row["p"]),
        "p corrected": _p(row["p_holm"]),
        "verdict": row["verdict"],
    }


def _value(value: float, is_rate: bool) -> str:
    if pd.isna(value):
        return "-"
    return f"{100 * value:.1f} %" if is_rate else f"{value:.4g}"


def _against(row: dict[Any, Any]) -> str:
    if row["measure"] == SUCCESS:
        return f"only A {row['only_a']}, only B {row['only_b']}"
    if pd.isna(row["estimate"]):
        return "-"
    numbers = f"{row['estimate']:.3g} [{row['low']:.3g}, {row['high']:.3g}]"
    if row["differing"] < row["n"]:
        numbers += f" of {row['differing']}"
    return f"B - A: {numbers}" if row["effect"] == effects.DIFFERENCE else numbers


def _p(p: float) -> str:
    if pd.isna(p):
        return "-"
    return f"< {_LEAST_P:.4f}" if p < _LEAST_P else f"{p:.4f}"


def _reasons(table: pd.DataFrame, labels: Mapping[str, str]) -> list[str]:
    """Why some measures do not compare, each reason once."""
    without = table[table["reason"] != ""]
    lines = []
    for (measure, reason), rows in without.groupby(["measure", "reason"], sort=False):
        where = [
            f"{env} {a}" if a == b else f"{env} {a} and {b}"
            for env, a, b in rows[["env", "planner_a", "planner_b"]].itertuples(index=False)
        ]
        lines.append(f"Not comparable, {labels[str(measure)]}: {reason} ({'; '.join(where)}).")
    return lines
