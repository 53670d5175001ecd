"""OMPL 2's sampling planners, behind the same checks as those of OMPL 1.7.

The two cannot live in one interpreter, so this one names another, where an environment is made as
it is here. OMPL 2 has no LazyPRM*, AIT* or EIT*; it has AORRTC, which OMPL 1.7 has not.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from functools import cached_property
from importlib import metadata
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from envs.problem import Array, Problem
from planners.base import Budget, PlannerResult, Status
from planners.ompl_common.checks import Checks
from planners.ompl_common.progress import Progress
from planners.ompl_common.time_limit import unpruned, usable
from planners.peers.guest import Guest, Installed
from planners.peers.ompl2_parameters import setters
from planners.peers.ompl2_space import StateSpace

if TYPE_CHECKING:
    from envs.environment import Environment

_FIRST_SOLUTION_ONLY = ("RRTConnect", "FMT", "BFMT")
"""Planners that end with their first solution, whatever time is left."""

_WITHOUT_THRESHOLD = ("AORRTC",)
"""Planners that do not stop at the objective's cost, and must be told to."""

_LOSES_STRAIGHT_LINES = ("AORRTC",)
"""Planners that are asked only where no straight line to a goal is proved free: there AORRTC, of
2.0.1, returns a path from the goal to the goal (OMPL's issue 1420)."""

_SECOND_THREAD = ("PRMstar",)
"""Planners with a thread that looks for a solution. It may call no object that Python has made, as
it would wait for Python, which waits for it; so of several goals they are given the nearest."""

_ROUNDING = 1e-9
"""By what share a path may be longer than the straight line, and still be taken for it. Where it
is found, Informed RRT* finds nothing to draw that may shorten it, and divides it into thousands of
pieces."""

_WANTED = "2."  # how the version begins
_INSTALL = "pip install --no-deps ompl==2.0.1"
_NEW = f"python -m venv ompl2; ompl2/bin/pip install plannerbench; ompl2/bin/{_INSTALL}"


class Ompl2Planner(Guest):
    """A planner of OMPL 2's `ompl.geometric` over the environment's configuration space.

    States are checked by the environment's FCL model and motions by its certified segment check, as
    behind OMPL 1.7. The objective is path length; planning stops at the budget's cost, or where a
    path is the straight line.

    Args:
        algorithm: the class in `ompl.geometric`.
        python: see `Guest`; what environments need must be there, too.
        simplify: shorten and smooth the path with OMPL's PathSimplifier, on the clock.
        parameters: of the planner, by OMPL's names ("range", "goal_bias", ...).

    Raises:
        InputError: a parameter is unknown to the algorithm, or its value is refused.
    """

    distribution = "ompl"
    packages = (
        *("ompl", "numpy", "scipy", "numba", "fcl", "trimesh", "igl", "manifold3d"),
        *("yourdfpy", "yaml", "platformdirs"),
    )

    def __init__(
        self, algorithm: str, *, python: str = "", simplify: bool = False, **parameters: Any
    ) -> None:
        super().__init__(python)
        self.improves = algorithm not in _FIRST_SOLUTION_ONLY
        self._algorithm, self._simplify = algorithm, simplify
        chosen = {name: str(value) for name, value in parameters.items()}
        self._setters = setters(algorithm, chosen, ("python", "simplify"))

    def lacking(self, found: Installed) -> str | None:
        if found.version.startswith(_WANTED) and not found.missing:
            return None
        where = self.interpreter or sys.executable
        if found.version.startswith(_WANTED):
            missing = ", ".join(found.missing)
            return f"{where} lacks what environments need ({missing}); {_NEW}"
        has = f"ompl {found.version}" if found.version else "no ompl"
        if self.interpreter:
            return f"OMPL 2 is wanted, and {where} has {has}; {where} -m {_INSTALL}"
        return (
            f"OMPL 2 is wanted, and this interpreter has {has}; name one that has OMPL 2, "
            f"python=PATH, made by: {_NEW}"
        )

    def setup(self, env: Environment, *, seed: int) -> None:
        from ompl import base, util

        util.setLogLevel(util.LogLevel.LOG_NONE)
        self._space = StateSpace(env.sampling_space)
        self._model = env.collision_model(env.planning_tolerance)
        anywhere = env.sampling_space.lower
        self._model.stays_free(anywhere, anywhere)  # compiles, and fills tables, off the clock
        self._progress = Progress()
        self._checks = Checks(self._space.values, self._model, self._progress)
        self._checks.ends_iterations = True
        self._si = base.SpaceInformation(self._space.ompl)
        self._si.setStateValidityChecker(self._checks.of_state)
        self._motion_validator = _motion_validator(self._si, self._checks)
        self._si.setMotionValidator(self._motion_validator)
        self._si.setup()

    @cached_property
    def _version(self) -> str:
        return f"{self.distribution} {metadata.version(self.distribution)}"

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        begin, checks, callbacks = perf_counter(), self._model.checks, self._checks.seconds
        line = self._free_line(problem) if self._algorithm in _LOSES_STRAIGHT_LINES else None
        if line is None:
            status, path = self._solve(problem, budget)
            history = self._progress.history
        else:
            status, path = Status.EXACT_SOLUTION, line
            history = [[perf_counter() - begin, self._length(*line)]]
        stats = {
            "library": self._version,
            "collision_checks": self._model.checks - checks,
            "callback_s": self._checks.seconds - callbacks,
            "cost_history": history,
        }
        return PlannerResult(status, path, stats)

    def _solve(self, problem: Problem, budget: Budget) -> tuple[Status, Array | None]:
        """As OMPL does it; a path (k, d) if there is one."""
        from ompl import geometric, util

        util.RNG.setSeed(problem.seed)
        definition = self._definition(problem, budget.stop_cost)
        least = min(self._length(problem.start, q) for q in _goals(problem))
        enough = max(budget.stop_cost, (1 + _ROUNDING) * least)
        status = self._run(definition, usable(budget, self._algorithm), enough)
        if not definition.hasSolution():
            return status, None
        path, exact = definition.getSolutionPath(), definition.hasExactSolution()
        if self._simplify and exact:
            geometric.PathSimplifier(self._si).simplify(path, usable(budget, self._algorithm))
        states = [self._space.values(state) for state in path.getStates()]
        # FMT*'s path to where it is already has one state.
        waypoints = np.array(states if len(states) > 1 else 2 * states)
        return (Status.EXACT_SOLUTION if exact else Status.APPROXIMATE_SOLUTION), waypoints

    def _free_line(self, problem: Problem) -> Array | None:
        """The shortest straight line (2, d) to a goal that is proved free, if there is one."""
        goals = sorted(_goals(problem), key=lambda q: self._length(problem.start, q))
        begin = perf_counter()
        free = (q for q in goals if self._checks.of_edge(problem.start, q))
        found = next(free, None)
        self._checks.seconds += perf_counter() - begin
        return None if found is None else np.array([problem.start, found])

    def _length(self, a: Array, b: Array) -> float:
        """Of the straight line between two configurations (d,), as OMPL has it."""
        return float(self._si.distance(self._state(a), self._state(b)))

    def _run(self, definition: Any, seconds: float, enough: float) -> Status:
        """Plans for at most `seconds`, or until a path is short enough; the status that holds if
        there is no solution then."""
        from ompl import base

        planner = self._planner(definition)
        condition = base.timedPlannerTerminationCondition(seconds)
        end = perf_counter() + seconds
        self._checks.stop_at(end)
        self._progress.begin(_best_cost(planner), keen=self._algorithm in _WITHOUT_THRESHOLD)
        self._progress.when_below(enough, condition.terminate)
        if self._algorithm == "BITstar":
            begin = end - unpruned(seconds)
            self._progress.at(begin, lambda: planner.setPruneThresholdFraction(1.0))
        answer = planner.solve(condition)
        self._progress.end()
        self._checks.stop_at(math.inf)  # the path may be simplified
        return _STATUS.get(answer.getStatus().name, Status.TIMEOUT)

    def _planner(self, definition: Any) -> Any:
        """A new one of OMPL's, for a problem, with our parameters."""
        from ompl import geometric

        planner = getattr(geometric, self._algorithm)(self._si)
        for setter, value in self._setters:
            getattr(planner, setter)(value)
        planner.setProblemDefinition(definition)
        planner.setup()
        return planner

    def _definition(self, problem: Problem, stop_cost: float) -> Any:
        from ompl import base

        definition = base.ProblemDefinition(self._si)
        goals = _goals(problem)
        if self._algorithm in _SECOND_THREAD:
            goals = [min(goals, key=lambda q: self._length(problem.start, q))]
        definition.addStartState(self._state(problem.start))
        if len(goals) == 1:
            definition.setGoalState(self._state(goals[0]))  # which Python has not made
        else:
            several = base.GoalStates(self._si)
            for q in goals:
                several.addState(self._state(q))
            definition.setGoal(several)
        objective = self._space.path_length(self._si)
        objective.setCostThreshold(base.Cost(stop_cost))
        definition.setOptimizationObjective(objective)
        return definition

    def _state(self, q: Array) -> Any:
        """A state at a configuration (d,), of which OMPL makes copies."""
        state = self._si.allocState()  # Python's to delete: `freeState` would do it twice
        self._space.fill(state, q)
        return state


def _goals(problem: Problem) -> Sequence[Array]:
    return [problem.goal] if problem.goals is None else list(problem.goals)


def _best_cost(planner: Any) -> Callable[[], float] | None:
    """What gives the length of a planner's best path; None if it does not tell."""
    if not hasattr(planner, "bestCost"):
        return None
    return lambda: float(planner.bestCost().value())


def _motion_validator(si: Any, checks: Checks) -> Any:
    from ompl import base

    class CertifiedMotionValidator(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, a: Any, b: Any) -> bool:  # noqa: N802
            return checks.of_motion(a, b)

    return CertifiedMotionValidator(si)


_STATUS = {
    "INVALID_START": Status.INVALID_START,
    "INVALID_GOAL": Status.INVALID_GOAL,
    "INFEASIBLE": Status.INFEASIBLE,
}
