"""Planning with an imitation network."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
import torch
from torch import nn

import planners
from envs import Environment, InputError, Problem
from envs.problem import Array
from envs.seeding import derived_seed
from planners.base import Budget, Planner, PlannerResult, Status
from planners.learning.learned_planner import LearnedPlanner, Trained, Training
from planners.learning.normalizer import Normalizer, obstacle_point_cloud, unsupported_space
from planners.learning.trainer import Method, filled, learn
from planners.learning.training_loop import Recipe
from planners.learning.weight_files import Tensors
from planners.mpnet.imitation import Imitation
from planners.mpnet.search import Expander, Mpnet, PlannerShape, Search


def network(env: Environment) -> Mpnet:
    """The networks for an environment's configurations."""
    return Mpnet(PlannerShape(env.dimension, circles=Normalizer.of(env).circles))


METHOD = Method(
    network,
    Imitation,
    Recipe(steps=12_000, learning_rate=1e-3, betas=(0.9, 0.999)),
    expected_minutes=30.0,
)

_VALIDATION_S = 0.5  # for a problem, while training
_ATTEMPTS = 3  # of the network alone, before a fallback is asked
_FALLBACK_SHARE = 0.2  # of the time that is left, for one motion: it may be one without a path


def _made(fallback: str) -> Planner:
    entry = planners.REGISTRY.entry(fallback)
    if issubclass(entry.spec.load(), MpnetPlanner):
        raise InputError(f"mpnet: fallback={entry.spec.id} would fall back on itself; name another")
    return entry.make()


class MpnetPlanner(LearnedPlanner):
    """Bidirectional neural expansion, lazy vertex contraction and neural replanning.

    From both ends in turn, the network steps towards the other, until a free straight motion
    joins them. The path is contracted; infeasible motions are replanned by the network. When that
    does not help, a new path is begun (dropout is random), until the time is over.

    Every check of a configuration or motion is the environment's certified one.

    Args:
        fallback: a planner of another kind, as in `bench run --planners`, for the motions that
            stay infeasible; by default none, and the time limit ends the search.
        weights: a file of weights; by default the shipped ones, else those in the user's cache.
        device: of PyTorch, "cpu", "cuda" or "cuda:INDEX", for training; the network is so small
            that it plans on the CPU.

    Raises:
        InputError: an argument is out of range.
    """

    improves = False

    def __init__(self, fallback: str = "", weights: str = "", device: str = "cpu") -> None:
        super().__init__("mpnet", weights, device)
        self._fallback = _made(fallback) if fallback else None

    def unsupported(self, env: Environment) -> str | None:
        if len(env.family()) < 2:
            return "it learns from demonstrations in many scenes, and this one has no family"
        reason = unsupported_space(env.space)
        if reason is None and self._fallback is not None:
            reason = self._fallback.unsupported(env)
        return reason

    def domain(self, env: Environment) -> str:
        return env.family_fingerprint

    def weights_digest(self, env: Environment) -> str:
        own = super().weights_digest(env)
        theirs = self._fallback.weights_digest(env) if self._fallback is not None else ""
        return "-".join(filter(None, (own, theirs)))

    def expected_minutes(self, env: Environment) -> float:
        return METHOD.expected_minutes

    def setup(self, env: Environment, *, seed: int) -> None:
        super().setup(env, seed=seed)
        if self._fallback is not None:
            self._fallback.setup(env, seed=derived_seed("mpnet fallback", seed))

    def fitted(self, env: Environment, tensors: Tensors) -> nn.Module:
        return filled(METHOD.network(env), tensors)

    def load(self, env: Environment, tensors: Tensors) -> None:
        self._use(env, self.fitted(env, tensors))

    def train(self, env: Environment, how: Training) -> Trained:
        def solved(net: nn.Module, problems: Sequence[Problem]) -> int:
            student = MpnetPlanner()
            student._use(env, net)
            results = (student.solve(p, Budget(perf_counter() + _VALIDATION_S)) for p in problems)
            return sum(result.status is Status.EXACT_SOLUTION for result in results)

        return learn(METHOD, env, how, solved)

    def _use(self, env: Environment, net: Any) -> None:
        """Plans in `env` with `net` from now on."""
        self._env = env
        self._model = env.collision_model(env.planning_tolerance)
        points = torch.from_numpy(obstacle_point_cloud(env)).float()[None]
        with torch.no_grad():
            code = net.encoder(points.to(next(net.parameters()).device))[0]
        self._expander = Expander(net.planner, code.cpu().numpy(), Normalizer.of(env))

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        checks = self._model.checks
        helper = None if self._fallback is None else _Helper(self._fallback, problem, budget)
        status, path, spent = self._solved(problem, budget, helper)
        others = 0 if helper is None else helper.checks
        if others is not None:
            spent = {**spent, "collision_checks": self._model.checks - checks + others}
        return PlannerResult(status, path, spent)

    def _solved(
        self, problem: Problem, budget: Budget, helper: _Helper | None
    ) -> tuple[Status, Array | None, dict[str, Any]]:
        for end, refusal in (
            (problem.start, Status.INVALID_START),
            (problem.goal, Status.INVALID_GOAL),
        ):
            if not self._env.contains(end[None])[0] or not self._model.is_valid(end):
                return refusal, None, {}
        search = Search(self._env, self._model, self._expander, problem, budget)
        fallbacks = 0
        while budget.remaining() > 0:
            path = search.attempt()
            if helper is not None and search.attempts >= _ATTEMPTS and search.is_open(path):
                fallbacks += 1
                path = search.mended(path, helper.between)
            if not search.is_open(path) and budget.remaining() > 0:
                break
        else:
            return Status.TIMEOUT, None, search.stats()
        helped = {} if helper is None else {"fallbacks": fallbacks}
        return Status.EXACT_SOLUTION, np.array(path), search.stats() | helped


class _Helper:
    """Another planner's help with one problem.

    Attributes:
        checks: collision checks that it made, or None once it has not said how many.
    """

    def __init__(self, planner: Planner, problem: Problem, budget: Budget) -> None:
        self._planner = planner
        self._problem = problem
        self._budget = budget
        self._seeds = itertools.count()
        self.checks: int | None = 0

    def between(self, a: Array, b: Array) -> list[Array]:
        """Its first path between two configurations, or the two if it has none."""
        budget, seen = self._budget, self._problem
        seed = derived_seed("mpnet fallback", seen.seed, next(self._seeds))
        deadline = budget.deadline - (1 - _FALLBACK_SHARE) * budget.remaining()
        found = self._planner.solve(
            Problem(a, b, seen.index, seed), Budget(deadline, stop_cost=math.inf)
        )
        said = found.stats.get("collision_checks")
        self.checks = None if said is None or self.checks is None else self.checks + said
        return list(found.path) if found.status is Status.EXACT_SOLUTION else [a, b]
