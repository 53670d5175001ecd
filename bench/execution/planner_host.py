"""Strangers' planners are imported in a process that neither plans nor judges, and asked there.

Importing a file or a package may change anything in a process. The harness judges, times and
stores, so it reads of a stranger's planner only what this process says of it: its spec, whether its
arguments fit, and the answers to `planner_queries`. `hosting` has the process started when it is
first needed; `planner_host_process` runs in it.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import planners
from bench.execution.planner_queries import HOSTED, PlannerError, World
from envs import InputError
from envs.errors import brief
from envs.registry import Entry
from envs.registry.plugins import PlugIns
from envs.registry.spec import Spec, check_form

if TYPE_CHECKING:
    from bench.execution.child_process import ChildProcess
    from bench.execution.protocol import Message
    from planners import Planner

logger = logging.getLogger(__name__)


class PlannerHost:
    """Asks the process, and passes on what is logged there meanwhile."""

    def __init__(self) -> None:
        self._child: ChildProcess | None = None
        self._asking = threading.Lock()

    def ask(self, what: str, *arguments: Any) -> Any:
        """What the function `what` of the process gives: JSON data.

        Raises:
            InputError: it does, or the process has died.
        """
        from bench.execution.child_process import ChildProcess  # not for commands that ask nothing

        with self._asking:
            if self._child is None or not self._child.alive:
                self._child = ChildProcess("bench.execution.planner_host_process")
            message = self._exchange(self._child, {"what": what, "arguments": list(arguments)})
        if "traceback" in message:
            raise PlannerError(str(message["error"]), str(message["traceback"]))
        if "error" in message:
            raise InputError(str(message["error"]))
        return message["answer"]

    def _exchange(self, child: ChildProcess, request: Message) -> Message:
        from bench.execution import protocol

        child.resume()
        try:
            protocol.send(child.connection, request)
            message, _ = protocol.receive(child.connection)
            while "note" in message:
                logger.log(int(message["level"]), "%s", message["note"])
                message, _ = protocol.receive(child.connection)
            if not {"answer", "error"} & message.keys():
                raise KeyError("answer")
        except BaseException as error:
            if isinstance(error, EOFError | OSError):
                raise self._lost(child, child.cause_of_death()) from None
            if isinstance(error, ValueError | KeyError | TypeError | RecursionError):
                raise self._lost(child, f"sent what is no message: {error!r}") from None
            child.close()  # interrupted while it is at work
            raise
        child.pause()
        return message

    def _lost(self, child: ChildProcess, why: str) -> InputError:
        said = child.last_output().strip().splitlines()[-1:]
        child.close()
        why = f"the process that imports planners to ask them {why}"
        return InputError(": ".join([why, *said]))

    def query(self, name: str, planner: Entry[Planner], *more: Any) -> Any:
        """See `bench.execution.planner_queries.Host`."""
        chosen = planner.description["chosen"]
        answer = self.ask("query", name, planner.spec.data, chosen, *map(_sent, more))
        if not isinstance(answer, bool | str | int | float | None):
            raise InputError(f"{planner.id} answered {name} with {brief(answer)}")
        return answer

    def close(self) -> None:
        """Ends the process."""
        if self._child is not None:
            self._child.close()


class HostedPlugIns(PlugIns):
    """Planners of packages and files, looked at in the process."""

    def __init__(self, here: PlugIns, host: PlannerHost) -> None:
        super().__init__(here.kind, here.group, here.declared_base)
        self._host = host

    def of_packages(self) -> list[Spec]:
        if not self.points():
            return []  # and no process is started
        return self._specs("a package", "specs_of_packages")

    def of_file(self, file: Path) -> list[Spec]:
        return self._specs(str(file), "specs_of_file", str(file.absolute()))

    def _specs(self, origin: str, what: str, *arguments: str) -> list[Spec]:
        try:
            specs = [Spec.of(data) for data in self._host.ask(what, *arguments)]
            for spec in specs:
                check_form(self.kind, spec)
            # Never empty, whatever is said there: what has none is taken for ours, and imported.
            specs = [replace(spec, origin=spec.origin or origin) for spec in specs]
        except (AttributeError, TypeError) as error:
            raise InputError(f"what is said to be planners' specs is none: {error}") from error
        return specs

    def check(self, spec: Spec) -> None:
        self._host.ask("check", spec.data)

    def typed(self, spec: Spec, chosen: Mapping[str, str]) -> dict[str, Any]:
        """As texts, of which any process makes the same values."""
        typed = self._host.ask("typed", spec.data, dict(chosen))
        if not isinstance(typed, dict):
            raise InputError(f"what is said to be arguments of {spec.id} is {brief(typed)}")
        return {str(key): str(text) for key, text in typed.items()}


@contextmanager
def hosting() -> Iterator[None]:
    """As long as the context lasts, strangers' planners are asked in a process of their own; the
    same one within another such context."""
    if HOSTED.host is not None:
        yield
        return
    host, registry = PlannerHost(), planners.REGISTRY
    before = registry.plugins, HOSTED.host
    registry.plugins, HOSTED.host = HostedPlugIns(registry.plugins, host), host
    try:
        yield
    finally:
        registry.plugins, HOSTED.host = before
        host.close()


def _sent(argument: Any) -> Any:
    if isinstance(argument, World):
        return {"env": argument.entry.description, "fingerprint": argument.env.fingerprint}
    return argument
