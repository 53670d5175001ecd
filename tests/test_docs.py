"""What is written beside the code is true: the example of a workflow, and files that are named."""

from __future__ import annotations

import configparser
import re
import shlex
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
import yaml
from documents import ALL, ROOT

import bench
import envs
import planners
from bench.cli import app

TEXT = (ROOT / "docs" / "github-actions.yml").read_text(encoding="utf-8")


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
    assert all((ROOT / name).is_file() for name in python["cache-dependency-path"].split())


@pytest.mark.parametrize("page", ALL, ids=lambda page: page.stem)
def test_files_and_folders_that_are_named_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"`((?:bench|planners|envs|tests|results|docs)/[\w./-]*)`", text)
    written = [one for one in named if one.startswith("results/runs/")]  # by commands
    assert [one for one in named if not (ROOT / one).exists()] == written


def test_the_citation_is_of_this_version() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["version"] == metadata.version("plannerbench") == bench.__version__
    assert cited["license"] == "BSD-3-Clause"


def test_hooks_are_the_checks_of_the_lint_run() -> None:
    [repository] = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    lint = configparser.ConfigParser()
    lint.read(ROOT / "tox.ini")
    commands = lint["testenv:lint"]["commands"].split("\n")[1:]
    entries = [hook["entry"] for hook in repository["hooks"]]
    assert entries == [command.removesuffix(" .") for command in commands]
