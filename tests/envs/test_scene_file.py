"""Scenes from YAML files: what they mean, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from envs import InputError
from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, Sphere
from envs.scenes.scene_file import read_scene

GOOD = """
obstacles:
  - box: [0.6, 1.2, 0.05]  # a table
    position: [0.5, 0, 0.2]
  - sphere: 0.1
  - cylinder: [0.05, 0.4]
    position: [0, 1, 0]
    rpy: [1.5707963267948966, 0, 1.5707963267948966]
  - capsule: [0.04, 0.3]
  - mesh: solids/shelf.stl
    scale: 0.001
    rpy: [0, 0, 3]
"""


def written(folder: Path, content: str | bytes) -> Path:
    file = folder / "scene.yaml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With a mesh in millimetres, one with a hole and a file that holds none."""
    (tmp_path / "solids").mkdir()
    shelf = trimesh.creation.box((1000, 2000, 3000))
    shelf.export(tmp_path / "solids" / "shelf.stl")
    shelf.update_faces(np.arange(len(shelf.faces)) > 0)
    shelf.export(tmp_path / "open.stl")
    (tmp_path / "junk.obj").write_bytes(b"v 0 0 0\n")
    return tmp_path


def test_every_kind_of_obstacle_is_read(folder: Path) -> None:
    box, sphere, cylinder, capsule, mesh = read_scene(written(folder, GOOD))
    assert isinstance(box.solid, Box)
    assert box.solid.center.tolist() == [0, 0, 0]
    assert box.solid.sides.tolist() == [0.6, 1.2, 0.05]
    assert box.pose[:3, 3].tolist() == [0.5, 0, 0.2]
    assert (box.pose[:3, :3] == np.eye(3)).all()
    assert sphere.solid == Sphere(0.1)
    assert (sphere.pose == np.eye(4)).all()
    assert cylinder.solid == Cylinder(0.05, 0.4)
    assert capsule.solid == Capsule(0.04, 0.3)
    # Rolled, its axis points to -y; yawed then, to x.
    expected = [[0, 0, 1, 0], [1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 0, 1]]
    assert cylinder.pose == pytest.approx(np.array(expected), abs=1e-15)
    assert isinstance(mesh.solid, Mesh)
    assert np.ptp(mesh.solid.vertices, axis=0) == pytest.approx([1, 2, 3])
    assert mesh.pose[0, 0] == pytest.approx(math.cos(3))


def test_rpy_is_about_fixed_axes(folder: Path) -> None:
    (turned,) = read_scene(written(folder, "obstacles: [{sphere: 1, rpy: [0.3, -0.5, 2]}]"))
    expected = trimesh.transformations.euler_matrix(0.3, -0.5, 2, "sxyz")
    assert turned.pose == pytest.approx(expected, abs=1e-15)


def of(entry: str) -> str:
    """A scene whose second obstacle is the entry."""
    return f"obstacles: [{{sphere: 1}}, {entry}]"


BAD_SCENES = {
    "nothing": ("", "must be a mapping"),
    "a list": ("[1, 2]", "must be a mapping"),
    "other encoding": (b"\xff\xfe\xfa", "not YAML"),
    "syntax": ("obstacles: [", "not YAML"),
    "tabs": ("obstacles:\n\t- sphere: 1", "not YAML"),
    "odd scalar": ("obstacles: !!timestamp 1", "not YAML"),
    "python": ("obstacles: !!python/object/apply:os.getcwd []", "not YAML"),
    "deep": ("[" * 10000, "not YAML"),
    "misspelt": ("obstacle: [{sphere: 1}]", "did you mean 'obstacles'"),
    "another key": ("obstacles: [{sphere: 1}]\nrobot: 1", "unknown key 'robot'"),
    "key of a number": ("1: 2", "unknown key 1"),
    "twice": ("obstacles: [{sphere: 1}]\nobstacles: [{sphere: 2}]", "twice"),
    "empty list": ("obstacles: []", "at least one"),
    "no list": ("obstacles: {sphere: 1}", "at least one"),
    "null": ("obstacles:", "at least one"),
    "huge key": ("? 0x" + "f" * 5000 + "\n: 1", "unknown key int with too many digits"),
    "merges that double": (
        "a0: &a0 {x: 1}\n"
        + "".join(f"a{n + 1}: &a{n + 1} {{<<: [*a{n}, *a{n}]}}\n" for n in range(40)),
        "'<<' in the mapping at line 2 is not supported",
    ),
    "overflow": ("obstacles: " + ":".join(["1"] * 300) + ".5", "not YAML"),
    "many bytes": ("# " + "x" * 2**18, "scenes of at most 262144 are read"),
}

BAD_OBSTACLES = {
    "no mapping": ("sphere", "must be a mapping"),
    "no shape": ("{position: [1, 2, 3]}", "not none"),
    "two shapes": ("{box: [1, 1, 1], sphere: 1}", "not box and sphere"),
    "shape twice": ("{sphere: 1, sphere: 2}", "twice"),
    "misspelt shape": ("{spere: 1}", "did you mean 'sphere'"),
    "misspelt position": ("{sphere: 1, postion: [1, 2, 3]}", "did you mean 'position'"),
    "scale of a box": ("{box: [1, 1, 1], scale: 2}", "only a mesh"),
    "short box": ("{box: [1, 1]}", "box must be a list of 3"),
    "number as box": ("{box: 1}", "box must be a list of 3"),
    "flat box": ("{box: [1, 0, 1]}", "box must be above 0"),
    "word in box": ("{box: [1, x, 1]}", "not 'x'"),
    "no point": ("{sphere: 1e-3}", "such as 0.5 or 1.0e-3, not '1e-3'"),
    "truth": ("{sphere: true}", "sphere wants a number"),
    "list as sphere": ("{sphere: [1]}", "sphere wants a number"),
    "negative sphere": ("{sphere: -1}", "sphere must be above 0"),
    "NaN sphere": ("{sphere: .nan}", "must be finite"),
    "infinite sphere": ("{sphere: .inf}", "must be finite"),
    "huge sphere": ("{sphere: 1" + "0" * 400 + "}", "must be finite"),
    "long cylinder": ("{cylinder: [1, 2, 3]}", "cylinder must be a list of 2"),
    "thin cylinder": ("{cylinder: [0, 2]}", "cylinder must be above 0"),
    "short capsule": ("{capsule: [1]}", "capsule must be a list of 2"),
    "capsule without length": ("{capsule: [1, 0]}", "capsule must be above 0"),
    "long name of a mesh": ("{mesh: " + "a" * 300 + ".stl}", "no such file"),
    "far sphere": ("{sphere: 1, position: [1.0e+307, 0, 0]}", "at most 1e+06"),
    "number as mesh": ("{mesh: 3}", "must name a file"),
    "no such mesh": ("{mesh: none.stl}", "no such file"),
    "junk": ("{mesh: junk.obj}", "junk.obj"),
    "other format": ("{mesh: scene.yaml}", "meshes are read from"),
    "open mesh": ("{mesh: open.stl}", "not watertight"),
    "scale 0": ("{mesh: solids/shelf.stl, scale: 0}", "scale must be above 0"),
    "list as scale": ("{mesh: solids/shelf.stl, scale: [1, 1, 1]}", "scale wants a number"),
    "short position": ("{sphere: 1, position: [1, 2]}", "position must be a list of 3"),
    "NaN position": ("{sphere: 1, position: [1, 2, .nan]}", "position must be finite"),
    "number as rpy": ("{sphere: 1, rpy: 1}", "rpy must be a list of 3"),
    "null rpy": ("{sphere: 1, rpy: }", "rpy must be a list of 3"),
}


def refusal(file: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_scene(file)
    said = str(caught.value)
    assert "\n" not in said
    assert said.startswith(f"{file}: ")
    return said


@pytest.mark.parametrize("name", BAD_SCENES)
def test_bad_files_are_refused_in_one_line(name: str, folder: Path) -> None:
    content, said = BAD_SCENES[name]
    assert said in refusal(written(folder, content))


@pytest.mark.parametrize("name", BAD_OBSTACLES)
def test_bad_obstacles_are_refused_in_one_line(name: str, folder: Path) -> None:
    entry, said = BAD_OBSTACLES[name]
    message = refusal(written(folder, of(entry)))
    assert said in message
    if said != "twice":  # found before obstacles are counted
        assert "obstacle 2: " in message


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "scene.yaml")
    assert "no such file" in refusal(tmp_path)
