"""Files that another file names: how its folder is called makes no difference."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh
from bad_urdfs import collision, joint, link, robot

from envs.errors import InputError
from envs.files.paths import safe_join
from envs.robots.urdf import read_urdf
from envs.scenes.scene_file import read_scene


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """robot/urdf/ and robot/meshes/part.stl, with `away` beside robot and a link to robot/urdf in
    it, and that of the tests as the current folder."""
    for folder in ("robot/urdf", "robot/meshes", "away/deep"):
        (tmp_path / folder).mkdir(parents=True)
    (tmp_path / "robot/urdf/part.stl").touch()
    (tmp_path / "robot/meshes/part.stl").touch()
    (tmp_path / "away/link").symlink_to(tmp_path / "robot/urdf")
    return tmp_path


@pytest.mark.parametrize(
    "folder",
    [
        "robot/urdf",
        "robot/../robot/urdf",
        "away/deep/../../robot/urdf",
        "robot/urdf/../urdf",
        "robot/urdf/../../robot/./urdf",
        "away/link",
        "away/link/../urdf",  # from a link, ".." is the folder above its target
    ],
)
@pytest.mark.parametrize("name", ["part.stl", "./part.stl", "deep/../part.stl"])
def test_a_folder_may_be_called_in_many_ways(folder: str, name: str, package: Path) -> None:
    assert safe_join(package / folder, name).samefile(package / "robot/urdf/part.stl")


@pytest.mark.parametrize("folder", [".", "../urdf", "../../robot/urdf", "../../away/link/../urdf"])
def test_it_may_be_relative(folder: str, package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(package / "robot/urdf")
    assert safe_join(Path(folder), "part.stl").samefile(package / "robot/urdf/part.stl")
    assert safe_join(Path(folder), "../meshes/part.stl").samefile(package / "robot/meshes/part.stl")
    absolute = package / "robot/meshes/part.stl"
    assert safe_join(Path(folder), str(absolute)).samefile(absolute)


@pytest.mark.parametrize("folder", ["robot/urdf", "away/../robot/urdf", "away/link/../urdf"])
@pytest.mark.parametrize("name", ["../../away/x.stl", "../meshes/../../x.stl", "/etc/passwd"])
def test_climbing_out_is_refused_however_the_folder_is_called(
    folder: str, name: str, package: Path
) -> None:
    with pytest.raises(InputError, match="climbs out"):
        safe_join(package / folder, name)


@pytest.mark.parametrize("way", ["robot/urdf", "away/deep/../../robot/urdf", "away/link/../urdf"])
def test_robots_and_scenes_are_read_by_every_way(way: str, package: Path) -> None:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(package / "robot/meshes/part.stl")
    hand = link("b", collision('<mesh filename="../meshes/part.stl"/>'))
    urdf = robot('<link name="a"/>', hand, joint("ab", "a", "b"))
    (package / "robot/urdf/arm.urdf").write_text(urdf)
    scene = "obstacles:\n- mesh: ../meshes/part.stl\n"
    (package / "robot/urdf/scene.yaml").write_text(scene)
    assert len(read_urdf(package / way / "arm.urdf")[1]) == 1
    assert len(read_scene(package / way / "scene.yaml").obstacles) == 1
