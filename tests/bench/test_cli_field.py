"""`bench field`: the picture, the errors, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import Cli, Refused
from matplotlib.image import imread
from turning_cubes import Plane

import envs
from bench.report import field as fields
from bench.report.field import Field, Slice
from envs import Environment, InputError
from envs.spaces import Coordinates, Part, Rotations, Space


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(fields, "PER_AXIS", 40)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("MPLCONFIGDIR", str(tmp_path / "mpl"))


@pytest.mark.slow
def test_it_draws_a_column_a_planner_and_prints_the_errors(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "f.png"
    code, out, err = bench("field", "--env", "c3d", "--planners", "ntfields,fmm", "--out", file)
    assert code == 0, err
    height, width, _ = imread(file).shape
    assert width > 1.5 * height
    header, _, *rows = out.strip().splitlines()
    assert "T error median" in header
    assert "T error 90th percentile" in header
    found = {
        name.strip(): (float(median), float(high))
        for name, median, high in (row.strip("|").split("|") for row in rows)
    }
    assert list(found) == ["ntfields", "fmm"]
    assert found["fmm"] == (0, 0)
    assert 0 < found["ntfields"][0] < 0.04
    assert found["ntfields"][1] < 0.10


@pytest.mark.slow
def test_fast_marching_is_the_reference_even_if_it_is_not_drawn(bench: Cli, tmp_path: Path) -> None:
    source = ("--source=-9,-9,5",)
    chosen = ("field", "--env", "c3d", "--planners", "ntfields", "--out", tmp_path / "f.png")
    code, out, _ = bench(*chosen, *source)
    assert code == 0
    [row] = out.strip().splitlines()[2:]
    assert 0 < float(row.strip("|").split("|")[1]) < 0.05


def test_errors_are_relative_and_over_free_space(c3d: Environment) -> None:
    where = Slice.through(c3d)
    distance = np.linalg.norm(where.q - where.source, axis=1)
    reference = Field(distance, np.ones_like(distance))
    wrong = np.where(where.free, 1.1 * distance, 1e9)
    table = fields.errors({"p": Field(wrong, wrong)}, reference, where)
    assert table.loc[0, "T error median"] == pytest.approx(0.1)
    assert table.loc[0, "T error 90th percentile"] == pytest.approx(0.1)


def test_the_slice_goes_through_its_source_and_many_obstacles(c3d: Environment) -> None:
    where = Slice.through(c3d)
    assert c3d.clearance(where.source[None])[0] >= 0.5
    assert (where.q[:, 2] == where.source[2]).all()
    assert len(where.q) == len(where.axes[0]) * len(where.axes[1]) == 40 * 40
    assert (~where.free).mean() > 0.1
    corner = np.full(3, -9.0)
    assert (Slice.through(c3d, corner).source == corner).all()


def test_the_slice_of_a_room_is_where_there_is_most_room(tmp_path: Path) -> None:
    room = trimesh.creation.box((8.0, 6.0, 3.0))
    room.invert()
    table = trimesh.creation.box((7.0, 5.0, 0.8)).apply_translation((0.0, 0.0, -1.0))
    trimesh.util.concatenate([room, table]).export(tmp_path / "room.ply")
    where = Slice.through(envs.make(f"mesh:file={tmp_path / 'room.ply'},kind=interior"))
    height = where.source[2] * 8 / 20
    assert -0.6 + 0.3 < height < 1.5 - 0.3, "well above the table and below the ceiling"
    assert where.free.mean() > 0.9


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--planners", "rrtstar"), "rrtstar has no time field"),
        (("--planners", "ntfield"), "did you mean 'ntfields'"),
        (("--source", "1,2"), "3 finite numbers"),
        (("--source", "1,nan,2"), "3 finite numbers"),
        (("--source", "a,b,c"), "not numbers"),
        (("--source", "11,0,0"), "out of bounds"),
        (("--planners", "ntfields-nosym", "--no-train"), "--no-train was given"),
        (("--device", "gpu"), "no device is called"),
    ],
)
def test_mistakes(arguments: tuple[object, ...], said: str, refused: Refused) -> None:
    assert said in refused("field", "--env", "c3d", "--out", "f.png", *arguments)


def test_a_source_in_an_obstacle_is_refused(bench: Cli, tmp_path: Path, c3d: Environment) -> None:
    inside = ",".join(f"{x:.3f}" for x in c3d.obstacles[0].center)
    code, _, err = bench(
        *("field", "--env", "c3d", "--planners", "fmm", "--out", tmp_path / "f.png"),
        f"--source={inside}",
    )
    assert code == 2
    assert "is in collision" in err


@pytest.mark.slow
def test_a_file_that_is_no_image_is_refused(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "f.xyz"
    code, _, err = bench("field", "--env", "c3d", "--planners", "fmm", "--out", file)
    assert code == 2
    assert "cannot write" in err


@pytest.mark.parametrize(
    "parts", [[Coordinates([-4] * 3, [4] * 3), Rotations()], [Coordinates([-1], [1])]]
)
def test_what_has_no_two_coordinates_has_no_slice(parts: list[Part]) -> None:
    class Other(Plane):
        space = Space(parts)

    with pytest.raises(InputError, match="the plane of the first two coordinates"):
        Slice.through(Other())


def test_distances_are_the_spaces() -> None:
    where = Slice.through(Plane(), np.array([-3.0, -3.0, 3.0]))
    assert where.distances[0] == pytest.approx(np.hypot(1, 1)), "from the lower corner"
    assert (where.q[:, 2] == 3.0).all()
