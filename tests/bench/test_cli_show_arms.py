"""`bench show` of arms: a panel a planner, and what is refused."""

from __future__ import annotations

from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from conftest import Cli, records_of

import envs
from bench.report import raster
from bench.report.postures import along
from envs.problem import Array
from envs.scenes.arm_world import ArmWorld
from envs.spaces import Coordinates, Space


def colours_in(file: Path) -> tuple[tuple[int, ...], int]:
    """The size of a picture in pixels, and how many colours there are in it."""
    pixels = np.round(255 * matplotlib.image.imread(file)[:, :, :3]).astype(int)
    return pixels.shape[:2], len(np.unique(pixels @ [1 << 16, 1 << 8, 1]))


def has_hue_of(file: Path, red: float, green: float, blue: float) -> bool:
    """Whether any pixel is just of a colour (0 to 1)."""
    pixels = matplotlib.image.imread(file)[:, :, :3]
    return bool((np.abs(pixels - [red, green, blue]).max(axis=2) < 0.01).any())


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_arms_are_drawn_along_the_paths(bench: Cli, faulty: list[str], tmp_path: Path) -> None:
    run = tmp_path / "run"
    code, _, err = bench(
        *("run", "--env", "arm4", "--planners", "rrtconnect,straight,not-a-number"),
        *("--problems", 2, "--stop", "first", "--out", run),
    )
    assert code == 0, err
    outcomes = records_of(run).groupby("planner")["outcome"].apply(set)
    assert outcomes["rrtconnect"] == {"VALID"}
    assert outcomes["not-a-number"] == {"MALFORMED"}

    show, paths = ("show", "--env", "arm4", "--out"), ("--paths", run)
    shapes = {}
    for name, more in (
        ("plain", ()),
        ("all", paths),
        ("nothing", (*paths, "--planners", "not-a-number", "--problem", 0)),
    ):
        file = tmp_path / f"{name}.png"
        assert bench(*show, file, *more) == (0, "", "")
        shapes[name], colours = colours_in(file)
        assert min(shapes[name]) > 300
        assert colours > 1000, "shaded solids, not blank"
    assert shapes["all"][1] > 2.5 * shapes["plain"][1], "three panels side by side"
    assert has_hue_of(tmp_path / "all.png", 0.839, 0.153, 0.157), "the trace in the planner's red"
    assert not has_hue_of(tmp_path / "nothing.png", 0.839, 0.153, 0.157)

    for more, said in (
        (("--planners", "fmt"), "no path"),
        (("--problem", 7), "no path for this environment's problem 7"),
    ):
        code, _, err = bench(*show, tmp_path / "x.png", *paths, *more)
        assert code == 2
        assert said in err
    code, _, err = bench(*show, tmp_path / "x.docx", *paths)
    assert code == 2
    assert "cannot write" in err
    assert not list(tmp_path.glob("x.*"))


@pytest.mark.slow
def test_a_users_arm_that_holds_a_tool_without_solids(bench: Cli, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(
        """<robot name="slider">
        <link name="base"/><link name="tool"/>
        <link name="cart"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
        <joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
          <origin xyz="0 0 0.3"/><axis xyz="1 0 0"/><limit lower="-0.5" upper="0.5"/></joint>
        <joint name="turn" type="revolute"><parent link="cart"/><child link="tool"/>
          <axis xyz="0 0 1"/><limit lower="-1" upper="1"/></joint></robot>"""
    )
    (tmp_path / "scene.yaml").write_text(
        "obstacles:\n  - box: [9, 9, 0.1]\n    position: [0, 0, -0.1]\n"
        "  - sphere: 0.1\n    position: [20, 0, 0]\n"
    )
    env = f"arm:urdf={tmp_path}/arm.urdf,scene={tmp_path}/scene.yaml"
    file = tmp_path / "arm.png"
    assert bench("show", "--env", env, "--out", file) == (0, "", "")
    (rows, columns), colours = colours_in(file)
    assert 0.3 < rows / columns < 1.7, "cut to what is about the arm"
    assert colours > 1000


def test_the_tip_and_where_it_goes() -> None:
    world = envs.make("arm6")
    assert isinstance(world, ArmWorld)
    q = np.random.default_rng(0).uniform(world.lower, world.upper, (5, 6))
    last = world.robot.tree.forward(q)[:, -1]
    tip = last[:, :3, 3] + 0.15 * last[:, :3, 2]
    assert world.robot.trace(q) == pytest.approx(tip[:, None])


def test_shares_of_a_path_are_of_its_length() -> None:
    plane = Space([Coordinates([0, 0], [5, 5])])
    corner = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 0.0], [3.0, 1.0]])
    expected = [[0, 0], [2, 0], [3, 0], [3, 1]]
    found = along(plane, corner, np.array([0, 0.5, 0.75, 1]))
    assert found == pytest.approx(np.array(expected))
    assert (along(plane, corner[:1], np.array([0, 0.5, 1])) == corner[0]).all()
    heading = Space([Coordinates([-np.pi], [np.pi], wraps=[True])])
    [[half]] = along(heading, np.array([[3.0], [-3.0]]), np.array([0.5]))
    assert abs(half) == pytest.approx(np.pi), "the short way"


def test_surfaces_that_cross_hide_each_other_where_they_are_nearer() -> None:
    def square(tilt: float) -> Array:
        """Over [0, 4] x [0, 4], nearer on the right if `tilt` is positive."""
        a, b, c, d = ([x, y, tilt * (x - 2)] for x, y in ((0, 0), (4, 0), (4, 4), (0, 4)))
        return np.array([[a, b, c], [a, c, d]])

    red, blue = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
    layers = [raster.Layer(square(1), red, 1.0), raster.Layer(square(-1), blue, 1.0)]
    picture = raster.paint(layers, np.array([-1.0, -1.0]), 0.05, (120, 120))
    assert (picture[60, 75] * [1, 0, 0]).max() > picture[60, 75, 2]
    assert picture[60, 45, 2] > picture[60, 45, 0]
    assert (picture[:15] == 1).all(), "white where there is nothing"
    see_through = [layers[1], raster.Layer(square(1), red, 0.5)]
    mixed = raster.paint(see_through, np.array([-1.0, -1.0]), 0.05, (120, 120))[60, 75]
    assert mixed[0] > 0.3
    assert mixed[2] > 0.3
    depth = raster.depths(square(1), np.array([-1.0, -1.0]), 0.05, (120, 120))
    assert depth[60, 80] == pytest.approx((80.5 * 0.05 - 3) / 0.05)
    assert depth[5, 5] == -np.inf
