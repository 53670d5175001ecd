"""Which problems a straight line does not solve."""

from __future__ import annotations

from collections.abc import Sequence

from envs import Environment, Problem

BLOCKED, FREE = "B", "F"
"""A letter each, of the problems 0, 1, ..., as runs note them."""


def straight_lines(env: Environment, problems: Sequence[Problem]) -> str:
    """Of each problem whether its straight line is BLOCKED or FREE, by the check that the judge
    has, at its tolerance."""
    model = env.collision_model()
    free = (model.segment_is_free(problem.start, problem.goal) for problem in problems)
    return "".join(FREE if is_free else BLOCKED for is_free in free)


def share_blocked(letters: str) -> float:
    """The share of blocked straight lines, to four digits; 0 without problems."""
    return round(letters.count(BLOCKED) / max(len(letters), 1), 4)
