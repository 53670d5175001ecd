"""What commands have in common."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any


def command(
    subparsers: Any, name: str, does: Callable[[argparse.Namespace], int], **texts: str
) -> argparse.ArgumentParser:
    """A new command of the command line, still without arguments."""
    parser: argparse.ArgumentParser = subparsers.add_parser(name, allow_abbrev=False, **texts)
    parser.set_defaults(command=does, parser=parser, planner_file=())
    return parser


def add_planner_file(parser: argparse.ArgumentParser) -> None:
    """The option that makes planners of files known."""
    parser.add_argument(
        "--planner-file",
        type=Path,
        action="append",
        default=[],
        metavar="FILE.py",
        help="of Python whose planners are to be known too; may be given several times",
    )
