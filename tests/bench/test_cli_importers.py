"""Files of others through the command line, each importer with files that hold nothing, rubbish, a
part of what they should or a pointer of Git LFS, and with what is wrong within them: one clear
line, exit code 2, nothing written."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mbm_files
import numpy as np
import pytest
import robometrics_files
import trimesh
from conftest import Cli, Refused
from map_files import scenarios, voxel_text, voxels, write_image, write_octile, write_ros
from omplapp_files import SPATIAL, write_problem

Command = Sequence[object]

RUBBISH = bytes(range(256)) * 8
POINTER = b"version https://git-lfs.github.com/spec/v1\noid sha256:37d859ae\nsize 2895799\n"

WALL = mbm_files.box("wall", mbm_files.pose(-0.6, 0), 0.1, 0.4, 1)
SCENE = json.dumps(mbm_files.scene(WALL), indent=1)
TEXT = "wall\n* wall\n1\nbox\n0.1 0.4 1\n-0.6 0 0\n0 0 0 1\n0 0 0 0\n.\n"
OWN = "obstacles:\n  - box: [0.1, 0.4, 1]\n    position: [-0.6, 0, 0]\n"
PATHS = {"paths": [{"problem": 0, "waypoints": [[0.0, 0, 0], [1, 1, 1]]}]}
POSED = [{"start": [0, 0, 0], "goal": [1, 2, 3]}]


def problems(env: str) -> Command:
    return "problems", "--env", env, "--problems", 1


def mbm(folder: Path, name: str) -> tuple[Path, Command]:
    pair = mbm_files.scene(WALL), mbm_files.request([0, 0], [1, 1])
    mbm_files.write(folder / "mbm" / "panda", {"box_panda": [pair] * 2})
    return folder / "mbm" / "panda" / name, problems("mbm-panda-box")


def robometrics(folder: Path, name: str) -> tuple[Path, Command]:
    content = {"box_panda": [robometrics_files.problem([[0.5] * 7])]}
    file = robometrics_files.write(folder, content, name)
    return file, problems(f"robometrics:file={file},urdf={folder / 'panda.urdf'}")


def arm(folder: Path, name: str) -> tuple[Path, Command]:
    (folder / "two.urdf").write_text(mbm_files.URDF)
    (folder / "two.srdf").write_text(mbm_files.SRDF)
    for scene, text in (("a.scene", TEXT), ("moveit.yaml", SCENE), ("own.yaml", OWN)):
        (folder / scene).write_text(text)
    scene = name if name not in ("two.urdf", "two.srdf") else "own.yaml"
    files = {"urdf": "two.urdf", "srdf": "two.srdf", "scene": scene}
    said = ",".join(f"{key}={folder / file}" for key, file in files.items())
    return folder / name, problems(f"arm:{said}")


def grid(folder: Path, name: str) -> tuple[Path, Command]:
    file = folder / name
    if file.suffix in (".pgm", ".png", ".bmp"):
        write_image(file)
    elif file.suffix == ".yaml":
        write_ros(folder)
    elif file.suffix == ".npy":
        np.save(file, voxels())
    elif file.suffix == ".map":
        write_octile(folder)
    else:
        file.write_text(voxel_text(voxels()))
    return file, problems(f"grid:file={file}")


def scen(folder: Path, name: str) -> tuple[Path, Command]:
    of_map = write_octile(folder)
    (folder / name).write_text(scenarios("1 1 18 11 30.5", "3 2 1 1 2.41421356"))
    return folder / name, problems(f"grid:file={of_map},scen={folder / name}")


def posed(folder: Path, name: str) -> tuple[Path, Command]:
    text = "start_1,start_2,start_3,goal_1,goal_2,goal_3\n0,0,0,1,2,3\n"
    (folder / name).write_text(text if name.endswith("csv") else json.dumps(POSED))
    return folder / name, ("problems", "--env", "c3d", "--problem-file", folder / name)


def paths(folder: Path, name: str) -> tuple[Path, Command]:
    file = folder / name
    if file.suffix == ".npz":
        np.savez(file, waypoints=np.arange(6.0).reshape(2, 3))
    else:
        texts = {".json": json.dumps(PATHS), ".csv": "q1,q2,q3\n0,0,0\n1,1,1\n"}
        file.write_text(texts.get(file.suffix, "0 0 0\n1 1 1\n"))
    return file, ("judge", "--env", "c3d", "--paths", file)


def omplapp(folder: Path, name: str) -> tuple[Path, Command]:
    file = write_problem(folder, SPATIAL)
    return folder / name, problems(f"omplapp:file={file}")


def mesh(folder: Path, name: str) -> tuple[Path, Command]:
    trimesh.creation.box((1, 2, 3)).export(folder / name)
    return folder / name, problems(f"mesh:file={folder / name}")


def dae(folder: Path, name: str) -> tuple[Path, Command]:
    write_problem(folder, SPATIAL)
    return folder / name, problems(f"mesh:file={folder / name}")


Importer = Callable[[Path, str], tuple[Path, Command]]

FILES: dict[str, Importer] = {
    **dict.fromkeys(("problems.tar.bz2", "panda.urdf", "panda.srdf"), mbm),
    "mb_set.yaml": robometrics,
    **dict.fromkeys(("a.scene", "moveit.yaml", "own.yaml", "two.urdf", "two.srdf"), arm),
    **dict.fromkeys(("map.yaml", "map.pgm", "map.png", "map.bmp", "cubes.npy"), grid),
    **dict.fromkeys(("rooms.map", "rooms.3dmap"), grid),
    "rooms.scen": scen,
    **dict.fromkeys(("own.csv", "own.json", "posed.yaml"), posed),
    **dict.fromkeys(("paths.csv", "paths.json", "paths.npz", "paths.txt"), paths),
    **dict.fromkeys(("own.cfg", "ell.dae"), omplapp),
    **dict.fromkeys(("box.obj", "box.ply", "box.off", "box.stl", "box.glb"), mesh),
    "wall.dae": dae,
}
"""Names of files, and what writes good ones and a command that reads them."""

CONTENTS: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda good: b"",
    "rubbish": lambda good: RUBBISH,
    "zeros": lambda good: bytes(500),
    "pointer": lambda good: POINTER,
    "truncated": lambda good: good[: len(good) // 2],
}

STILL_GOOD = {
    ("rooms.3dmap", "truncated"),  # fewer voxels
    ("rooms.scen", "truncated"),  # fewer digits
}


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder of data, and a cache, of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("BENCH_DATA", str(tmp_path / "files"))
    (tmp_path / "files").mkdir()


@pytest.mark.parametrize("how", CONTENTS)
@pytest.mark.parametrize("name", FILES)
def test_files_that_hold_something_else(
    name: str, how: str, tmp_path: Path, refused: Refused
) -> None:
    if (name, how) in STILL_GOOD:
        pytest.skip("it is a file all the same")
    file, command = FILES[name](tmp_path / "files", name)
    good = file.read_bytes()
    file.write_bytes(CONTENTS[how](good))
    said = refused(*command)
    assert said.count(file.name) == 1, said
    assert ("Git LFS" in said) == (how == "pointer"), said


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_none(name: str, tmp_path: Path, refused: Refused) -> None:
    file, command = FILES[name](tmp_path / "files", name)
    file.unlink()
    if name == "problems.tar.bz2":
        return  # it would be fetched
    assert file.name in refused(*command)
    file.mkdir()
    assert file.name in refused(*command)


def edited(**more: Any) -> str:
    return json.dumps({**json.loads(SCENE), **more})


def scene(**more: Any) -> str:
    """MoveIt's, with an object that has this."""
    return json.dumps(mbm_files.scene({**WALL, **more}))


def urdf(old: str, new: str) -> str:
    assert old in mbm_files.URDF
    return mbm_files.URDF.replace(old, new, 1)


def robometric(**more: Any) -> str:
    return json.dumps({"box_panda": [robometrics_files.problem([[0.5] * 7], **more)]})


def cfg(**more: Any) -> str:
    values = {**SPATIAL, **more}
    return "[problem]\n" + "\n".join(f"{key} = {value}" for key, value in values.items())


SQUARE = {"entry_names": ["a", "b"], "entry_values": [[True, True], [True]]}
BOX = '<box size="0.5 0.04 0.04"/>'
KIND = {"primitives": [{"type": "boks", "dimensions": [1, 1, 1]}]}
AXES = {"primitives": [{"type": "box", "dimensions": [1, 1]}]}
LOST = {"header": {"frame_id": "nowhere"}}
ROS = """image: {}
resolution: {}
origin: [0, 0, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.2
"""
PGM = b"P5\n4 4\n255\n" + bytes(16)

WITHIN: dict[str, tuple[str, str | bytes, str]] = {
    "scene, no such mesh": ("own.yaml", "obstacles: [{mesh: none.stl}]", "no such file"),
    "scene, kind": ("own.yaml", "obstacles: [{boks: [1, 1, 1]}]", "did you mean 'box'"),
    "scene, sizes": ("own.yaml", "obstacles: [{box: [1, 1]}]", "a list of 3"),
    "scene, NaN": ("own.yaml", "obstacles: [{sphere: .nan}]", "must be finite"),
    "scene, huge": ("own.yaml", "obstacles: [{sphere: 1e300}]", "at most 1e+06"),
    "scene, twice": ("own.yaml", "obstacles: []\nobstacles: []", "'obstacles' is given twice"),
    "scene, another key": ("own.yaml", "obstacle: []", "did you mean 'obstacles'"),
    "planning scene, kind": ("moveit.yaml", scene(**KIND), "did you mean 'box'"),
    "planning scene, matrix": (
        "moveit.yaml",
        edited(allowed_collision_matrix=SQUARE),
        "allowed_collision_matrix is not 2 by 2",
    ),
    "planning scene, sizes": ("moveit.yaml", scene(**AXES), "must be 3 numbers, not 2"),
    "planning scene, frame": ("moveit.yaml", scene(**LOST), "in frame 'nowhere'"),
    "planning scene, twice": ("moveit.yaml", "world: {}\nworld: {}", "'world' is given twice"),
    "planning scene, octomap": (
        "moveit.yaml",
        edited(world={"octomap": {"octomap": {"data": [1]}}}),
        "octomap, which is not read",
    ),
    "text, kind": ("a.scene", TEXT.replace("box", "boks"), "line 4: object 'wall' is a 'boks'"),
    "text, octomap": ("a.scene", TEXT.replace("box", "octree"), "octomaps are not read"),
    "text, sizes": ("a.scene", TEXT.replace("0.1 0.4 1", "0.1 0.4"), "3 numbers on a line"),
    "text, NaN": ("a.scene", TEXT.replace("0.1 0.4 1", "0.1 nan 1"), "finite numbers"),
    "urdf, no such mesh": ("two.urdf", urdf(BOX, '<mesh filename="a.stl"/>'), "a.stl"),
    "urdf, kind": ("two.urdf", urdf(BOX, "<boks/>"), "did you mean 'box'"),
    "urdf, NaN": ("two.urdf", urdf('lower="-3"', 'lower="nan"'), "'nan'"),
    "urdf, huge": ("two.urdf", urdf('xyz="0.25 0 0"', 'xyz="1e300 0 0"'), "1e300"),
    "urdf, two of a name": ("two.urdf", urdf('name="lower"', 'name="upper"'), "upper"),
    "srdf, root": ("two.srdf", "<srdf/>", "two.srdf"),
    "srdf, lacks a name": ("two.srdf", "<robot><group/></robot>", "name"),
    "mbm, no such mesh": ("panda.urdf", urdf(BOX, '<mesh filename="a.stl"/>'), "no such mesh"),
    "robometrics, kind": (
        "mb_set.yaml",
        robometric(obstacles={"cubiod": {}}),
        "did you mean 'cuboid'",
    ),
    "robometrics, joints": ("mb_set.yaml", robometric(start=[0] * 9), "7 numbers, not 9"),
    "robometrics, no goals": ("mb_set.yaml", robometric(goal_ik=[]), "has a goal_ik"),
    "map, no image": ("map.yaml", ROS.format("none.pgm", 0.1), "none.pgm does not exist"),
    "map, resolution": ("map.yaml", ROS.format("map.pgm", -1), "resolution must be above 0"),
    "map, NaN": ("map.yaml", ROS.format("map.pgm", ".nan"), "resolution"),
    "image, short": ("map.pgm", PGM[:-1], "map.pgm"),
    "image, all occupied": ("map.pgm", PGM, "all cells are occupied"),
    "octile, ragged": ("rooms.map", "type octile\nheight 2\nwidth 2\nmap\n..\n.\n", "line 6"),
    "octile, terrain": ("rooms.map", "type octile\nheight 1\nwidth 2\nmap\n.x\n", "called 'x'"),
    "octile, huge": ("rooms.map", "type octile\nheight 99999999\nwidth 9\nmap\n", "rooms.map"),
    "voxels, outside": ("rooms.3dmap", "voxel 2 2 2\n0 0 2\n", "voxel 0 0 2 is outside"),
    "problems, another map": (
        "rooms.scen",
        scenarios("1 1 18 11 30.5", map_name="maps/arena.map"),
        "arena.map",
    ),
    "problems, size": ("rooms.scen", scenarios("1 1 18 11 30.5", size=(9, 9)), "9"),
    "problems, outside": ("rooms.scen", scenarios("1 1 99 11 30.5"), "not on the map"),
    "problems, NaN": ("rooms.scen", scenarios("1 1 18 11 nan"), "nan"),
    "problem file, size": ("own.json", '[{"start": [0], "goal": [1]}]', "3 numbers, not 1"),
    "problem file, twice": ("own.json", '[{"start": [0], "start": [0]}]', "given twice"),
    "problem file, NaN": ("own.json", '[{"start": [NaN], "goal": [1]}]', "finite numbers"),
    "problem file, quote": ("own.csv", 'start_1,goal_1\n0,"1', "no CSV"),
    "problem file, column": ("own.csv", "start_1,gaol_1\n0,1\n", "'gaol_1'; did you mean"),
    "paths, size": ("paths.csv", "q1,q2\n0,0\n1,1\n", "2"),
    "paths, NaN": ("paths.csv", "q1,q2,q3\n0,0,nan\n1,1,1\n", "line 2 holds NaN"),
    "paths, twice": ("paths.json", '{"paths": [], "paths": []}', "given twice"),
    "paths, ragged": ("paths.txt", "0 0 0\n1 1\n", "paths.txt"),
    "cfg, no such mesh": ("own.cfg", cfg(robot="none.dae"), "none.dae"),
    "cfg, NaN": ("own.cfg", cfg(**{"start.x": "nan"}), "start.x"),
    "cfg, controls": ("own.cfg", cfg(control="blimp"), "control"),
    "cfg, twice": ("own.cfg", cfg() + "\nstart.x = 2", "start.x"),
    "mesh, index": ("box.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "box.obj"),
    "mesh, NaN": ("box.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "box.obj"),
    "mesh, huge": ("box.off", "OFF\n3 1 0\n1e300 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "box.off"),
}
"""By what is wrong: the file, what it holds, and what is said."""


@pytest.mark.parametrize("what", WITHIN)
def test_what_is_wrong_within(what: str, tmp_path: Path, refused: Refused) -> None:
    name, content, said = WITHIN[what]
    file, command = FILES[name](tmp_path / "files", name)
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert said in refused(*command)


OF_SETS = {
    "matrix": (
        mbm_files.scene(WALL, allowed_collision_matrix=SQUARE),
        mbm_files.request([0, 0], [1, 1]),
        "scene0001.yaml: its allowed_collision_matrix is not 2 by 2",
    ),
    "kind": (
        mbm_files.scene({**WALL, **KIND}),
        mbm_files.request([0, 0], [1, 1]),
        "scene0001.yaml: object 'wall' is a 'boks'; did you mean 'box'",
    ),
    "group": (
        mbm_files.scene(WALL),
        {**mbm_files.request([0, 0], [1, 1]), "group_name": "hand"},
        "hand",
    ),
    "goal": (
        mbm_files.scene(WALL),
        mbm_files.request([0, 0], [1]),
        "request0001.yaml: its goal does not say where joint 'elbow' of 'arm' is",
    ),
    "NaN": (
        mbm_files.scene(WALL),
        mbm_files.request([0, float("nan")], [1, 1]),
        "request0001.yaml: a start's value must be a number",
    ),
}


@pytest.mark.parametrize("what", OF_SETS)
def test_what_is_wrong_within_sets(what: str, tmp_path: Path, bench: Cli) -> None:
    scene, request, said = OF_SETS[what]
    mbm_files.write(tmp_path / "files" / "mbm" / "panda", {"box_panda": [(scene, request)]})
    code, out, err = bench(*problems("mbm-panda-box"))
    assert (code, out) == (2, "")
    errors = [line for line in err.splitlines() if "joints that stand still" not in line]
    assert len(errors) == 1
    assert said in errors[0]
