"""One environment is one fingerprint, whatever names it was given: reports call it by the first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd


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
