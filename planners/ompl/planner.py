"""OMPL's sampling planners through one adapter; each planner is a spec."""

from __future__ import annotations

import math
from time import perf_counter
from typing import Any

import numpy as np

from envs import Environment, InputError, Problem
from envs.collision.shapes import Mesh
from envs.problem import Array
from envs.seeding import training_seed
from planners.base import Budget, Planner, PlannerResult, Status
from planners.ompl import parameters
from planners.ompl.parameters import set_parameters
from planners.ompl.state_space import StateSpace, unit_square
from planners.ompl.validity import CERTIFIED, validity_by
from planners.ompl_common.progress import Progress
from planners.ompl_common.time_limit import unpruned, usable

_ROADMAPS = ("PRMstar", "LazyPRMstar")

_FIRST_SOLUTION_ONLY = ("RRTConnect", "FMT")
"""Planners that end with their first solution, whatever time is left."""

_PAPERS_ROADMAP_S = 40.0
"""Of growing a roadmap, in the paper's tables: it plans with one where obstacles are meshes
(Gibson), by LazyPRM*, and without one elsewhere."""

_MOST_ROADMAP_S = 86_400  # a day

_GROWTH_OF_LAZY_ROADMAP = 0.02
"""The share of its time in which LazyPRM*'s roadmap grows; in the rest its edges are checked. In a
generated house 1 s of growth gives 158,000 edges, which 24 s check."""


class OmplPlanner(Planner):
    """A planner of `ompl.geometric` over the environment's configuration space.

    States are checked by the environment's FCL model and motions by its certified segment check,
    so that no path is lost to a resolution that the planner never chose. A planner that tests
    states along an edge itself gets a state check with a margin that closes the gaps between
    them. The objective is path length; planning stops at the budget's cost. With
    `validator=sampled` motions are checked as OMPL does by default, by states along them.

    Args:
        algorithm: the class in `ompl.geometric`.
        validator: "certified", or "sampled", which proves nothing: the judge may refuse what this
            planner takes for valid.
        resolution: the longest gap between the states that are sampled, as a share of the extent of
            the space: above 0, at most 1; 0.01, as OMPL has it, by default.
        simplify: shorten and smooth the path with OMPL's PathSimplifier, on the clock.
        roadmap_s: at most so many seconds of growing a roadmap offline, no more than a day. PRM*
            keeps it, and lets it grow, from problem to problem; LazyPRM*, whose later edges are
            unchecked, begins each problem with it as it was. 0 plans every problem from nothing.
            None, the default, is 40 for LazyPRM* among meshes, as the paper has it in Gibson, and 0
            else.
        parameters: of the OMPL planner, by OMPL's names ("range", "goal_bias", ...), see
            `parameters.set_parameters`.

    Raises:
        InputError: a parameter is unknown to the algorithm, or its value is refused.
    """

    def __init__(
        self,
        algorithm: str,
        *,
        validator: str = CERTIFIED,
        resolution: float | None = None,
        simplify: bool = False,
        roadmap_s: float | None = None,
        **parameters: Any,
    ) -> None:
        if roadmap_s is not None and not 0 <= roadmap_s <= _MOST_ROADMAP_S:
            raise InputError(f"roadmap_s must be between 0 and {_MOST_ROADMAP_S}, not {roadmap_s}")
        if roadmap_s and algorithm not in _ROADMAPS:
            raise InputError(f"{algorithm} keeps no roadmap; roadmap_s is for PRM* and LazyPRM*")
        self._validity_of = validity_by(validator, resolution, algorithm)
        self.improves = algorithm not in _FIRST_SOLUTION_ONLY
        self._algorithm = algorithm
        self._simplify = simplify
        self._roadmap_s = roadmap_s
        self._parameters = {name: str(value) for name, value in parameters.items()}
        self._kept: Any = None
        self._roadmap: Any = None
        if parameters:
            self._make(unit_square().information())

    def setup(self, env: Environment, *, seed: int) -> None:
        _, _, util = parameters.load()
        self._space = StateSpace(env.sampling_space)
        self._model = env.collision_model(env.planning_tolerance)
        anywhere = env.sampling_space.lower
        self._model.stays_free(anywhere, anywhere)  # compiles, and fills tables, off the clock
        self._si = self._space.information()
        self._progress = Progress()
        self._validity = self._validity_of(
            self._si, self._space, env, self._model, self._algorithm, self._progress
        )
        self._si.setup()
        # One for all problems: a planner that is kept looks only at the first it was given.
        self._objective = self._space.path_length(self._si)
        seconds = self._roadmap_seconds(env)
        if seconds:
            util.RNG.setSeed(seed)
            self._kept = self._make(self._si)
            [problem] = env.sample_problems(1, training_seed("ompl roadmap", seed))
            self._grow(problem, seconds)

    def _grow(self, problem: Problem, seconds: float) -> None:
        """Grows the roadmap on one problem. LazyPRM*'s edges are not checked then, and those that
        are blocked would be found one path at a time, so most of its time goes into checking."""
        end = perf_counter() + seconds
        lazy = self._algorithm == "LazyPRMstar"
        share = _GROWTH_OF_LAZY_ROADMAP if lazy else 1.0
        self._run(self._kept, problem, share * seconds, stop_cost=0.0)
        if lazy:
            self._roadmap = self._checked(self._kept, end)

    def _checked(self, planner: Any, end: float) -> Any:
        """A planner's roadmap without the edges that are found to be blocked until `end`, on
        `time.perf_counter`."""
        base, _, util = parameters.load()
        data = base.PlannerData(self._si)
        planner.getPlannerData(data)
        data.decoupleFromPlanner()
        vertices = (data.getVertex(i) for i in range(data.numVertices()))
        states = [self._space.values(vertex.getState()) for vertex in vertices]
        for i, state in enumerate(states):
            neighbours = util.vectorUint()
            data.getEdges(i, neighbours)
            for j in list(neighbours):
                if perf_counter() > end:
                    break
                if j > i and not self._validity.of_edge(state, states[j]):
                    data.removeEdge(i, j)
                    data.removeEdge(j, i)
        data.computeEdgeWeights(self._objective)
        return data

    def _roadmap_seconds(self, env: Environment) -> float:
        if self._roadmap_s is not None:
            return self._roadmap_s
        among_meshes = any(isinstance(obstacle, Mesh) for obstacle in env.obstacles)
        return _PAPERS_ROADMAP_S if self._algorithm == "LazyPRMstar" and among_meshes else 0.0

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        _, geometric, util = parameters.load()
        checks, callbacks = self._model.checks, self._validity.seconds
        if self._roadmap is not None:
            util.RNG.setSeed(problem.seed)
            planner = self._with_parameters(geometric.LazyPRMstar(self._roadmap))
        elif self._kept is None:
            util.RNG.setSeed(problem.seed)
            planner = self._make(self._si)
        else:
            planner = self._kept
            planner.clearQuery()
        seconds = usable(budget, self._algorithm)
        definition, status = self._run(planner, problem, seconds, budget.stop_cost)
        path = definition.getSolutionPath() if definition.hasSolution() else None
        if path is not None and self._simplify and definition.hasExactSolution():
            geometric.PathSimplifier(self._si).simplify(path, usable(budget, self._algorithm))
        stats = {
            "collision_checks": self._model.checks - checks,
            "callback_s": self._validity.seconds - callbacks,
            "cost_history": self._progress.history,
            **self._validity.stats,
        }
        if path is None:
            return PlannerResult(status, None, stats)
        states = [self._space.values(state) for state in path.getStates()]
        # FMT*'s path to where it is already has one state.
        waypoints = np.array(states if len(states) > 1 else 2 * states)
        exact = definition.hasExactSolution()
        status = Status.EXACT_SOLUTION if exact else Status.APPROXIMATE_SOLUTION
        return PlannerResult(status, waypoints, stats)

    def _run(
        self, planner: Any, problem: Problem, seconds: float, stop_cost: float
    ) -> tuple[Any, Status]:
        """Plans for at most `seconds`; the problem definition with its solutions, and the status
        that holds if there are none."""
        base, _, _ = parameters.load()
        definition = base.ProblemDefinition(self._si)
        if problem.goals is None:
            ends = (self._space.state(q) for q in (problem.start, problem.goal))
            definition.setStartAndGoalStates(*ends)
        else:
            definition.addStartState(self._space.state(problem.start))
            definition.setGoal(self._goals(problem.goals))
        self._objective.setCostThreshold(base.Cost(stop_cost))
        definition.setOptimizationObjective(self._objective)
        planner.setProblemDefinition(definition)
        if not planner.isSetup():
            planner.setup()
        self._progress.begin(_best_cost(planner))
        end = perf_counter() + seconds
        self._validity.stop_at(end)
        if self._algorithm == "BITstar":
            begin = end - unpruned(seconds)
            self._progress.at(begin, lambda: planner.setPruneThresholdFraction(1.0))
        # Not solve(seconds): that one polls the clock from a thread.
        answer = planner.solve(base.timedPlannerTerminationCondition(seconds))
        self._progress.end()
        self._validity.stop_at(math.inf)  # the path may be simplified
        return definition, _STATUS.get(answer.getStatus().name, Status.TIMEOUT)

    def _goals(self, goals: Array) -> Any:
        """Several, any of which will do, (g, d)."""
        base, _, _ = parameters.load()
        states = base.GoalStates(self._si)
        for goal in goals:
            states.addState(self._space.state(goal))
        return states

    def _make(self, si: Any) -> Any:
        """A new planner with our parameters."""
        _, geometric, _ = parameters.load()
        return self._with_parameters(getattr(geometric, self._algorithm)(si))

    def _with_parameters(self, planner: Any) -> Any:
        _, _, util = parameters.load()
        own = [
            "simplify",
            "validator",
            "resolution",
            *(["roadmap_s"] if self._algorithm in _ROADMAPS else []),
        ]
        set_parameters(planner, self._algorithm, self._parameters, own, util.vectorString())
        return planner


_STATUS = {
    "INVALID_START": Status.INVALID_START,
    "INVALID_GOAL": Status.INVALID_GOAL,
    "INFEASIBLE": Status.INFEASIBLE,
}


def _best_cost(planner: Any) -> Any:
    """What gives the length of a planner's best path, as text; None if it does not tell."""
    properties = planner.getPlannerProgressProperties()
    # Not a mapping to Python: iterating it gives entries, not names.
    names = list(properties.keys())
    best = next((name for name in names if name.startswith("best cost")), None)
    return properties[best] if best else None
