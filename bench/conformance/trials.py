"""What a planner does when it is asked a few things in processes of its own.

Some problems are solvable; one has its goal in an obstacle, one its start within closed walls.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

import planners
from bench.conformance.instrumented_planner import PROBED
from bench.execution.planner_queries import World, is_learned
from bench.execution.supervised_planner import SETUP_LIMIT_S
from bench.execution.weights_manager import refuse_untrained
from bench.execution.worker_process import Attempt, SetUp, WorkerProcess
from bench.judging.judge import Judge, Judgement
from bench.storage.record import Fault
from envs import Environment, Problem, Spec
from envs.collision.shapes import Box
from envs.registry import Entry
from envs.scenes.boxes import BoxWorld
from planners import Planner, Status, user_plugins

TIME_LIMIT_S = 2.0
"""For each problem."""

_PROBLEMS, _SEED = 3, 8
_MEMORY_LIMIT_MB = 4096
_PLACES = 2000  # at which to look for one that is in collision
_WALLED_IN: Entry[Environment] = Entry(
    Spec("walled-in", "bench.conformance.trials:WalledIn", "walled in"), {}
)


class Process(Protocol):
    """What is asked; see `bench.execution.worker_process.WorkerProcess`."""

    def set_up(self, seed: int, limit_s: float) -> SetUp: ...

    def set_scene(self, problem: Problem, limit_s: float) -> SetUp: ...

    def solve(self, problem: Problem, time_limit_s: float, stop_cost: float) -> Attempt: ...

    def close(self) -> None: ...

    @property
    def alive(self) -> bool: ...


Start = Callable[[World, Entry[Planner]], Process]
"""Environment and planner to a process."""


@dataclass(frozen=True)
class Trial:
    """One problem, asked once.

    Attributes:
        what: the problem, for messages.
        limit_s: the time it was given, in seconds.
        judged: of a path, if it has one.
    """

    what: str
    problem: Problem
    limit_s: float
    attempt: Attempt
    judged: Judgement | None = None

    @property
    def seen(self) -> dict[str, Any]:
        """What the probe noted; empty if the planner did not return."""
        noted: dict[str, Any] = self.attempt.stats.get(PROBED, {})
        return noted

    @property
    def claimed(self) -> bool:
        """Whether the planner says that it solved the problem."""
        return self.attempt.status == Status.EXACT_SOLUTION.value

    @property
    def fault(self) -> Fault | None:
        """What befell it, if it did not return."""
        names = [fault.value for fault in Fault]
        return Fault(self.attempt.status) if self.attempt.status in names else None

    @property
    def solve_s(self) -> float:
        """Seconds until it returned or was ended."""
        return float(self.seen.get("solve_s", self.attempt.solve_s or 0.0))


@dataclass(frozen=True)
class Evidence:
    """What was seen of a planner.

    Attributes:
        set_up: in the environment that was asked for.
        solvable: problems that have a solution.
        again: the first of them in a new process, in reverse.
        unsolvable: problems that have none, tried if it returned from the others.
        walled_in: setting up among the closed walls, None if that was not tried.
        not_repeatable: see `envs.Spec`.
    """

    set_up: SetUp
    solvable: tuple[Trial, ...] = ()
    again: tuple[Trial, ...] = ()
    unsolvable: tuple[Trial, ...] = ()
    walled_in: SetUp | None = None
    not_repeatable: str = ""

    @property
    def unsupported(self) -> str:
        """Why it does not plan in the environment, if it does not."""
        return self.set_up.error if self.set_up.fault == Fault.UNSUPPORTED.value else ""

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All of them."""
        return self.solvable + self.again + self.unsolvable


def probed(planner: Entry[Planner]) -> Entry[Planner]:
    """The planner with a probe about it."""
    described = {"described": planner.description}
    return Entry(
        Spec(planner.id, "bench.conformance.instrumented_planner:Probe", "", described), {}
    )


def _worker(world: World, planner: Entry[Planner]) -> Process:
    return WorkerProcess(world, planner, _MEMORY_LIMIT_MB)


def gathered(
    env: Entry[Environment],
    planner: Entry[Planner],
    time_limit_s: float = TIME_LIMIT_S,
    start: Start = _worker,
) -> Evidence:
    """Asks a planner what `Evidence` holds.

    Raises:
        InputError: the environment cannot be made, or the planner would have to be trained first.
    """
    if is_learned(planner):
        refuse_untrained(planner, World(env, env.make()))
    world = env.make()  # the judge's own
    asked = _Asked(world, env, probed(planner), time_limit_s, start)
    problems = world.sample_problems(_PROBLEMS, _SEED)
    with asked.process() as (process, set_up):
        solvable = tuple(asked.tried(process, _first_solutions(problems)))
        if process.alive:
            solvable += tuple(asked.tried(process, [("all its time", problems[0], 0.0)]))
        works = not set_up.fault and not any(trial.fault for trial in solvable)
        blocked = _blocked(world, problems[0]) if works else []
        unsolvable = tuple(asked.tried(process, blocked))
    if not works:
        return Evidence(set_up, solvable)
    with asked.process() as (process, _):
        again = tuple(asked.tried(process, _first_solutions(problems[::-1])))
    walled_in = None
    if not is_learned(planner):  # which has no weights for it
        among_walls = _Asked(_WALLED_IN.make(), _WALLED_IN, asked.planner, time_limit_s, start)
        with among_walls.process() as (process, walled_in):
            enclosed = [("a start that is walled in", unsolvable_problem(), math.inf)]
            unsolvable += tuple(among_walls.tried(process, enclosed))
    return Evidence(set_up, solvable, again, unsolvable, walled_in, planner.spec.not_repeatable)


_Question = tuple[str, Problem, float]
"""The problem in words, the problem, and the length at which to stop."""


@dataclass(frozen=True)
class _Asked:
    """A planner in an environment, started anew for each process."""

    world: Environment
    env: Entry[Environment]
    planner: Entry[Planner]
    time_limit_s: float
    start: Start

    @contextmanager
    def process(self) -> Iterator[tuple[Process, SetUp]]:
        """A new process in which the planner is set up, or a closed one if it cannot be."""
        process = self.start(World(self.env, self.world), self.planner)
        try:
            set_up = process.set_up(_SEED, SETUP_LIMIT_S)
            if set_up.fault:
                process.close()
            yield process, set_up
        finally:
            process.close()

    def tried(self, process: Process, questions: Iterable[_Question]) -> Iterator[Trial]:
        """A trial for each question, until the process dies."""
        judge = Judge(self.world)
        for what, problem, stop_cost in questions:
            if not process.alive:
                return
            attempt = self._attempted(process, problem, stop_cost)
            judged = judge(problem, attempt.path) if attempt.claims else None
            yield Trial(what, problem, self.time_limit_s, attempt, judged)

    def _attempted(self, process: Process, problem: Problem, stop_cost: float) -> Attempt:
        if self.world.scenes_differ:
            scene = process.set_scene(problem, SETUP_LIMIT_S)
            if scene.fault:
                return Attempt(scene.fault, None, error=f"set_scene: {scene.error}")
        return process.solve(problem, self.time_limit_s, stop_cost)


def _first_solutions(problems: Iterable[Problem]) -> list[_Question]:
    return [(f"problem {problem.index}", problem, math.inf) for problem in problems]


def _blocked(world: Environment, problem: Problem) -> list[_Question]:
    """The problem with a goal in the midst of an obstacle, if there is such a place."""
    q = world.space.sample(np.random.default_rng(_SEED), _PLACES)
    clearance = world.scene_of(problem).clearance(q)
    deepest = int(np.argmin(clearance))
    if clearance[deepest] >= 0:
        return []
    goal = Problem(problem.start, q[deepest], problem.index, problem.seed)
    return [("a goal within an obstacle", goal, math.inf)]


_OF_FILE = re.compile(
    r"(?P<file>.*?\.py)(?::(?P<cls>[^:=]*))?(?::(?P<arguments>[^:]*=.*))?", re.DOTALL
)

_INSIDE, _WALL = 4.0, 1.0  # the inner side of the walls and their thickness, in units of the cube


class WalledIn(BoxWorld):
    """A point robot in the cube, in whose middle six slabs enclose a smaller cube."""

    kind_of_problems = "walls"
    advice = "there is room for any number"

    def __init__(self) -> None:
        side = _INSIDE + 2 * _WALL
        slabs = []
        for axis in range(3):
            sides = np.full(3, side)
            sides[axis] = _WALL
            centre = np.zeros(3)
            centre[axis] = (_INSIDE + _WALL) / 2
            slabs += [Box(centre, sides), Box(-centre, sides)]
        super().__init__(slabs, robot_radius=0.01)

    def definition(self) -> dict[str, Any]:
        return {
            "class": "WalledIn",
            "version": 1,
            "boxes": self.boxes_definition(),
            **self.point_definition(),
        }


def unsolvable_problem(seed: int = 1) -> Problem:
    """From the middle of the walls to outside."""
    return Problem(np.zeros(3), np.full(3, 7.0), 0, seed)


@contextmanager
def resolve_planner(text: str) -> Iterator[Entry[Planner]]:
    """What "NAME", "FILE.py:CLASS" or "FILE.py" names, with ":key=value,..." after it or not. A
    file's planners are registered as long as the context lasts.

    Raises:
        InputError: there is no such planner, or its file is not in order.
    """
    of_file = _OF_FILE.fullmatch(text)
    if of_file is None:
        yield planners.REGISTRY.entry(text)
        return
    file = Path(of_file["file"])
    with user_plugins.registered([file]):
        id = user_plugins.spec_of_class(file, of_file["cls"] or "").id
        yield planners.REGISTRY.entry(":".join(filter(None, (id, of_file["arguments"]))))
