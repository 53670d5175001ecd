"""A run's records, divided into what compares problem by problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

import envs
from bench.analysis.run_results import RunResults
from bench.storage.record import NOT_ATTEMPTED
from envs import Environment, InputError


@dataclass(frozen=True)
class Arena:
    """The attempts at the same problems of one environment.

    Attributes:
        env, fingerprint: of the environment.
        seed: of the problems.
        records: the attempts.
        time_limit_s: the longest of them had.
        units: of the environment; see `envs.Environment.units`.
    """

    env: str
    fingerprint: str
    seed: int
    records: pd.DataFrame
    time_limit_s: float
    units: Mapping[str, str]

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


def arenas_of(run: RunResults) -> list[Arena]:
    """In the tables' order."""
    limits = {
        selection["settings_digest"]: float(selection["settings"]["time_limit_s"])
        for selection in run.selections
    }
    units = {env["id"]: env.get("units", {}) for s in run.selections for env in s["envs"]}
    return [
        Arena(
            str(env),
            str(records["env_fingerprint"].iloc[0]),
            int(records["problems_seed"].iloc[0]),
            records,
            max(limits[digest] for digest in records["settings"].unique()),
            units.get(env, {}),
        )
        for env, records in run.records.groupby("env", sort=False)
    ]
