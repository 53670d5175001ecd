"""Whose paths pictures show, of which problem, and in which colours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
from matplotlib.colors import is_color_like

import planners
from bench.storage.record import Verdict, decode_path
from envs import InputError
from envs.errors import suggestion
from envs.problem import Array

_OTHER_COLOURS = (
    *("tab:red", "tab:pink", "tab:brown", "tab:olive", "black", "tab:gray"),
    *("darkgreen", "navy", "salmon", "plum"),
)


@dataclass(frozen=True)
class Shown:
    """One problem's paths, each (k, d), by planner; those that the judge refused are dashed."""

    problem: int
    paths: Mapping[str, Array]
    refused: frozenset[str]


def of_planners(records: pd.DataFrame, text: str, folder: Path) -> pd.DataFrame:
    """The records of the planners that "P,Q" names, or "all"; those of files and plug-ins that are
    not known here go by their ids in the run.

    Raises:
        InputError: one of them is not in the run, which is in `folder`.
    """
    known = list(dict.fromkeys(records["planner"]))
    wanted = planners.REGISTRY.ids_among(text, known)
    for id in wanted:
        if known and id not in known:
            raise InputError(f"{folder} holds no path of {id!r}; {suggestion(id, known)}")
    chosen: pd.DataFrame = records[records["planner"].isin(wanted)]
    return chosen


def paths_of_problem(records: pd.DataFrame, fingerprint: str, problem: int | None) -> Shown:
    """The paths of a problem, by default of the one with the longest verified path.

    Raises:
        InputError: there are none.
    """
    first = records[records["repeat"] == 0]
    rows = first[(first["env_fingerprint"] == fingerprint) & first["path"].notna()]
    if problem is None and not rows["length"].dropna().empty:
        problem = int(rows.loc[rows["length"].astype(float).idxmax(), "problem"])
    rows = rows[rows["problem"] == problem]
    if problem is None or rows.empty:
        which = "problem" if problem is None else f"problem {problem}"
        raise InputError(f"the run holds no path for this environment's {which}")
    paths = {row.planner: decode_path(row.path) for row in rows.itertuples()}
    refused = rows.loc[rows["outcome"] != Verdict.VALID.value, "planner"]
    return Shown(problem, paths, frozenset(refused))


def colours(ids: Iterable[str]) -> dict[str, str]:
    """What each planner is drawn in: what its spec says, or one of the rest."""
    names = list(ids)
    specified = {spec.id: spec.colour for spec in planners.REGISTRY.known() if spec.colour}
    others = iter(_OTHER_COLOURS * (1 + len(names)))
    return {
        name: specified[name] if is_color_like(specified.get(name)) else next(others)
        for name in names
    }
