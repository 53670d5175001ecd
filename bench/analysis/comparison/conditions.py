"""How attempts were measured, and whether that lets their times compare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from bench.analysis import claims
from bench.analysis.run_results import RunResults

_NOT_OF_TIME = {"memory_limit_mb"}
"""Settings that decide whether an attempt ends, but not how fast it is."""


@dataclass(frozen=True)
class Conditions:
    """How some attempts were measured.

    Attributes:
        settings: of the run; see `bench.execution.config.RunConfig.settings`.
        machines: what is known of the machine and of the variables that decide how fast libraries
            are, by the id of the session; None where a session was cut off before it was noted.
        planned_elsewhere: whether their times are claims.
    """

    settings: Mapping[str, Any]
    machines: Mapping[str, Mapping[str, Any] | None]
    planned_elsewhere: bool = False

    @staticmethod
    def of(run: RunResults, attempts: pd.DataFrame) -> Conditions:
        """Those of some rows of a run, all measured with the same settings."""
        settings = {s["settings_digest"]: s["settings"] for s in run.selections}
        machines = {s["run_id"]: _machine(s) for s in run.sessions}
        [digest] = attempts["settings"].unique()
        ids = attempts["run_id"].unique()
        elsewhere = claims.were_planned_elsewhere(attempts)
        return Conditions(settings[digest], {id: machines.get(id) for id in ids}, elsewhere)


def _machine(session: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """A session of before those variables were noted counts as one without any."""
    machine = session.get("machine")
    variables = session.get("speed_variables")
    return {**machine, "environment variables": variables} if machine and variables else machine


def why_times_differ(a: Conditions, b: Conditions) -> str:
    """What keeps times of `a` and `b` from comparing, empty if nothing does."""
    if a.planned_elsewhere or b.planned_elsewhere:
        return f"times of what was planned elsewhere are {claims.CLAIM}"
    settings = [
        fact
        for key, fact in _differences(a.settings, b.settings).items()
        if key not in _NOT_OF_TIME
    ]
    return "; ".join([*settings, *_other_machines(a, b)])


def _differences(one: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, str]:
    """What differs, told, by its key."""
    return {
        key: f"{key.replace('_', ' ')} {one.get(key)} against {other.get(key)}"
        for key in sorted({*one, *other})
        if one.get(key) != other.get(key)
    }


def _other_machines(a: Conditions, b: Conditions) -> list[str]:
    # A session whose machine is not known is only known to be on one.
    own, others = (
        _distinct([m or {"session": id} for id, m in c.machines.items()]) for c in (a, b)
    )
    machines = _distinct([*own, *others])
    if len(machines) == 1:
        return []
    if len(own) > 1 or len(others) > 1 or any("session" in machine for machine in machines):
        return ["measured on several machines, or on some that are not known"]
    facts = ", ".join(_differences(*machines).values())
    return [f"measured on different machines: {facts}"]


def _distinct(machines: list[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    return [machine for i, machine in enumerate(machines) if machine not in machines[:i]]
