"""README and docs are true: their Python text runs, their commands and options exist."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh
from conftest import Cli
from documents import (
    ALL,
    BLOCKS,
    NOT_RUN,
    NOTEBOOKS,
    PAGES,
    README,
    ROOT,
    TEXT,
    block_after,
    blocks,
)

import envs
import planners
from bench.cli import app


@pytest.mark.slow
def test_the_python_text_runs_as_written(tmp_path: Path) -> None:
    said = []
    for text in blocks("python"):
        done = subprocess.run(
            [sys.executable, "-c", text], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        said.append(done.stdout)
    frame, status = said
    assert "success_rate" in frame
    assert (tmp_path / "solved.png").is_file()
    assert "EXACT_SOLUTION" in status


def test_the_commands_and_entries_it_shows_are_accepted() -> None:
    lines = [
        shlex.split(line.partition("#")[0].split("bench ", 1)[1])
        for block in blocks("sh")
        for line in block.splitlines()
        if "bench " in line and "pytest" not in line
    ]
    assert len(lines) >= 6
    for arguments in lines:
        chosen = vars(app.parse(arguments))
        if chosen.get("env") and not chosen["env"].startswith("slalom"):  # run where it is shown
            assert envs.REGISTRY.entries(chosen["env"])
        if "planners" in chosen:
            assert planners.REGISTRY.entries(chosen["planners"])


@pytest.mark.slow
def test_the_quick_start_goes_through(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    measure = block_after("quick start: measure")
    look, choose = block_after("quick start: look"), block_after("quick start: choose")
    for line in (measure + look + choose).splitlines():
        program, *arguments = shlex.split(line)
        assert program == "bench"
        code, _, err = bench(*arguments)
        assert code == 0, line + err
    for made in ("first-run/summary.csv", "first-run/report.html", "paths.png", "other/run.sqlite"):
        assert (tmp_path / made).is_file(), made


def test_no_block_is_forgotten() -> None:
    """Each is run by a test, or named with the reason why not."""
    assert {block.name for block in BLOCKS if not block.is_run} == NOT_RUN.keys()


@pytest.mark.slow
def test_the_arm_and_the_scene_it_shows_make_a_world(bench: Cli, tmp_path: Path) -> None:
    [arm], [scene] = blocks("xml"), blocks("yaml")
    (tmp_path / "arm.urdf").write_text(arm, encoding="utf-8")
    (tmp_path / "scene.yaml").write_text(scene, encoding="utf-8")
    trimesh.creation.box((200, 50, 300)).export(tmp_path / "shelf.ply")
    name = f"arm:urdf={tmp_path / 'arm.urdf'},scene={tmp_path / 'scene.yaml'}"
    world = envs.make(name)
    assert world.dimension == 2
    assert len(world.obstacles) == 6
    planner = planners.make("rrtconnect")
    planner.setup(world, seed=1)
    [problem] = world.sample_problems(1, 0)
    result = planner.solve(problem, planners.Budget(time.perf_counter() + 5))
    assert result.status is planners.Status.EXACT_SOLUTION
    code, _, err = bench("show", "--env", name, "--out", tmp_path / "arm.png")
    assert code == 0, err
    assert (tmp_path / "arm.png").is_file()


def test_it_lists_what_is_registered() -> None:
    for spec in [*envs.REGISTRY.specs(), *planners.REGISTRY.specs()]:
        # What is a group's name and more goes by that of the group.
        [name] = [group for group in spec.groups if spec.id.startswith(f"{group}-")] or [spec.id]
        assert f"`{name}`" in TEXT


def test_options_and_defaults_are_those_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert app.main(["run", "--help"]) == 0
    text = re.sub(r"\s+", " ", capsys.readouterr().out)
    for option, default in re.findall(r"^\| `(--[a-z-]+)` \| `?([^|`]+?)`? \|", TEXT, re.MULTILINE):
        assert option in text
        assert f"default: {default}" in text, option


def test_the_readme_is_short() -> None:
    assert len(README.read_text(encoding="utf-8").split()) <= 700


def test_the_readme_leads_to_every_page() -> None:
    index = ROOT / "docs" / "index.md"
    assert "(docs/index.md)" in README.read_text(encoding="utf-8")
    linked = re.findall(r"\]\(([\w/-]+\.(?:md|ipynb))\)", index.read_text(encoding="utf-8"))
    assert {index, *(index.parent / name for name in linked)} == {*PAGES, *NOTEBOOKS}


def test_links_lead_somewhere() -> None:
    for page in ALL:
        for target in re.findall(r"\]\(([^)#]+)[)#]", page.read_text(encoding="utf-8")):
            assert target.startswith("https://") or (page.parent / target).exists(), (page, target)


def test_rows_in_the_readme_are_those_of_the_results() -> None:
    pattern = re.compile(r"^\| `([\w-]+)` \| (\d.*?) \|$", re.MULTILINE)
    short = pattern.findall(README.read_text(encoding="utf-8"))
    results = (README.parent / "docs" / "results.md").read_text(encoding="utf-8")
    whole = dict(pattern.findall(results.partition("## In a house")[0]))
    assert len(short) == 9
    for planner, cells in short:
        assert set(cells.split(" | ")) <= set(whole[planner].split(" | ")), planner
