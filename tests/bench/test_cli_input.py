"""Wrong input through the command line: one clear line, exit code 2, nothing written."""

from __future__ import annotations

import json
import re
import sqlite3
import subprocess
import sys
from itertools import chain
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete
from conftest import Cli, Refused

from bench.analysis import regression
from bench.cli import interface
from bench.conformance.trials import TIME_LIMIT_S
from bench.judging.metrics import METRICS
from bench.report import writers


def run(*more: object) -> tuple[object, ...]:
    return ("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", 1, *more)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "--env", "c3dd", "--planners", "fmn"), "did you mean 'c3d'?"),
        (("run", "--env", "c3d", "--planners", "fmn"), "'fmm'"),
        (("run", "--env", "c3d", "--planners", "papr"), "did you mean 'paper'"),
        (("run", "--env", "c3d:scen=1", "--planners", "fmm"), "did you mean 'scene'?"),
        (("run", "--env", "c3d:scene=x", "--planners", "fmm"), "not of type int"),
        (("run", "--env", "c3d", "--planners", "rrtstar:goal_bais=0.1"), "'goal_bias'"),
        (("run", "--env", "c3d", "--planners", "fmm:resolution=0"), "resolution"),
        (("run", "--planners", "fmm"), "--env"),
        (("run", "--env", ""), "no environment named"),
        (run("--problms", 3), "did you mean '--problems'"),
        (run("--prob", 3), "did you mean '--problems'"),
        (run("extra"), "unknown argument 'extra'"),
        (("list", "--jsn"), "did you mean '--json'"),
        (run("--problems", 0), "--problems must be between"),
        (run("--problems", "many"), "'many' is not a valid integer"),
        (run("--seed", -1), "--seed must be between"),
        (run("--time-limit", 0), "--time-limit must be between"),
        (run("--time-limit", "nan"), "--time-limit must be between"),
        (run("--time-limit", "inf"), "--time-limit must be between"),
        (run("--memory-limit", 1), "--memory-limit must be between"),
        (run("--jobs", 0), "physical cores"),
        (run("--jobs", 1000), "physical cores"),
        (run("--stop", "soon"), "first, limit or match"),
        (run("--stop", "first:1"), "first, limit or match"),
        (run("--stop", "match"), "first, limit or match"),
        (run("--stop", "match:fmn"), "'fmm'"),
        (run("--stop", "match:fmm:-1"), "tolerance"),
        (run("--stop", "match:fmm:nan"), "tolerance"),
        (run("--problems", 10**12), "--problems must be between"),
        (run("--problems", -5), "--problems must be between"),
        (run("--seed", 10**30), "--seed must be between"),
        (run("--memory-limit", 10**12), "--memory-limit must be between"),
        (("run", "--env", "c3d:boxes=1000000000", "--planners", "fmm"), "boxes"),
        (("run", "--env", "c3d:boxes=-1", "--planners", "fmm"), "boxes"),
        (("run", "--env", "c3d", "--planners", "fmm:resolution=100000"), "resolution"),
        (("run", "--env", "../c3d", "--planners", "fmm"), "did you mean 'c3d'?"),
        (("run", "--env", "/etc/passwd", "--planners", "fmm"), "unknown environment '/etc/passwd'"),
        (("run", "--env", "c3d", "--planners", "../../fmm"), "unknown planner '../../fmm'"),
        (("run", "--env", "c3d\n\x1b[2J", "--planners", "fmm"), r"'c3d\n\x1b[2J'"),
        (("paper", "--only", "../scenes"), "did you mean 'scenes'?"),
        (("check", "nowhere", "--baseline", "/etc/passwd"), "nowhere holds no run.sqlite"),
        (("list", "nothing"), "'nothing' is not one of"),
        (("lst",), "unknown command 'lst'; did you mean 'list'?"),
        (("--verson",), "did you mean '--version'?"),
        (("field", "--env", "c3d", "--source", "1,b", "--out", "x.png"), "'1,b' is not numbers"),
        ((), "COMMAND"),
        (("show", "--env", "c3d"), "--out"),
    ],
)
def test_mistakes(arguments: tuple[object, ...], said: str, refused: Refused) -> None:
    assert said in refused(*arguments)


def test_the_installed_command_exits_with_2() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "bench", "run", "--env", "c3dd", "--planners", "fmn"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "bench: error: unknown environment 'c3dd'; did you mean 'c3d'?\n"


def test_a_store_that_is_not_ours_is_left_alone(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "run.sqlite"
    with sqlite3.connect(file) as other:
        other.execute("CREATE TABLE precious (x)")
    other.close()
    before = file.read_bytes()
    for what in (run("--out", tmp_path), ("report", tmp_path)):
        code, _, err = bench(*what)
        assert code == 2
        assert "not a store of this program" in err
    assert file.read_bytes() == before


def test_a_store_of_another_version_is_left_alone(bench: Cli, tmp_path: Path) -> None:
    assert bench(*run("--stop", "first", "--out", tmp_path))[0] == 0
    with sqlite3.connect(tmp_path / "run.sqlite") as store:
        store.execute("PRAGMA user_version = 99")
    store.close()
    code, _, err = bench(*run("--out", tmp_path))
    assert code == 2
    assert "version 99" in err


@pytest.mark.parametrize("content", [b"not a database at all" * 50, b"x"])
def test_a_file_that_is_no_database(bench: Cli, tmp_path: Path, content: bytes) -> None:
    (tmp_path / "run.sqlite").write_bytes(content)
    code, _, err = bench(*run("--out", tmp_path))
    assert code == 2
    assert "cannot use" in err
    assert (tmp_path / "run.sqlite").read_bytes() == content


def test_out_is_a_file(bench: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("precious")
    code, _, err = bench(*run("--out", tmp_path / "file"))
    assert code == 2
    assert "cannot use" in err
    assert (tmp_path / "file").read_text() == "precious"


def test_reports_and_pictures_of_nothing(bench: Cli, tmp_path: Path) -> None:
    for what in (
        ("report", tmp_path),
        ("report", tmp_path / "missing"),
        ("show", "--env", "c3d", "--paths", tmp_path, "--out", tmp_path / "f.png"),
    ):
        code, _, err = bench(*what)
        assert code == 2
        assert "holds no run.sqlite" in err
    code, _, err = bench("show", "--env", "c3d", "--out", tmp_path / "no" / "such" / "f.png")
    assert code == 2
    assert "cannot write" in err
    code, _, err = bench("show", "--env", "c3d", "--out", tmp_path / "f.docx")
    assert code == 2
    assert "cannot write" in err
    assert not list(tmp_path.iterdir())


def test_unknown_formats_and_problems(bench: Cli, tmp_path: Path) -> None:
    assert bench(*run("--stop", "first", "--out", tmp_path))[0] == 0
    code, _, err = bench("report", tmp_path, "--format", "pdf")
    assert code == 2
    assert "choose from: csv, html" in err
    picture = ("--out", tmp_path / "f.png")
    code, _, err = bench("show", "--env", "c3d", "--paths", tmp_path, "--problem", 77, *picture)
    assert code == 2
    assert "no path" in err
    code, _, err = bench("show", "--env", "c3d:scene=5", "--paths", tmp_path, *picture)
    assert code == 2
    assert "no path" in err


def test_list(bench: Cli) -> None:
    code, out, _ = bench("list", "--json")
    assert code == 0
    listed = json.loads(out)
    assert set(listed) == {"planners", "envs"}
    assert listed["envs"][0]["id"] == "c3d"
    ids = [entry["id"] for entry in listed["planners"]]
    assert {"fmm", "rrtstar", "lazyprmstar", "rrtconnect", "prmstar", "informedrrtstar"} <= set(ids)
    assert {"bitstar", "aitstar", "eitstar", "fmt"} <= set(ids)
    for entry in [*listed["envs"], *listed["planners"]]:
        assert entry["description"]
        assert "\n" not in entry["description"]
    code, out, _ = bench("list", "planners")
    assert "fmm" in out
    assert "c3d" not in out


def test_help_names_every_command(bench: Cli) -> None:
    code, out, _ = bench("--help")
    assert code == 0
    sections = re.findall(r"^(\w+):\n((?:  .*\n)+)", out, re.MULTILINE)
    listed = [line.split()[0] for name, lines in sections[1:] for line in lines.splitlines()]
    assert [name for name, _ in sections] == ["Options", "Measure", "Report", "Try"]
    assert sorted(listed) == sorted(interface.bench.commands)
    assert len(listed) == 16


def test_help_of_a_command_says_what_can_be_chosen(bench: Cli) -> None:
    for command, names in (("report", writers.FORMATS), ("check", regression.always_kept())):
        code, out, _ = bench(command, "--help")
        assert code == 0
        assert set(names) <= set(re.findall(r"[a-z-]+", out)), "written out there"
    assert f"(default: {TIME_LIMIT_S:g})" in bench("test-planner", "--help")[1]


def test_a_shell_completes_the_last_name() -> None:
    def completed(line: str) -> list[str]:
        *words, last = line.split(" ")
        found = ShellComplete(interface.bench, {}, "bench", "_BENCH_COMPLETE")
        return [item.value for item in found.get_completions(words, last)]

    assert completed("re") == ["report", "replay"]
    assert completed("run --prob") == ["--problems", "--problem-file"]
    assert completed("run --env bun") == ["bunny"]
    assert completed("run --planners fmm,rrts") == ["fmm,rrtstar"]
    assert completed("list planners more ") == []


@pytest.mark.parametrize(
    ("option", "name", "said"),
    [
        ("--env", "my/arm.urdf", "an arm is arm:urdf=my/arm.urdf"),
        ("--env", "Room{0}.PLY", "a mesh is mesh:file=Room{0}.PLY"),
        ("--env", "a.glb:kind=interior", "a mesh is mesh:file=a.glb"),
        ("--planners", "fmm,mine.py", "--planner-file mine.py"),
        ("--planners", "mine.py:Mine", "--planner-file mine.py"),
    ],
)
def test_who_gives_a_file_for_a_name_is_told_what_to_write(
    refused: Refused, option: str, name: str, said: str
) -> None:
    chosen = {"--env": "c3d", "--planners": "fmm", option: name}
    assert said in refused("run", *chain(*chosen.items()))


def test_metrics_are_listed(bench: Cli) -> None:
    code, out, _ = bench("list", "metrics", "--json")
    [listed] = json.loads(out).values()
    assert code == 0
    assert [one["id"] for one in listed] == [metric.name for metric in METRICS]
    assert "travel time at speed S*, better lower" in bench("list", "metrics")[1]
