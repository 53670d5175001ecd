"""Rows of an older version of a planner do not count as measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from conftest import Cli, records_of

import planners


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_planner_of_another_version_is_measured_again(bench: Cli, tmp_path: Path) -> None:
    spec = replace(planners.REGISTRY.entry("rrtconnect").spec, id="changing", aliases=(), groups=())
    run = (
        *("run", "--env", "c3d", "--planners", "changing,fmt", "--problems", 2),
        *("--stop", "first", "--out", tmp_path),
    )
    found = []
    for version in (1, 2):
        planners.REGISTRY.register(replace(spec, version=version))
        try:
            assert bench(*run)[0] == 0
        finally:
            planners.REGISTRY.unregister("changing")
        found.append(records_of(tmp_path).set_index(["planner", "problem"]))
    first, again = found
    assert len(again) == 4
    same = again["run_id"] == first["run_id"].reindex(again.index)
    assert same.groupby("planner").all().to_dict() == {"fmt": True, "changing": False}
    assert (again.loc["changing", "planner_version"] == 2).all()
