"""What pictures show of arms whose files have visual geometry."""

from __future__ import annotations

import logging
from pathlib import Path

import mbm_files as made
import numpy as np
import pytest
import trimesh
from conftest import Cli

import envs
from bench.report.postures import RobotShape
from envs.collision.shapes import Box, Mesh, Sphere
from envs.environment import Environment
from envs.errors import tell_once

VISUAL = '<visual><origin xyz="0.2 0 0"/><geometry><mesh filename="{}"/></geometry></visual>'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With a robot whose upper link has a visual mesh that is there, and open; whose lower one has
    one that is not; whose finger is drawn as a ball."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCH_DATA", str(tmp_path / "data"))
    tell_once.cache_clear()
    folder = tmp_path / "data" / "mbm" / "panda"
    wall = made.box("wall", made.pose(-0.6, 0), 0.1, 0.4, 1)
    made.write(folder, {"box_panda": [(made.scene(wall), made.request([0, 0], [1, 1]))]})
    sheet = trimesh.Trimesh(
        [[0, 0, 0], [0.3, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], [[0, 1, 2], [0, 2, 3]]
    )
    sheet.export(folder / "upper.stl")
    ball = '<visual><geometry><sphere radius="0.05"/></geometry></visual>'
    text = made.URDF
    for name, visual in (
        ("base", ball),
        ("upper", VISUAL.format("upper.stl")),
        ("lower", VISUAL.format("lower.stl")),
        ("finger", ball),
    ):
        text = text.replace(f'<link name="{name}"/>', f'<link name="{name}">{visual}</link>')
        text = text.replace(f'<link name="{name}"><', f'<link name="{name}">{visual}<', 1)
    (folder / "panda.urdf").write_text(text.replace(f"{ball}{ball}", ball))
    return folder


def make() -> Environment:
    return envs.make("mbm:robot=panda,set=box,scene=1")


@pytest.mark.usefixtures("folder")
def test_visual_meshes_are_shown_where_they_are(caplog: pytest.LogCaptureFixture) -> None:
    env = make()
    drawn = env.drawn_robot
    with caplog.at_level(logging.INFO):
        upper, lower, finger, base = drawn.shapes
    assert isinstance(upper, Mesh)
    assert len(upper.faces) == 2
    assert isinstance(lower, Box)
    assert (finger, base) == (Sphere(0.05), Sphere(0.05))
    assert drawn.moving == 3
    [line] = [one.message for one in caplog.records if "pictures show" in one.message]
    assert line.endswith("pictures show collision geometry where visual meshes are not: 'lower'")
    assert not any(isinstance(shape, Mesh) for shape in env.robot.shapes), "checks are as they were"


@pytest.mark.usefixtures("folder")
def test_shapes_are_where_the_links_are() -> None:
    env = make()
    q = np.array([np.pi / 2, 0.5])
    poses, collide = env.drawn_robot.poses(q), env.robot.poses(q)
    assert poses.shape == (4, 3, 4)
    assert poses[0, :, 3] == pytest.approx([0, 0.2, 0]), "its origin is its own"
    lower, finger = (env.robot.links.index(name) for name in ("lower", "finger"))
    assert poses[1] == pytest.approx(collide[lower])
    assert poses[2] == pytest.approx(collide[finger])
    assert poses[3] == pytest.approx(np.eye(3, 4))


@pytest.mark.usefixtures("folder")
def test_problems_scenes_and_sets_are_drawn_so_and_others_as_they_collide() -> None:
    env = envs.make("mbm:robot=panda,set=box")
    [problem] = env.sample_problems(1, 0)
    assert len(env.scene_of(problem).drawn_robot.shapes) == 4
    assert len(env.drawn_robot.shapes) == 4
    shipped = envs.make("arm4")
    assert shipped.drawn_robot is shipped.robot
    shape = RobotShape(env, env.drawn_robot)
    assert [len(link) for link in shape.links[:2]] == [2, 12]


@pytest.mark.usefixtures("folder")
def test_a_mesh_that_cannot_be_read_is_not_shown(folder: Path) -> None:
    (folder / "upper.stl").write_bytes(b"solid a\nfacet")
    upper, *_ = make().drawn_robot.shapes
    assert isinstance(upper, Box)


@pytest.mark.slow
def test_pictures_show_them(folder: Path, bench: Cli, tmp_path: Path) -> None:
    show = ("show", "--env", "mbm:robot=panda,set=box,scene=1", "--out")
    assert bench(*show, tmp_path / "with.png")[0] == 0
    (folder / "upper.stl").unlink()
    assert bench(*show, tmp_path / "without.png")[0] == 0
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "without.png").read_bytes()
