"""`bench audit`: what becomes of paths that planners take for valid."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from conftest import Cli, Refused
from documents import block_after

import bench as front_door
import envs
from bench.judging.path_contacts import path_contacts
from bench.report.audit_report import NOTE
from bench.storage.record import checked_every
from envs.collision import penetration
from envs.collision.shapes import Box
from envs.problem import Array
from envs.scenes.boxes import BoxWorld

SWEEP = "rrtconnect,rrtconnect:validator=sampled,resolution=0.3|0.1|0.003"


class Wall(BoxWorld):
    """A wall of one unit across a ball of radius 0.1."""

    min_clearance, kind_of_problems, advice = 0.4, "wall", ""

    def __init__(self) -> None:
        super().__init__([Box(np.zeros(3), np.array([1.0, 20.0, 20.0]))], 0.1)

    def definition(self) -> dict[str, Any]:
        return {"class": "Wall"}


def contacts(env: envs.Environment, path: Any) -> Any:
    return path_contacts(env, env.collision_model(), np.array(path, dtype=np.float64))


def test_a_ball_through_a_wall_is_half_the_wall_and_itself_deep() -> None:
    found = contacts(Wall(), [[-5, 1, 2], [3, 1, 2]])
    assert found.depth == pytest.approx(0.6, abs=0.02)
    assert found.configuration == pytest.approx([0, 1, 2], abs=0.02)
    assert found.share == pytest.approx(1.2 / 8, abs=0.01)
    assert found.between is None


def test_a_graze_that_no_piece_shows_is_found_all_the_same() -> None:
    """The ball comes within the judge's tolerance, or touches at one waypoint alone."""
    near = contacts(Wall(), [[-5, 0, 0], [-0.6005, 0, 0], [-5, 0.1, 0]])
    assert (near.share, near.depth) == (0.0, 0.0)
    once = contacts(Wall(), [[-5, 0, 0], [-0.599, 0, 0], [-5, 0.1, 0]])
    assert 0 <= once.share < 0.01
    assert once.depth == pytest.approx(0.001, abs=1e-3)


def test_a_path_of_no_length_in_contact_is_all_in_contact() -> None:
    found = contacts(Wall(), [[0.3, 0, 0], [0.3, 0, 0]])
    assert found.share == 1.0
    assert found.depth == pytest.approx(0.3)


def blocked_motion(env: envs.Environment) -> Array:
    """From a free configuration (2, d)."""
    model, rng = env.collision_model(), np.random.default_rng(0)
    return next(
        np.array([a, b])
        for a, b in zip(env.space.sample(rng, 50), env.space.sample(rng, 50), strict=True)
        if model.min_clearance(np.array([a, b])) <= 0 and model.is_valid(a)
    )


def test_surfaces_are_divided_once_for_each_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes ten times as long as all else, and an audit asks of each shape a thousand times."""
    env, divided = envs.make("arm4:scene=9"), []
    whole = penetration.remesh.subdivide_to_size

    def counted(*arguments: Any) -> Any:
        divided.append(arguments)
        return whole(*arguments)

    monkeypatch.setattr(penetration.remesh, "subdivide_to_size", counted)
    path = blocked_motion(env)
    first = contacts(env, path)
    assert 1 <= len(divided) <= len(env.robot.shapes) + len(env.obstacles)
    divided.clear()
    assert contacts(env, path).depth == first.depth > 0
    assert divided == []


def test_an_arm_is_as_deep_as_its_links_are_and_they_are_named() -> None:
    env = envs.make("arm4")
    model, path = env.collision_model(), blocked_motion(env)
    found = path_contacts(env, model, path)
    assert 0 < found.share < 1
    assert 0 < found.depth < 1
    assert found.between is not None and set(found.between) <= {
        *env.shape_names,
        *env.obstacle_names,
    }
    assert not model.is_valid(found.configuration)


def test_states_far_apart_pass_what_the_judge_refuses(bench: Cli, tmp_path: Path) -> None:
    code, out, err = bench(
        *("audit", "--env", "c3d", "--planners", SWEEP, "--problems", "12", "--out", tmp_path)
    )
    assert code == 0, err
    assert NOTE in out
    table = pd.read_csv(tmp_path / "audit.csv").set_index("planner")
    proved, coarse = table.loc["rrtconnect"], table.iloc[1]
    assert proved["claimed"] == 12 and proved["refused"] == 0
    assert coarse["refused"] > 0 and coarse["touching"] > 0
    assert 0 < coarse["depth_median"] <= coarse["depth_max"] < 5
    assert 0 < coarse["share_of_path_mean"] < 1
    assert coarse["refused_low"] < coarse["refused_share"] < coarse["refused_high"]
    assert table["refused"].iloc[3] <= coarse["refused"]
    extent = envs.make("c3d").sampling_space.extent
    gaps = [share * extent for share in (0.3, 0.1, 0.003)]
    assert table["checked_every"].tolist()[1:] == pytest.approx(gaps)
    assert np.isnan(proved["checked_every"])
    paths = pd.read_csv(tmp_path / "audit_paths.csv")
    assert len(paths) == table["refused"].sum()
    assert paths["depth"].max() == table["depth_max"].max()
    for name in ("audit.png", "worst.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "audit.md").read_text()
    assert page.startswith(out[: out.index(NOTE)])
    deepest = paths.loc[paths["depth"].idxmax()]
    assert f"problem {deepest['problem']} of c3d by {deepest['planner']}" in page
    for picture in ("audit.png", "worst.png"):
        assert f"]({picture})" in page

    again = tmp_path / "again"
    code, _, err = bench("audit", tmp_path, "--out", again)
    assert code == 0, err
    assert (again / "audit.csv").read_text() == (tmp_path / "audit.csv").read_text()
    frames = front_door.load(tmp_path).audit()
    assert frames.summary["refused"].tolist() == table["refused"].tolist()
    assert frames.worst is not None and frames.worst["depth"] == paths["depth"].max()


def test_environments_are_also_counted_together(bench: Cli, tmp_path: Path) -> None:
    """Lengths of several units have no place in one table."""
    sampled = "rrtconnect:resolution=0.2,validator=sampled"
    code, _, err = bench(
        *("audit", "--env", "c3d,c3d:scene=1,arm4", "--planners", f"{sampled},fmm"),
        *("--problems", "6", "--out", tmp_path),
    )
    assert code == 0, err
    found = front_door.load(tmp_path).audit()
    overall, each = found.overall.set_index("planner"), found.summary.set_index("planner")
    assert overall.index.tolist() == [sampled, "fmm"]
    for count in ("claimed", "refused", "touching"):
        assert overall[count].to_dict() == each[count].groupby(level=0).sum().to_dict()
    assert overall.loc[sampled, "refused"] > 0
    assert overall.loc[sampled, "refused_low"] < overall.loc[sampled, "refused_share"]
    assert overall.loc[sampled, "checked_every"] == each.loc[sampled, "checked_every"].max()
    text = (tmp_path / "audit.md").read_text()
    [of_all] = [line for line in text.splitlines() if line.startswith("| all") and sampled in line]
    assert " units" not in of_all and " rad" not in of_all and " m " not in of_all
    assert sum(line.startswith("| c3d:scene=1") for line in text.splitlines()) == 2


@pytest.mark.parametrize("said", ["soon", True, -1, None, 1e999])
def test_what_is_no_gap_between_states_is_not_taken_for_one(said: object) -> None:
    assert checked_every(json.dumps({"checked_every": said})) is None


def test_without_refusals_there_is_no_worst_path(bench: Cli, tmp_path: Path) -> None:
    code, _, err = bench(
        *("audit", "--env", "c3d", "--planners", "rrtconnect", "--problems", "3"),
        *("--out", tmp_path),
    )
    assert code == 0, err
    assert "worst.png" not in err + (tmp_path / "audit.md").read_text()
    assert not (tmp_path / "worst.png").exists()


def test_a_run_without_claims_has_nothing_to_audit(refused: Refused, tmp_path: Path) -> None:
    said = refused(
        *("audit", "--env", "c3d", "--planners", "straight-line", "--problems", "1"),
        *("--out", tmp_path / "run"),
    )
    assert "claims to have solved anything" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "name folders of runs, or --env and --planners"),
        (("--env", "c3d"), "name folders of runs, or --env and --planners"),
        (("--planners", "fmm"), "name folders of runs, or --env and --planners"),
        (("here", "--env", "c3d", "--planners", "fmm"), "name folders of runs, or"),
        (("nowhere",), "nowhere"),
        (("--env", "c3e", "--planners", "fmm"), "did you mean 'c3d'"),
        (("--env", "c3d", "--planners", "rrtconnect", "--jobs", "0"), "--jobs"),
    ],
)
def test_what_makes_no_sense_is_refused(refused: Refused, arguments: Any, said: str) -> None:
    assert said in refused("audit", *arguments)


@pytest.mark.slow
def test_the_command_of_the_page_runs(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    program, *arguments = shlex.split(block_after("audit of states along motions"))
    assert program == "bench"
    code, _, err = bench(*arguments)
    assert code == 0, err
    table = pd.read_csv("results/runs/audit-c3d/audit.csv")
    assert table["claimed"].tolist() == [100] * 5
    shares = table["refused_share"].tolist()
    assert shares[0] == 0
    assert shares[1] > shares[-1]
