"""A robot, a shape and an environment of somebody's own package are drawn as ours are."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import trimesh
import turning_cubes
from conftest import Cli
from html_reports import ACROSS, run_in_cubes, unpacked

import envs
from bench.analysis.run_results import RunResults
from bench.paper.experiment import Place
from bench.paper.figures import Paths
from bench.report.chosen_paths import Shown
from bench.report.html.geometry import POSTURES, Scene
from bench.report.html.page import text
from bench.report.html.problems import columns, problem_sets_of, problems_data
from bench.report.postures import RobotShape, free_posture, triangles_of
from bench.report.projection import seen_when_cut_open
from bench.report.scene import draw
from envs import Environment, Spec
from envs.collision.fcl_model import Allowed
from envs.collision.shapes import Mesh
from envs.problem import Array

PI = np.pi


@pytest.fixture
def cubes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Environment]:
    """That of a module that is there for the length of a test."""
    site = tmp_path / "site"
    site.mkdir()
    shutil.copy(turning_cubes.__file__, site / "cubes.py")
    monkeypatch.syspath_prepend(site)
    envs.REGISTRY.register(Spec("cubes", "cubes:Plane", "two cubes that turn in a plane"))
    yield envs.make("cubes")
    envs.REGISTRY.unregister("cubes")
    del sys.modules["cubes"]


def corners(side: float, middle: Array, turn: float) -> Array:
    """Of a cube, (8, 3), sorted."""
    ends = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), axis=-1).reshape(-1, 3) * side / 2
    cos, sin = np.cos(turn), np.sin(turn)
    placed = ends @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]]) + middle
    return in_order(placed)


def in_order(points: Array) -> Array:
    whole = np.unique(points.reshape(-1, 3).round(2), axis=0)
    return whole[np.lexsort(whole.T)]


def blue_pixels(file: Path) -> int:
    """How many pixels are of the colour of a robot that is drawn by itself, or of a start."""
    red, _, blue = matplotlib.image.imread(file)[:, :, :3].transpose(2, 0, 1)
    return int((blue - red > 0.15).sum())


@pytest.mark.slow
def test_show_draws_it(cubes: Environment, bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "cubes.png"
    assert bench("show", "--env", "cubes", "--out", file) == (0, "", "")
    assert blue_pixels(file) > 2000


def test_a_figure_draws_a_panel_a_planner(cubes: Environment, tmp_path: Path) -> None:
    @dataclass(frozen=True)
    class Measured(Place):
        def measured(self, name: str) -> RunResults:
            return run_in_cubes(cubes)

    names = ("good", "odd")
    figure = Paths(
        name="paths", order=1, title="t", where="w", of="all", env="cubes", planners=names
    )
    section = figure.carried_out(Measured(tmp_path, tmp_path, quick=True))
    assert section.picture is not None
    assert blue_pixels(section.picture) > 2000
    height, width, _ = matplotlib.image.imread(section.picture).shape
    assert width > 1.2 * height, "panels side by side"


def test_its_surface_is_where_its_poses_put_it(cubes: Environment) -> None:
    shape = RobotShape(cubes, cubes.robot)
    q = np.array([1.0, 2.0, PI / 6])
    left, right = cubes.robot.trace(q[None])[0]
    both = np.concatenate([corners(0.6, left, PI / 6), corners(0.4, right, PI / 6)])
    assert in_order(shape.triangles(q)) == pytest.approx(in_order(both))
    assert in_order(shape.still) == pytest.approx(corners(1.0, np.array([0, 0, 2.0]), 0.0))
    lower, upper = shape.bounds
    assert (lower < -4.5).any()
    assert upper[2] == 2.5
    assert cubes.clearance(free_posture(cubes)[None])[0] > 0


def test_the_report_shows_it(cubes: Environment) -> None:
    run = run_in_cubes(cubes)
    [problem_set] = problem_sets_of(run)
    data = problems_data(problem_set, columns(run))
    scene, [good, odd] = data["scene"], data["problems"][0]["attempts"]
    [bad] = data["problems"][1]["attempts"]
    assert [link["many"] for link in scene["links"]] == [12, 12]
    assert [mesh["many"] for mesh in scene["meshes"]] == [12, 12], "the obstacle, and what is still"
    assert scene["followed"] == "middles of the cubes"
    assert "drawn" not in odd
    poses = unpacked(good["drawn"]["postures"], POSTURES, 2, 3, 4)
    for posture, q in ((0, ACROSS[0]), (POSTURES // 2, np.array([0, 0, PI])), (-1, ACROSS[1])):
        for link, side, pose, middle in zip(
            scene["links"], (0.6, 0.4), poses[posture], cubes.robot.trace(q[None])[0], strict=True
        ):
            placed = unpacked(link["vertices"], -1, 3) @ pose[:, :3].T + pose[:, 3]
            for corner in corners(side, middle, q[2]):
                assert np.linalg.norm(placed - corner, axis=1).min() < 0.02
    ends = cubes.robot.trace(ACROSS)
    assert np.allclose(data["problems"][0]["start"], ends[0])
    assert np.allclose(data["problems"][0]["goal"], ends[1])
    for number, curve in enumerate(good["drawn"]["curves"]):
        assert np.allclose(unpacked(curve, -1, 3)[[0, -1]], ends[:, number], atol=0.02)
    assert len(bad["contact"]["drawn"]["curves"]) == 2
    assert 0 < bad["contact"]["share"] < 0.5
    assert "The scene cannot be shown" not in text(run)


class Indoors(turning_cubes.Plane):
    """In a hall, whose mesh is seen from within."""

    def __init__(self) -> None:
        super().__init__()
        hall = trimesh.creation.box((12.0, 12.0, 3.0))
        self.obstacles = [Mesh(hall.vertices, hall.faces[:, ::-1])]  # type: ignore[list-item]

    @property
    def rooms(self) -> Allowed:
        return lambda points: (np.abs(points) < [6.0, 6.0, 1.5]).all(axis=1)


def test_buildings_about_it_are_cut_open(tmp_path: Path) -> None:
    world = Indoors()
    faces = triangles_of(world.obstacles)
    seen = faces[seen_when_cut_open(world.rooms, faces, np.inf)]
    assert len(seen) == 6, "the floor, and two of the walls"
    assert (seen.mean(axis=1)[:, 2] < 1.4).all()
    data = Scene(world).data()
    assert data["enclosed"]
    assert data["meshes"][0]["many"] == 10, "without the ceiling"
    draw(world, "hall", Shown(0, {"p": ACROSS}, frozenset()), tmp_path / "hall.png")
    assert blue_pixels(tmp_path / "hall.png") > 500
    pixels = matplotlib.image.imread(tmp_path / "hall.png")[:, :, :3]
    floor = (np.ptp(pixels, axis=2) < 0.1) & (pixels.max(axis=2) < 0.9)
    assert floor.mean() > 0.2, "seen whole, and not through"
