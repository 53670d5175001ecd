"""The command line: arguments to calls."""

from __future__ import annotations

import argparse
import logging
import re
import sys
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import psutil

from bench import commands
from bench.report import files
from bench.suite import PAPER
from envs import InputError
from envs.errors import suggestion

BAD_INPUT, INTERRUPTED = 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr, force=True)
    try:
        chosen = _parse(arguments)
        chosen.started_s = _since_process_start() if arguments is None else 0.0
        code: int = chosen.command(chosen)
    except InputError as error:
        print(f"bench: error: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("bench: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED
    return code


def _since_process_start() -> float:
    return time.time() - psutil.Process().create_time()


def _parse(arguments: Sequence[str] | None) -> argparse.Namespace:
    """The arguments, with a suggestion for what is not among them."""
    chosen, unknown = _parser().parse_known_args(arguments)
    if unknown:
        options = re.findall(r"--[a-z-]+", chosen.parser.format_help())
        raise InputError(f"unknown argument {unknown[0]!r}; {suggestion(unknown[0], set(options))}")
    return chosen


class _Parser(argparse.ArgumentParser):
    """Reports a wrong argument in one line."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message} (see {self.prog} --help)")


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="bench", description="Benchmark of robot motion planners.", allow_abbrev=False
    )
    parser.add_argument("--version", action="version", version=metadata.version("plannerbench"))
    subparsers = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for add in (
        _add_run,
        _add_train,
        _add_report,
        _add_compare,
        _add_show,
        _add_field,
        _add_paper,
        _add_list,
    ):
        add(subparsers)
    return parser


def _command(
    subparsers: Any, name: str, command: Callable[[argparse.Namespace], int], **texts: str
) -> argparse.ArgumentParser:
    """A new command of the command line, still without arguments."""
    parser: argparse.ArgumentParser = subparsers.add_parser(name, allow_abbrev=False, **texts)
    parser.set_defaults(command=command, parser=parser)
    return parser


def _add_run(subparsers: Any) -> None:
    parser = _command(
        subparsers,
        "run",
        commands.run,
        help="measure planners and print a table",
        description="Runs every planner on the same problems, each in its own process, judges "
        "every path, and prints a table. What DIR holds already is not measured again.",
    )
    add = parser.add_argument
    add("--env", required=True, help="environments, as in c3d,c3d:scene=3,boxes=20")
    add(
        "--planners",
        default="all",
        help="planners, as in fmm,rrtstar:range=2; or all, or paper (default: all)",
    )
    add("--problems", type=int, default=50, metavar="N", help="an environment (default: 50)")
    add("--seed", type=int, default=0, metavar="S", help="of problems and planners (default: 0)")
    add("--time-limit", type=float, default=5.0, metavar="SECONDS", help="(default: 5)")
    add(
        "--stop",
        default=PAPER,
        metavar="RULE",
        help="when planners that improve their path stop: first, at the first solution; limit, "
        "at the time limit; match:PLANNER[:TOL], when no longer than (1+TOL) times PLANNER's "
        "path, TOL 0.05; paper, match:mpnet, or match:fmm where mpnet has no weights "
        "(default: paper)",
    )
    add("--jobs", type=int, default=1, metavar="N", help="planners at a time (default: 1)")
    add(
        "--memory-limit",
        type=int,
        default=4096,
        metavar="MB",
        help="of each planner's process (default: 4096)",
    )
    add("--device", default="cpu", help="of learned planners, cpu or cuda (default: cpu)")
    add("--no-train", action="store_true", help="skip learned planners that have no weights")
    add("--out", type=Path, metavar="DIR", help="(default: results/runs/ENV)")
    add("--force", action="store_true", help="measure again what DIR holds")


def _add_train(subparsers: Any) -> None:
    parser = _command(
        subparsers,
        "train",
        commands.train,
        help="train a learned planner for an environment",
        description="Trains a learned planner, or goes on where an interrupted training stopped. "
        "Runs find its weights afterwards, unless others are shipped.",
    )
    add = parser.add_argument
    add("--env", required=True, help="an environment, as in c3d:scene=3")
    add("--planner", required=True, metavar="P", help="a learned planner, as in ntfields")
    add("--minutes", type=float, metavar="M", help="how long (default: the planner's own steps)")
    add("--seed", type=int, default=0, metavar="S", help="(default: 0)")
    add("--device", default="cpu", help="of PyTorch, cpu or cuda (default: cpu)")
    add("--out", type=Path, metavar="FILE", help="of the weights (default: the user's cache)")


def _add_report(subparsers: Any) -> None:
    parser = _command(
        subparsers,
        "report",
        commands.report,
        help="tables of a run",
        description="Writes reports of what was last run into each DIR, or one report of all into "
        "--out, and prints the tables.",
    )
    parser.add_argument("dirs", nargs="+", type=Path, metavar="DIR")
    parser.add_argument(
        "--format", default="md,csv", help=f"of {','.join(files.FORMATS)} (default: md,csv)"
    )
    parser.add_argument(
        "--spread",
        type=_spread,
        default="deviation",
        metavar="deviation|variance",
        help="what stands after the ± of means (default: deviation)",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="(default: the run's own)")


def _add_compare(subparsers: Any) -> None:
    parser = _command(
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


def _add_show(subparsers: Any) -> None:
    parser = _command(
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


def _add_field(subparsers: Any) -> None:
    parser = _command(
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


def _add_paper(subparsers: Any) -> None:
    parser = _command(
        subparsers,
        "paper",
        commands.paper,
        help="the paper's tables and figures beside ours",
        description="Carries out the paper's experiments, or goes on where it stopped, and prints "
        "each table beside the paper's figures. DIR holds paper.md, its pictures, and every table "
        "as CSV.",
    )
    add = parser.add_argument
    add("--only", metavar="NAME", help="of the experiments, as in c3d,gibson (default: all)")
    add("--quick", action="store_true", help="fewer problems, and say so in every caption")
    add(
        "--out",
        type=Path,
        metavar="DIR",
        help="(default: results/runs/paper, or results/runs/paper-quick)",
    )


def _add_list(subparsers: Any) -> None:
    parser = _command(
        subparsers,
        "list",
        commands.list_,
        help="list planners and environments",
        description="Lists what is registered.",
    )
    parser.add_argument("what", nargs="?", choices=("planners", "envs"))
    parser.add_argument("--json", action="store_true")


if __name__ == "__main__":
    sys.exit(main())
