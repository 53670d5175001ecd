"""Scenes from YAML files: what they mean, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from envs import InputError
from envs.collision.shapes import Box, Capsule, ConvexHull, Cylinder, Mesh, Sphere
from envs.scenes.scene_file import Scene, read_scene

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
  - hull: points.obj
    scale: 0.5
    name: rock
  - hull: solids/shelf.stl
    scale: 0.001
  - hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.1, 0.1, 0.1]]
    position: [0, 0, 2]
allowed_collisions: [[hand, rock]]
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
    cloud = np.random.default_rng(0).normal(size=(50, 3))
    lines = (f"v {x} {y} {z}\n" for x, y, z in [*cloud, *trimesh.creation.box((9, 8, 7)).vertices])
    (tmp_path / "points.obj").write_text("".join(lines))
    (tmp_path / "flat.obj").write_text("v 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n")
    return tmp_path


def test_every_kind_of_obstacle_is_read(folder: Path) -> None:
    scene = read_scene(written(folder, GOOD))
    box, sphere, cylinder, capsule, mesh, *hulls = scene.obstacles
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
    of_points, of_mesh, of_list = (hull.solid for hull in hulls)
    assert isinstance(of_points, ConvexHull)
    assert isinstance(of_mesh, ConvexHull)
    assert isinstance(of_list, ConvexHull)
    assert np.ptp(of_points.vertices, axis=0) == pytest.approx([4.5, 4, 3.5])
    assert len(of_points.vertices) == 8
    assert np.ptp(of_mesh.vertices, axis=0) == pytest.approx([1, 2, 3])
    assert len(of_list.vertices) == 4
    assert scene.names == ("", "", "", "", "", "rock", "", "")
    assert scene.allowed == [("hand", "rock")]


def test_rpy_is_about_fixed_axes(folder: Path) -> None:
    file = written(folder, "obstacles: [{sphere: 1, rpy: [0.3, -0.5, 2]}]")
    [turned] = read_scene(file).obstacles
    expected = trimesh.transformations.euler_matrix(0.3, -0.5, 2, "sxyz")
    assert turned.pose == pytest.approx(expected, abs=1e-15)


def of(entry: str) -> str:
    """A scene whose second obstacle is the entry."""
    return f"obstacles: [{{sphere: 1}}, {entry}]"


PAIRS = "obstacles: [{{sphere: 1}}]\nallowed_collisions: {}"

POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:37d8\nsize 28\n"

BAD_SCENES = {
    "nothing": ("", "must be a mapping"),
    "a list": ("[1, 2]", "must be a mapping"),
    "other encoding": (b"\xff\xfe\xfa", "not YAML"),
    "syntax": ("obstacles: [", "not YAML"),
    "pointer": (POINTER, "is a pointer to a file in Git LFS"),
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
    "pairs that are none": (PAIRS.format("hand"), "must be a list of pairs, not 'hand'"),
    "one name": (PAIRS.format("[[hand]]"), "each must be two names of links or obstacles"),
    "three names": (PAIRS.format("[[a, b, c]]"), "as in [hand, table], not ['a', 'b', 'c']"),
    "a name twice": (PAIRS.format("[[a, a]]"), "not ['a', 'a']"),
    "a number as name": (PAIRS.format("[[a, 1]]"), "not ['a', 1]"),
    "misspelt pairs": ("obstacles: [{sphere: 1}]\nallowed_collision: []", "did you mean 'allowed"),
    "names alike": (
        "obstacles: [{sphere: 1, name: a}, {sphere: 2}, {sphere: 3, name: a}]",
        "two obstacles are called 'a'; rename one",
    ),
    "many bytes": ("# " + "x" * 2**22, "scenes of at most 4194304 are read"),
}

BAD_OBSTACLES = {
    "no mapping": ("sphere", "must be a mapping"),
    "no shape": ("{position: [1, 2, 3]}", "not none"),
    "two shapes": ("{box: [1, 1, 1], sphere: 1}", "not box and sphere"),
    "shape twice": ("{sphere: 1, sphere: 2}", "twice"),
    "misspelt shape": ("{spere: 1}", "did you mean 'sphere'"),
    "misspelt position": ("{sphere: 1, postion: [1, 2, 3]}", "did you mean 'position'"),
    "scale of a box": ("{box: [1, 1, 1], scale: 2}", "only a mesh or a hull may have a scale"),
    "few points": ("{hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0]]}", "at least 4 points that differ"),
    "points alike": ("{hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]]}", "differ, not 3"),
    "no points": ("{hull: []}", "at least 4 points that differ, not 0"),
    "flat hull": ("{hull: [[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]]}", "all lie in one plane"),
    "hull of a flat file": ("{hull: flat.obj}", "all lie in one plane"),
    "hull of one point": ("{hull: junk.obj}", "at least 4 points that differ, not 1"),
    "NaN in a hull": ("{hull: [[0, 0, .nan]]}", "a point of a hull must be finite"),
    "far point": ("{hull: [[0, 0, 1.0e+7]]}", "at most 1e+06"),
    "short point": ("{hull: [[0, 0]]}", "a point of a hull must be a list of 3 numbers"),
    "number as hull": ("{hull: 1}", "must name a file or list points, not 1"),
    "no such hull": ("{hull: none.obj}", "no such file"),
    "huge hull": ("{hull: points.obj, scale: 1.0e+6}", "at most 1e+06 from the origin"),
    "mesh and hull": ("{hull: points.obj, mesh: open.stl}", "not mesh and hull"),
    "number as name": ("{sphere: 1, name: 1}", "name must be a word such as 'shelf', not 1"),
    "empty name": ("{sphere: 1, name: ''}", "name must be a word"),
    "short box": ("{box: [1, 1]}", "box must be a list of 3"),
    "number as box": ("{box: 1}", "box must be a list of 3"),
    "flat box": ("{box: [1, 0, 1]}", "box must be above 0"),
    "word in box": ("{box: [1, x, 1]}", "not 'x'"),
    "no number": ("{sphere: 1e-3 m}", "such as 0.5 or 1.0e-3, not '1e-3 m'"),
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


def scene_of(folder: Path, pairs: str) -> Scene:
    named = "obstacles: [{sphere: 1, name: ball}, {sphere: 2}, {box: [1, 1, 1], name: crate}]"
    return read_scene(written(folder, f"{named}\nallowed_collisions: {pairs}"))


LINKS = ["base", "hand", "finger", "hand"]


def test_allowed_pairs_are_of_links_or_of_links_and_obstacles(folder: Path) -> None:
    scene = scene_of(folder, "[[hand, finger], [crate, hand], [finger, ball], [base, hand]]")
    scene.check_names(LINKS)
    assert scene.allowed_links(LINKS) == {
        frozenset(("hand", "finger")),
        frozenset(("base", "hand")),
    }
    touching = {(link, o) for link in LINKS for o in scene.names if o and scene.allows(link, o)}
    assert touching == {("hand", "crate"), ("finger", "ball")}


def test_what_a_scene_without_pairs_allows_is_nothing(folder: Path) -> None:
    scene = read_scene(written(folder, "obstacles: [{sphere: 1, name: ball}]"))
    scene.check_names(LINKS)
    assert scene.allowed_links(LINKS) == frozenset()
    assert not scene.allows("hand", "ball")


@pytest.mark.parametrize(
    ("pairs", "links", "said"),
    [
        ("[[hand, fingr]]", LINKS, "unknown link or obstacle 'fingr'; did you mean 'finger'?"),
        ("[[crat, hand]]", LINKS, "unknown link or obstacle 'crat'; did you mean 'crate'?"),
        ("[[crate, ball]]", LINKS, "'crate' and 'ball' are obstacles, which may touch anyway"),
        ("[[hand, ball]]", [*LINKS, "ball"], "a link and an obstacle are called 'ball'"),
    ],
)
def test_pairs_of_what_is_not_there_are_one_clear_line(
    pairs: str, links: list[str], said: str, folder: Path
) -> None:
    scene = scene_of(folder, pairs)
    with pytest.raises(InputError) as caught:
        scene.check_names(links)
    assert said in str(caught.value)
    assert str(caught.value).startswith(f"{folder / 'scene.yaml'}: ")
    assert "\n" not in str(caught.value)
