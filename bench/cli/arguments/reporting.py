"""Arguments of the commands that report, compare and draw what was measured."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from bench.analysis import regression
from bench.cli import commands
from bench.cli.arguments.common import add_planner_file, command
from bench.report import writers
from envs.errors import suggestion


def add_report(subparsers: Any) -> None:
    """`bench report`."""
    parser = command(
        subparsers,
        "report",
        commands.report,
        help="tables of a run",
        description="Writes reports of what was last run into each DIR, or one report of all into "
        "--out, and prints the tables.",
    )
    parser.add_argument("dirs", nargs="+", type=Path, metavar="DIR")
    parser.add_argument(
        "--format", default="md,csv", help=f"of {','.join(writers.FORMATS)} (default: md,csv)"
    )
    parser.add_argument(
        "--spread",
        type=_spread,
        default="deviation",
        metavar="deviation|variance",
        help="what stands after the ± of means (default: deviation)",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="(default: the run's own)")


def add_compare(subparsers: Any) -> None:
    """`bench compare`."""
    parser = command(
        subparsers,
        "compare",
        commands.compare,
        help="compare two runs, or two planners of one",
        description="Compares planners on the problems that two runs, or two planners of one run, "
        "share: success, time, length and margin, with tests and verdicts.",
    )
    parser.add_argument("a", type=Path, metavar="A", help="a folder that run wrote")
    parser.add_argument("b", type=Path, nargs="?", metavar="B", help="another (default: A)")
    parser.add_argument(
        "--planners",
        default="all",
        metavar="P,Q",
        help="P of A against Q of B; or one name, in both (default: all that are in both)",
    )
    parser.add_argument("--out", type=Path, metavar="FILE.csv", help="the table, unrounded")
    add_planner_file(parser)


def add_check(subparsers: Any) -> None:
    """`bench check`."""
    parser = command(
        subparsers,
        "check",
        commands.check,
        help="fail if a run is worse than a baseline",
        description="Tests whether planners solve fewer problems than in a baseline, or do worse "
        "by what --ratios names, and says how small a fall it would notice. Exit code 1 for a "
        "regression, 3 if nothing compares.",
    )
    add = parser.add_argument
    add("dir", type=Path, metavar="DIR", help="a folder that run wrote")
    add("--baseline", type=Path, required=True, metavar="FILE.csv", help="kept with the code")
    add("--update", action="store_true", help="write the baseline from DIR, and check nothing")
    add(
        "--alpha",
        type=float,
        default=0.01,
        metavar="P",
        help="the probability of any false alarm in a check (default: 0.01)",
    )
    known = ",".join(regression.MEASURES)
    add("--ratios", metavar="NAMES", help=f"of {known}, by the reference's if one is named")
    add("--reference", metavar="PLANNER", help="of the same run, as in fmm")
    add(
        "--tolerance",
        type=float,
        default=0.1,
        metavar="SHARE",
        help="by how much ratios may get worse (default: 0.1)",
    )
    add("--out", type=Path, metavar="FILE.md", help="what is printed, as a file too")
    add_planner_file(parser)


def add_show(subparsers: Any) -> None:
    """`bench show`."""
    parser = command(
        subparsers,
        "show",
        commands.show,
        help="draw an environment and paths",
        description="Draws an environment, and one problem with every planner's path from a run.",
    )
    parser.add_argument("--env", required=True)
    parser.add_argument("--paths", type=Path, metavar="DIR", help="a folder that run wrote")
    parser.add_argument("--planners", default="all", help="whose paths (default: all there are)")
    parser.add_argument("--problem", type=int, metavar="I", help="(default: the longest path's)")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.png")
    add_planner_file(parser)


def add_field(subparsers: Any) -> None:
    """`bench field`."""
    parser = command(
        subparsers,
        "field",
        commands.field,
        help="draw the time fields of planners",
        description="Draws predicted speed (colour) and arrival time from a source (lines) on a "
        "slice, a column a planner, with the relative error of the time against fast marching.",
    )
    add = parser.add_argument
    add("--env", required=True)
    add("--planners", default="fmm,ntfields,ief3d", help="(default: fmm,ntfields,ief3d)")
    add(
        "--source",
        type=_numbers,
        metavar="X,Y,Z",
        help="of the times, and place of the slice (default: near a corner, where most is filled)",
    )
    add("--device", default="cpu", help="of learned planners, cpu or cuda (default: cpu)")
    add("--no-train", action="store_true", help="refuse learned planners that have no weights")
    add("--out", type=Path, required=True, metavar="FILE.png")
    add_planner_file(parser)


def _spread(text: str) -> str:
    known = {"deviation": "std", "variance": "var"}
    if text not in known:
        raise argparse.ArgumentTypeError(f"unknown {text!r}; {suggestion(text, known)}")
    return known[text]


def _numbers(text: str) -> Any:
    try:
        return np.array([float(part) for part in text.split(",")])
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not numbers with commas between") from None
