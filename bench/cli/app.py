"""The command line: arguments to calls, and every mistake in one line."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from errno import EDQUOT, EFBIG, EIO, ENOSPC, EROFS
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import click

from bench.cli import interface, terminal
from envs.errors import InputError

DONE, BAD_INPUT, INTERRUPTED, PIPE_CLOSED = 0, 2, 130, 141

_NOT_WRITTEN = (ENOSPC, EDQUOT, EFBIG, EROFS, EIO)
"""Errors of a full disk, and of output that nobody reads."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line and gives the exit code."""
    terminal.prepare()
    try:
        chosen = parse(sys.argv[1:] if arguments is None else arguments)
        code = DONE if chosen is None else _carried_out(chosen, by_user=arguments is None)
        print(end="", flush=True)  # what cannot be written shall fail here
    except InputError as error:
        terminal.note(f"bench: error: {error}")
        return BAD_INPUT
    except KeyboardInterrupt:
        terminal.note("bench: interrupted; what was finished is kept")
        return INTERRUPTED
    except BrokenPipeError:  # whoever read what was printed has seen enough, as `head` has
        _let_go_of_output()
        return PIPE_CLOSED
    except OSError as error:
        if error.errno not in _NOT_WRITTEN:
            raise
        _let_go_of_output()
        terminal.note(f"bench: error: cannot write: {error}; stored results are kept")
        return BAD_INPUT
    return code


def parse(arguments: Sequence[str]) -> SimpleNamespace | None:
    """A command's arguments by name, and as `does` where in `bench.cli` it is carried out; None if
    help or the version was asked for and has been printed.

    Raises:
        InputError: they are none that the command takes.
    """
    try:
        chosen = interface.bench.main(list(arguments), prog_name="bench", standalone_mode=False)
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        where = context.command_path if context else "bench"
        raise InputError(f"{error.format_message()} (see {where} --help)") from None
    return chosen if isinstance(chosen, SimpleNamespace) else None


def _carried_out(chosen: SimpleNamespace, *, by_user: bool) -> int:
    """The exit code of a command."""
    from bench.execution.launch import COMMAND
    from bench.execution.planner_host import hosting
    from planners import user_plugins

    chosen.started_s = _since_process_start() if by_user else 0.0
    with (
        COMMAND.begun(),
        hosting(),
        user_plugins.registered(vars(chosen).get("planner_file", ())),
        _metrics(vars(chosen).get("metric_file")),
    ):
        COMMAND.check_program()
        module, _, function = chosen.does.partition(":")
        code: int = getattr(import_module(f"bench.cli.{module}"), function)(chosen)
    return code


def _metrics(files: Sequence[Path] | None) -> AbstractContextManager[None]:
    """The metrics of packages and files, for a command that measures or reports."""
    if files is None:
        return nullcontext()
    from bench.judging import user_metrics

    return user_metrics.registered(files)


def _let_go_of_output() -> None:
    """At its end, Python would try again to write what is left, and fail in its own words."""
    if sys.stdout is not None:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _since_process_start() -> float:
    import psutil

    return time.time() - psutil.Process().create_time()


if __name__ == "__main__":
    sys.exit(main())
