"""Arguments of the commands that measure or train."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bench.cli import commands
from bench.cli.arguments.common import add_planner_file, command
from bench.execution.config import PAPER


def add_run(subparsers: Any) -> None:
    """`bench run`."""
    parser = command(
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
    add_planner_file(parser)
    add("--device", default="cpu", help="of learned planners, cpu or cuda (default: cpu)")
    add("--no-train", action="store_true", help="skip learned planners that have no weights")
    add("--out", type=Path, metavar="DIR", help="(default: results/runs/ENV)")
    add("--force", action="store_true", help="measure again what DIR holds")


def add_train(subparsers: Any) -> None:
    """`bench train`."""
    parser = command(
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
    add_planner_file(parser)


def add_paper(subparsers: Any) -> None:
    """`bench paper`."""
    parser = command(
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
