"""The command line in processes that have imported it before they begin, for tests that start many.

They are forked by a server that has done nothing else.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
from multiprocessing.context import ForkServerProcess

from bench import cli

_CONTEXT = multiprocessing.get_context("forkserver")


def start(arguments: list[str]) -> ForkServerProcess:
    """`bench` with some arguments, and without output."""
    _CONTEXT.set_forkserver_preload(["bench.cli.commands", "bench.api", "envs.scenes.cluttered"])
    process = _CONTEXT.Process(target=_run, args=(arguments,))
    process.start()
    return process


def _run(arguments: list[str]) -> None:
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        os.dup2(nowhere, stream.fileno())
    sys.exit(cli.main(arguments))
