"""Paths that their planners take for valid, and how many of them are not: how often, how deep, and
over how much of the path they are in contact."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pandas as pd

import envs
from bench.analysis.run_results import RunResults
from bench.analysis.statistics.intervals import wilson_interval
from bench.execution.problem_choice import ProblemChoice
from bench.judging.judge import SceneModels
from bench.judging.path_contacts import path_contacts
from bench.storage.record import Verdict, checked_every, decode_path
from envs import Environment, InputError
from planners import Status


@dataclass(frozen=True)
class RefusedPath:
    """A path that its planner claimed and the judge refused for contact.

    Attributes:
        env: str, the environment's name.
        planner: str, the planner's.
        problem: int, its index.
        repeat: int, which of the attempts at it, from 0.
        share: of the path's length that is in contact, from 0 to 1.
        depth: where it is deepest, in workspace units, see `PathContacts`.
        touches: whether anything is touched at a place that was looked at; the judge also refuses
            what comes within its tolerance.
        between: the two that touch there, "" of point robots.
    """

    env: str
    planner: str
    problem: int
    repeat: int
    share: float
    depth: float
    touches: bool
    between: str


@dataclass(frozen=True)
class Audit:
    """What became of the claims of a run.

    Attributes:
        refused: a row for each `RefusedPath`.
        summary: a row for each environment and planner: `claimed` paths; those `refused` for
            contact; `refused_share` with its 95 % interval `refused_low`, `refused_high` (Wilson);
            `touching`, those in which contact was found at a place looked at; over these
            `depth_max`, `depth_median` and `share_of_path_mean`; `time_median`, seconds of planning
            over all claimed; `checked_every`, how far apart in the configuration space the planner
            checks states, NaN of those that prove motions or do not say.
        overall: a row for each planner, the same over all environments. Its lengths mean something
            only where these agree in `units`.
        units: of depths ("workspace") and of `checked_every` ("configuration"), by environment.
    """

    refused: pd.DataFrame
    summary: pd.DataFrame
    overall: pd.DataFrame
    units: Mapping[str, Mapping[str, str]]

    @property
    def worst(self) -> Mapping[str, Any] | None:
        """The row of the deepest, None if nothing was refused."""
        rows = self.refused.sort_values("depth", ascending=False).to_dict("records")
        return {str(name): value for name, value in rows[0].items()} if rows else None


def audit(run: RunResults) -> Audit:
    """Looks again at all paths of a run that were claimed and refused.

    Raises:
        InputError: an environment is not what it was, or none of the planners claimed anything.
    """
    records = run.records
    claimed = records[(records["status"] == Status.EXACT_SOLUTION.value) & records["path"].notna()]
    if claimed.empty:
        raise InputError("no planner of the run claims to have solved anything")
    made = {
        where["id"]: (_environment(where), ProblemChoice.of_selection(selection))
        for selection in run.selections
        for where in selection["envs"]
    }
    rows = [
        row
        for id, (env, choice) in made.items()
        for row in _refused(env, choice, claimed[claimed["env"] == id])
    ]
    columns = [field.name for field in fields(RefusedPath)]
    refused = pd.DataFrame([vars(row) for row in rows], columns=columns)
    units = {id: env.units for id, (env, _) in made.items()}
    known = [whose for whose in run.order if _of(claimed, *whose).any()]
    summary = pd.DataFrame(
        {"env": env, **_summarised(planner, *(t[_of(t, env, planner)] for t in (claimed, refused)))}
        for env, planner in known
    )
    overall = pd.DataFrame(
        _summarised(planner, *(t[t["planner"] == planner] for t in (claimed, refused)))
        for planner in dict.fromkeys(planner for _, planner in known)
    )
    return Audit(refused, summary, overall, units)


def _environment(where: Mapping[str, Any]) -> Environment:
    env = envs.make(where["id"])
    if env.fingerprint != where["fingerprint"]:
        raise InputError(
            f"{where['id']} is not what it was: its fingerprint was {where['fingerprint']} and is "
            f"{env.fingerprint}; audit with the files and versions that the manifest names"
        )
    return env


def _refused(
    env: Environment, choice: ProblemChoice, claimed: pd.DataFrame
) -> Iterator[RefusedPath]:
    rows = claimed[claimed["verdict"] == Verdict.COLLISION.value].sort_values("problem")
    indices = sorted(set(rows["problem"]))
    problems = dict(zip(indices, choice.at(env, indices), strict=True)) if indices else {}
    models = SceneModels(env)
    for row in rows.to_dict("records"):
        problem = problems[row["problem"]]
        scene, model = env.scene_of(problem), models.of(problem)
        found = path_contacts(scene, model, decode_path(row["path"]))
        yield RefusedPath(
            row["env"],
            row["planner"],
            row["problem"],
            row["repeat"],
            found.share,
            found.depth,
            found.depth > 0 or found.share > 0,
            " and ".join(found.between or ()),
        )


def _summarised(planner: str, claims: pd.DataFrame, refused: pd.DataFrame) -> dict[str, Any]:
    touching = refused[refused["touches"].astype(bool)]
    low, high = wilson_interval(len(refused), len(claims))
    return {
        "planner": planner,
        "claimed": len(claims),
        "refused": len(refused),
        "refused_share": len(refused) / len(claims),
        "refused_low": low,
        "refused_high": high,
        "touching": len(touching),
        "depth_max": touching["depth"].max() if len(touching) else np.nan,
        "depth_median": touching["depth"].median(),
        "share_of_path_mean": touching["share"].mean(),
        "time_median": claims["solve_s"].median(),
        "checked_every": _coarsest(claims),
    }


def _coarsest(claims: pd.DataFrame) -> float:
    """Of all environments."""
    gaps = (checked_every(stats) for stats in claims["stats"])
    return max((gap for gap in gaps if gap is not None), default=math.nan)


def _of(table: pd.DataFrame, env: str, planner: str) -> pd.Series[bool]:
    return (table["env"] == env) & (table["planner"] == planner)
