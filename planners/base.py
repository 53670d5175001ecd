"""The contract of a planner, and of one that knows arrival times from anywhere to anywhere."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from enum import Enum
from time import perf_counter
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from envs.problem import Array, Problem
from envs.seeding import derived_seed

if TYPE_CHECKING:  # which planners in interpreters of their own do without
    from envs.environment import Environment


class Status(str, Enum):
    """What a planner says of its attempt, in OMPL's words."""

    EXACT_SOLUTION = "EXACT_SOLUTION"  # the path joins start and goal
    APPROXIMATE_SOLUTION = "APPROXIMATE_SOLUTION"  # the best it has, known not to do
    TIMEOUT = "TIMEOUT"  # nothing found in time
    INFEASIBLE = "INFEASIBLE"  # it says that there is no path
    INVALID_START = "INVALID_START"
    INVALID_GOAL = "INVALID_GOAL"


@dataclass(frozen=True)
class PlannerResult:
    """What `Planner.solve` returns.

    The result is read and copied before the clock stops: a path that is computed only when it is
    looked at, or on a device, takes that time as if `solve` had.

    Args:
        status: `Status`; what the planner says of its attempt. Only `EXACT_SOLUTION` claims that
            the problem is solved, and the judge decides whether that is true.
        path: waypoints (k, d) from start to goal, k >= 2, in the environment's unit, as any
            array-like, iterator or tensor, or an `envs.Path`; None without a path. The robot moves
            along straight segments between waypoints.
        stats: JSON data, kept with the attempt. Reports use `collision_checks` (int, configurations
            or motions asked about), `cost_history` (pairs of seconds since the start of `solve` and
            the length of the best path so far), `fallbacks` (int, calls of another planner),
            `checked_every` (float, the longest gap between the states that are checked along
            motions) and, of planners that say `planned_elsewhere`, `claimed_solve_s` (float,
            seconds).

    Example:
        >>> PlannerResult(Status.EXACT_SOLUTION, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]).stats
        {}
    """

    status: Status
    path: Any = None
    stats: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Budget:
    """How long to plan.

    Args:
        deadline: float, seconds on the clock of `time.perf_counter`. A path that comes later does
            not count; a process that goes on for 1 s more, or 20 % of the time limit if that is
            more, is killed.
        stop_cost: float, in the environment's unit. A planner that improves its path stops as soon
            as the path is no longer than this: infinity (the default) means at the first solution,
            0 means to use all the time.

    Example:
        >>> 0.9 < Budget(perf_counter() + 1.0).remaining() <= 1.0
        True
    """

    deadline: float
    stop_cost: float = float("inf")

    def remaining(self) -> float:
        """Seconds (float) left until the deadline, at least 0."""
        return max(0.0, self.deadline - perf_counter())


class Planner(ABC):
    """The contract of a planner: subclass it, implement `solve`, and the harness does the rest.

    The harness makes an instance in a process of its own for each environment, with the arguments
    of the command line, as in `my-planner:step=0.5`. Annotations of `__init__` give the arguments
    their types; one without a default must be given. Then it calls `unsupported`; `setup` once,
    timed as offline work; and `solve` for each problem, timed. Where problems have scenes of their
    own, `set_scene` comes before, on a clock of its own. The process has one thread for each
    numerical library and a limit of memory. An exception is recorded as the fault of the problem at
    hand (`ERROR`), and planning goes on with the next; after a crash, in a new process.

    Class attributes:
        improves: bool, by default True, whether `solve` may go on after its first solution, until
            the path is no longer than `Budget.stop_cost`. Say False if it returns its first path.
        planned_elsewhere: bool, by default False, whether `solve` only hands over what was planned
            elsewhere, so that its time here says nothing. None is recorded then; tables have the
            seconds that `stats["claimed_solve_s"]` claims in a column of their own, and no
            comparison of times uses them.
        plans_from_data: bool, by default False, whether `setup` and `set_scene` are given plain
            data (`envs.plain_scene.PlainScene`) instead of an environment, as planners want that
            bring a collision model of their own; `unsupported` too.
        interpreter: str, by default empty, the Python that is to run the planner, by its path,
            where it is another than the harness's; an instance may set it. There must be NumPy
            there; and all that the environment needs, unless `plans_from_data`.
        train_s: float, by default 0.0, seconds that making data and training took for the weights
            in use; `setup` may set it. It is reported as offline work.

    Example:
        >>> class StraightLine(Planner):
        ...     improves = False
        ...
        ...     def setup(self, env, *, seed):
        ...         self.model = env.collision_model(env.planning_tolerance)
        ...
        ...     def solve(self, problem, budget):
        ...         if self.model.segment_is_free(problem.start, problem.goal):
        ...             return PlannerResult(Status.EXACT_SOLUTION, [problem.start, problem.goal])
        ...         return PlannerResult(Status.TIMEOUT)
        >>> import envs
        >>> env, planner = envs.make("c3d"), StraightLine()
        >>> planner.setup(env, seed=1)
        >>> problem = env.sample_problems(4, seed=0)[3]
        >>> planner.solve(problem, Budget(perf_counter() + 1.0)).status.value
        'EXACT_SOLUTION'
    """

    train_s: float = 0.0
    improves: bool = True
    planned_elsewhere: bool = False
    plans_from_data: bool = False
    interpreter: str = ""

    def unsupported(self, env: Environment) -> str | None:
        """Whether the planner can plan in an environment.

        Args:
            env: `envs.Environment`, not to be changed.

        Returns:
            None if it can, else the reason why not (str, a line), which tables show. By default
            None. Planners chosen by a group ("all") are left out where they give a reason.
        """
        return None

    def setup(self, env: Environment, *, seed: int) -> None:  # noqa: B027  (nothing is a fine default)
        """Prepares for an environment: loads weights, builds a roadmap. By default does nothing.

        It is offline work: the harness times it together with `__init__` as `setup_s`, and reports
        it beside the planning times. It may take an hour.

        Args:
            env: `envs.Environment`, to be kept for `solve` and not to be changed.
            seed: int, 1 to 2^31 - 2, for everything random here.

        Raises:
            Exception: any; then that is the outcome of every problem. Threads and processes that
                are still at work when it returns are the fault of the first `solve`.
        """

    def set_scene(self, env: Environment) -> None:
        """Prepares for the scene of the next problem: encodes it, builds a collision model. By
        default `setup` again, with a seed of the scene's.

        Called only where problems have scenes of their own (`Environment.scenes_differ`), before
        `solve`, if the scene is another than before. The harness times it as `scene_s`, which is a
        column of its own and no part of the planning time.

        Args:
            env: `envs.Environment`, the scene (`Environment.scene_of`), to be kept for `solve` and
                not to be changed. Robot, space and bounds are those of the environment of `setup`.

        Raises:
            Exception: any; then that is the outcome of the problem.
        """
        self.setup(env, seed=derived_seed("scene", int(env.fingerprint, 16)))

    def weights_digest(self, env: Environment) -> str:
        """Names the trained numbers that the planner uses, so that results of other numbers are
        not taken for its own.

        Args:
            env: `envs.Environment`, not to be changed.

        Returns:
            A digest (str) of the files with which it plans in `env`; empty, which is the default,
            for a planner without any.

        Raises:
            InputError: they cannot be read.
        """
        return ""

    @abstractmethod
    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        """Plans a path: the online work, timed until the path is an array of numbers in memory.

        Args:
            problem: `envs.Problem` with `start` and `goal`, float64 arrays (d,) in the
                environment's unit, not to be changed; and `seed` (int), to be used for everything
                random, so that the same problem has the same path in another run.
            budget: `Budget`, when to stop.

        Returns:
            `PlannerResult`. The harness has the judge check any path in it, and stores status,
            path and stats.

        Raises:
            Exception: any; it is recorded as the outcome `ERROR` of this problem.

        Threads and processes that it begins must have ended when it returns, and those of pools
        and libraries be at rest: what works on is a fault (`LEFT_RUNNING`).
        """


NOT_PLAIN = "it is told of robots and scenes as plain data, and nobody has said how for this one"
"""Why a planner that plans from data does not in an environment without."""


def why_unsupported(planner: Planner, env: Environment) -> str | None:
    """Why a planner cannot plan in an environment, shown to it as it wants it; None if it can."""
    if not planner.plans_from_data:
        return planner.unsupported(env)
    scene: Any = env.plain_scene
    return NOT_PLAIN if scene is None else planner.unsupported(scene)


@runtime_checkable
class TimeFieldPlanner(Protocol):
    """A planner, once set up, whose field of arrival times can be looked at."""

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """Arrival times (n,) from `source` (d,) at configurations (n, d), and the speeds (n,)
        that the field implies there, `1 / |grad T|`."""
