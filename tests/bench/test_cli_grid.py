"""The commands on maps: a run over Moving AI's problems, pictures and pages of a plane."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import matplotlib.image
import numpy as np
import pandas as pd
import pytest
from conftest import Cli, Refused, records_of
from map_files import (
    ROOMS,
    occupied,
    octile_distance,
    scenarios,
    voxels,
    write_image,
    write_octile,
    write_ros,
)

import envs
import planners
from bench.report import field, plane_scene
from bench.report.html.geometry import Scene
from envs.collision.shapes import Box
from planners.base import Budget, TimeFieldPlanner
from planners.fields.labels import LabelPlan
from planners.fields.methods import METHODS, method, unsupported
from planners.fields.objectives import Regression
from planners.learning import trainer
from planners.learning.normalizer import obstacle_point_cloud
from planners.mpnet.imitation import _turns

ENDS = ((1, 1, 18, 11), (1, 9, 18, 1), (12, 5, 2, 9))
"""x and y of starts and goals, from the upper left."""


@pytest.fixture
def game(tmp_path: Path) -> str:
    """An entry of Moving AI's map and problems."""
    free = ~occupied()
    lines = [
        f"{x} {y} {u} {v} {octile_distance(free, (x, 12 - y), (u, 12 - v)):.8f}"
        for x, y, u, v in ENDS
    ]
    (tmp_path / "rooms.map.scen").write_text(scenarios(*lines))
    return f"grid:file={write_octile(tmp_path)},scen={tmp_path / 'rooms.map.scen'}"


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_run_tells_lengths_by_those_that_are_known(game: str, bench: Cli, tmp_path: Path) -> None:
    names = "fmm,rrtstar,straight-line"
    asked = ("run", "--env", game, "--planners", names, "--problems", 3, "--stop", "limit")
    code, out, err = bench(*asked, "--time-limit", 1, "--out", tmp_path / "run", "--wide")
    assert code == 0, err
    assert "length cells" in out
    assert "length / known" in out
    records = records_of(tmp_path / "run")
    solved = records[records["outcome"] == "VALID"]
    assert set(solved["planner"]) == {"fmm", "rrtstar"}
    known = [octile_distance(~occupied(), (x, 12 - y), (u, 12 - v)) for x, y, u, v in ENDS]
    expected = solved["length"] / np.array(known)[solved["problem"]]
    assert solved["length_over_known"].to_numpy() == pytest.approx(expected.to_numpy(), rel=1e-6)
    assert solved["length_over_known"].min() > 0.85
    assert (solved[solved["planner"] == "rrtstar"]["length_over_known"] < 1.1).all()
    summary = pd.read_csv(tmp_path / "run" / "summary.csv")
    assert "length_over_known_mean" in summary

    drawn = ("--paths", tmp_path / "run", "--problem", 1, "--out", tmp_path / "paths.png")
    code, _, err = bench("show", "--env", game, *drawn)
    assert code == 0, err
    report = ("report", tmp_path / "run", "--format", "html", "--out", tmp_path / "html")
    assert bench(*report)[0] == 0
    assert "The scene cannot be shown" not in (tmp_path / "html" / "report.html").read_text()
    many = ("run", "--env", game, "--planners", "fmm", "--problems", 4, "--out", tmp_path / "many")
    code, _, err = bench(*many)
    assert code == 2
    assert "its file has 3 problems, not 4" in err


def test_bad_maps_are_refused_in_one_line(tmp_path: Path, refused: Refused) -> None:
    write_octile(tmp_path, ROOMS.replace("#....##", "#....#x", 1))
    run = ("run", "--planners", "rrtconnect", "--problems", 1, "--env")
    said = refused(*run, f"grid:file={tmp_path / 'rooms.map'}")
    assert "line 8, column 16: no terrain is called 'x'" in said
    assert "did you mean 'radius'" in refused(*run, f"grid:file={tmp_path / 'rooms.map'},radios=1")


def test_maps_without_known_lengths_have_no_such_metric(tmp_path: Path) -> None:
    env = envs.make(f"grid:file={write_octile(tmp_path)}")
    assert env.known_length(env.sample_problems(1, 0)[0]) is None


def test_a_picture_of_a_plane_is_the_map(tmp_path: Path) -> None:
    env = envs.make(f"grid:file={write_ros(tmp_path)},radius=0.02")
    plane_scene.draw(env, "rooms", None, tmp_path / "map.png")
    dark = matplotlib.image.imread(tmp_path / "map.png")[:, :, 0] < 0.6
    rows, columns = np.flatnonzero(dark.mean(axis=1) > 0.5), np.flatnonzero(dark.mean(axis=0) > 0.5)
    inner = dark[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    # The share that is occupied, and what is dark where the door in the middle of the left is not.
    assert inner.mean() == pytest.approx(occupied().mean(), abs=0.04)


def test_what_looks_up_is_what_is_seen_from_above() -> None:
    seen = plane_scene._seen_from_above([Box([1, 2, 0], [2, 2, 5])])
    assert seen.shape == (2, 3, 2)
    assert seen.min(axis=(0, 1)).tolist() == [0, 1]
    assert seen.max(axis=(0, 1)).tolist() == [2, 3]


def test_pages_show_a_plane_in_space(tmp_path: Path) -> None:
    env = envs.make(f"grid:file={write_ros(tmp_path)}")
    scene = Scene(env)
    data = scene.data()
    assert data["lower"] == pytest.approx([-1, 2, 0])
    assert data["upper"] == pytest.approx([1, 3.3, 0])
    assert json.dumps(data)
    assert scene.points(np.array([[0.5, 2.5]])).tolist() == [[[0.5, 2.5, 0]]]


def test_fields_of_a_plane_are_drawn_as_they_are(tmp_path: Path) -> None:
    env = envs.make(f"grid:file={write_ros(tmp_path)}")
    where = field.Slice.through(env)
    assert where.q.shape[1] == 2
    assert where.free.mean() == pytest.approx(1 - occupied().mean(), abs=0.02)


def test_learners_are_told_of_a_plane_what_they_know(tmp_path: Path) -> None:
    env = envs.make(f"grid:file={write_ros(tmp_path)}")
    cloud = obstacle_point_cloud(env)
    assert cloud.shape[1] == 3
    assert cloud.min(axis=0)[:2] == pytest.approx([-0.5, -0.325], abs=0.01)
    assert cloud.max(axis=0)[:2] == pytest.approx([0.5, 0.325], abs=0.01)
    assert cloud.mean(axis=0)[2] == pytest.approx(0, abs=0.01)
    [[of_points, of_configurations]] = _turns(env)
    assert of_points.tolist() == np.eye(3).tolist()
    assert of_configurations.tolist() == np.eye(2).tolist()
    reason = unsupported("ntfields-wenc", env)
    assert reason is not None
    assert "not in the plane" in reason
    assert unsupported("ntfields", env) is unsupported("ief3d", env) is None
    assert method("ntfields", env).network(env).shape.dimension == 2


def test_cubes_are_a_world_in_space(tmp_path: Path) -> None:
    np.save(tmp_path / "cubes.npy", voxels())
    env = envs.make(f"grid:file={tmp_path / 'cubes.npy'}")
    assert unsupported("ntfields-wenc", env) is None
    assert Scene(env).data()["upper"] == pytest.approx([0.6, 0.5, 0.4])


@pytest.mark.training
@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("planner", ["ntfields", "ief3d"])
def test_time_fields_learn_a_plane(
    planner: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bench: Cli
) -> None:
    """A few steps, after which the field is one, if not a good one."""
    whole = METHODS[planner]
    brief = replace(whole, recipe=replace(whole.recipe, steps=20))
    if planner == "ief3d":
        few = LabelPlan(sources=5, goals=200, resolution=40)
        brief = replace(brief, objective=lambda: Regression(few))
    monkeypatch.setitem(METHODS, planner, brief)
    monkeypatch.setattr(trainer, "_VALIDATION_PROBLEMS", 2)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    env = f"grid:file={write_image(tmp_path / 'map.png', OPEN)}"
    code, _, err = bench("train", "--env", env, "--planner", planner)
    assert code == 0, err
    world, made = envs.make(env), planners.make(planner)
    made.setup(world, seed=1)
    assert isinstance(made, TimeFieldPlanner)
    [problem] = world.sample_problems(1, 0)
    times, speeds = made.times_and_speeds(problem.start, world.space.sample(RNG, 50))
    assert np.isfinite(times).all()
    assert (times > 0).all()
    assert (speeds > 0).all()
    found = made.solve(problem, Budget(perf_counter() + 20.0))
    if found.path is not None:
        assert np.asarray(found.path).shape[1] == 2


RNG = np.random.default_rng(0)

OPEN = "\n".join(["." * 20, *["." * 8 + "##" + "." * 10] * 6, "." * 20])
"""One wall in the middle."""
