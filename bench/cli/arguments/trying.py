"""Arguments of the commands that list planners, try them, and make attempts again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bench.cli import commands
from bench.cli.arguments.common import add_planner_file, command
from bench.conformance.trials import TIME_LIMIT_S


def add_test_planner(subparsers: Any) -> None:
    """`bench test-planner`."""
    parser = command(
        subparsers,
        "test-planner",
        commands.test_planner,
        help="check that a planner keeps to the contract",
        description="Has a planner solve a few problems in processes of its own, and prints a line "
        "for each thing it must keep to. Exit code 1 if it does not.",
    )
    add = parser.add_argument
    add("planner", metavar="NAME|FILE.py:CLASS", help="as in rrtstar:range=2 or my.py:Mine")
    add("--env", default="c3d", help="an environment (default: c3d)")
    add(
        "--time-limit",
        type=float,
        default=TIME_LIMIT_S,
        metavar="SECONDS",
        help=f"a problem (default: {TIME_LIMIT_S:g})",
    )
    add_planner_file(parser)


def add_replay(subparsers: Any) -> None:
    """`bench replay`."""
    parser = command(
        subparsers,
        "replay",
        commands.replay,
        help="make one attempt of a run again",
        description="Makes one attempt again from what a run's store holds, and says whether path "
        "and verdict are the same. Exit code 1 if they are not.",
    )
    add = parser.add_argument
    add("dir", type=Path, metavar="DIR", help="a folder that run wrote")
    add("--planner", required=True, metavar="P", help="a planner of that run")
    add("--problem", type=int, required=True, metavar="I", help="the index of a problem")
    add("--env", help="an environment of that run (default: the only one)")
    add_planner_file(parser)


def add_list(subparsers: Any) -> None:
    """`bench list`."""
    parser = command(
        subparsers,
        "list",
        commands.list_,
        help="list planners and environments",
        description="Lists what is registered.",
    )
    parser.add_argument("what", nargs="?", choices=("planners", "envs"))
    parser.add_argument("--json", action="store_true")
    add_planner_file(parser)
