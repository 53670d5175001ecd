"""A run summed up, small enough for version control, and what `bench check` is asked to check."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

import planners
from bench.analysis.run_results import RunResults
from bench.judging.metric import Metric
from bench.judging.metrics import REGISTERED, SHORT
from bench.storage.record import NOT_ATTEMPTED, Verdict, decode_path
from envs import InputError
from envs.errors import suggestion
from envs.problem import Array


def gated_metrics() -> dict[str, Metric]:
    """What can be compared with a reference planner's, by the names of the command line: first what
    baselines have without being asked, times last."""
    ordered = sorted(REGISTERED, key=lambda metric: (not metric.primary, metric.timed))
    return {SHORT.get(metric.name, metric.name): metric for metric in ordered}


def always_kept() -> tuple[str, ...]:
    """Names of `gated_metrics` that every baseline has."""
    return tuple(name for name, metric in gated_metrics().items() if metric.primary)


_DIGITS = 4  # of a value; both sides of a check are rounded alike

SOLVED, STRAIGHT, FAILED, MISSING = "S", "L", "F", "."
"""What came of an attempt, a letter each: solved by a path with bends, solved by the straight line
(which any random numbers find), failed, and not attempted."""

_STRAIGHT = 1e-6  # by how much, as a fraction, a path may be longer than the straight line


@dataclass(frozen=True)
class Row:
    """A planner in an environment.

    Attributes:
        fingerprint: of the environment.
        seed: of the problems.
        settings: how it was measured, as "key=value ...".
        problems: how many were attempted; 0 if the planner was UNSUPPORTED or SKIPPED.
        solved: verified successes among them.
        values: by the names of `gated_metrics`, (k,) positive numbers to four digits in the
            metrics' units, of the problems 0, 1, ...; NaN where there is none, as
            the problem was not solved.
        outcomes: of the problems 0, 1, ..., a letter each: SOLVED, STRAIGHT, FAILED or MISSING;
            empty in baselines of programs that did not keep it.
    """

    env: str
    planner: str
    fingerprint: str
    seed: int
    settings: str
    problems: int
    solved: int
    values: Mapping[str, Array]
    outcomes: str = ""

    @property
    def key(self) -> tuple[str, str]:
        """Environment and planner."""
        return self.env, self.planner


@dataclass(frozen=True)
class Baseline:
    """Rows, one for each environment and planner.

    Attributes:
        measures: the names of `gated_metrics` that each row has values of, in their order.
    """

    rows: Mapping[tuple[str, str], Row]
    measures: tuple[str, ...] = ()

    @staticmethod
    def of(run: RunResults, more: Sequence[str] = ()) -> Baseline:
        """What one folder's run comes to, with values of the primary metrics and some more; of
        several attempts at a problem it is the first."""
        [selection] = run.selections
        wanted = {*always_kept(), *more}
        chosen = {name: metric for name, metric in gated_metrics().items() if name in wanted}
        first = run.records[run.records["repeat"] == 0]
        groups = first.groupby(["env", "planner"])
        rows = (_row(attempts, selection, chosen) for _, attempts in groups)
        return Baseline({row.key: row for row in rows}, tuple(chosen))

    @property
    def attempted(self) -> Baseline:
        """Without the rows in which nothing was attempted."""
        rows = {key: row for key, row in self.rows.items() if row.problems}
        return Baseline(rows, self.measures)

    def called_as(self, other: Baseline) -> Baseline:
        """With the other's names for environments of the same fingerprint: a mesh may have been
        given by another path."""
        known = {row.env for row in other.rows.values()}
        names = {row.fingerprint: row.env for row in other.rows.values()}
        rows = [
            row if row.env in known else replace(row, env=names.get(row.fingerprint, row.env))
            for row in self.rows.values()
        ]
        return replace(self, rows={row.key: row for row in rows})

    @property
    def planners(self) -> set[str]:
        """All that have a row."""
        return {planner for _, planner in self.rows}


def _row(attempts: pd.DataFrame, selection: dict[str, Any], chosen: Mapping[str, Metric]) -> Row:
    first = attempts.iloc[0]
    made = attempts[~attempts["status"].isin(NOT_ATTEMPTED)]
    solved = made[made["outcome"] == Verdict.VALID.value]
    settings = sorted(selection["settings"].items())
    return Row(
        env=str(first["env"]),
        planner=str(first["planner"]),
        fingerprint=str(first["env_fingerprint"]),
        seed=int(selection["seed"]),
        settings=" ".join(f"{key}={value}" for key, value in settings),
        problems=len(made),
        solved=len(solved),
        values={
            name: _values(solved, metric.name, selection["problems"])
            for name, metric in chosen.items()
        },
        outcomes=_outcomes(made, selection["problems"]),
    )


def _values(solved: pd.DataFrame, column: str, problems: int) -> Array:
    values = np.full(problems, np.nan)
    measured = [float(f"{value:.{_DIGITS}g}") for value in solved[column].astype(float)]
    values[solved["problem"].to_numpy(dtype=int)] = measured
    # No ratio can be made of others, such as the endless margin where there are no obstacles.
    values[~(np.isfinite(values) & (values > 0))] = np.nan
    return values


def _outcomes(made: pd.DataFrame, problems: int) -> str:
    letters = np.full(problems, MISSING)
    solved = made["outcome"] == Verdict.VALID.value
    told = [
        (STRAIGHT if _is_straight(path, length) else SOLVED) if won else FAILED
        for won, path, length in zip(solved, made["path"], made["length"], strict=True)
    ]
    letters[made["problem"].to_numpy(dtype=int)] = told
    return "".join(letters)


def _is_straight(path: bytes | None, length: float | None) -> bool:
    if path is None or length is None:
        return False
    waypoints = decode_path(path)
    least = float(np.linalg.norm(waypoints[-1] - waypoints[0]))
    return float(length) <= (1 + _STRAIGHT) * least


@dataclass(frozen=True)
class CheckOptions:
    """How to check.

    Attributes:
        alpha: the probability of any false alarm in a check, in (0, 1).
        measures: names of `gated_metrics` to compare.
        reference: the planner by whose they are measured, without which times do not compare; None
            compares lengths and margins themselves.
        tolerance: the fraction by which they may get worse.
    """

    alpha: float = 0.01
    measures: tuple[str, ...] = ()
    reference: str | None = None
    tolerance: float = 0.1

    @staticmethod
    def parse(
        *,
        alpha: float,
        ratios: str | None,
        reference: str | None,
        tolerance: float,
        update: bool = False,
    ) -> CheckOptions:
        """Checks the options; `ratios` is as in "length,time". An update needs no reference.

        Raises:
            InputError: a name is unknown, a number is out of its range, or one is given without
                what it needs.
        """
        if not 0 < alpha < 1:
            raise InputError(f"--alpha {alpha:g}: choose a probability above 0 and below 1")
        if not 0 <= tolerance < math.inf:
            raise InputError(f"--tolerance {tolerance:g}: choose a fraction of at least 0")
        chosen = _chosen(ratios.split(",")) if ratios is not None else {}
        if reference is not None and not chosen:
            raise InputError("--reference: name with --ratios what to compare with it")
        timed = [name for name, metric in chosen.items() if metric.timed]
        if timed and reference is None and not update:
            raise InputError(
                f"--ratios {timed[0]}: name with --reference the planner to compare with"
            )
        return CheckOptions(alpha, tuple(chosen), reference, tolerance)

    def of(self, held: Baseline, where: str) -> CheckOptions:
        """With the reference by its id, as in a run or a baseline, which holds what is wanted.

        Raises:
            InputError: it does not.
        """
        missing = [name for name in self.measures if name not in held.measures]
        if missing:
            raise InputError(
                f"--ratios: {where} holds no {', '.join(missing)}; write it with "
                f"--update --ratios {','.join(self.measures)}"
            )
        return self if self.reference is None else replace(self, reference=self._id(held, where))

    def _id(self, held: Baseline, where: str) -> str:
        known, name = held.planners, self.reference or ""
        id = planners.REGISTRY.id_among(name, known)
        if id not in known:
            raise InputError(f"--reference: {where} has no {name!r}; {suggestion(name, known)}")
        return id


def _chosen(names: Sequence[str]) -> dict[str, Metric]:
    """The measures of some names, in their order; a metric's own name is as good as its short one.

    Raises:
        InputError: one is unknown.
    """
    known = gated_metrics()
    wanted = {SHORT.get(name, name) for name in names}
    for name in names:
        if SHORT.get(name, name) not in known:
            raise InputError(f"--ratios: unknown {name!r}; {suggestion(name, known)}")
    return {name: metric for name, metric in known.items() if name in wanted}
