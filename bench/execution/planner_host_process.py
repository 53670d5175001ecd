"""The process in which strangers' planners are imported; see `bench.execution.planner_host`.

What they print goes to the log that the parent gave as standard output and error.
"""

from __future__ import annotations

import faulthandler
import logging
import os
import socket
import threading
import traceback
from collections.abc import Callable, Mapping
from functools import cache
from json import dumps, loads
from pathlib import Path
from time import sleep
from typing import Any

import planners
from bench.execution import protocol
from bench.execution.planner_queries import QUERIES, PlannerError, World
from bench.execution.process_group import tie_to_parent
from envs import InputError
from envs.errors import reason
from envs.registry import Entry, Spec
from envs.registry.text_values import text_of

_MOST_NOTE = 2000  # characters of a line of log
_GLANCE_S = 0.5  # between looks whether the parent is there

_Data = Mapping[str, Any]


def main(descriptor: int) -> None:
    """Answers the parent's questions until it hangs up."""
    connection = socket.socket(fileno=descriptor)
    os.set_inheritable(descriptor, False)  # else what a planner starts would keep it open
    faulthandler.enable()
    tie_to_parent()
    threading.Thread(target=_end_with, args=(os.getppid(),), daemon=True).start()
    line = _Line(connection)
    logging.basicConfig(level=logging.INFO, handlers=[_PassesOn(line)], force=True)
    try:
        while True:
            request, _ = protocol.receive(connection)
            line.send(_answer(request))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return  # the parent has gone or has hung up


def _end_with(parent: int) -> None:
    """Ends this process when its parent has, whatever a planner's file is doing meanwhile."""
    while os.getppid() == parent:
        sleep(_GLANCE_S)
    os._exit(1)


class _Line:
    """To the parent, for whatever thread has something to say."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._sending = threading.Lock()

    def send(self, message: protocol.Message) -> None:
        with self._sending:
            protocol.send(self._connection, message)


class _PassesOn(logging.Handler):
    """Has the parent log what is logged here."""

    def __init__(self, line: _Line) -> None:
        super().__init__()
        self._line = line

    def emit(self, record: logging.LogRecord) -> None:
        self._line.send({"note": record.getMessage()[:_MOST_NOTE], "level": record.levelno})


def _answer(request: protocol.Message) -> protocol.Message:
    try:
        return {"answer": _ANSWERS[request["what"]](*request["arguments"])}
    except PlannerError as error:
        return {"error": str(error), "traceback": error.traceback}
    except InputError as error:
        return {"error": str(error)}
    except (Exception, SystemExit) as error:  # noqa: BLE001  a planner may fail in any way
        told = traceback.format_exc(limit=-4).strip()
        return {"error": reason(error), "traceback": told}


def _specs_of_packages() -> list[dict[str, Any]]:
    return [spec.data for spec in planners.REGISTRY.plugins.of_packages()]


def _specs_of_file(file: str) -> list[dict[str, Any]]:
    return [spec.data for spec in planners.REGISTRY.plugins.of_file(Path(file))]


def _check(spec: _Data) -> None:
    planners.REGISTRY.plugins.check(Spec.of(spec))


def _typed(spec: _Data, chosen: Mapping[str, str]) -> dict[str, str]:
    typed = planners.REGISTRY.plugins.typed(Spec.of(spec), chosen)
    return {key: text_of(value) for key, value in typed.items()}


def _query(name: str, spec: _Data, chosen: Mapping[str, str], *more: Any) -> Any:
    made = Spec.of(spec)
    entry: Entry[Any] = Entry(made, planners.REGISTRY.plugins.typed(made, chosen))
    return QUERIES[name](entry, *map(_received, more))


def _received(argument: Any) -> Any:
    """What `bench.execution.planner_host` sent."""
    is_world = isinstance(argument, dict) and "fingerprint" in argument
    return _world(dumps(argument, sort_keys=True)) if is_world else argument


@cache
def _world(described: str) -> World:
    said = loads(described)
    entry: Entry[Any] = Entry.described(said["env"])
    env = entry.make()
    if env.fingerprint != said["fingerprint"]:
        raise InputError(f"{entry.id} is not the same environment in every process")
    return World(entry, env)


_ANSWERS: dict[str, Callable[..., Any]] = {
    "specs_of_packages": _specs_of_packages,
    "specs_of_file": _specs_of_file,
    "check": _check,
    "typed": _typed,
    "query": _query,
}
