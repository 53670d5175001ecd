"""Prints where the time of OMPL's planners goes: in OMPL, in our checks, which are Python's with
FCL's answers, and in the binding between:
python tests/benchmarks/ompl_cost.py [ENVIRONMENT [PROBLEMS]]
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import pytest

import envs
import planners
from envs import Environment, Problem
from planners import Budget
from planners.ompl import parameters
from planners.ompl.state_space import unit_square
from planners.ompl.validity import Validity

_QUESTIONS = 100_000
_LIMIT_S = 5.0


class Clock:
    """Seconds within functions that it wraps, and calls of them."""

    def __init__(self) -> None:
        self.seconds, self.calls = 0.0, 0

    def around(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any) -> Any:
            begin = perf_counter()
            try:
                return function(*arguments)
            finally:
                self.seconds += perf_counter() - begin
                self.calls += 1

        return timed


def main(name: str = "c3d", count: str = "30") -> None:
    env = envs.make(name)
    problems = env.sample_problems(int(count), 7)
    stops = lengths_to_stop_at(env, problems)
    crossing = seconds_of_a_question()
    print(f"OMPL asks Python in {crossing * 1e6:.2f} us")
    print("planner            mean s  questions  in checks  in binding")
    for spec in planners.REGISTRY.specs():
        if spec.entry_point == "planners.ompl.planner:OmplPlanner":
            clock = Clock()
            whole = time_of(spec.id, env, problems, stops, clock)
            each = whole / len(problems), clock.calls / len(problems)
            shares = clock.seconds / whole, clock.calls * crossing / whole
            print(
                f"{spec.id:<16} {each[0]:8.4f} {each[1]:10.0f} {shares[0]:10.0%} {shares[1]:11.1%}"
            )


def time_of(
    name: str, env: Environment, problems: list[Problem], stops: list[float], clock: Clock
) -> float:
    """Seconds of a planner on all problems; the clock has those in our checks."""
    with pytest.MonkeyPatch.context() as patched:
        for asked in ("of_state", "of_motion"):
            patched.setattr(Validity, asked, clock.around(getattr(Validity, asked)))
        planner = planners.make(f"{name}:roadmap_s=0" if "prm" in name else name)
        planner.setup(env, seed=1)
        planner.solve(problems[0], Budget(perf_counter() + _LIMIT_S))  # compiles what is compiled
        clock.seconds = clock.calls = 0
        begin = perf_counter()
        for problem, stop in zip(problems, stops, strict=True):
            planner.solve(problem, Budget(perf_counter() + _LIMIT_S, stop))
        return perf_counter() - begin


def lengths_to_stop_at(env: Environment, problems: list[Problem]) -> list[float]:
    """As `--stop match:fmm`; the first solution where there is no grid."""
    reference = planners.make("fmm")
    if reference.unsupported(env) is not None:
        return [np.inf] * len(problems)
    reference.setup(env, seed=0)
    paths = (reference.solve(p, Budget(perf_counter() + 60)).path for p in problems)
    return [1.05 * env.space.length(np.asarray(path)) for path in paths]


def seconds_of_a_question() -> float:
    """From OMPL to a function in Python that does nothing, and back."""
    base, _, _ = parameters.load()
    in_python = base.StateValidityCheckerFn(lambda state: True)
    si = unit_square().information()
    spent = []
    for checker in (in_python, base.AllValidStateValidityChecker(si)):
        si.setStateValidityChecker(checker)
        si.setup()
        begin = perf_counter()
        si.probabilityOfValidState(_QUESTIONS)
        spent.append(perf_counter() - begin)
    return (spent[0] - spent[1]) / _QUESTIONS


if __name__ == "__main__":
    main(*sys.argv[1:])
