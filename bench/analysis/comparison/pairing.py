"""Which planners of two runs are compared, and on which problems that both were measured on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import planners
from bench.analysis.comparison.conditions import Conditions
from bench.analysis.run_results import RunResults
from bench.storage.record import NOT_ATTEMPTED, Verdict, versions_of
from envs import InputError
from envs.errors import suggestion
from envs.registry.arguments import split_entries


@dataclass(frozen=True)
class Side:
    """A planner in an environment, on the problems that it shares with the other side.

    Attributes:
        folder: where its run is stored.
        attempts: rows of the store, ordered by problem and repeat; the other side has the same
            problems.
        conditions: how they were measured.
    """

    folder: str
    planner: str
    attempts: pd.DataFrame
    conditions: Conditions

    @property
    def success(self) -> NDArray[np.float64]:
        """(n,) of each problem the share of its attempts that were verified successes."""
        solved = self.attempts["outcome"] == Verdict.VALID.value
        rates: NDArray[np.float64] = (
            solved.groupby(self.attempts["problem"]).mean().to_numpy(dtype=float)
        )
        return rates

    def values(self, metric: str) -> NDArray[np.float64]:
        """(n,) of each problem the median over its verified successes; NaN where there is none, or
        the run knows no such metric."""
        solved = self.attempts["outcome"] == Verdict.VALID.value
        column = self.attempts[metric] if metric in self.attempts else np.nan * solved
        known = column.astype(float).where(solved)
        medians: NDArray[np.float64] = (
            known.groupby(self.attempts["problem"]).median().to_numpy(dtype=float)
        )
        return medians

    def definitions(self, metric: str) -> set[str]:
        """The versions of a metric that its values here are of; none of metrics that ship."""
        return {versions[metric] for versions in self._versions if metric in versions}

    @cached_property
    def _versions(self) -> list[dict[str, str]]:
        """Of the metrics of each attempt, read once for all metrics."""
        return [versions_of(text) for text in self.attempts["metrics"]]


@dataclass(frozen=True)
class Pair:
    """Two sides, and where they met. `seed` is the problems'."""

    env: str
    fingerprint: str
    seed: int
    a: Side
    b: Side


@dataclass(frozen=True)
class Pairing:
    """All pairs of two runs, and what was left out, a line each with the reason."""

    pairs: tuple[Pair, ...]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class _ProblemSet:
    """What a run measured on the problems of one seed in one environment."""

    run: RunResults
    env: str
    fingerprint: str
    seed: int
    rows: pd.DataFrame

    @property
    def planners(self) -> list[str]:
        return list(self.rows["planner"].unique())

    @property
    def named(self) -> str:
        return f"{self.env} (fingerprint {self.fingerprint}, seed {self.seed})"

    def problems(self, planner: str) -> set[int]:
        return set(self.rows.loc[self.rows["planner"] == planner, "problem"])

    def side(self, planner: str, problems: set[int]) -> Side:
        chosen = (self.rows["planner"] == planner) & self.rows["problem"].isin(problems)
        attempts = self.rows[chosen].sort_values(["problem", "repeat"], ignore_index=True)
        return Side(_folder(self.run), planner, attempts, Conditions.of(self.run, attempts))


def pair_runs(a: RunResults, b: RunResults, who: tuple[str, str] | None = None) -> Pairing:
    """Sets planners of two runs against each other, on the problems that both were measured on:
    those of an environment with the same fingerprint, with the same seed and number.

    Each planner meets itself; where no name is in both runs and either has one planner, these
    meet. The runs may be the same one.

    Args:
        who: instead, this planner of `a` meets that one of `b`, by their ids.

    Raises:
        InputError: they share nothing. It says why: other environments, or other seeds.
    """
    ours, theirs = _problem_sets(a), _problem_sets(b)
    pairs: list[Pair] = []
    left_out: list[str] = []
    for problem_set in ours:
        other = next((o for o in theirs if _key(o) == _key(problem_set)), None)
        if other is None:
            left_out.append(_why_apart(problem_set, theirs))
            continue
        meeting = [who] if who else _namesakes(problem_set, other)
        pairs += [
            _pair(problem_set, other, *names)
            for names in meeting
            if _shared(problem_set, other, *names)
        ]
        left_out += [] if who else _unmet(problem_set, other, meeting)
        for p, q in meeting:
            left_out += [
                *_unshared(problem_set, "A", p, other, q),
                *_unshared(other, "B", q, problem_set, p),
            ]
    known = {name for problem_set in ours for name in (problem_set.env, problem_set.fingerprint)}
    left_out += [f"{o.named}: only in B" for o in theirs if not known & {o.env, o.fingerprint}]
    reasons = tuple(dict.fromkeys(left_out))
    if not pairs:
        raise InputError(
            f"nothing to compare between A, {_folder(a)}, and B, {_folder(b)}: "
            + ("; ".join(reasons) or "nothing was measured")
        )
    return Pairing(tuple(pairs), reasons)


def _problem_sets(run: RunResults) -> list[_ProblemSet]:
    """In the order of the run; rows in which nothing was measured are left out."""
    rows = run.records[~run.records["status"].isin(NOT_ATTEMPTED)]
    groups = rows.groupby(["env_fingerprint", "problems_seed"], sort=False)
    return [
        _ProblemSet(run, group["env"].iloc[0], str(fingerprint), int(seed), group)
        for (fingerprint, seed), group in groups
    ]


def _key(problem_set: _ProblemSet) -> tuple[str, int]:
    return problem_set.fingerprint, problem_set.seed


def _folder(run: RunResults) -> str:
    return ", ".join(str(folder) for folder in run.folders)


def _why_apart(problem_set: _ProblemSet, others: Sequence[_ProblemSet]) -> str:
    """Why none of B's problem sets has the problems of this one of A."""
    for other in others:
        if other.fingerprint == problem_set.fingerprint:
            return (
                f"{problem_set.env}: the environment is the same, the problems are not: their "
                f"seed is {problem_set.seed} in A, {other.seed} in B"
            )
    for other in others:
        if other.env == problem_set.env:
            return (
                f"{problem_set.env}: the name is the same, the environment is not: its "
                f"fingerprint is {problem_set.fingerprint} in A, {other.fingerprint} in B"
            )
    return f"{problem_set.named}: only in A"


def _namesakes(problem_set: _ProblemSet, other: _ProblemSet) -> list[tuple[str, str]]:
    common = [(name, name) for name in problem_set.planners if name in other.planners]
    if not common and len(problem_set.planners) == len(other.planners) == 1:
        return [(problem_set.planners[0], other.planners[0])]
    return common


def _shared(problem_set: _ProblemSet, other: _ProblemSet, p: str, q: str) -> set[int]:
    """The problems on which p was measured in one and q in the other."""
    return problem_set.problems(p) & other.problems(q)


def _pair(problem_set: _ProblemSet, other: _ProblemSet, p: str, q: str) -> Pair:
    problems = _shared(problem_set, other, p, q)
    sides = problem_set.side(p, problems), other.side(q, problems)
    return Pair(problem_set.env, problem_set.fingerprint, problem_set.seed, *sides)


def _unmet(
    problem_set: _ProblemSet, other: _ProblemSet, meeting: Sequence[tuple[str, str]]
) -> list[str]:
    """Planners that meet none."""
    if not meeting:
        both = f"A has {', '.join(problem_set.planners)}; B has {', '.join(other.planners)}"
        return [
            f"{problem_set.env}: no planner is in both, so --planners P,Q must say who meets "
            f"({both})"
        ]
    alone = []
    for side, one, met in zip("AB", (problem_set, other), zip(*meeting, strict=True), strict=True):
        names = [name for name in one.planners if name not in met]
        told = f"{one.env}: measured in {side} alone: {', '.join(names)}"
        alone += [f"{told}; --planners P,Q sets P of A against Q of B"] if names else []
    return alone


def _unshared(one: _ProblemSet, side: str, p: str, other: _ProblemSet, q: str) -> list[str]:
    """Problems of one side that the other was not measured on."""
    count = len(one.problems(p) - other.problems(q))
    return [f"{one.env}: {count} problems of {side} ({p}) alone"] if count else []


ALL = "all"


def chosen_planners(text: str, a: RunResults, b: RunResults) -> tuple[str, str] | None:
    """The planners of `a` and of `b` that "P,Q" names, or "P" in both; None for "all", if
    there are two runs: each planner then meets itself.

    Raises:
        InputError: a run has no such planner, there are more than two names, or those of one run
            are not two planners.
    """
    names = split_entries(text)
    if names == [ALL] and a is not b:
        return None
    pair = names * 2 if len(names) == 1 and names != [ALL] else names
    if len(pair) != 2:
        raise _misnamed(text, a, b)
    who = _id_in(a, pair[0]), _id_in(b, pair[1])
    if a is b and who[0] == who[1]:
        raise _misnamed(text, a, b)
    return who


def _misnamed(text: str, a: RunResults, b: RunResults) -> InputError:
    wanted = "two planners of that run" if a is b else "one planner, or one of each run"
    return InputError(f"--planners {text}: name {wanted}, from {', '.join(_planners(a))}")


def _planners(run: RunResults) -> list[str]:
    return list(dict.fromkeys(planner for _, planner in run.order))


def _id_in(run: RunResults, name: str) -> str:
    known = _planners(run)
    id = planners.REGISTRY.id_among(name, known)
    if id in known:
        return id
    folders = ", ".join(str(folder) for folder in run.folders)
    raise InputError(f"--planners: {folders} has no {name!r}; {suggestion(name, known)}")
