"""One attempt of a recorded run again, and whether it comes out the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import envs
import planners
from bench.analysis.run_results import RunResults
from bench.execution import measurement, weights_manager
from bench.execution.config import CPU, ProblemSet, RunConfig, on_device, repeated
from bench.execution.problem_choice import ProblemChoice
from bench.execution.session import Session
from bench.execution.stop_rule import StopRule
from bench.execution.supervised_planner import SupervisedPlanner
from bench.judging.judge import Judge
from bench.judging.metrics import REGISTERED
from bench.storage.record import decode_path, metrics_of
from envs import Environment, InputError
from envs.errors import UnknownNameError
from envs.problem import Array
from envs.registry import Entry
from planners import Planner
from planners.learning.learned_planner import checked_device

_SHOWN = ("outcome", "status", "verdict", "solve_s")
"""Columns of the two rows that are printed, before the metrics."""

_COMPARED = ("status", "verdict")
"""What must be equal besides the path: times, and with them `LATE`, are the machine's."""


@dataclass(frozen=True)
class Replay:
    """An attempt twice: as recorded, and made again.

    Attributes:
        then, now: the rows, with the columns of `bench.storage.record.Record`.
        notes: what may explain a difference, a line each.
        contact: where the new path first collides and what with, if it does, in words.
    """

    then: Mapping[str, Any]
    now: Mapping[str, Any]
    notes: tuple[str, ...]
    contact: str = ""

    @property
    def difference(self) -> str:
        """The first thing that differs, in a line; empty if nothing does."""
        paths = [None if row["path"] is None else decode_path(row["path"]) for row in self._rows]
        said = [
            f"another {name}: {self.then[name] or 'none'} then, {self.now[name] or 'none'} now"
            for name in _COMPARED
            if self.then[name] != self.now[name]
        ]
        return "; ".join(filter(None, [*said, _path_difference(*paths)]))

    @property
    def _rows(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        return self.then, self.now

    @property
    def text(self) -> str:
        """Both rows, and what comes of comparing them."""
        metrics = [m.name for m in REGISTERED if any(row.get(m.name) for row in self._rows)]
        shown = [*_SHOWN, *(name for name in metrics if name != "time_s")]  # solve_s is there
        rows = pd.DataFrame(
            [[row.get(name) for name in shown] for row in self._rows],
            index=["then", "now"],
            columns=shown,
        )
        told = f"not the same: {self.difference}" if self.difference else "same path"
        reasons = self.notes if self.difference else ()
        failed = [self.now["error"]] if self.difference and self.now["error"] else []
        table = rows.to_markdown(floatfmt=".6g", missingval="")
        collides = [f"the new path collides: {self.contact}"] if self.contact else []
        return "\n".join([table, "", told, *failed, *reasons, *collides])


def replay(
    folder: Path, planner: str, problem: int, env: str | None = None, repeat: int = 0
) -> Replay:
    """Makes one attempt of a run again, in a new process, as the run did.

    Args:
        folder: that `bench run` wrote.
        planner, env: as on the command line; `env` may be left out where the run has only one.
        problem: its index.
        repeat: which of the attempts at it, from 0.

    Raises:
        InputError: the run has no such attempt, or planner, environment or rules are not those of
            the run any more.
    """
    run = RunResults.read(folder)
    [selection] = run.selections
    where = _arena_of(selection, env, folder)
    who = _planner_of(selection, planner, folder)
    attempts = run.records[run.records["env_fingerprint"] == where["fingerprint"]]
    attempts = attempts[attempts["repeat"] == repeat]
    whose = f"{folder}: {who.id}" if repeat == 0 else f"{folder}, repeat {repeat}: {who.id}"
    then = _row(attempts[attempts["planner"] == who.id], problem, whose)
    problem_set = _made(where, problem, ProblemChoice.of_selection(selection))
    config = _config(selection, problem_set, who)
    stop_cost = config.stop.stop_cost(_reference_length(config.stop, attempts, problem))
    now, contact = _attempted(config, repeat, stop_cost)
    return Replay(then, now, tuple(_notes(then, now, who)), contact)


def _arena_of(selection: Mapping[str, Any], env: str | None, folder: Path) -> Mapping[str, Any]:
    """What the run says of an environment, by the name that is asked for: one fingerprint is one
    environment, whatever it was called in the run."""
    known: dict[str, Mapping[str, Any]] = {said["id"]: said for said in selection["envs"]}
    if env is None:
        if len(known) > 1:
            raise InputError(f"{folder} has several environments; --env one of {', '.join(known)}")
        [id] = known
        return known[id]
    id = envs.REGISTRY.id_among(env, known)
    if id in known:
        return known[id]
    try:
        fingerprint = envs.make(env).fingerprint
    except UnknownNameError:
        fingerprint = ""
    for said in known.values():
        if said["fingerprint"] == fingerprint:
            return {**said, "id": id}
    raise UnknownNameError(f"environment of {folder}", id, known)


def _planner_of(selection: Mapping[str, Any], planner: str, folder: Path) -> Entry[Planner]:
    known = selection["planners"]
    id = planners.REGISTRY.id_among(planner, known)
    if id not in known:
        raise UnknownNameError(f"planner of {folder}", id, known)
    try:
        return planners.REGISTRY.entry(id)
    except UnknownNameError as error:
        raise InputError(
            f"no planner {id!r} is installed here; if it is in a file, name that by --planner-file"
        ) from error


def _row(attempts: pd.DataFrame, problem: int, whose: str) -> Mapping[str, Any]:
    found = attempts[attempts["problem"] == problem]
    if found.empty:
        held = sorted(attempts["problem"])
        there = f"it has {held[0]} to {held[-1]}" if held else "it has none; was it interrupted?"
        raise InputError(f"{whose} has no problem {problem}: {there}")
    row = found.iloc[0]
    # pandas has NaN for what is missing from a column of numbers.
    return {name: None if _missing(row[name]) else row[name] for name in found.columns}


def _missing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and bool(np.isnan(value)))


def _made(where: Mapping[str, Any], problem: int, choice: ProblemChoice) -> ProblemSet:
    entry: Entry[Environment] = envs.REGISTRY.entry(where["id"])
    problem_set = ProblemSet.make(entry, replace(choice, count=1))
    if problem_set.env.fingerprint != where["fingerprint"]:
        raise InputError(
            f"{entry.id} is not what it was: its fingerprint was {where['fingerprint']} and is "
            f"{problem_set.env.fingerprint}; replay with the files and versions that the manifest "
            "names"
        )
    return replace(problem_set, problems=tuple(choice.at(problem_set.env, [problem])))


def _config(
    selection: Mapping[str, Any], problem_set: ProblemSet, planner: Entry[Planner]
) -> RunConfig:
    settings = selection["settings"]
    config = RunConfig(
        (problem_set,),
        (planner,),
        ProblemChoice.of_selection(selection),
        settings["time_limit_s"],
        StopRule.parse(settings["stop"]),
        settings["jobs"],
        settings["memory_limit_mb"],
        train=False,
        device=checked_device(settings.get("device", CPU)),
        keep_invalid="invalid_problems" in settings,
        simplify_s=settings.get("simplify_s", 0.0),
    )
    if config.settings != settings:
        old = settings["rules"]
        raise InputError(f"the run was measured by rules {old}, and this version has others")
    return config


def _reference_length(stop: StopRule, attempts: pd.DataFrame, problem: int) -> float | None:
    """What the reference of the stop rule reached on the problem, None if it failed."""
    if stop.reference is None:
        return None
    of_reference = attempts["planner"] == stop.reference.id
    solved = attempts[of_reference & (attempts["problem"] == problem) & (attempts["solved"] == 1)]
    return None if solved.empty else float(solved["length"].iloc[0])


def _attempted(config: RunConfig, repeat: int, stop_cost: float) -> tuple[Mapping[str, Any], str]:
    """The new row, and the contact of its path in words, "" if it has none."""
    [problem_set], [planner] = config.problem_sets, config.planners
    [first] = problem_set.problems if config.keep_invalid else problem_set.facts.problems
    problem = repeated(first, repeat)
    wanted = on_device(planner, config.device)
    unready = weights_manager.unready(wanted, problem_set.shown, may_train=False)
    supervised = SupervisedPlanner(problem_set, planner, config, Session(), unready)
    try:
        attempt = supervised.attempt(problem, stop_cost)
    finally:
        supervised.stop()
    judge = Judge(problem_set.env)
    judged = measurement.judged(judge, problem, attempt, config.simplifier())
    contact = None if judged is None else judge.with_contact(judged, problem, attempt.path).contact
    known = {"run_id": "replay", "repeat": repeat, "measured_at": ""}
    record = asdict(supervised.record(problem, attempt, judged, **known))
    return record | metrics_of(record["metrics"]), "" if contact is None else str(contact)


def _path_difference(then: Array | None, now: Array | None) -> str:
    """The first waypoint at which two paths (k, d) differ; empty if none does."""
    if then is None or now is None:
        one = "then" if now is None else "now"
        return "" if then is now else f"there is a path {one} only"
    for i, (a, b) in enumerate(zip(then, now, strict=False)):
        if not np.array_equal(a, b, equal_nan=True):
            return f"the paths differ from waypoint {i} on: {_told(a)} then, {_told(b)} now"
    if len(then) != len(now):
        return f"one path ends at waypoint {min(len(then), len(now)) - 1}, the other goes on"
    return ""


def _told(waypoint: Array) -> str:
    return f"({', '.join(f'{value:.17g}' for value in waypoint)})"


def _notes(
    then: Mapping[str, Any], now: Mapping[str, Any], planner: Entry[Planner]
) -> Sequence[str]:
    notes = []
    if planner.spec.version != then["planner_version"]:
        old, new = then["planner_version"], planner.spec.version
        notes.append(f"{planner.id} was another version: {old}, and is {new}")
    if then["weights"] not in ("", now["weights"]):
        notes.append(f"{planner.id} has other weights than it had then")
    if planner.spec.not_repeatable:
        notes.append(f"{planner.id} is not repeatable: {planner.spec.not_repeatable}")
    return notes
