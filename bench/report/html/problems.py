"""The problems of an environment as JSON data: the scene, each attempt with its path, and where a
refused path first collides. A run's records are divided first into what compares problem by
problem.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

import envs
from bench.analysis.run_results import RunResults
from bench.execution.problem_choice import ProblemChoice
from bench.judging.contact import first_contact
from bench.judging.judge import SceneModels
from bench.report import formatting
from bench.report.html.geometry import Scene
from bench.report.postures import drawable
from bench.storage.record import NOT_ATTEMPTED, Verdict, decode_path
from envs import Environment, InputError, Problem
from envs.problem import Array


@dataclass(frozen=True)
class ProblemSetResults:
    """The attempts at the same problems of one environment.

    Attributes:
        env, fingerprint: of the environment.
        records: the attempts.
        time_limit_s: the longest of them had.
        units: of the environment; see `envs.Environment.units`.
        choice: of the problems.
    """

    env: str
    fingerprint: str
    records: pd.DataFrame
    time_limit_s: float
    units: Mapping[str, str]
    choice: ProblemChoice

    @property
    def planners(self) -> list[str]:
        """In the tables' order."""
        return [str(name) for name in self.records["planner"].unique()]

    @property
    def first_attempts(self) -> pd.DataFrame:
        """Of several attempts at a problem the first."""
        first: pd.DataFrame = self.records[self.records["repeat"] == 0]
        return first

    @property
    def measured(self) -> pd.DataFrame:
        """The attempts of which something was measured."""
        tried: pd.DataFrame = self.records[~self.records["status"].isin(NOT_ATTEMPTED)]
        return tried

    @property
    def problems(self) -> list[int]:
        """The numbers of the problems."""
        return sorted(int(number) for number in self.records["problem"].unique())

    def world(self) -> Environment:
        """The environment, made again.

        Raises:
            InputError: it cannot be, or is not what it was.
        """
        world = envs.make(self.env)
        if world.fingerprint != self.fingerprint:
            raise InputError(f"{self.env} is not what it was when this was measured")
        return world


def problem_sets_of(run: RunResults) -> list[ProblemSetResults]:
    """In the tables' order."""
    limits = {
        selection["settings_digest"]: float(selection["settings"]["time_limit_s"])
        for selection in run.selections
    }
    choices = {
        (s["settings_digest"], s["seed"]): ProblemChoice.of_selection(s) for s in run.selections
    }
    units = {env["id"]: env.get("units", {}) for s in run.selections for env in s["envs"]}
    return [
        ProblemSetResults(
            str(env),
            str(records["env_fingerprint"].iloc[0]),
            records,
            max(limits[digest] for digest in records["settings"].unique()),
            units.get(env, {}),
            choices[records["settings"].iloc[0], int(records["problems_seed"].iloc[0])],
        )
        for env, records in run.records.groupby("env", sort=False)
    ]


Column = tuple[str, str, int]
"""Of an attempt's numbers: the record's column, its title, its decimals."""

_MORE_DIGITS = 1  # of one attempt than of means

_OF_ANY_ATTEMPT: tuple[Column, ...] = (
    ("collision_checks", "collision checks", 0),
    ("peak_memory_mb", "memory MB", 0),
)


def columns(run: RunResults) -> list[Column]:
    """What the pages show of each attempt: its time, also of a failure, and the metrics that have a
    value somewhere."""
    metrics = [m for m in run.metrics if run.records[m.name].notna().any() and m.name != "time_s"]
    return [
        ("solve_s", "time s", 4),
        *((m.name, run.heading(m), m.digits + _MORE_DIGITS if m.digits else 0) for m in metrics),
        *_OF_ANY_ATTEMPT,
    ]


def problems_data(problem_set: ProblemSetResults, shown: Sequence[Column]) -> dict[str, Any]:
    """What the pages of a problem set's problems show.

    `scene` is as of `Scene.data`, None where it cannot be made again: `why` says so then.
    `problems` maps the number of each to its `start` and `goal`, (k, 3) of the points that are
    traced, where they are known, and to
    its `attempts`, each with `planner` (its number among the set's), `outcome`, `texts` (one for
    each column), `error`, and where there is a path to show `drawn` (see `Scene.drawn`), and
    of one that collides `contact`: where first, as `drawn` and as a `share` of its length, and
    what with, as `text`. Where problems have scenes of their own, the `obstacles` of each are as
    the first of `scene`'s meshes.
    """
    try:
        world = problem_set.world()
    except InputError as error:
        return _Plain(problem_set, shown).data(f"The scene cannot be shown: {error}")
    return _Shown(problem_set, shown, world).data()


class _Plain:
    """Problems of which nothing can be drawn."""

    def __init__(self, problem_set: ProblemSetResults, shown: Sequence[Column]) -> None:
        self._problem_set, self._columns = problem_set, shown
        self._numbers = {planner: number for number, planner in enumerate(problem_set.planners)}

    def data(self, why: str) -> dict[str, Any]:
        return {
            "scene": None,
            "why": why,
            "problems": {
                number: {"attempts": [self._attempt(row) for row in rows.to_dict("records")]}
                for number, rows in self._problem_set.first_attempts.groupby("problem")
            },
        }

    def _attempt(self, row: dict[Any, Any]) -> dict[str, Any]:
        texts = [formatting.number(row[column], digits) for column, _, digits in self._columns]
        return {
            "planner": self._numbers[row["planner"]],
            "outcome": row["outcome"],
            "texts": texts,
            "error": row["error"],
        }


class _Shown(_Plain):
    """Problems whose paths are drawn in their world."""

    def __init__(
        self,
        problem_set: ProblemSetResults,
        shown: Sequence[Column],
        world: Environment,
    ) -> None:
        super().__init__(problem_set, shown)
        self._world, self._scene = world, Scene(world)
        self._ends = self._known_ends()
        self._models = SceneModels(world)

    def data(self, why: str = "") -> dict[str, Any]:
        data = {**super().data(why), "scene": self._scene.data()}
        for number, problem in data["problems"].items():
            start, goal = self._scene.points(self._ends[number])
            problem.update(start=start.tolist(), goal=goal.tolist())
            if self._world.scenes_differ:
                scene = self._world.scene_of(self._problem(number))
                problem["obstacles"] = self._scene.obstacles(scene)
        return data

    def _known_ends(self) -> dict[int, Array]:
        """Start and goal (2, d) of each problem: the ends of a path that the judge took for one of
        it; problems without such paths are made again, which may take a while."""
        ends = {}
        known = self._problem_set.records[
            self._problem_set.records["verdict"].isin(
                [Verdict.VALID.value, Verdict.COLLISION.value]
            )
        ]
        for row in known.to_dict("records"):
            if row["path"] is not None:
                ends[row["problem"]] = decode_path(row["path"])[[0, -1]]
        missing = [number for number in self._problem_set.problems if number not in ends]
        if missing:
            made = self._problem_set.choice.at(self._world, missing)
            ends.update({one.index: np.stack([one.start, one.goal]) for one in made})
        return ends

    def _attempt(self, row: dict[Any, Any]) -> dict[str, Any]:
        attempt = super()._attempt(row)
        path = None if row["path"] is None else decode_path(row["path"])
        if path is None or not drawable(self._world, path):
            return attempt
        attempt["drawn"] = self._scene.drawn(path)
        if row["verdict"] == Verdict.COLLISION.value:
            problem = self._problem(row["problem"])
            scene = self._world.scene_of(problem)
            found = first_contact(scene, self._models.of(problem), path)
            drawn = self._scene.drawn(found.configuration[None])
            attempt["contact"] = {"share": found.share, "text": found.text, "drawn": drawn}
        return attempt

    def _problem(self, number: int) -> Problem:
        start, goal = self._ends[number]
        return Problem(start, goal, number)
