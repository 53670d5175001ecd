"""The command line: arguments to calls."""

from __future__ import annotations

import argparse
import os
import re
import sys
import time
from collections.abc import Sequence
from errno import EDQUOT, EFBIG, EIO, ENOSPC, EPIPE, EROFS
from importlib import metadata
from typing import NoReturn

import psutil

from bench.cli import terminal
from bench.cli.arguments import COMMANDS
from bench.execution.launch import COMMAND
from bench.execution.planner_host import hosting
from envs import InputError
from envs.errors import suggestion
from planners import user_plugins as planner_files

BAD_INPUT, INTERRUPTED = 2, 130

_NOT_WRITTEN = (EPIPE, ENOSPC, EDQUOT, EFBIG, EROFS, EIO)
"""Errors of a full disk, and of output that nobody reads."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code."""
    terminal.prepare()
    try:
        chosen = _parse(arguments)
        chosen.started_s = _since_process_start() if arguments is None else 0.0
        files = chosen.planner_file
        with COMMAND.begun(), hosting(), planner_files.registered(files):
            COMMAND.check_program()
            code: int = chosen.command(chosen)
        print(end="", flush=True)  # what cannot be written shall fail here
    except InputError as error:
        terminal.note(f"bench: error: {error}")
        return BAD_INPUT
    except KeyboardInterrupt:
        terminal.note("bench: interrupted; what was finished is kept")
        return INTERRUPTED
    except OSError as error:
        if error.errno not in _NOT_WRITTEN:
            raise
        _let_go_of_output()
        terminal.note(f"bench: error: cannot write: {error}; stored results are kept")
        return BAD_INPUT
    return code


def _let_go_of_output() -> None:
    """At its end, Python would try again to write what is left, and fail in its own words."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


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
