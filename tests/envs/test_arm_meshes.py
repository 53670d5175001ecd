"""Arms with meshes for links and among meshes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from arms import (
    arm_of,
    ball,
    fcl_only,
    sliding,
)
from bad_urdfs import LIMIT, collision, joint, link, robot

import envs
from envs import Environment
from envs.collision.mesh import Containment
from envs.collision.shapes import Box


def written(folder: Path, urdf: str, *obstacles: str) -> Environment:
    """The world of a URDF and of obstacles as in a scene file."""
    trimesh.creation.box((0.4, 0.4, 0.4)).export(folder / "block.stl")
    trimesh.creation.icosphere(subdivisions=2, radius=0.2).export(folder / "ball.ply")
    (folder / "arm.urdf").write_text(urdf)
    (folder / "scene.yaml").write_text(f"obstacles: [{', '.join(obstacles)}]")
    return envs.make(
        f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'},self_collision=false"
    )


def slider(shape: str) -> str:
    """Its hand slides along x, from 0 to 2."""
    hand = link("hand", collision(shape))
    limit = '<limit lower="0" upper="2"/>'
    return robot(link("base", ""), hand, joint("j", "base", "hand", "prismatic", limit, "1 0 0"))


SMALL, HOLLOW = '<sphere radius="0.05"/>', '<mesh filename="ball.ply"/>'


@pytest.mark.parametrize(
    ("hand", "obstacle"),
    [
        (SMALL, "{mesh: block.stl, position: [1, 0, 0]}"),
        (HOLLOW, "{sphere: 0.05, position: [1, 0, 0]}"),
        (HOLLOW, "{mesh: ball.ply, scale: 0.1, position: [1, 0, 0]}"),
        (HOLLOW, "{box: [1, 1, 1], position: [1, 0, 0]}"),
        (HOLLOW, "{mesh: block.stl, scale: 2, position: [1, 0, 0]}"),
    ],
)
def test_one_solid_within_another_is_a_collision(hand: str, obstacle: str, tmp_path: Path) -> None:
    world = written(tmp_path, slider(hand), obstacle)
    beside, within = np.array([0.05]), np.array([1.0])
    for model in (world.collision_model(), fcl_only(world)):
        assert model.is_valid(beside)
        assert model.clearance(beside) > 0.1
        assert not model.is_valid(within)
        assert model.clearance(within) < 0
        assert not model.segment_is_free(within, within + 1e-3)
        assert not model.segment_is_free(beside, within)
        assert model.min_clearance(np.array([within, within + 1e-3])) < 0
    assert (world.clearance(np.array([beside, within])) > 0).tolist() == [True, False]


def test_only_meshes_have_an_inside_of_their_own() -> None:
    arm = arm_of([sliding("x")], ball(1, 0.05, 0))
    assert not Containment(arm, [Box(np.zeros(3), np.ones(3))]).possible
    assert envs.make("arm4").allowed is None


def test_a_piece_of_a_mesh_of_many_is_found_within(tmp_path: Path) -> None:
    """Two small cubes in one file, the second of them within the block."""
    pair = [trimesh.creation.box((0.02,) * 3).apply_translation((x, 0, 0)) for x in (0, 0.3)]
    trimesh.util.concatenate(pair).export(tmp_path / "pair.ply")
    block = "{mesh: block.stl, position: [1.3, 0, 0]}"
    world = written(tmp_path, slider('<mesh filename="pair.ply"/>'), block)
    model = world.collision_model()
    assert not model.is_valid(np.array([1.0]))
    assert model.is_valid(np.array([0.6]))


def test_clearances_to_meshes_are_lower_bounds_by_little(tmp_path: Path) -> None:
    block = "{mesh: block.stl, position: [0.7, 0, 0], rpy: [0.3, 0.4, 0.5]}"
    world = written(tmp_path, slider(SMALL), block)
    q = np.linspace(0, 0.4, 50)[:, None]
    exact, rough = world.clearance(q), world.approximate_clearance(q)
    short = (exact - rough)[exact > 0]
    assert len(short) > 30
    assert (short >= 0).all()
    assert short.max() < 2 * math.sqrt(3) * 0.02 * 2 * (1 + 2 * 0.125)


def test_a_ball_that_touches_a_mesh_has_no_clearance(tmp_path: Path) -> None:
    block = "{mesh: block.stl, position: [0.7, 0, 0], rpy: [0.3, 0.4, 0.5]}"
    world = written(tmp_path, slider(SMALL), block)
    model = fcl_only(world)
    q = np.linspace(0.3, 1.1, 200)[:, None]
    touching = [one for one in q if not model.is_valid(one)]
    assert len(touching) > 100
    assert max(model.clearance(one) for one in touching) <= 0


@pytest.mark.parametrize("kind", ["slide", "mast"])
def test_meshes_are_seen_wherever_an_arm_can_reach(kind: str, tmp_path: Path) -> None:
    mesh = "{mesh: block.stl, position: [POSITION]}"
    if kind == "slide":
        limit = '<limit lower="0" upper="4"/>'
        hand = link("hand", collision(SMALL))
        one = joint("j", "base", "hand", "prismatic", limit, "1 0 0")
        text, mesh = robot(link("base", ""), hand, one), mesh.replace("POSITION", "3, 0, 0")
    else:
        up = '<origin xyz="0 0 2"/>' + LIMIT
        hand = link("hand", collision(SMALL, '<origin xyz="0.3 0 0"/>'))
        mast = link("mast", "")
        turns = joint("turn", "base", "mast", axis="0 0 1")
        nods = joint("nod", "mast", "hand", inside=up, axis="0 0 1")
        text = robot(link("base", ""), mast, hand, turns, nods)
        mesh = mesh.replace("POSITION", "0.53, 0, 2")
    world = written(tmp_path, text, mesh)
    touching = np.array([[2.76]]) if kind == "slide" else np.zeros((1, 2))
    assert not fcl_only(world).is_valid(touching[0])
    assert world.approximate_clearance(touching)[0] <= 0
    assert not world.collision_model().is_valid(touching[0])


def test_no_path_begins_with_an_obstacle_within_a_link(tmp_path: Path) -> None:
    world = written(tmp_path, slider(HOLLOW), "{sphere: 0.02, position: [1, 0, 0]}")
    path = np.array([[1.0], [1.01]])
    assert not world.paths_are_free([path], 1e-3)[0]
