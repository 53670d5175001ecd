"""What the stores of some folders hold of what was asked for last: the input of all reports.

An environment is known by its fingerprint; reports call it by the first name that it was given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from bench.analysis import claims, timing
from bench.analysis.summary import common_problems, faults, left_out_of_common, summarise
from bench.judging.metric import Metric
from bench.judging.metrics import known_metrics
from bench.judging.problem_facts import BLOCKED, FREE, UNKNOWN
from bench.storage.store import StoredRecords
from envs import InputError


@dataclass(frozen=True)
class RunResults:
    """A run, or several that are reported together.

    Attributes:
        folders: where it is stored.
        selections: what was asked for, of each folder; see
            `bench.execution.config.RunConfig.selection`.
        records: one row an attempt, with the columns of `bench.storage.record.Record`, one for
            each metric, and those of `bench.analysis.claims`; ordered by environment, planner (as
            asked for), problem and repeat.
        sessions: when, where and at what cost it was measured, oldest first.
        spread: what stands after the ± of a mean in its tables; see
            `bench.report.formatting.SPREADS`.
    """

    folders: tuple[Path, ...]
    selections: tuple[dict[str, Any], ...]
    records: pd.DataFrame
    sessions: tuple[dict[str, Any], ...]
    spread: str = "std"

    @staticmethod
    def of(store: StoredRecords, folder: Path) -> RunResults:
        """What was last asked for in an open store.

        Raises:
            InputError: nothing yet.
        """
        asked = store.selection()
        names = names_of([asked])
        selection = renamed_selection(asked, names)
        records = renamed_records(_selected(store, selection), names)
        records = claims.with_claims(records, selection)
        ran = set(records["run_id"])
        sessions = tuple(s for s in store.sessions() if s["run_id"] in ran)
        return RunResults((folder,), (selection,), records, sessions).completed()

    @staticmethod
    def read(folder: Path) -> RunResults:
        """What was last asked for in a folder that `bench run` wrote.

        Raises:
            InputError: there is no such store, or nothing in it yet.
        """
        with StoredRecords(folder) as store:
            return RunResults.of(store, folder)

    @staticmethod
    def joined(runs: Sequence[RunResults]) -> RunResults:
        """Several runs as one. An environment that has several names in them, such as one mesh in
        two folders, gets the first of them.

        Raises:
            InputError: two of them have the same planner in the same environment, whose rows
                would be mixed, or other problems under one environment's name, on which planners
                would be compared.
        """
        _check_problems(runs)
        names = names_of([selection for run in runs for selection in run.selections])
        runs = [run.renamed(names) for run in runs]
        _check_problems(runs)
        _check_planners(runs)
        return RunResults(
            tuple(folder for run in runs for folder in run.folders),
            tuple(selection for run in runs for selection in run.selections),
            pd.concat([run.records for run in runs], ignore_index=True),
            tuple(session for run in runs for session in run.sessions),
        ).completed()

    def completed(self) -> RunResults:
        """With a column of the records for each metric, empty where nothing has a value of it."""
        missing = [metric.name for metric in self.metrics if metric.name not in self.records]
        return replace(self, records=self.records.assign(**dict.fromkeys(missing, math.nan)))

    @cached_property
    def metrics(self) -> tuple[Metric, ...]:
        """All that are registered now or were when it was measured, in the tables' order."""
        return known_metrics([m for s in self.selections for m in s.get("metrics", ())])

    def heading(self, metric: Metric) -> str:
        """What tables call it, with its unit in the run's environments."""
        units = [env.get("units", {}) for s in self.selections for env in s["envs"]]
        return metric.heading(units)

    def renamed(self, names: Mapping[str, str]) -> RunResults:
        """With these names of environments, by their fingerprints."""
        selections = tuple(renamed_selection(selection, names) for selection in self.selections)
        records = renamed_records(self.records, names)
        return replace(self, selections=selections, records=records)

    @property
    def order(self) -> list[tuple[str, str]]:
        """(environment, planner) of the tables' rows."""
        return [
            (env["id"], planner)
            for selection in self.selections
            for env in selection["envs"]
            for planner in selection["planners"]
        ]

    @property
    def problems(self) -> list[tuple[str, str]]:
        """By environment, what tells its problems from others."""
        return [
            (env["id"], f"fingerprint {env['fingerprint']} and seed {selection['seed']}")
            for selection in self.selections
            for env in selection["envs"]
        ]

    @cached_property
    def summary(self) -> pd.DataFrame:
        """A row per environment and planner; see `bench.analysis.summary.summarise`. Besides what
        each was held to, and how soon it reached common lengths, as in `common`."""
        table = summarise(self._with_blocked, self.order, self.metrics)
        of_common = self.common.set_index(["env", "planner"])
        keys = pd.MultiIndex.from_frame(table[["env", "planner"]])
        told = {name: of_common[name].reindex(keys).to_numpy() for name in timing.COLUMNS}
        whole: pd.DataFrame = self._with_held_to(table).assign(**told)
        return whole

    @cached_property
    def common(self) -> pd.DataFrame:
        """Of commonly solved problems; see `bench.analysis.summary.common_problems`. Besides,
        `held_to` says when each planner might stop."""
        return self._with_held_to(common_problems(self._with_blocked, self.metrics))

    def _with_held_to(self, table: pd.DataFrame) -> pd.DataFrame:
        rules = {
            (env["id"], planner): timing.held_to(selection, planner)
            for selection in self.selections
            for env in selection["envs"]
            for planner in selection["planners"]
        }
        keys = zip(table["env"], table["planner"], strict=True)
        whole: pd.DataFrame = table.assign(held_to=[rules.get(key, "") for key in keys])
        return whole

    @cached_property
    def _with_blocked(self) -> pd.DataFrame:
        """The records with a column `blocked`: whether the problem's straight line is blocked, None
        where that is not known, as in runs of before it was noted."""
        letters = {
            (env["fingerprint"], selection["seed"]): env.get("straight_lines", "")
            for selection in sorted(self.selections, key=lambda chosen: int(chosen["problems"]))
            for env in selection["envs"]
        }
        places = self.records[["env_fingerprint", "problems_seed", "problem"]]
        told = [
            letters.get((fingerprint, seed), "")[problem : problem + 1]
            for fingerprint, seed, problem in places.itertuples(index=False)
        ]
        known = [letter == BLOCKED if letter in (BLOCKED, FREE) else None for letter in told]
        blocked = pd.Series(known, index=self.records.index, dtype=object)
        whole: pd.DataFrame = self.records.assign(blocked=blocked)
        return whole

    @property
    def left_out(self) -> dict[str, dict[str, int]]:
        """Who is not in `common`; see `bench.analysis.summary.left_out_of_common`."""
        return left_out_of_common(self._with_blocked)

    @property
    def remarks(self) -> list[str]:
        """A line each on what befell planners, and on what keeps times from comparing; see
        `remarks` in `bench.analysis.claims` and `bench.analysis.timing`, and `summary.faults`."""
        return [
            *faults(self.records),
            *claims.remarks(self.records),
            *timing.remarks(self.records, self.sessions),
        ]

    @property
    def caption(self) -> str:
        """How the numbers came about, in a line for each run; of several, each says whose. What is
        still to be measured is told, too."""
        if len(self.selections) == 1:
            told = [_caption(self.selections[0])]
        else:
            told = [f"{_whose(s)}: {_caption(s)}" for s in self.selections]
        return "\n\n".join([*told, *filter(None, [self.incomplete])])

    @cached_property
    def incomplete(self) -> str:
        """What was asked for and not attempted yet, in a sentence; empty if nothing is missing."""
        made = self.records.groupby(["env_fingerprint", "planner"]).size()
        asked = {
            (env["fingerprint"], planner): (env["id"], _attempts_asked(selection, env))
            for selection in self.selections
            for env in selection["envs"]
            for planner in selection["planners"]
        }
        total = sum(count for _, count in asked.values())
        if len(self.records) >= total:
            return ""
        absent = [f"{key[1]} in {env}" for key, (env, _) in asked.items() if key not in made.index]
        none_of = f", none by {', '.join(absent)}" if absent else ""
        return (
            f"Incomplete: {len(self.records)} of {total} attempts were made{none_of}; "
            "the same `bench run` goes on from there."
        )


def _check_problems(runs: Sequence[RunResults]) -> None:
    seen: dict[str, tuple[str, Path]] = {}
    for run in runs:
        for env, problems in run.problems:
            known, folder = seen.setdefault(env, (problems, run.folders[0]))
            if problems != known:
                raise InputError(
                    f"{folder} has {env} with {known}, {run.folders[0]} with {problems}: "
                    "planners would be compared on different problems"
                )


def _check_planners(runs: Sequence[RunResults]) -> None:
    seen: dict[tuple[str, str], Path] = {}
    for run in runs:
        for pair in run.order:
            if pair in seen:
                raise InputError(
                    f"{seen[pair]} and {run.folders[0]} both have {pair[1]} in {pair[0]}; "
                    "`bench compare` sets such runs side by side"
                )
            seen[pair] = run.folders[0]


def _selected(store: StoredRecords, selection: dict[str, Any]) -> pd.DataFrame:
    fingerprints = [env["fingerprint"] for env in selection["envs"]]
    rows = store.records(
        fingerprints,
        selection["seed"],
        selection["settings_digest"],
        selection.get("planner_versions"),  # which older stores do not say
        _weights(selection),
    )
    wanted = (
        rows["planner"].isin(selection["planners"])
        & (rows["problem"] < rows["env_fingerprint"].map(_problems_of(selection)))
        & (rows["repeat"] < repeats_of(selection))
    )
    ranked = rows[wanted].assign(
        env_rank=rows["env_fingerprint"].map(fingerprints.index),
        planner_rank=rows["planner"].map({p: i for i, p in enumerate(selection["planners"])}),
    )
    ordered = ranked.sort_values(
        ["env_rank", "planner_rank", "problem", "repeat"], ignore_index=True
    )
    chosen: pd.DataFrame = ordered.drop(columns=["env_rank", "planner_rank"])
    return chosen


def _problems_of(selection: Mapping[str, Any]) -> dict[str, int]:
    """The number after the last problem's, by fingerprint; older runs have one for all."""
    return {e["fingerprint"]: e.get("problems", selection["problems"]) for e in selection["envs"]}


def repeats_of(selection: Mapping[str, Any]) -> int:
    """How often each planner attempted each problem; older runs, which do not say, once."""
    return int(selection.get("repeats", 1))


def _attempts_asked(selection: Mapping[str, Any], env: Mapping[str, Any]) -> int:
    """How many attempts each planner was to make in one of a selection's environments; older runs,
    which do not say how many problems it has, had none that leave numbers out."""
    problems = env.get("count", _problems_of(selection)[env["fingerprint"]])
    return int(problems) * repeats_of(selection)


def _weights(selection: dict[str, Any]) -> dict[str, dict[str, str]] | None:
    """Digests by fingerprint and planner; None where an older store does not say."""
    said = {env["fingerprint"]: env.get("weights") for env in selection["envs"]}
    return None if None in said.values() else said


def _whose(selection: dict[str, Any]) -> str:
    """Which rows of the tables are a run's."""
    envs = ", ".join(env["id"] for env in selection["envs"])
    return f"{', '.join(selection['planners'])} in {envs}"


def _caption(selection: dict[str, Any]) -> str:
    settings = selection["settings"]
    times = repeats_of(selection)
    often = f", {times} attempts a problem" if times > 1 else ""
    text = (
        f"{_counts(selection)}{often}, {_origin(selection)}, "
        f"time limit {settings['time_limit_s']:g} s, stop rule `{settings['stop']}`, "
        f"{settings['jobs']} at a time."
    )
    for env in selection["envs"]:
        if env.get("census"):
            facts = ", ".join(
                f"{what.replace('_', ' ')} {n:g}" for what, n in env["census"].items()
            )
            text += f" Problems of {env['id']}: {facts}."
    return text


def _origin(selection: dict[str, Any]) -> str:
    """Where the problems come from."""
    given = selection.get("given_problems")
    return f"of {given['file']}" if given else f"seed {selection['seed']}"


def _counts(selection: dict[str, Any]) -> str:
    """How many problems each environment has; lists may leave numbers out."""
    numbers = _problems_of(selection)
    counts = [
        numbers[env["fingerprint"]] - str(env.get("straight_lines", "")).count(UNKNOWN)
        for env in selection["envs"]
    ]
    if len(set(counts)) == 1:
        return f"{counts[0]} problems an environment"
    names = [env["id"] for env in selection["envs"]]
    told = zip(counts, names, strict=True)
    return f"{', '.join(f'{count} of {name}' for count, name in told)} problems"


def names_of(selections: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """The first name of each fingerprint that some selections have."""
    names: dict[str, str] = {}
    for selection in selections:
        for env in selection["envs"]:
            names.setdefault(str(env["fingerprint"]), str(env["id"]))
    return names


def renamed_selection(selection: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    """A selection with each environment once, by its name."""
    once = {env["fingerprint"]: env for env in reversed(selection["envs"])}
    envs = [
        {**once[fingerprint], "id": names[fingerprint]}
        for fingerprint in dict.fromkeys(env["fingerprint"] for env in selection["envs"])
    ]
    return {**selection, "envs": envs}


def renamed_records(records: pd.DataFrame, names: Mapping[str, str]) -> pd.DataFrame:
    """Records with the environments' names in place of those that they were measured under."""
    renamed: pd.DataFrame = records.assign(env=records["env_fingerprint"].map(names))
    return renamed
