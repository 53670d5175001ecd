"""The example in docs/ is what it says: a workflow, whose commands the command line accepts."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import yaml

import envs
import planners
from bench.cli import app

TEXT = (Path(__file__).parents[1] / "docs" / "github-actions.yml").read_text(encoding="utf-8")


def steps() -> list[dict[str, Any]]:
    [job] = yaml.safe_load(TEXT)["jobs"].values()
    return list(job["steps"])


def commands(text: str) -> list[list[str]]:
    lines = re.findall(r"^(?:#\s+)?bench (.*)$", text, re.MULTILINE)
    return [shlex.split(line) for line in lines]


def test_every_bench_command_is_accepted() -> None:
    shown = [*commands("\n".join(step.get("run", "") for step in steps())), *commands(TEXT)]
    assert [arguments[0] for arguments in shown] == ["run", "check"] * 2, "done, and in its comment"
    for arguments in shown:
        chosen = vars(app.parse(arguments))
        if "env" in chosen:
            assert envs.REGISTRY.entries(chosen["env"])
            assert planners.REGISTRY.entries(chosen["planners"])


def test_the_comment_writes_the_baseline_that_the_steps_check() -> None:
    done = commands("\n".join(step.get("run", "") for step in steps()))
    [run, check], [same_run, update] = done, commands(TEXT)
    assert run == same_run
    assert "--update" in update
    for option in ("--baseline", "--ratios"):
        assert update[update.index(option) + 1] == check[check.index(option) + 1]


def test_the_result_is_shown_even_if_the_check_fails() -> None:
    [show] = [step for step in steps() if "GITHUB_STEP_SUMMARY" in step.get("run", "")]
    [check] = [step["run"] for step in steps() if "bench check" in step.get("run", "")]
    file = check.split("--out ")[1]
    assert show["if"].startswith("always()")
    assert show["run"] == f'cat {file} >> "$GITHUB_STEP_SUMMARY"'


def test_packages_are_kept_between_runs() -> None:
    [python] = [step["with"] for step in steps() if "setup-python" in step.get("uses", "")]
    assert python["cache"] == "pip"
    root = Path(__file__).parents[1]
    assert all((root / name).is_file() for name in python["cache-dependency-path"].split())
