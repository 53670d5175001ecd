"""Files with commas and quotes in their names, and typed arguments, from the command line to the
store, the reports and back."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import ANY

import pandas as pd
import pytest
import trimesh
from conftest import Cli, records_of
from records import recorded, row

from bench.report import latex, markdown

PLANNER = """
from pathlib import Path
from typing import Literal

from planners import Planner, PlannerResult, Status


class Typed(Planner):
    improves = False

    def __init__(self, file: Path, sizes: list[int], how: Literal["up", "down"] | None = "up"):
        assert isinstance(file, Path)
        assert sizes == [1, 2]
        assert how is None
        self.file = file

    def setup(self, env, *, seed):
        pass

    def solve(self, problem, budget):
        path = [problem.start, problem.goal]
        return PlannerResult(Status.EXACT_SOLUTION, path, {"file": str(self.file)})
"""


@pytest.mark.slow
def test_from_the_command_line_to_the_store_and_back(bench: Cli, tmp_path: Path) -> None:
    mesh = tmp_path / 'my "room", v2.obj'
    trimesh.creation.box().export(mesh)
    planners = tmp_path / "mine, new.py"
    planners.write_text(PLANNER)
    env = f"mesh:file='{mesh}',robot_radius=0.02"
    planner = "typed:file=\"a, b\",sizes='1,2',how=none"
    run = tmp_path / "run"
    code, out, err = bench(
        *("run", "--env", env, "--planners", planner, "--planner-file", planners),
        *("--problems", 1, "--stop", "first", "--out", run),
    )
    assert code == 0, err
    [record] = records_of(run).to_dict("records")
    assert record["status"] == "EXACT_SOLUTION"
    assert "a, b" in record["stats"]
    assert record["planner"] == 'typed:file="a, b",how=None,sizes="1,2"'
    assert record["env"] == env
    assert record["env"] in out
    assert bench("report", run, "--format", "csv,latex")[0] == 0
    assert pd.read_csv(run / "summary.csv")["env"].tolist() == [env]
    show = ("show", "--env", env, "--paths", run, "--out", tmp_path / "paths.png")
    assert bench(*show, "--planners", record["planner"]) == (0, "", ANY), "it need not be known"
    assert bench(*show, "--planners", planner, "--planner-file", planners)[0] == 0
    code, _, err = bench(*show, "--planners", "typed")
    assert code == 2
    assert record["planner"] in err
    again = ("--env", record["env"], "--planner", record["planner"], "--problem", 0)
    code, _, err = bench("replay", run, *again, "--planner-file", planners)
    assert code == 0, err


def test_of_a_comma_without_quotes_the_message_says_how_they_are_put(
    bench: Cli, tmp_path: Path
) -> None:
    code, _, err = bench("run", "--env", "mesh:file=my room, v2.obj", "--out", tmp_path / "run")
    assert code == 2
    assert err.count("\n") == 1
    assert "'mesh:file=\"my room, v2.obj\"'" in err


def test_a_suggested_command_can_be_copied(bench: Cli, tmp_path: Path) -> None:
    mesh = tmp_path / "my room, v2.obj"
    trimesh.creation.box().export(mesh)
    code, _, err = bench("test-planner", "ntfields", "--env", f'mesh:file="{mesh}"')
    assert code == 2
    assert f"bench train --env 'mesh:file=\"{mesh}\"' --planner ntfields" in err


@pytest.mark.parametrize("odd", ["\x1b[31m", "a\nb", "\x9b2J", "\u202e", "\r"])
def test_tables_write_what_does_not_print_as_escapes(odd: str) -> None:
    env = f"mesh:file={odd}.ply"
    run = recorded(
        [
            row("p", 0, "ERROR", env=env, error=odd),
            row("p", 1, "VALID", env=env, solve_s=1.0, length=1.0),
        ]
    )
    for text in (markdown.text(run), latex.text(run)):
        assert all(line.isprintable() for line in text.split("\n"))
    assert odd.encode("unicode_escape").decode("ascii") in markdown.text(run)
