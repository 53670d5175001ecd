"""What the harness has to know of a planner before it plans, and training it on the spot.

A planner is made and asked here if it is one of ours. A stranger's is asked in a process of its
own while `hosting` lasts (see `planner_host`), as importing it can change anything in a process:
the judge, the clock, a library that they use.
"""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, Protocol, TypeGuard, TypeVar

import planners
from envs import InputError
from envs.errors import reason
from envs.registry import Entry

if TYPE_CHECKING:  # commands that ask nothing do without what these import
    from envs import Environment
    from planners import Planner
    from planners.learning.learned_planner import LearnedPlanner

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class World:
    """An environment as planners are asked about it.

    Attributes:
        entry: of which any process makes the same.
        env: made, to be shown to planners of this process.
    """

    entry: Entry[Environment]
    env: Environment


class PlannerError(InputError):
    """A planner failed where it should not.

    Attributes:
        traceback: where, in lines.
    """

    def __init__(self, message: str, traceback: str) -> None:
        super().__init__(message)
        self.traceback = traceback


class Host(Protocol):
    """Asks strangers' planners elsewhere."""

    def query(self, name: str, planner: Entry[Planner], *more: Any) -> Any:
        """What the query of this name answers; it raises as that does."""


QUERIES: dict[str, Callable[..., Any]] = {}
"""By name; all of them ask in this process. Arguments and answers are JSON data, and `World`."""


class _Hosted:
    """Who is asked about strangers' planners; None: they are, in this process."""

    host: Host | None = None


HOSTED = _Hosted()


def _imports_strangers(planner: Entry[Planner]) -> bool:
    """Whether making it imports a stranger's code: its own, or that of a planner which one of its
    arguments names, or describes (`Entry.description`)."""
    strangers = [spec for spec in planners.REGISTRY.specs() if spec.origin]
    names = {name for spec in strangers for name in (spec.id, *spec.aliases)}
    arguments = {**planner.spec.arguments, **planner.arguments}
    said = {_named_by(value) for value in arguments.values()}
    return bool(planner.spec.origin) or not names.isdisjoint(said)


def _named_by(argument: object) -> str:
    """The name of the planner that an argument may be about."""
    if isinstance(argument, dict):
        return str(argument.get("id", ""))
    return str(argument).partition(":")[0]


def _query(
    ask: Callable[Concatenate[Entry[Planner], P], T],
) -> Callable[Concatenate[Entry[Planner], P], T]:
    """Has a function that asks a planner something ask a stranger's where that is to be done."""

    @wraps(ask)
    def here(planner: Entry[Planner], /, *args: P.args, **named: P.kwargs) -> T:
        try:
            return ask(planner, *args, **named)
        except InputError:
            raise
        except (Exception, SystemExit) as error:  # a stranger's may fail in any way
            if not planner.spec.origin:
                raise
            told = traceback.format_exc(limit=-4).strip()
            raise PlannerError(f"{planner.id} failed: {reason(error)}", told) from error

    @wraps(ask)
    def wherever(planner: Entry[Planner], /, *args: P.args, **named: P.kwargs) -> T:
        if HOSTED.host is None or not _imports_strangers(planner):
            return here(planner, *args, **named)
        assert not named, "what is sent to another process has no names"
        answer: T = HOSTED.host.query(ask.__name__, planner, *args)
        return answer

    QUERIES[ask.__name__] = here
    return wherever


@_query
def improves(planner: Entry[Planner]) -> bool:
    """Whether it may go on after its first solution."""
    return bool(planner.make().improves)


@_query
def planned_elsewhere(planner: Entry[Planner]) -> bool:
    """Whether it only hands over what was planned elsewhere, so that its times are claims."""
    return bool(planner.make().planned_elsewhere)


@_query
def interpreter(planner: Entry[Planner]) -> str:
    """The Python that is to run it, by its path; empty for that of this process."""
    return str(planner.make().interpreter)


@_query
def plans_from_data(planner: Entry[Planner]) -> bool:
    """Whether it is given plain data instead of an environment."""
    return bool(planner.make().plans_from_data)


@_query
def takes_device(planner: Entry[Planner]) -> bool:
    """Whether its class can be told on which device of PyTorch to run; the spec does not say."""
    parameters = inspect.signature(planner.spec.load()).parameters
    return "device" in parameters.keys() - planner.spec.arguments.keys()


@_query
def is_learned(planner: Entry[Planner]) -> bool:
    """Whether it has weights for each environment."""
    from planners.learning.learned_planner import LearnedPlanner

    return issubclass(planner.spec.load(), LearnedPlanner)


@_query
def unsupported(planner: Entry[Planner], world: World) -> str | None:
    """Why it cannot plan there, or None if it can."""
    return _why_unsupported(planner.make(), world)


@_query
def weights_digest(planner: Entry[Planner], world: World) -> str:
    """The digest of the weights with which it plans there now, empty if it has none.

    Raises:
        InputError: they cannot be read.
    """
    made = planner.make()
    return made.weights_digest(world.env) if _why_unsupported(made, world) is None else ""


@_query
def refuse_bad_weights(planner: Entry[Planner], world: World) -> None:
    """Raises InputError if it would find weights there that it cannot use, or cannot be made."""
    from planners.learning.learned_planner import check_weights

    made = planner.make()
    check_weights(made, world.env)
    if made.planned_elsewhere:  # its weights are the paths
        made.weights_digest(world.env)


@_query
def lacks_weights(planner: Entry[Planner], world: World) -> bool:
    """Whether it has to be trained before it can plan there."""
    return _lacks_weights(planner.make(), world.env)


@_query
def minutes_of_training(planner: Entry[Planner], world: World) -> float:
    """About how long it has to be trained before it can plan there."""
    made = planner.make()
    return float(made.expected_minutes(world.env)) if _lacks_weights(made, world.env) else 0.0


@_query
def train(planner: Entry[Planner], world: World) -> None:
    """Trains it for an environment, by its own recipe and on its own device.

    Raises:
        InputError: the weights cannot be kept.
    """
    from bench.execution.weights_manager import train as trained
    from planners.learning.learned_planner import LearnedPlanner

    made = planner.make()
    assert isinstance(made, LearnedPlanner)
    trained(world.entry, planner, device=made.device)


def _why_unsupported(planner: Planner, world: World) -> str | None:
    from planners.base import why_unsupported  # not for commands that ask nothing

    return why_unsupported(planner, world.env)


def _lacks_weights(planner: Planner, env: Environment) -> TypeGuard[LearnedPlanner]:
    from planners.learning.learned_planner import LearnedPlanner

    return (
        isinstance(planner, LearnedPlanner)
        and planner.unsupported(env) is None
        and planner.weights_file(env) is None
    )
