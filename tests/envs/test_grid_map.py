"""Point robots, discs and balls in occupancy grids."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from map_files import (
    ROOMS,
    occupied,
    octile_distance,
    scenarios,
    voxel_text,
    voxels,
    write_image,
    write_octile,
    write_ros,
)
from scipy import ndimage

import envs
from envs import InputError, Problem
from envs.collision.shapes import Sphere
from envs.scenes import cell_world
from envs.scenes.grid_map import GridMap
from envs.seeding import training_seed


def made(text: str) -> GridMap:
    env = envs.make(f"grid:{text}")
    assert isinstance(env, GridMap)
    return env


@pytest.fixture
def ros(tmp_path: Path) -> Path:
    return write_ros(tmp_path)


@pytest.fixture
def cubes(tmp_path: Path) -> Path:
    np.save(tmp_path / "cubes.npy", voxels())
    return tmp_path / "cubes.npy"


def test_a_map_lies_where_its_file_says(ros: Path) -> None:
    """Cells are a tenth of a metre, and the lower left corner is at (-1, 2)."""
    env = made(f"file={ros},radius=0.02")
    assert env.lower == pytest.approx([-1 + 0.02, 2 + 0.02])
    assert env.upper == pytest.approx([-1 + 2.0 - 0.02, 2 + 1.3 - 0.02])
    assert env.dimension == env.space.size == 2
    assert env.is_point_robot
    assert env.units["workspace"] == "m"
    # The middle of the room at the upper left, 4 cells wide to either side.
    found = env.clearance(np.array([[-1 + 0.5, 2 + 0.95], [-1 + 0.05, 2 + 0.05]]))
    assert found == pytest.approx([0.25 - 0.02, -0.05 * np.sqrt(2) - 0.02])


def test_other_files_have_their_corner_at_the_origin(tmp_path: Path) -> None:
    image = made(f"file={write_image(tmp_path / 'map.png')}")
    assert (image.lower.tolist(), image.upper.tolist()) == ([0, 0], pytest.approx([1, 0.65]))
    assert made(f"file={tmp_path / 'map.png'},resolution=2").upper.tolist() == [40, 26]
    game = made(f"file={write_octile(tmp_path)}")
    assert game.upper.tolist() == [20, 13]
    assert game.units == {"configuration": "cells", "workspace": "cells"}
    assert made(f"file={write_octile(tmp_path)},resolution=0.5").units["workspace"] == "m"


def test_checks_and_clearances_agree(ros: Path, cubes: Path) -> None:
    for entry in (f"file={ros},radius=0.03", f"file={ros}", f"file={cubes},radius=0.01"):
        env = made(entry)
        q = env.space.sample(np.random.default_rng(0), 400)
        model, clearances = env.collision_model(), env.clearance(q)
        assert [model.is_valid(one) for one in q] == (clearances > 0).tolist()
        free = clearances > 0
        exact = [model.clearance(one) for one in q[free]]
        assert exact == pytest.approx(clearances[free], abs=1e-9)
        assert 0.1 < free.mean() < 0.95


def test_nothing_passes_where_cells_meet_at_a_corner(tmp_path: Path) -> None:
    file = write_image(tmp_path / "map.pgm", ".#\n#.")
    env = made(f"file={file},resolution=1")
    a, b = np.array([0.5, 1.5]), np.array([1.5, 0.5])
    model = env.collision_model(1e-9)
    assert not model.segment_is_free(a, b)
    assert model.min_clearance(np.array([a, b])) <= 1e-9
    assert not env.paths_are_free([np.array([a, b])], 1e-9)[0]
    problems = env.sample_problems(50, 0)
    assert all((p.start[0] < 1) == (p.goal[0] < 1) for p in problems)


def test_a_disc_passes_a_door_that_is_wider(ros: Path) -> None:
    """The door in the wall between the upper rooms is a cell wide, of 0.1 m."""
    door = np.array([[-1 + 0.5, 2 + 0.85], [-1 + 1.25, 2 + 0.85]])
    for radius, expected in ((0.0, True), (0.045, True), (0.0499, False), (0.06, False)):
        env = made(f"file={ros},radius={radius}")
        assert env.collision_model().segment_is_free(*door) is expected
        assert env.paths_are_free([door], env.tolerance)[0] == expected


def test_problems_are_connected_on_the_map(ros: Path, cubes: Path) -> None:
    """By neighbours along the axes, in cells; the upper left of the map is cut off with a point."""
    for file, cells, side in ((ros, occupied(), 0.1), (cubes, voxels(), 0.05)):
        env = made(f"file={file}")
        labels, _ = ndimage.label(~cells)
        origin = env.lower
        problems = env.sample_problems(40, 3)
        ends = np.array([[p.start, p.goal] for p in problems])
        places = np.floor((ends - origin) / side).astype(int)
        found = labels[tuple(np.moveaxis(places, -1, 0))]
        assert (found > 0).all()
        assert (found[:, 0] == found[:, 1]).all()
        assert (env.clearance(ends.reshape(-1, cells.ndim)) >= env.min_clearance).all()
        assert (np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) >= env.min_separation).all()


def test_rooms_without_a_door_have_no_problem_between_them(tmp_path: Path) -> None:
    closed = "\n".join(["##########", *["#...#....#"] * 5, "##########"])
    env = made(f"file={write_image(tmp_path / 'map.pgm', closed)},resolution=1")
    for problem in env.sample_problems(60, 0):
        assert (problem.start[0] < 4) == (problem.goal[0] < 4)


def test_a_door_that_a_disc_does_not_pass_parts_rooms(tmp_path: Path) -> None:
    rooms = "\n".join(
        ["##########", *["#...#....#"] * 3, "#........#", *["#...#....#"] * 3, "#" * 10]
    )
    file = write_image(tmp_path / "map.pgm", rooms)
    for radius, crossing in ((0.0, True), (0.2, True), (0.6, False)):
        problems = made(f"file={file},resolution=1,radius={radius}").sample_problems(60, 0)
        assert any((p.start[0] < 4) != (p.goal[0] < 4) for p in problems) is crossing


@pytest.fixture
def game(tmp_path: Path) -> tuple[Path, Path]:
    """A map of Moving AI with problems, of known optimal lengths."""
    free = ~occupied()
    ends = [(1, 11, 18, 1), (3, 3, 3, 9), (1, 1, 18, 7), (10, 5, 12, 5)]
    lines = [
        f"{x} {y} {u} {v} {octile_distance(free, (x, 12 - y), (u, 12 - v)):.8f}"
        for x, y, u, v in ends
    ]
    (tmp_path / "rooms.map.scen").write_text(scenarios(*lines))
    return write_octile(tmp_path), tmp_path / "rooms.map.scen"


def test_problems_of_files_are_as_they_say(game: tuple[Path, Path]) -> None:
    env = made(f"file={game[0]},scen={game[1]}")
    problems = env.sample_problems(4, 0)
    assert problems[0].start.tolist() == [1.5, 1.5]
    assert problems[0].goal.tolist() == [18.5, 11.5]
    assert [p.index for p in problems] == [0, 1, 2, 3]
    assert env.known_length(problems[3]) == pytest.approx(2)
    assert env.sample_problems(2, 7)[1].start.tolist() == problems[1].start.tolist()
    with pytest.raises(InputError, match="has 4 problems, not 5"):
        env.sample_problems(5, 0)


def test_known_lengths_are_of_the_problems_of_the_file(game: tuple[Path, Path]) -> None:
    env = made(f"file={game[0]},scen={game[1]},resolution=0.5")
    [first] = env.sample_problems(1, 0)
    whole = env.known_length(first)
    assert whole == pytest.approx(0.5 * octile_distance(~occupied(), (1, 1), (18, 11)), abs=1e-6)
    assert env.known_length(Problem(first.start, first.goal + 0.1, 0)) is None
    assert env.known_length(Problem(first.start, first.goal, 99)) is None
    others = env.sample_problems(3, training_seed("maps", 0))
    assert all(env.known_length(problem) is None for problem in others)
    assert made(f"file={game[0]}").known_length(first) is None


def test_a_robot_for_which_an_end_has_no_room_is_refused(game: tuple[Path, Path]) -> None:
    assert made(f"file={game[0]},scen={game[1]},radius=0.4").min_clearance == pytest.approx(0.1)
    with pytest.raises(InputError, match="line 2: its start or goal leaves no room"):
        made(f"file={game[0]},scen={game[1]},radius=0.5")
    game[1].write_text(scenarios("0 0 1 1 2"))
    with pytest.raises(InputError, match="line 2: its start or goal leaves no room"):
        made(f"file={game[0]},scen={game[1]}")


def test_voxels_with_problems(tmp_path: Path) -> None:
    (tmp_path / "own.3dmap").write_text(voxel_text(voxels()))
    length = octile_distance(~voxels(), (0, 0, 0), (11, 9, 7))
    text = f"version 1\nown.3dmap\n0 0 0 11 9 7 {length} 1.1\n"
    (tmp_path / "own.3dmap.3dscen").write_text(text)
    env = made(f"file={tmp_path / 'own.3dmap'},scen={tmp_path / 'own.3dmap.3dscen'}")
    [problem] = env.sample_problems(1, 0)
    assert problem.goal.tolist() == [11.5, 9.5, 7.5]
    assert env.known_length(problem) == pytest.approx(length)


def test_what_defines_a_map(ros: Path, game: tuple[Path, Path]) -> None:
    texts = [f"file={ros}", f"file={ros},radius=0.02", f"file={game[0]}"]
    texts += [f"file={game[0]},scen={game[1]}", f"file={game[0]},resolution=0.05"]
    assert len({made(text).fingerprint for text in texts}) == len(texts)
    before = made(texts[0]).fingerprint
    write_image(ros.parent / "map.pgm", ROOMS.replace("##...#", "#....#", 1))
    assert made(texts[0]).fingerprint != before


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "say which map, as in grid:file=map.yaml"),
        ("file={},radius=-1", "radius must be from 0"),
        ("file={},radius=0.65", "less than half of the map's shortest side, 0.65, not 0.65"),
        ("file={},resolution=0.1", "says its resolution itself, 0.1"),
        ("file={},unknown=maybe", "unknown must be 'occupied' or 'free'"),
        ("file={},scen={}", "problems are a .scen"),
        ("file={},robot_radius=1", "did you mean 'radius'"),
    ],
)
def test_bad_arguments_are_refused(ros: Path, arguments: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        envs.make(f"grid:{arguments.replace('{}', str(ros))}")


def test_a_resolution_is_a_length(tmp_path: Path) -> None:
    file = write_image(tmp_path / "map.png")
    for bad in ("-1", "nan", "1e9", "1e-5"):
        with pytest.raises(InputError, match="resolution"):
            made(f"file={file},resolution={bad}")


def test_a_ragged_map_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cell_world, "_MOST_BOXES", 5)
    with pytest.raises(InputError, match=r"too ragged: it takes .* boxes .* more than 5"):
        made(f"file={write_image(tmp_path / 'map.png')}")


def test_a_map_by_itself_is_told_how_to_name_it(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"grid:file=my\.pgm"):
        envs.make("my.pgm")


def test_obstacles_go_by_where_their_cells_are(ros: Path) -> None:
    env = made(f"file={ros}")
    assert len(env.obstacle_names) == len(env.obstacles)
    assert "occupied cells about (-0.95, 2.7)" in env.obstacle_names  # the wall to the left


@pytest.mark.slow
def test_bodies_turn_among_cubes_and_not_in_the_plane(ros: Path, cubes: Path) -> None:
    body = envs.make(f"rigid:body=box,size=0.1,world=grid,file={cubes}")
    [problem] = body.sample_problems(1, 0)
    assert np.linalg.norm(problem.goal[:3] - problem.start[:3]) >= 0.6 / 5
    with pytest.raises(InputError, match="world=grid is a plane"):
        envs.make(f"rigid:body=box,size=0.1,world=grid,file={ros}")


def test_a_point_has_no_surface() -> None:
    assert Sphere(0.0).triangulate().triangles.shape == (0, 3, 3)
