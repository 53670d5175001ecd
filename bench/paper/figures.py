"""Figures: time fields, and planners' paths."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

import envs
import planners
from bench.execution import weights_manager
from bench.paper.experiment import Experiment, Place, Section, Table
from bench.report import chosen_paths, field, formatting, scene
from bench.report.field import Slice, Strip

logger = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class Fields(Experiment):
    """Speeds and arrival times on a slice, a row an environment, a column a planner.

    Attributes:
        env, planners: ids; fast marching is what errors are against.
    """

    env: tuple[str, ...]
    planners: tuple[str, ...]

    def carried_out(self, place: Place) -> Section:
        strips = list(self._strips())
        picture = place.out / f"{self.name}.png"
        field.draw(strips, picture)
        numbers = pd.concat([s.errors.assign(env=s.title) for s in strips], ignore_index=True)
        rows = [
            {
                "env": row["env"],
                "planner": row["planner"],
                "T error, median %": formatting.number(100 * row["T error median"], 1),
                "90th percentile %": formatting.number(100 * row["T error 90th percentile"], 1),
            }
            for row in numbers.to_dict("records")
        ]
        how = "Colour is the predicted speed, lines are arrival times from the star."
        return Section(self.name, self.heading, self.caption(how), Table(rows, numbers), picture)

    def _strips(self) -> Iterator[Strip]:
        for name in self.env:
            entry = envs.REGISTRY.entry(name)
            logger.info("fields on %s", entry.id)
            where = Slice.through(entry.make())
            chosen = [planners.REGISTRY.entry(planner) for planner in self.planners]
            found = {
                one.id: field.field_of(
                    weights_manager.ready(entry, one, may_train=False), one.id, where
                )
                for one in chosen
            }
            yield Strip(entry.id, where, found, field.errors(found, found["fmm"], where))


@dataclass(frozen=True, kw_only=True)
class Paths(Experiment):
    """Every planner's path on one problem of a comparison.

    Attributes:
        of: the comparison.
        env: one of its environments.
        planners: whose paths.
        problem: its index; by default that with the longest path.
    """

    of: str
    env: str
    planners: tuple[str, ...]
    problem: int | None = None

    def carried_out(self, place: Place) -> Section:
        entry = envs.REGISTRY.entry(self.env)
        world, picture = entry.make(), place.out / f"{self.name}.png"
        records = place.measured(self.of).records
        wanted = records["planner"].isin(self.planners)
        shown = chosen_paths.paths_of_problem(records[wanted], world.fingerprint, self.problem)
        scene.draw(world, entry.id, shown, picture)
        how = f"Problem {shown.problem} of `{self.of}`; dashed is what the judge refused."
        return Section(self.name, self.heading, self.caption(how), picture=picture)
