"""Prints tables of runs over sets of problems: of each planner and set how many problems it solved
and in what time, and which problems can be solved as they are posed:

    bench problems --env mbm-panda,mbm-ur5,mbm-fetch,mbm-baxter --json > CENSUS
    python tests/benchmarks/problem_sets_page.py CENSUS RUN [RUN ...]

A RUN is a folder of `bench run`.
"""

from __future__ import annotations

import json
import math
import re
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

import pandas as pd

import bench
from bench.report import markdown


def main(census: Path, runs: Sequence[Path]) -> None:
    print("## Which problems are valid as posed\n")
    print(markdown.table([checked(entry) for entry in json.loads(census.read_text())]))
    for run in runs:
        summary = bench.load(run).summary
        shared = shared_words(summary["env"])
        print(f"\n## {shared}\n")
        sets = list(dict.fromkeys(summary["env"]))
        names = [name.removeprefix(shared + "-") for name in sets]
        print(markdown.table(list(rows(summary, dict(zip(sets, names, strict=True))))))


def shared_words(names: Iterable[str]) -> str:
    """The words with which all begin, as in a-b of a-b-c and a-b-d."""
    split = [name.split("-") for name in names]
    alike = takewhile(lambda words: len(set(words)) == 1, zip(*split, strict=False))
    return "-".join(words[0] for words in alike)


def checked(entry: dict[str, Any]) -> dict[str, str]:
    """The cells of a set: problems may be invalid at both ends, and are counted once for each."""
    causes = Counter(cause(end["reason"]) for end in entry["invalid"])
    told = "; ".join(f"{name} ({count})" for name, count in causes.most_common(2))
    more = len(causes) - 2
    return {
        "set": entry["env"],
        "problems": str(entry["problems"]),
        "valid": str(entry["valid"]),
        "invalid, by what touches": told + (f"; {more} more" if more > 0 else ""),
    }


def cause(reason: str) -> str:
    """What touches, without how deep: "link 'a' and link 'b'"."""
    first = reason.split(";")[0]
    return re.sub(r" is [-0-9.e]+ \w+ deep in ", " and ", first)


def rows(summary: pd.DataFrame, sets: dict[str, str]) -> Iterable[dict[str, str]]:
    """A row for each planner, with a column for each set under the name that is given."""
    for planner, found in summary.groupby("planner", sort=False):
        cells = found.set_index("env").reindex(list(sets))
        told = map(cell, cells.to_dict("records"))
        solved, attempted = int(cells["solved"].sum()), int(cells["attempted"].sum())
        share = f"{100 * solved / attempted:.1f} %" if attempted else "-"
        yield {
            "planner": f"`{planner}`",
            **dict(zip(sets.values(), told, strict=True)),
            "all": share,
        }


def cell(of: dict[str, Any]) -> str:
    """Solved of attempted, and the median time, in which what was not solved takes for ever."""
    seconds = of["time_s_median_censored"]
    if math.isnan(of["attempted"]):
        return "-"
    time = f", {seconds:.3f} s" if math.isfinite(seconds) else ""
    return f"{int(of['solved'])} of {int(of['attempted'])}{time}"


if __name__ == "__main__":
    main(Path(sys.argv[1]), [Path(run) for run in sys.argv[2:]])
