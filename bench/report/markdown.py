"""The tables as Markdown, for the terminal and `summary.md`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from bench.analysis.run_results import RunResults
from bench.report import formatting
from envs.errors import printable


def write(run: RunResults, file: Path) -> None:
    """Writes the tables with their captions."""
    file.write_text(text(run), encoding="utf-8")


def text(run: RunResults) -> str:
    """The tables with their captions: all attempts, their further metrics, and the commonly solved
    problems."""
    further = formatting.further_rows(run)
    parts = [
        run.caption,
        table(formatting.success_rows(run)),
        formatting.success_note(run),
        formatting.spaces_note(run),
        *([formatting.FURTHER_NOTE, table(further)] if further else []),
        formatting.COMMON_NOTE,
        table(formatting.common_rows(run)),
        formatting.REACHED_NOTE,
        formatting.left_out_note(run.left_out),
        "\n".join(f"- {remark}." for remark in run.remarks),
    ]
    lines = "\n\n".join(filter(None, parts)).split("\n")
    return "".join(f"{printable(line)}\n" for line in lines)


def table(rows: Sequence[dict[str, str]]) -> str:
    """Rows of cells as a table."""
    if not rows:
        return "(none)"
    aligned = ["right" if key in formatting.NUMERIC else "left" for key in rows[0]]
    escaped = pd.DataFrame(rows).map(lambda cell: printable(cell).replace("|", r"\|"))
    text: str = escaped.to_markdown(index=False, colalign=aligned, disable_numparse=True)
    return text
