"""The command line: arguments to calls."""

from __future__ import annotations

import argparse
import logging
import re
import sys
import time
from collections.abc import Sequence
from importlib import metadata
from typing import NoReturn

import psutil

from bench.arguments import COMMANDS
from envs import InputError
from envs.errors import suggestion
from planners import files as planner_files

BAD_INPUT, INTERRUPTED = 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code."""
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stderr, force=True)
    try:
        chosen = _parse(arguments)
        chosen.started_s = _since_process_start() if arguments is None else 0.0
        with planner_files.registered(chosen.planner_file):
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
    for add in COMMANDS:
        add(subparsers)
    return parser


if __name__ == "__main__":
    sys.exit(main())
