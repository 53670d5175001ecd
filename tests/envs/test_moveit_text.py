"""MoveIt's planning scenes in text, in both forms of it, and what is wrong with them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from documents import block_after
from mbm_files import SRDF, URDF

import envs
from envs import InputError
from envs.collision.shapes import Box, ConvexHull, Cylinder, Mesh, Sphere
from envs.files.moveit_text import read_scene_text
from envs.files.planning_scene import SIDES

BEFORE = """(noname)+
* table
1
box
0.6 1.2 0.05
0.5 0 0.2
0 0 0 1
0.1 0.2 0.3 1
* two things
2
sphere
0.1
1 0 0
0 0 0 1
0 0 0 0
cylinder
0.05 0.4
0 0 1
0 0 0.7071067811865476 0.7071067811865476
0 0 0 0
.
"""
"""From before objects had poses."""

TETRAHEDRON = """4 4
0 0 0
1 0 0
0 1 0
0 0 1
0 2 1
0 1 3
0 3 2
1 2 3"""

NOW = f"""my scene
* table
0 0 1
0 0 0.7071067811865476 0.7071067811865476
1
box
0.6 1.2 0.05
0.5 0 0.2
0 0 0 1
0 0 0 0
2
top
0 0 0.025
0 0 0 1
a corner
0.3 0.6 0
0 0 0 1
* can
0 0 0
0 0 0 1
2
cone
0.3 0.5
0 0 0
0 0 0 1
0 0 0 0
mesh
{TETRAHEDRON}
2 0 0
0 0 0 1
0 0 0 0
0
.
"""


def test_scenes_from_before_objects_had_poses() -> None:
    found = read_scene_text(BEFORE.encode())
    assert found.names == ("table", "two things", "two things")
    table, ball, can = (one.solid for one in found.obstacles)
    assert isinstance(table, Box)
    assert table.sides.tolist() == [0.6, 1.2, 0.05]
    assert ball == Sphere(0.1)
    assert can == Cylinder(0.05, 0.4), "the radius comes first, unlike in messages"
    places = [one.pose[:3, 3].tolist() for one in found.obstacles]
    assert places == [[0.5, 0, 0.2], [1, 0, 0], [0, 0, 1]]
    assert found.obstacles[2].pose[:3, 0].round(9).tolist() == [0, 1, 0]


def test_shapes_are_placed_in_objects_that_have_poses_and_subframes() -> None:
    found = read_scene_text(NOW.encode())
    assert found.names == ("table", "can", "can")
    table, cone, tetrahedron = found.obstacles
    assert table.pose[:3, 3].round(9).tolist() == [0, 0.5, 1.2]
    assert table.pose[:3, 0].round(9).tolist() == [0, 1, 0]
    assert isinstance(cone.solid, ConvexHull)
    assert isinstance(tetrahedron.solid, Mesh)
    assert tetrahedron.solid.vertices.shape == (4, 3)
    assert tetrahedron.pose[:3, 3].tolist() == [2, 0, 0]


def test_line_breaks_matter_about_names_only() -> None:
    words = NOW.replace("0 0 1\n0 0 0.707", "0 0 1 0 0 0.707", 1).replace(
        "\n1\nbox\n", " 1 box\n\n"
    )
    for text in (words, NOW.replace("\n", "\r\n"), NOW + "\nand more", "\ufeff" + NOW):
        assert read_scene_text(text.encode()).names == ("table", "can", "can")
    many = read_scene_text(b"s\n.\n")
    assert many.obstacles == ()


def test_a_cone_is_held_closely_by_its_hull() -> None:
    [cone] = [one.solid for one in read_scene_text(NOW.encode()).obstacles][1:2]
    assert isinstance(cone, ConvexHull)
    radius, length = 0.3, 0.5
    rng = np.random.default_rng(0)
    angles, up = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(0, 1, 2000)
    at = radius * (1 - up) * np.array([np.cos(angles), np.sin(angles)])
    surface = np.column_stack([*at, length * (up - 0.5)])
    corners = cone.vertices[cone.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    beyond = surface @ normals.T - (corners[:, 0] * normals).sum(axis=1)
    assert beyond.max() < 1e-12, "the cone is within"
    outer = np.linalg.norm(cone.vertices[:, :2], axis=1).max() - radius
    assert 0 < outer < 4e-4 * radius
    assert len(cone.vertices) == SIDES + 1


def changed(old: str, new: str, text: str = NOW) -> str:
    assert text.count(old) >= 1
    return text.replace(old, new, 1)


BAD = {
    "nothing": ("", "the file ends where the scene's name should be"),
    "a name alone": ("scene", "the file ends where an object or the end should be"),
    "truncated": (NOW[:200], "must be 3 numbers on a line, not 2"),
    "no end": (NOW.removesuffix(".\n"), "the file ends where an object or the end should be"),
    "rubbish": (b"\x80\xff\x00\xfe", "it is no text in UTF-8"),
    "no mark": (changed("* table", "table"), "line 2: an object begins with '* ' and its name"),
    "no name": (changed("* table", "*"), "must be"),
    "twice": (changed("* can", "* table"), "line 18: two objects are called 'table'; rename one"),
    "kind": (changed("box", "boks"), "line 6: object 'table' is a 'boks'; did you mean 'box'"),
    "octree": (changed("box", "octree"), "object 'table': octomaps are not read"),
    "plane": (changed("box\n0.6 1.2 0.05", "plane\n0 0 1 0"), "a plane has no end; use a box"),
    "negative": (changed("0.6 1.2", "0.6 -1.2"), "line 7: object 'table': dimensions must be"),
    "flat": (changed("0.6 1.2", "0.6 0"), "dimensions must be positive, not [0.6, 0.0, 0.05]"),
    "NaN": (
        changed("0.5 0 0.2", "nan 0 0.2"),
        "the position of a box of object",
    ),
    "infinite": (changed("0.6 1.2", "0.6 inf"), "the sizes of object 'table' must be finite"),
    "huge": (changed("0.6 1.2", "0.6 1e300"), "must be finite numbers of at most 1e+06"),
    "many digits": (changed("0.6 1.2", "0.6 " + "9" * 5000), "must be finite numbers"),
    "hexadecimal": (changed("0.6 1.2", "0.6 0x10"), "must be finite numbers"),
    "underscore": (changed("0.6 1.2", "0.6 1_0"), "must be finite numbers"),
    "word": (changed("0.6 1.2", "0.6 x"), "not 'x'"),
    "thin cone": (changed("0.3 0.5", "1e-320 0.5"), "object 'can': a hull's points must not"),
    "no turn": (changed("0 0 0 1\n0 0 0 0\n2", "0 0 0 0\n0 0 0 0\n2"), "is a quaternion, and not"),
    "short": (
        changed("0.6 1.2 0.05", "0.6 1.2"),
        "line 7: the sizes of object",
    ),
    "long": (changed("0.6 1.2 0.05", "0.6 1.2 0.05 7"), "must be 3 numbers on a line, not 1"),
    "count": (
        changed("\n1\nbox", "\n-1\nbox"),
        "how many shapes object",
    ),
    "half": (changed("\n1\nbox", "\n1.5\nbox"), "must be a whole number, not '1.5'"),
    "many": (changed("\n1\nbox", "\n999999999\nbox"), "line 11: object 'table' is a '2'"),
    "more": (changed("\n1\nbox", "\n9999999999\nbox"), "must be a whole number"),
    "no subframe": (
        changed("0 0 0 0\n2\n", "0 0 0 0\n3\n"),
        "has fewer subframes than it says",
    ),
    "index": (changed("1 2 3\n2 0 0", "1 2 4\n2 0 0"), "faces whose vertices are not there"),
    "negative index": (changed("1 2 3\n2 0 0", "1 2 -3\n2 0 0"), "must be a whole number"),
    "open": (changed("4 4\n", "4 3\n").replace("1 2 3\n2 0 0", "2 0 0"), "is not watertight"),
    "no triangles": (changed(TETRAHEDRON, "0 0"), "the mesh of object 'can' has no triangles"),
    "no area": (changed(TETRAHEDRON, "3 1\n0 0 0\n1 0 0\n2 0 0\n0 1 2"), "degenerate faces only"),
    "huge mesh": (changed("4 4\n", "999999999 4\n"), "a vertex of the mesh"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_said_in_a_line(name: str) -> None:
    text, said = BAD[name]
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        read_scene_text(text if isinstance(text, bytes) else text.encode())
    assert "\n" not in str(caught.value)


WALL = "wall\n* wall\n1\nbox\n0.1 0.4 1\n-0.6 0 0\n0 0 0 1\n0 0 0 0\n.\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "two.urdf").write_text(URDF)
    (tmp_path / "two.srdf").write_text(SRDF)
    (tmp_path / "wall.scene").write_text(
        "wall\n* wall\n1\nbox\n0.1 0.4 1\n-0.6 0 0\n0 0 0 1\n0 0 0 0\n.\n"
    )
    return tmp_path


def test_arms_stand_among_what_is_in_them(folder: Path) -> None:
    arm = f"arm:urdf={folder / 'two.urdf'},srdf={folder / 'two.srdf'},group=arm"
    env = envs.make(f"{arm},scene={folder / 'wall.scene'}")
    assert list(env.obstacle_names) == ["obstacle 'wall'"]
    assert env.clearance(np.array([[np.pi - 0.2, 0.0], [0.0, 0.0]])).round(2).tolist()[0] <= 0
    own = "obstacles: [{box: [0.1, 0.4, 1], position: [-0.6, 0, 0], name: wall}]"
    (folder / "own.yaml").write_text(own)
    assert envs.make(f"{arm},scene={folder / 'own.yaml'}").fingerprint == env.fingerprint
    moved = envs.make(f'{arm},scene={folder / "wall.scene"},base="1,0,0"')
    assert moved.obstacles[0].pose[:3, 3].tolist() == [-0.6, 0, 0], "in the world, wherever it is"


def test_what_is_wrong_with_a_file_begins_with_its_name(folder: Path) -> None:
    for content, said in (
        (b"version https://git-lfs.github.com/spec/v1\n", "is a pointer to a file in Git LFS"),
        (b"s\n* a\n1\nboks\n", "line 4: object 'a' is a 'boks'"),
        (b"x" * (2**25 + 1), "scenes of at most 33554432 are read"),
    ):
        file = folder / "bad.scene"
        file.write_bytes(content)
        with pytest.raises(InputError) as caught:
            envs.make(f"arm:urdf={folder / 'two.urdf'},scene={file}")
        assert str(caught.value).startswith(str(file))
        assert said in str(caught.value)


def test_commands_of_the_documentation_have_such_scenes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    (folder / "kitchen.scene").write_text(NOW)
    (folder / "planning_scene.yaml").write_text("world: {collision_objects: []}")
    counts = []
    for line in block_after("scenes of MoveIt").splitlines():
        words = shlex.split(line)
        text = words[words.index("--env") + 1].replace("robot=panda", "urdf=two.urdf")
        counts.append(len(envs.make(text).obstacles))
    assert counts == [3, 0]


def test_a_scene_in_place_of_an_environment_is_told_what_to_write() -> None:
    with pytest.raises(InputError, match=r"arm:robot=NAME,scene=kitchen.scene"):
        envs.make("kitchen.scene")
