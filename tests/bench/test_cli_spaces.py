"""The commands, one after the other, on spaces that turn and wrap; what tables say of them."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path

import matplotlib.image
import pytest
from bad_urdfs import LIMIT, collision, joint, link, robot
from conftest import Cli, records_of
from records import recorded, row

from bench.report import latex, markdown

PLANNERS = ("rrtconnect", "fmm:resolution=30", "straight-line")


def wrapping(folder: Path) -> str:
    """A boom that turns for ever, past a wall on one side, with a hand on it."""
    boom = collision('<box size="0.5 0.05 0.05"/>', '<origin xyz="0.25 0 0"/>')
    hand = collision('<sphere radius="0.04"/>', '<origin xyz="0.15 0 0"/>')
    (folder / "arm.urdf").write_text(
        robot(
            *(link("base", ""), link("boom", boom), link("hand", hand)),
            joint("turn", "base", "boom", "continuous", "", "0 0 1"),
            joint("bend", "boom", "hand", inside='<origin xyz="0.5 0 0"/>' + LIMIT, axis="0 1 0"),
        )
    )
    wall = "{box: [0.3, 0.06, 0.5], position: [0.35, 0, 0]}"
    block = "{box: [0.2, 0.2, 0.2], position: [-0.7, 0, 0]}"
    (folder / "scene.yaml").write_text(f"obstacles: [{wall}, {block}]")
    return f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}"


ENTRIES = {
    "SE(2)": (lambda _: "rigid:space=se2", "R^2 x 1.49 S^1"),
    "SE(3)": (lambda _: "rigid", "R^3 x 1.49 SO(3)"),
    "wrapping": (wrapping, "R^1 x S^1"),
}


def test_tables_say_which_spaces_are_not_plain() -> None:
    names = {"a": "R^3", "b": "R^3 x 1.49 SO(3)", "c": "0.5 R^2", "d": None, "e": "R^1 x S^1"}
    rows = [row("p", 0, "VALID", solve_s=1.0, length=2.0, env=name) for name in names]
    spaces = {name: {"space": space} if space else {} for name, space in names.items()}
    entries = [{"id": name, "fingerprint": "f", **said} for name, said in spaces.items()]
    run = recorded(rows, envs=entries)
    told = "Configuration spaces: `b` R^3 x 1.49 SO(3), `c` 0.5 R^2, `e` R^1 x S^1. A number"
    assert told in markdown.text(run)
    spoken = r"\texttt{b} R\textasciicircum{}3 x 1.49 SO(3), \texttt{c} 0.5 R"
    assert spoken in latex.text(run)
    old = recorded(rows[:1], envs=entries[:1])
    assert "Configuration spaces" not in markdown.text(old) + latex.text(old)


@pytest.mark.slow
@pytest.mark.parametrize("name", ENTRIES)
def test_a_user_goes_through_all_commands(name: str, bench: Cli, tmp_path: Path) -> None:
    made, space = ENTRIES[name]
    env, folder = made(tmp_path), tmp_path / "run"
    plans = [planner for planner in PLANNERS if name != "SE(3)" or "fmm" not in planner]

    assert bench("show", "--env", env, "--out", tmp_path / "env.png")[0] == 0
    assert is_drawn(tmp_path / "env.png")

    asked = ("--env", env, "--planners", ",".join(PLANNERS), "--problems", 3, "--stop", "first")
    code, out, err = bench("run", *asked, "--time-limit", 5, "--out", folder)
    assert code == 0, err
    records = records_of(folder)
    assert len(records) == 3 * len(PLANNERS)
    attempted = records[records["planner"].isin(plans)]
    assert set(attempted["outcome"]) <= {"VALID", "APPROXIMATE_SOLUTION"}
    assert (attempted["outcome"][attempted["planner"] == "rrtconnect"] == "VALID").all()
    left_out = records[~records["planner"].isin(plans)]
    assert set(left_out["outcome"]) <= {"UNSUPPORTED"}
    [said] = json.loads((folder / "manifest.json").read_text())["envs"]
    assert said["space"] == space
    assert f"\nConfiguration spaces: `{said['id']}` {space}. A number before a part" in out

    formats = "html,planner-arena,latex"
    assert bench("report", folder, "--format", formats, "--out", tmp_path / "out")[0] == 0
    html = (tmp_path / "out" / "report.html").read_text()
    assert f"</code> {space}. A number before a part" in html
    assert "The scene cannot be shown" not in html
    with closing(sqlite3.connect(tmp_path / "out" / "planner_arena.db")) as arena:
        [[runs]] = arena.execute("SELECT count(*) FROM runs WHERE correct_solution").fetchall()
    assert runs == (records["outcome"] == "VALID").sum()

    drawn = ("--env", env, "--paths", folder, "--problem", 1, "--out", tmp_path / "paths.png")
    code, _, err = bench("show", *drawn)
    assert code == 0, err
    assert is_drawn(tmp_path / "paths.png")

    for planner in plans[:2]:
        code, out, err = bench("replay", folder, "--planner", planner, "--problem", 2)
        assert code == 0, out + err
        assert "same path" in out.splitlines()

    code, out, err = bench("test-planner", "rrtconnect", "--env", env)
    assert code == 0, out + err
    assert out.count("passed") >= 10


def is_drawn(file: Path) -> bool:
    """Whether a picture has something of a robot's colour in it."""
    red, _, blue = matplotlib.image.imread(file)[:, :, :3].transpose(2, 0, 1)
    return int((blue - red > 0.15).sum()) > 300
