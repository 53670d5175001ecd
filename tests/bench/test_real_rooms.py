"""The real rooms of the folder of meshes, through the command line, at what is asked of them."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest
from conftest import Cli, has_data, records_of

from planners import learning
from planners.fields.methods import IN_ROOMS
from planners.training import Recipe

ROOMS = ("office_small", "office_large", "meeting_room")


@pytest.fixture(params=ROOMS)
def room(request: pytest.FixtureRequest) -> str:
    """An environment."""
    file = f"rooms/{request.param}_zup.ply"
    if not has_data(file):
        pytest.skip("BENCH_DATA has no rooms")
    path = Path(os.environ["BENCH_DATA"]) / file
    return f"mesh:file={path},kind=interior,robot_radius=0.15"


def solved(bench: Cli, env: str, planners: str, out: Path) -> dict[str, int]:
    """How many of 100 problems each planner solves."""
    chosen = ("--env", env, "--planners", planners, "--problems", 100, "--seed", 2026)
    code, _, err = bench("run", *chosen, "--stop", "first", "--out", out)
    assert code == 0, err
    records = records_of(out)
    return (records["outcome"] == "VALID").groupby(records["planner"]).sum().to_dict()


def test_classical_planners_solve_99_of_100(bench: Cli, room: str, tmp_path: Path) -> None:
    count = solved(bench, room, "fmm,rrtconnect", tmp_path)
    assert count["fmm"] >= 99
    assert count["rrtconnect"] >= 99


def test_ntfields_solves_95_of_100_after_an_eighth_of_its_training(
    bench: Cli, room: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = IN_ROOMS["ntfields"]
    brief = Recipe(steps=whole.recipe.steps // 8)
    monkeypatch.setitem(IN_ROOMS, "ntfields", replace(whole, recipe=brief))
    monkeypatch.setattr(learning, "_VALIDATION_PROBLEMS", 2)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert solved(bench, room, "ntfields", tmp_path / "run")["ntfields"] >= 95
