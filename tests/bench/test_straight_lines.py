"""Which straight lines are blocked, and that runs note it."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from conftest import Cli

import envs
from bench.judging.problem_facts import problem_facts, share_blocked


def test_letters_are_the_checks_answers() -> None:
    env = envs.REGISTRY.entry("c3d").make()
    problems = env.sample_problems(30, 0)
    letters = problem_facts(env, problems).straight_lines
    model = env.collision_model()
    assert letters == "".join("BF"[model.segment_is_free(p.start, p.goal)] for p in problems)
    assert 0.1 < share_blocked(letters) < 0.9
    assert share_blocked("") == 0


@pytest.mark.usefixtures("in_process_workers")
def test_a_run_says_which_and_who_solved_them(bench: Cli, tmp_path: Path) -> None:
    options = ("--planners", "rrtconnect", "--problems", 3, "--stop", "first", "--out", tmp_path)
    code, out, _ = bench("run", "--env", "box", *options)
    assert code == 0
    [env] = json.loads((tmp_path / "manifest.json").read_text())["envs"]
    assert len(env["straight_lines"]) == 3
    share = env["census"]["share_of_straight_lines_blocked"]
    assert f"Problems of box: share of straight lines blocked {share:g}." in out
    [row] = pd.read_csv(tmp_path / "summary.csv").to_dict("records")
    assert row["blocked_attempted"] == env["straight_lines"].count("B")
    assert row["held_to"] == "its first path"
