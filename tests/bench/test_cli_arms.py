"""`bench run` and `bench show` of users' arms: that of docs/, and one whose links are meshes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_urdfs import LIMIT, collision, joint, link, robot
from conftest import Cli, records_of
from documents import blocks

import envs


def readmes(folder: Path) -> str:
    (folder / "my_arm.urdf").write_text(blocks("xml")[0], encoding="utf-8")
    (folder / "my_scene.yaml").write_text(blocks("yaml")[0], encoding="utf-8")
    trimesh.creation.box((200, 50, 300)).export(folder / "shelf.ply")
    return f"arm:urdf={folder / 'my_arm.urdf'},scene={folder / 'my_scene.yaml'}"


def of_meshes(folder: Path) -> str:
    """Three joints; links of three kinds of mesh file, one with a scale, among mesh and box."""
    meshes = folder / "meshes"
    meshes.mkdir()
    trimesh.creation.cylinder(radius=0.05, height=0.4, sections=24).export(meshes / "upper.stl")
    trimesh.creation.box((300, 60, 60)).export(meshes / "fore.obj")  # in millimetres
    trimesh.creation.icosphere(subdivisions=2, radius=0.05).export(meshes / "hand.ply")
    trimesh.creation.torus(major_radius=0.15, minor_radius=0.03).export(folder / "ring.ply")
    upper = collision('<mesh filename="meshes/upper.stl"/>', '<origin xyz="0 0 0.2"/>')
    fore = collision(
        '<mesh filename="meshes/fore.obj" scale="0.001 0.001 0.001"/>', '<origin xyz="0.15 0 0"/>'
    )
    hand = collision('<mesh filename="meshes/hand.ply"/>', '<origin xyz="0.1 0 0"/>')
    up, out = '<origin xyz="0 0 0.45"/>' + LIMIT, '<origin xyz="0.35 0 0"/>' + LIMIT
    (folder / "arm.urdf").write_text(
        robot(
            *(link("base", ""), link("upper", upper), link("fore", fore), link("hand", hand)),
            joint("turn", "base", "upper", axis="0 0 1"),
            joint("elbow", "upper", "fore", inside=up, axis="0 1 0"),
            joint("wrist", "fore", "hand", inside=out, axis="0 0 1"),
        )
    )
    (folder / "scene.yaml").write_text(
        "obstacles:\n"
        "  - {mesh: ring.ply, position: [0.4, 0.2, 0.5], rpy: [0, 1.2, 0]}\n"
        "  - {box: [0.05, 0.6, 0.4], position: [-0.35, 0, 0.5]}\n"
    )
    return f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}"


@pytest.mark.slow
@pytest.mark.parametrize("world", [readmes, of_meshes])
@pytest.mark.usefixtures("in_process_workers")
def test_users_arms_are_run_judged_and_drawn(
    world: Callable[[Path], str], bench: Cli, tmp_path: Path
) -> None:
    env, out = world(tmp_path), tmp_path / "run"
    code, text, err = bench(
        *("run", "--env", env, "--planners", "rrtconnect,rrtstar", "--problems", 4),
        *("--stop", "first", "--out", out),
    )
    assert code == 0, err
    assert "share of straight lines blocked" in text
    records = records_of(out)
    assert records["planner"].value_counts().to_dict() == {"rrtconnect": 4, "rrtstar": 4}
    assert set(records["outcome"]) == {"VALID"}, records[["planner", "outcome", "error"]]
    assert (records["safety_margin"] > 0).all()
    code, _, err = bench("show", "--env", env, "--paths", out, "--out", tmp_path / "paths.png")
    assert code == 0, err
    assert (tmp_path / "paths.png").stat().st_size > 10_000


@pytest.mark.slow
def test_what_a_mesh_hits_is_no_path(tmp_path: Path) -> None:
    """Between two free places on either side of the ring the fore arm goes through its rim."""
    env = envs.make(of_meshes(tmp_path))
    model = env.collision_model()
    assert model.is_valid(np.array([-1.0, 0.0, 0.0]))
    assert not model.segment_is_free(np.array([-1.0, 0.0, 0.0]), np.array([1.2, 0.0, 0.0]))
