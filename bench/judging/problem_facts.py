"""What is known of problems before anybody solves them: whose straight line is blocked, and which
cannot be solved as they are posed, as the judge accepts no path that begins or ends where they do.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from bench.judging.judge import SceneModels
from bench.judging.touching_pairs import touching_pairs
from envs import Environment, Problem
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array

BLOCKED, FREE, UNKNOWN = "B", "F", "-"
"""A letter each, of straight lines, as runs note them."""

_NAMED = 3
"""Pairs that are named, the deepest first."""


@dataclass(frozen=True)
class InvalidEnd:
    """A start or a goal that the judge refuses.

    Attributes:
        index: of the problem.
        end: "start" or "goal", of several goals "goal 1", "goal 2", ...
        reason: which joints are outside their limits and by how much, or which links and obstacles
            touch and how deep.
    """

    index: int
    end: str
    reason: str

    def data(self) -> dict[str, Any]:
        """As JSON data."""
        return asdict(self)

    def __str__(self) -> str:
        return f"{self.end}: {self.reason}"


@dataclass(frozen=True)
class ProblemFacts:
    """What the judge's collision check says of some problems before anybody solves them.

    Attributes:
        straight_lines: of each problem whether its straight line is BLOCKED or FREE.
        invalid_ends: the starts and goals that the judge refuses, in the problems' order.
        invalid: of the problems that cannot be solved as they are posed, since the start or all
            goals are refused, why not, by their indices.
        problems: as planners get them: of several goals those that are not refused.
    """

    straight_lines: str
    invalid_ends: tuple[InvalidEnd, ...]
    invalid: Mapping[int, str]
    problems: tuple[Problem, ...]


def problem_facts(env: Environment, problems: Sequence[Problem]) -> ProblemFacts:
    """Of problems of an environment, each in its own scene, to the judge's tolerance."""
    models = SceneModels(env)
    letters, ends, invalid, solvable = [], [], {}, []
    for problem in problems:
        model = models.of(problem)
        refused = _invalid_ends(env.scene_of(problem), model, problem)
        goals = _goals_but(problem, [end.end for end in refused])
        if len(goals) == 0 or any(end.end == "start" for end in refused):
            invalid[problem.index] = "; ".join(map(str, refused))
            goals = problem.all_goals[:0]
        is_free = any(model.segment_is_free(problem.start, goal) for goal in goals)
        letters.append(FREE if is_free else BLOCKED)
        ends += refused
        changed = bool(refused) and len(goals) > 0
        solvable.append(replace(problem, goal=goals[0], goals=goals) if changed else problem)
    return ProblemFacts("".join(letters), tuple(ends), invalid, tuple(solvable))


def _goals_but(problem: Problem, refused: Sequence[str]) -> Array:
    """The goals (g, d) that are not refused."""
    return problem.all_goals[[name not in refused for name in _goal_names(problem)]]


def _goal_names(problem: Problem) -> list[str]:
    count = len(problem.all_goals)
    return ["goal"] if count == 1 else [f"goal {n + 1}" for n in range(count)]


def share_blocked(letters: str) -> float:
    """The share of blocked straight lines, to four digits; 0 without problems."""
    return round(letters.count(BLOCKED) / max(len(letters), 1), 4)


def _invalid_ends(scene: Environment, model: CollisionModel, problem: Problem) -> list[InvalidEnd]:
    goals = zip(_goal_names(problem), problem.all_goals, strict=True)
    ends = [("start", problem.start), *goals]
    reasons = ((end, _refusal(scene, model, q)) for end, q in ends)
    return [InvalidEnd(problem.index, end, reason) for end, reason in reasons if reason]


def _refusal(scene: Environment, model: CollisionModel, q: Array) -> str:
    """Why the judge refuses whatever passes a configuration (d,), "" if it does not."""
    outside = "; ".join(_beyond_bounds(scene, q))
    if outside:
        return outside
    if model.clearance(q, 2 * model.tolerance) > model.tolerance:
        return ""
    return "; ".join(_contacts(scene, model, q)) or f"the robot is {scene.not_allowed}"


def _beyond_bounds(scene: Environment, q: Array) -> Iterator[str]:
    space, unit = scene.space, scene.units["configuration"]
    if space.contains(q[None])[0]:
        return
    limits = (("lower", space.lower, space.lower - q), ("upper", space.upper, q - space.upper))
    for which, limit, beyond in limits:
        for axis in np.flatnonzero(beyond > 0).tolist():
            yield (
                f"{scene.coordinate_names[axis]} is {beyond[axis]:.2g} {unit} beyond its {which} "
                f"limit of {limit[axis]:.6g}"
            )
    if (q >= space.lower).all() and (q <= space.upper).all():
        yield "its rotation is no quaternion of length 1"


def _contacts(scene: Environment, model: CollisionModel, q: Array) -> Iterator[str]:
    """The pairs that touch, or are too near to tell."""
    unit, found = scene.units["workspace"], []
    for pair in touching_pairs(scene, q, model.tolerance):
        one, other = pair.names
        if pair.distance <= 0:
            how = f"is {pair.depth:.2g} {unit} deep in" if pair.depth > 0 else "touches"
            found.append((-pair.depth, f"{one} {how} {other}"))
        else:
            near = f"{one} comes within {pair.distance:.2g} {unit} of {other}"
            found.append((pair.distance, f"{near}, which counts as contact"))
    found.sort()
    yield from (text for _, text in found[:_NAMED])
    if len(found) > _NAMED:
        yield f"and {len(found) - _NAMED} more"
