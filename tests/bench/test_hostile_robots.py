"""Arms and scenes that nobody should load, through the command line: one line, and nothing else is
read, run, changed or made."""

from __future__ import annotations

from pathlib import Path

import pytest
import trimesh
from bad_urdfs import AB, BAD_URDFS, A, B, robot, with_shape
from conftest import Refused

GOOD = robot(A, B, AB)
SCENE = "obstacles:\n  - {box: [0.1, 0.1, 0.1], position: [1, 0, 0]}\n"


def refusal(refused: Refused, folder: Path, urdf: str, scene: str = SCENE) -> str:
    """In `folder/package/urdf`, what is said of both files, which stay as they are."""
    inside = folder / "package" / "urdf"
    inside.mkdir(parents=True, exist_ok=True)
    files = {inside / "arm.urdf": urdf, inside / "scene.yaml": scene}
    for file, text in files.items():
        file.write_text(text, encoding="utf-8")
    arm, world = files
    said = refused(
        *("run", "--env", f"arm:urdf={arm},scene={world}", "--planners", "rrtconnect"),
        *("--problems", 1, "--out", "run"),
    )
    assert {file: file.read_text(encoding="utf-8") for file in files} == files
    return said


@pytest.mark.parametrize("name", BAD_URDFS)
def test_bad_urdfs_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    text, said = BAD_URDFS[name]
    assert said in refusal(refused, tmp_path, text)


def laughs(levels: int, each: int) -> str:
    """Ten to the power of `levels` laughs, if anybody wrote them all out."""
    entities = ['<!ENTITY e0 "ha">'] + [
        f'<!ENTITY e{n + 1} "{f"&e{n};" * each}">' for n in range(levels)
    ]
    return f'<!DOCTYPE robot [{"".join(entities)}]><robot name="&e{levels};">{A}{B}{AB}</robot>'


def quadratic(length: int, times: int) -> str:
    return (
        f'<!DOCTYPE robot [<!ENTITY e "{"a" * length}">]>'
        f'<robot name="a">{A}{B}{AB}{"&e;" * times}</robot>'
    )


def external(place: str) -> str:
    return f'<!DOCTYPE robot [<!ENTITY e SYSTEM "{place}">]><robot name="a">&e;{A}{B}{AB}</robot>'


BOMBS = {
    "billion laughs": laughs(9, 10),
    "ten to the thirtieth": laughs(30, 10),
    "quadratic": quadratic(100_000, 10_000),
    "itself": '<!DOCTYPE robot [<!ENTITY e "&e;">]><robot name="&e;"/>',
    "a file": external("file:///etc/passwd"),
    "an address": external("http://localhost:9/x"),
    "parameter": '<!DOCTYPE robot [<!ENTITY % p SYSTEM "http://localhost:9/x"> %p;]><robot/>',
    "deep": "<robot name='a'>" + "<link>" * 120_000,
    "deep and closed": robot(A, B, AB, "<x>" * 300 + "</x>" * 300),
    "100,000 links": robot(*(f'<link name="l{n}"/>' for n in range(100_000))),
}


@pytest.mark.parametrize("name", BOMBS)
def test_xml_bombs_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    said = refusal(refused, tmp_path, BOMBS[name])
    assert "arm.urdf" in said
    assert "root:" not in said, "no line of another file is shown"


CLIMBING = [
    "../../secret.stl",
    "../package/../../secret.stl",
    "meshes/../../../secret.stl",
    "FOLDER/secret.stl",
    "file://FOLDER/secret.stl",
    "file://../../secret.stl",
    "package://../secret.stl",
    "package://package/../../secret.stl",
]


@pytest.mark.parametrize("name", CLIMBING)
def test_meshes_outside_are_not_read(name: str, tmp_path: Path, refused: Refused) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "secret.stl")
    name = name.replace("FOLDER", str(tmp_path))
    said = refusal(refused, tmp_path, with_shape(f'<mesh filename="{name}"/>'))
    assert "climbs out" in said
    if "://" not in name:
        said = refusal(refused, tmp_path, GOOD, f"obstacles:\n  - mesh: {name}\n")
        assert "climbs out" in said


@pytest.mark.parametrize(
    "name",
    [
        *("gone.stl", "meshes/gone.ply", "package://gone/meshes/a.stl", "file:///gone.stl"),
        *("http://localhost:9/a.stl", "https://localhost:9/a.stl", "model://a/b.stl"),
    ],
)
def test_missing_meshes_are_named(name: str, tmp_path: Path, refused: Refused) -> None:
    said = refusal(refused, tmp_path, with_shape(f'<mesh filename="{name}"/>'))
    assert "no such mesh" in said or "climbs out" in said
    assert name in said


def merged(levels: int) -> str:
    lines = ["a0: &a0 {box: [1, 1, 1]}"]
    lines += [f"a{n + 1}: &a{n + 1} [{', '.join([f'*a{n}'] * 9)}]" for n in range(levels)]
    return "\n".join(lines) + f"\nobstacles: *a{levels}\n"


SCENES = {
    "empty": "",
    "no YAML": "obstacles: [",
    "a bomb": merged(12),
    "merged": "a: &a {box: [1, 1, 1]}\nobstacles:\n  - {<<: *a}\n",
    "itself": "obstacles: &a\n  - *a\n",
    "code": "obstacles: !!python/object/apply:os.system ['touch ran']\n",
    "module": "obstacles: !!python/module:antigravity\n",
    "deep": "obstacles: " + "[" * 120_000,
    "NaN": "obstacles:\n  - {box: [.nan, 1, 1]}\n",
    "infinite": "obstacles:\n  - {sphere: .inf}\n",
    "negative": "obstacles:\n  - {sphere: -1}\n",
    "flat": "obstacles:\n  - {box: [0, 1, 1]}\n",
    "unknown": "obstacles:\n  - {bocks: [1, 1, 1]}\n",
    "two shapes": "obstacles:\n  - {box: [1, 1, 1], sphere: 1}\n",
    "twice": "obstacles: []\nobstacles: []\n",
    "large": "obstacles:\n" + "  - {sphere: 0.1, position: [9, 9, 9]}\n" * 120_000,
    "missing mesh": "obstacles:\n  - {mesh: gone.stl}\n",
}


@pytest.mark.parametrize("name", SCENES)
def test_hostile_scenes_are_refused(name: str, tmp_path: Path, refused: Refused) -> None:
    assert "scene.yaml" in refusal(refused, tmp_path, GOOD, SCENES[name])
    assert not list(tmp_path.rglob("ran"))
