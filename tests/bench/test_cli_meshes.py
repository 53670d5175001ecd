"""Bad meshes through the command line: one clear line, exit code 2, nothing written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_meshes import BAD
from conftest import Cli, Refused

from envs.files import mesh_file


def run(file: Path) -> tuple[str, ...]:
    return ("run", "--env", f"mesh:file={file}", "--planners", "rrtconnect", "--problems", "1")


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes(name: str, tmp_path: Path, refused: Refused) -> None:
    content, said = BAD[name]
    file = tmp_path / name
    file.write_bytes(content)
    assert said in refused(*run(file))


def test_a_cloud_of_points(tmp_path: Path, refused: Refused) -> None:
    points = np.random.default_rng(0).normal(size=(50, 3))
    file = tmp_path / "cloud.ply"
    trimesh.PointCloud(points).export(file)
    assert "a cloud of points has to be meshed first" in refused(*run(file))


def test_too_many_faces(tmp_path: Path, refused: Refused, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_file, "MOST_FACES", 100)
    file = tmp_path / "ball.ply"
    trimesh.creation.icosphere().export(file)
    assert "has 1280 faces, more than 100: simplify it" in refused(*run(file))


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_degenerate_faces_are_dropped_and_the_kind_is_said(bench: Cli, tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    faces = np.concatenate([ball.faces, [[0, 0, 1], [5, 5, 5]]])
    file = tmp_path / "ball.obj"
    trimesh.Trimesh(ball.vertices, faces, process=False).export(file)
    code, out, err = bench(*run(file), "--out", tmp_path / "out")
    assert code == 0
    assert "100" in out
    said = [line for line in err.splitlines() if "solid, 320 faces" in line]
    assert len(said) == 1, "once"
    assert "2 degenerate ones dropped" in said[0]
    assert "leaked" not in err
