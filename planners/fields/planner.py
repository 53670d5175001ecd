"""Planning along a neural time field."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from envs import Environment, InputError, Problem
from envs.problem import Array
from planners.base import Budget, PlannerResult, Status
from planners.fields.computed_inputs import ComputedInputs
from planners.fields.indoor_features import RoomInputs
from planners.fields.methods import method, unsupported
from planners.fields.metric_field import MetricField
from planners.fields.networks import TimeField
from planners.fields.path_extraction import Descent, Field, descend, gradients
from planners.fields.single_query import CompiledField
from planners.learning.learned_planner import (
    LearnedPlanner,
    Trained,
    Training,
    unsupported_scenes,
)
from planners.learning.normalizer import Normalizer, unsupported_space
from planners.learning.trainer import filled, learn
from planners.learning.weight_files import Tensors

ATTEMPTS = (
    Descent(step=0.03),
    Descent(step=0.01),
    Descent(step=0.005, most_steps=1000),
    Descent(step=0.01, moves=(False, True), most_steps=1000),
    Descent(step=0.01, moves=(True, False), most_steps=1000),
)
"""Tried in turn until a path passes the check: the paper's step, smaller ones, one end only."""

ATTEMPTS_IN_ROOMS = (
    Descent(step=0.02, true_speed=True, margin=0.15),
    Descent(step=0.02, most_steps=150, true_speed=True, margin=0.15, escapes=25),
    Descent(step=0.01, true_speed=True, margin=0.1),
    Descent(step=0.03),
    Descent(step=0.02, moves=(False, True), most_steps=700, true_speed=True, margin=0.1),
)
"""The same in rooms, where a field is steep and least certain beside walls."""

ATTEMPTS_FOR_ARMS = (
    Descent(step=0.02, true_speed=True, margin=0.1),
    Descent(step=0.02, moves=(False, True), most_steps=700, true_speed=True, margin=0.1),
    Descent(step=0.02, moves=(True, False), most_steps=700, true_speed=True, margin=0.1),
    Descent(step=0.01, true_speed=True),
    Descent(step=0.03, true_speed=True, margin=0.2),
)
"""The same for arms."""

_SAFE = 3  # of the judge's tolerance: what the check finds free, the judge does too


def _computed_inputs(net: Any) -> ComputedInputs | None:
    """Those of a network, if it has any."""
    return net.inputs if isinstance(net, (TimeField, MetricField)) else None


def _attempts(net: Any) -> tuple[Descent, ...]:
    inputs = _computed_inputs(net)
    if isinstance(inputs, RoomInputs):
        return ATTEMPTS_IN_ROOMS
    return ATTEMPTS if inputs is None else ATTEMPTS_FOR_ARMS


class FieldPlanner(LearnedPlanner):
    """Follows a neural time field from both ends, and returns what its own check proves free.

    Args:
        method: one of `methods.METHODS`.
        weights: a file of weights; by default the shipped ones, else those in the user's cache.
        attempts: how many attempts it may make at a problem (`ATTEMPTS`, `ATTEMPTS_IN_ROOMS`); 1 is
            the paper's single one.
        device: of PyTorch, "cpu", "cuda" or "cuda:INDEX". Away from the CPU single problems are
            compiled in rooms only.

    Raises:
        InputError: an argument is out of range.
    """

    improves = False

    def __init__(
        self, method: str, weights: str = "", attempts: int = len(ATTEMPTS), device: str = "cpu"
    ) -> None:
        super().__init__(method, weights, device)
        if not 1 <= attempts <= len(ATTEMPTS):
            raise InputError(f"{method}: attempts must be between 1 and {len(ATTEMPTS)}")
        self._count = attempts

    def unsupported(self, env: Environment) -> str | None:
        reason = unsupported_scenes(env) or unsupported_space(env.space)
        return reason or unsupported(self.name, env)

    def expected_minutes(self, env: Environment) -> float:
        return method(self.name, env).expected_minutes

    def fitted(self, env: Environment, tensors: Tensors) -> nn.Module:
        return filled(method(self.name, env).network(env), tensors)

    def load(self, env: Environment, tensors: Tensors) -> None:
        self._use(env, self.fitted(env, tensors))
        if self._compiled is not None:
            self._compile()

    def _compile(self) -> None:
        """Compiles all that `solve` may call, or loads what was compiled before: off the clock."""
        assert self._compiled is not None
        middle = (self._env.lower + self._env.upper) / 2
        ends = np.array([middle, middle + 0.01 * self._scale.extent])
        at_once = replace(self._attempts[0], meeting=math.inf, margin=0.0)  # so there is a path
        self._one(ends[0], ends[1], at_once)
        self._free([ends])
        if any(descent.escapes for descent in self._attempts):
            self._compiled.escaped(self._scale.normalize(ends).astype(np.float32), 0)

    def solve(self, problem: Problem, budget: Budget) -> PlannerResult:
        refusal = self._refused([problem])[0]
        if refusal is not None:
            return PlannerResult(refusal)
        for number, descent in enumerate(self._attempts, start=1):
            if budget.remaining() <= 0:
                break
            path = self._one(problem.start, problem.goal, descent)
            if path is not None and self._free([path])[0] and budget.remaining() > 0:
                return PlannerResult(Status.EXACT_SOLUTION, path, {"attempts": number})
        late = budget.remaining() <= 0
        return PlannerResult(Status.TIMEOUT if late else Status.APPROXIMATE_SOLUTION)

    def solve_batch(self, problems: Sequence[Problem]) -> list[PlannerResult]:
        """Solves many problems at once, with the attempts of `solve`, without a deadline."""
        if not problems:
            return []
        refused = self._refused(problems)
        results = [PlannerResult(r or Status.APPROXIMATE_SOLUTION) for r in refused]
        left = [i for i, refusal in enumerate(refused) if refusal is None]
        for number, descent in enumerate(self._attempts, start=1):
            if not left:
                break
            paths = self._many([problems[i] for i in left], descent)
            found = [(i, path) for i, path in zip(left, paths, strict=True) if path is not None]
            free = self._free([path for _, path in found])
            for (i, path), is_free in zip(found, free, strict=True):
                if is_free:
                    solved = PlannerResult(Status.EXACT_SOLUTION, path, {"attempts": number})
                    results[i] = solved
            left = [i for i in left if results[i].status is not Status.EXACT_SOLUTION]
        return results

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """See `planners.base.TimeFieldPlanner`."""
        sources = self._tensor(np.broadcast_to(source, q.shape))
        with torch.no_grad():
            times, gradient, _ = gradients(self._net, self._tensor(q), sources, self._scale.circles)
        seconds: Array = times.cpu().numpy().astype(np.float64) * self._scale.extent
        steepness: Array = gradient.norm(dim=-1).cpu().numpy().astype(np.float64)
        return seconds, 1 / steepness

    def train(self, env: Environment, how: Training) -> Trained:
        def solved(net: nn.Module, problems: Sequence[Problem]) -> int:
            student = FieldPlanner(self.name, attempts=self._count, device=how.device)
            student._use(env, net)
            results = student.solve_batch(problems)
            return sum(result.status is Status.EXACT_SOLUTION for result in results)

        return learn(method(self.name, env), env, how, solved)

    def _use(self, env: Environment, net: Any) -> None:
        """Plans in `env` with `net` from now on."""
        self._env = env
        self._scale = Normalizer.of(env)
        bounds = (self._scale.normalize(corner) for corner in (env.lower, env.upper))
        self._lower, self._upper = self._scale.circles.limits(*bounds)
        self._net: Field = net.to(self.device).eval()
        self._one_by_one = _computed_inputs(net) is not None
        self._attempts = _attempts(net)[: self._count]
        wanted = self.device == "cpu" or self._one_by_one
        self._compiled = CompiledField(net) if wanted and CompiledField.fits(net) else None

    def _refused(self, problems: Sequence[Problem]) -> list[Status | None]:
        """Why a problem need not be tried."""
        starts, goals = (np.array([getattr(p, end) for p in problems]) for end in ("start", "goal"))
        bad_start, bad_goal = (
            (self._env.clearance(q) <= 0) | ~self._env.contains(q) for q in (starts, goals)
        )
        return [
            Status.INVALID_START if at_start else Status.INVALID_GOAL if at_goal else None
            for at_start, at_goal in zip(bad_start, bad_goal, strict=True)
        ]

    def _one(self, start: Array, goal: Array, descent: Descent) -> Array | None:
        """The path (k, d) of one attempt at one problem, in the environment's unit."""
        if self._compiled is None:
            [path] = self._many([Problem(start, goal)], descent)
            return path
        a, b = (self._scale.normalize(q).astype(np.float32) for q in (start, goal))
        lower, upper = (q.astype(np.float32) for q in (self._lower, self._upper))
        found = self._compiled.descend(a, b, lower, upper, descent)
        return None if found is None else self._grown(found, start, goal)

    def _many(self, problems: Sequence[Problem], descent: Descent) -> list[Array | None]:
        """The same for many problems; at once, but in rooms."""
        if self._one_by_one:
            return [self._one(p.start, p.goal, descent) for p in problems]
        starts = self._tensor(np.array([p.start for p in problems]))
        goals = self._tensor(np.array([p.goal for p in problems]))
        lower, upper = (
            torch.from_numpy(q).float().to(self.device) for q in (self._lower, self._upper)
        )
        circles = self._scale.circles
        paths = descend(self._net, starts, goals, lower, upper, descent, circles)
        return [
            None if path is None else self._grown(path.numpy(), p.start, p.goal)
            for path, p in zip(paths, problems, strict=True)
        ]

    def _grown(self, path: Any, start: Array, goal: Array) -> Array:
        """A path in the environment's unit, with the ends exactly as they were asked for."""
        grown = self._scale.denormalize(path.astype(np.float64))
        grown = np.clip(grown, self._env.lower, self._env.upper)
        grown[0], grown[-1] = start, goal
        return grown

    def _free(self, paths: Sequence[Array]) -> Any:
        return self._env.paths_are_free(paths, _SAFE * self._env.tolerance)

    def _tensor(self, q: Array) -> Tensor:
        return torch.from_numpy(self._scale.normalize(q)).float().to(self.device)
