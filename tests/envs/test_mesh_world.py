"""Worlds made of meshes: what they mean, and what is refused."""

from __future__ import annotations

import dataclasses
import logging
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_meshes import BAD
from conftest import has_data

import envs
from envs import InputError
from envs.files import mesh_file
from envs.files.mesh_file import read_mesh
from envs.scenes.mesh_world import MeshWorld

ROOM = (8.0, 6.0, 3.0)


def saved(mesh: trimesh.Trimesh, file: Path) -> str:
    mesh.export(file)
    return str(file)


@pytest.fixture
def ball(tmp_path: Path) -> str:
    """Of radius 2 about (5, 0, 0)."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=2).apply_translation((5, 0, 0))
    return saved(mesh, tmp_path / "ball.ply")


@pytest.fixture
def room(tmp_path: Path) -> str:
    """A box seen from within, with a pillar in its middle."""
    walls = trimesh.creation.box(ROOM)
    walls.invert()
    pillar = trimesh.creation.box((1.0, 1.0, 2.0)).apply_translation((0, 0, -0.5))
    return saved(trimesh.util.concatenate([walls, pillar]), tmp_path / "room.ply")


def test_a_solid_is_free_outside(ball: str) -> None:
    world = MeshWorld(ball)
    assert world.kind == "solid"
    assert world.transform.scale == pytest.approx(3)
    assert world.transform.to_world(np.array([5.0, 0, 0])) == pytest.approx([0, 0, 0], abs=1e-9)
    q = np.array([[0, 0, 0], [0, 0, 5.9], [0, 0, 6.5], [0, 8, 0]], dtype=float)
    clearance = world.clearance(q)
    assert clearance == pytest.approx([-6, -0.1, 0.5, 2], abs=0.04)
    model = world.collision_model()
    assert [model.is_valid(one) for one in q] == [False, False, True, True]
    assert model.clearance(q[0]) < 0
    assert model.clearance(q[3]) == pytest.approx(clearance[3])


def test_an_interior_is_free_inside(room: str) -> None:
    world = MeshWorld(room, robot_radius=0.2)
    assert world.kind == "interior"
    assert world.transform.scale == pytest.approx(20 / 8)
    there = world.transform.to_world
    q = there(np.array([[3.0, 2, 0], [0, 0, -0.5], [0, 0, 1.0], [3.0, 3.2, 0], [3.0, 2.9, 0]]))
    model = world.collision_model()
    valid = [True, False, True, False, False]
    assert [model.is_valid(one) for one in q] == valid
    assert (world.clearance(q) > 0).tolist() == valid
    assert world.clearance(q[:1])[0] == pytest.approx(2.5 * 0.8)
    outside = there(np.array([3.0, 4.0, 0]))
    assert not model.segment_is_free(q[0], outside)
    assert not model.is_valid(outside)


def test_a_shell_is_free_on_both_sides(ball: str) -> None:
    world = MeshWorld(ball, kind="shell")
    q = np.array([[0, 0, 0], [0, 0, 5.995], [0, 0, 7]], dtype=float)
    assert (world.clearance(q) > 0).tolist() == [True, False, True]
    assert not world.collision_model().segment_is_free(q[0], q[2])


@pytest.mark.slow
def test_a_mesh_with_holes_is_a_shell_unless_told_otherwise(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    box = trimesh.creation.box((4.0, 4.0, 4.0)).subdivide().subdivide()
    box.update_faces(box.triangles_center[:, 2] < 1.9)
    file = saved(box, tmp_path / "open.obj")
    assert MeshWorld(file).kind == "shell"
    with caplog.at_level(logging.INFO):
        solid = MeshWorld(file, kind="solid")
    assert "holes closed with" in caplog.text
    assert not solid.collision_model().is_valid(np.zeros(3))
    inside = MeshWorld(file, kind="interior")
    model = inside.collision_model()
    assert model.is_valid(np.zeros(3))
    assert not model.segment_is_free(np.zeros(3), np.array([0, 0, 10.0]))
    assert 0 < inside.clearance(np.array([[0, 0, 9.9]]))[0] < 0.2, "the lid is where the top was"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["solid", "interior", "shell"])
def test_problems_are_free_connected_and_repeatable(room: str, kind: str) -> None:
    world = MeshWorld(room, kind=kind, robot_radius=0.1)
    problems = world.sample_problems(20, 3)
    model = world.collision_model()
    for one, again in zip(problems, MeshWorld(room, kind, 0.1).sample_problems(5, 3), strict=False):
        assert (one.start == again.start).all()
    for one in problems:
        assert model.clearance(one.start) >= world.min_clearance - 1e-9
        assert model.clearance(one.goal) >= world.min_clearance - 1e-9
        assert np.linalg.norm(one.goal - one.start) >= world.min_separation


def test_fingerprints_follow_content_not_names(room: str, ball: str, tmp_path: Path) -> None:
    copy = tmp_path / "copy.ply"
    copy.write_bytes(Path(room).read_bytes())
    prints = {
        MeshWorld(room).fingerprint,
        MeshWorld(str(copy)).fingerprint,
        MeshWorld(room, robot_radius=0.1).fingerprint,
        MeshWorld(room, kind="shell").fingerprint,
        MeshWorld(room, scale=1.0).fingerprint,
        MeshWorld(ball).fingerprint,
    }
    assert len(prints) == 5


def test_the_fingerprint_covers_speeds_near_contact(room: str) -> None:
    world = MeshWorld(room)
    before = world.fingerprint
    world.speed_model = dataclasses.replace(world.speed_model, contact=0.03)
    assert world.fingerprint != before


def test_worlds_survive_pickling(room: str) -> None:
    world = MeshWorld(room)
    again = pickle.loads(pickle.dumps(world))
    q = np.random.default_rng(0).uniform(-10, 10, (100, 3))
    assert (again.clearance(q) == world.clearance(q)).all()


@pytest.mark.parametrize("ending", mesh_file.FORMATS)
def test_every_format_is_read(ending: str, tmp_path: Path) -> None:
    read = read_mesh(saved(trimesh.creation.box((1.0, 2.0, 3.0)), tmp_path / f"box{ending}"))
    assert len(read.vertices) == 8
    assert len(read.faces) == 12
    assert read.dropped == 0
    assert np.ptp(read.vertices, axis=0) == pytest.approx([1, 2, 3])


@pytest.mark.parametrize("whole, kind", [("ball", "solid"), ("room", "interior")])
def test_faces_that_are_turned_round_are_turned_back(
    whole: str, kind: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    right = request.getfixturevalue(whole)
    mesh = trimesh.load_mesh(right, process=False)
    rng = np.random.default_rng(0)
    turned = rng.random(len(mesh.faces)) < 0.3
    faces = np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces)
    wrong = saved(trimesh.Trimesh(mesh.vertices, faces, process=False), tmp_path / "wrong.ply")
    world = MeshWorld(wrong)
    assert world.kind == kind
    q = rng.uniform(-9, 9, (300, 3))
    assert world.clearance(q) == pytest.approx(MeshWorld(right).clearance(q))


def test_degenerate_faces_are_dropped_and_counted(tmp_path: Path) -> None:
    file = tmp_path / "some.obj"
    file.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 3\n")
    read = read_mesh(file)
    assert (len(read.faces), read.dropped) == (1, 2)


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, said = BAD[name]
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(InputError, match=said) as caught:
        MeshWorld(str(file))
    assert "\n" not in str(caught.value)
    assert name in str(caught.value)


def test_too_many_faces_are_refused(
    ball: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_file, "MOST_FACES", 1000)
    with pytest.raises(InputError, match="simplify it"):
        MeshWorld(ball)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("", "say which"),
        ("file=/no/such.ply", "no such file"),
        ("file=BALL,kind=soild", "did you mean 'solid'"),
        ("file=BALL,robot_radius=-1", "robot_radius must be between"),
        ("file=BALL,robot_radius=9", "robot_radius must be between"),
        ("file=BALL,scale=-1", "scale must be above 0"),
        ("file=BALL,scale=6", "scale must be above 0 and at most 5"),
        ("file=BALL,radius=1", "has no argument 'radius'"),
    ],
)
def test_bad_arguments_are_refused(arguments: str, said: str, ball: str) -> None:
    with pytest.raises(InputError, match=said):
        envs.make("mesh:" + arguments.replace("BALL", ball))


@pytest.mark.slow
def test_a_robot_too_large_for_its_world_is_said_so(room: str) -> None:
    with pytest.raises(InputError, match="too little room"):
        MeshWorld(room, robot_radius=1.4).sample_problems(1, 0)


ROOMS = ("office_small", "office_large", "meeting_room")


@pytest.mark.slow
@pytest.mark.parametrize("name", ROOMS)
def test_real_rooms(name: str) -> None:
    file = f"rooms/{name}_zup.ply"
    if not has_data(file):
        pytest.skip("BENCH_DATA has no rooms")
    world = MeshWorld(str(Path(os.environ["BENCH_DATA"]) / file), robot_radius=0.15)
    assert world.kind == "interior"
    q = np.random.default_rng(0).uniform(-10, 10, (500, 3))
    clearance = world.clearance(q)
    model = world.collision_model()
    assert [model.is_valid(one) for one in q] == (clearance > 0).tolist()
    free = clearance > 0
    assert 0.05 < free.mean() < 0.6
    exact = np.array([model.clearance(one) for one in q[free]])
    assert (exact <= clearance[free] + 1e-9).all()  # never above the truth, and hardly below
    assert exact == pytest.approx(clearance[free], rel=1e-6, abs=1e-6)
    assert len(world.sample_problems(10, 0)) == 10
