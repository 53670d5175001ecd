"""Files of occupancy grids: what is in them, and that what is wrong is said in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from map_files import (
    ROOMS,
    YAML,
    occupied,
    octile,
    rows_of,
    scenarios,
    shades,
    voxel_text,
    voxels,
    write_image,
    write_octile,
    write_ros,
)
from PIL import Image

from envs import InputError
from envs.files.map_file import read_map, read_problems

UNSURE = ROOMS.replace("##...#", "?#...#", 1)


def refused(file: Path, unknown: str = "occupied") -> str:
    """What is said of a file that is refused."""
    with pytest.raises(InputError) as caught:
        read_map(str(file), unknown)
    return str(caught.value)


@pytest.mark.parametrize("ending", ["pgm", "png", "bmp"])
def test_images(tmp_path: Path, ending: str) -> None:
    cells = read_map(str(write_image(tmp_path / f"map.{ending}")))
    assert (cells.occupied == occupied()).all()
    assert cells.resolution == 0
    assert cells.default_resolution == 0.05
    assert cells.unknown == 0


def test_a_pgm_of_text(tmp_path: Path) -> None:
    numbers = "\n".join(" ".join(map(str, row)) for row in shades())
    (tmp_path / "map.pgm").write_text(f"P2\n# by hand\n20 13\n255\n{numbers}\n")
    assert (read_map(str(tmp_path / "map.pgm")).occupied == occupied()).all()


def test_images_of_other_depths(tmp_path: Path) -> None:
    Image.fromarray(shades().astype(np.uint16) * 257).save(tmp_path / "deep.png")
    Image.fromarray(shades() > 128).save(tmp_path / "bits.png")
    Image.fromarray(shades()).convert("RGB").save(tmp_path / "grey.png")
    Image.fromarray(shades()).convert("P").save(tmp_path / "palette.png")
    for name in ("deep", "bits", "grey", "palette"):
        assert (read_map(str(tmp_path / f"{name}.png")).occupied == occupied()).all(), name


def test_what_is_not_known_counts_as_is_said(tmp_path: Path) -> None:
    file = write_image(tmp_path / "map.pgm", UNSURE)
    safe, bold = read_map(str(file)), read_map(str(file), "free")
    assert safe.unknown == bold.unknown == 1 / 260
    assert (safe.occupied == occupied()).all()
    assert (bold.occupied == occupied(UNSURE)).all()


def test_what_is_transparent_is_not_known(tmp_path: Path) -> None:
    pixels = np.stack([shades(), np.full((13, 20), 255, np.uint8)], axis=-1)
    pixels[4, 4, 1] = 0
    Image.fromarray(pixels, "LA").save(tmp_path / "map.png")
    cells = read_map(str(tmp_path / "map.png"))
    assert cells.occupied[4, 8]
    assert cells.occupied.sum() == occupied().sum() + 1


def test_a_map_of_ros(tmp_path: Path) -> None:
    cells = read_map(str(write_ros(tmp_path)))
    assert (cells.occupied == occupied()).all()
    assert cells.resolution == 0.1
    assert cells.origin is not None
    assert cells.origin.tolist() == [-1, 2]
    assert cells.notes == ()


def test_a_map_of_ros_of_light_on_dark(tmp_path: Path) -> None:
    write_ros(tmp_path, yaml=YAML.replace("negate: 0", "negate: 1"))
    Image.fromarray(255 - shades()).save(tmp_path / "map.pgm")
    assert (read_map(str(tmp_path / "map.yaml")).occupied == occupied()).all()


@pytest.mark.parametrize(
    ("mode", "shade", "expected"),
    [
        *(("trinary", shade, expected) for shade, expected in ((89, 1), (90, 0.5), (205, 0.5))),
        *(("scale", shade, expected) for shade, expected in ((89, 1), (90, 0.5), (206, 0))),
        *(("raw", shade, expected) for shade, expected in ((66, 1), (65, 0.5), (20, 0.5))),
        *(("raw", shade, expected) for shade, expected in ((19, 0), (100, 1), (101, 0.5))),
    ],
)
def test_thresholds_are_those_of_map_server(
    tmp_path: Path, mode: str, shade: int, expected: float
) -> None:
    """A shade is surely free (0), surely occupied (1), or not known (0.5)."""
    write_ros(tmp_path, yaml=YAML + f"mode: {mode}\n")
    free, black = (0, 100) if mode == "raw" else (254, 0)
    Image.fromarray(np.array([[free, black, shade]], np.uint8)).save(tmp_path / "map.pgm")
    found = [read_map(str(tmp_path / "map.yaml"), u).occupied[2, 0] for u in ("occupied", "free")]
    assert sum(found) / 2 == expected


def test_numbers_may_be_written_with_exponents(tmp_path: Path) -> None:
    cells = read_map(str(write_ros(tmp_path, yaml=YAML.replace("0.1\n", "5e-2\n"))))
    assert cells.resolution == 0.05


def test_a_yaw_is_left_out_and_said(tmp_path: Path) -> None:
    cells = read_map(str(write_ros(tmp_path, yaml=YAML.replace("2.0, 0.0]", "2.0, 0.5]"))))
    assert "yaw of 0.5" in cells.notes[0]


@pytest.mark.parametrize("kind", [bool, np.uint8, np.int64, np.float32])
def test_arrays_of_rows(tmp_path: Path, kind: type) -> None:
    np.save(tmp_path / "map.npy", occupied().T[::-1].astype(kind))
    assert (read_map(str(tmp_path / "map.npy")).occupied == occupied()).all()


def test_arrays_in_space_are_of_x_y_and_z(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", np.asfortranarray(voxels()))
    assert (read_map(str(tmp_path / "map.npy")).occupied == voxels()).all()


def test_arrays_of_probabilities(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", [[0.0, 0.19, 0.2, 0.65, 0.66, 1]])
    assert read_map(str(tmp_path / "map.npy")).occupied[:, 0].tolist() == [0, 0, 1, 1, 1, 1]
    free = read_map(str(tmp_path / "map.npy"), "free").occupied[:, 0]
    assert free.tolist() == [0, 0, 0, 0, 1, 1]


def test_a_map_of_moving_ai(tmp_path: Path) -> None:
    cells = read_map(str(write_octile(tmp_path)))
    assert (cells.occupied == occupied()).all()
    assert (cells.default_resolution, cells.unit) == (1, "cells")
    terrain = "type octile\nheight 2\nwidth 4\nmap\n.GS@\nOTW.\n"
    (tmp_path / "own.map").write_bytes(terrain.replace("\n", "\r\n").encode())
    assert read_map(str(tmp_path / "own.map")).occupied.T.tolist() == [[1, 1, 1, 0], [0, 0, 0, 1]]


def test_voxels_of_moving_ai(tmp_path: Path) -> None:
    (tmp_path / "own.3dmap").write_text(voxel_text(voxels()))
    assert (read_map(str(tmp_path / "own.3dmap")).occupied == voxels()).all()


def test_problems_of_moving_ai(tmp_path: Path) -> None:
    file = write_octile(tmp_path)
    (tmp_path / "rooms.map.scen").write_text(scenarios("1 1 18 11 30.5", "3 2 1 1 2.41421356"))
    cells = read_map(str(file))
    found = read_problems(str(tmp_path / "rooms.map.scen"), str(file), cells)
    assert found.ends.tolist() == [[[1, 11], [18, 1]], [[3, 10], [1, 11]]]
    assert found.lengths.tolist() == [30.5, 2.41421356]
    assert found.lines.tolist() == [2, 3]


def test_problems_among_voxels(tmp_path: Path) -> None:
    (tmp_path / "own.3dmap").write_text(voxel_text(voxels()))
    (tmp_path / "own.3dmap.3dscen").write_text(
        "version 1\nown.3dmap\n0 0 0 11 9 7 14.25 1.2\n1 2 3 2 2 3 1 1\n"
    )
    file = str(tmp_path / "own.3dmap")
    found = read_problems(file + ".3dscen", file, read_map(file))
    assert found.ends.tolist() == [[[0, 0, 0], [11, 9, 7]], [[1, 2, 3], [2, 2, 3]]]
    assert found.lengths.tolist() == [14.25, 1]


def changed(old: str, new: str) -> Callable[[Path], Path]:
    """Writes a map of ROS whose YAML says something else."""

    def write(folder: Path) -> Path:
        assert old in YAML
        return write_ros(folder, yaml=YAML.replace(old, new))

    return write


def of_text(name: str, text: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(text)
        return folder / name

    return write


def of_array(values: object) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        np.save(folder / "map.npy", np.array(values))
        return folder / "map.npy"

    return write


def huge_array(folder: Path) -> Path:
    header = "{'descr': '|b1', 'fortran_order': False, 'shape': (100000, 100000), }"
    content = b"\x93NUMPY\x01\x00v\x00" + header.ljust(117).encode() + b"\n"
    (folder / "map.npy").write_bytes(content)
    return folder / "map.npy"


def huge_image(folder: Path) -> Path:
    (folder / "map.pgm").write_bytes(b"P5 12000 12000 255\n")
    return folder / "map.pgm"


def coloured(folder: Path) -> Path:
    pixels = np.repeat(shades()[..., None], 3, axis=2)
    pixels[2, 3] = [255, 0, 0]
    Image.fromarray(pixels).save(folder / "map.png")
    return folder / "map.png"


def cut_off(folder: Path) -> Path:
    file = write_image(folder / "map.pgm")
    file.write_bytes(file.read_bytes()[:-40])
    return file


HEAD = "type octile\nheight 2\nwidth 3\nmap\n"

BAD = {
    "no file": (lambda folder: folder / "map.pgm", "no such file"),
    "no format": (of_text("map.jpg", ""), "no map's name ends so"),
    "no image": (of_text("map.pgm", "hello"), "no image in PGM, PNG or BMP"),
    "an image that ends early": (cut_off, "cannot read"),
    "colours": (coloured, r"colours \(row 3, column 4\)"),
    "a huge image": (huge_image, "12000 x 12000 cells is too large"),
    "no image beside the YAML": (changed("{image}", "other.pgm"), "other.pgm does not exist"),
    "an image elsewhere": (changed("{image}", "../../other.pgm"), "climbs out"),
    "a name that is none": (changed("{image}", "[1]"), "name of a file"),
    "no resolution": (changed("resolution: 0.1", "size: 3"), "needs 'resolution'; it has 'size'"),
    "resolution 0": (changed("0.1", "0"), "resolution must be above 0"),
    "resolution of words": (changed("0.1", "fine"), "finite number, not 'fine'"),
    "an origin in the plane": (changed("[-1.0, 2.0, 0.0]", "[0, 0]"), "must be .x, y, yaw."),
    "an origin far away": (changed("-1.0", "1.0e9"), "within 1e\\+06 metres"),
    "thresholds out of order": (changed("0.196", "0.7"), "not be above .* not 0.7 and 0.65"),
    "negate": (changed("negate: 0", "negate: maybe"), "0 or 1, not 'maybe'"),
    "mode": (changed("negate: 0", "negate: 0\nmode: scaled"), "did you mean 'scale'"),
    "no YAML": (of_text("map.yaml", "image: ["), "cannot read"),
    "YAML of something else": (of_text("map.yaml", "- 1"), "not a map of ROS"),
    "no array": (of_text("map.npy", "hello"), "cannot read"),
    "a huge array": (huge_array, "cannot read|too large"),
    "an empty array": (of_array(np.zeros((0, 3))), "0 x 3 cells is empty"),
    "an array of one axis": (of_array([0, 1]), "2 or 3 axes, not 1"),
    "an array of words": (of_array([["a"]]), "not str"),
    "NaN": (of_array([[0, np.nan, 1]]), r"from 0 to 1, not nan as at \(0, 1\)"),
    "percent": (of_array([[0, 100]]), r"must be 0 or 1, not 100 as at \(0, 1\)"),
    "no free space": (of_array([[True, True]]), "all cells are occupied; there is no free"),
    "nothing occupied": (of_array([[False]]), "no cell is occupied"),
    "no header": (of_text("a.map", "..\n@@\n"), "begins with the lines 'type octile'"),
    "another type": (of_text("a.map", HEAD.replace("octile", "tile")), "'type octile'"),
    "no height": (of_text("a.map", HEAD.replace("height 2", "height x")), "no whole number"),
    "no width": (of_text("a.map", HEAD.replace("width", "depth")), "no line 'width N'"),
    "few rows": (of_text("a.map", HEAD + "...\n"), "says height 2, but has 1 rows"),
    "a short row": (of_text("a.map", HEAD + "...\n..\n"), "line 6 has 2 characters"),
    "unknown terrain": (of_text("a.map", HEAD + "..@\n.x.\n"), "line 6, column 2: .* 'x'"),
    "a huge map": (of_text("a.map", HEAD.replace("2", "999999999")), "too large"),
    "no voxels": (of_text("a.3dmap", "voxels 1 2 3\n"), "begins with the line 'voxel W H D'"),
    "no blocked voxels": (of_text("a.3dmap", "voxel 1 2 3\n"), "no data|no cell is occupied"),
    "huge voxels": (of_text("a.3dmap", "voxel 5000 5000 5000\n1 1 1\n"), "too large"),
    "voxels outside": (of_text("a.3dmap", "voxel 2 2 2\n0 0 2\n"), "0 0 2 is outside of 2 x 2 x 2"),
    "two coordinates": (of_text("a.3dmap", "voxel 2 2 2\n0 0\n"), "have 2 numbers"),
    "no coordinates": (of_text("a.3dmap", "voxel 2 2 2\n0 0 1\n0 a 0\n"), "row 1, column 2"),
    "parts of voxels": (of_text("a.3dmap", "voxel 2 2 2\n0 0.5 1\n"), "x, y and z of a blocked"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_said_in_one_line(tmp_path: Path, name: str) -> None:
    write, said = BAD[name]
    folder = tmp_path / "maps" / "here"
    folder.mkdir(parents=True)
    with pytest.raises(InputError, match=said) as caught:
        read_map(str(write(folder)))
    assert "\n" not in str(caught.value)


def test_unknown_must_be_one_of_two(tmp_path: Path) -> None:
    assert "not 'maybe'" in refused(write_image(tmp_path / "map.pgm"), "maybe")


GOOD = "1 1 18 11 30.5"

BAD_PROBLEMS = {
    "another map": (scenarios(GOOD, map_name="maps/arena.map"), "line 2 is of the map"),
    "another size": (scenarios(GOOD, size=(20, 14)), "20 x 14, not of 20 x 13"),
    "no version": (scenarios(GOOD).replace("version 1", "version 2"), "'version 1'"),
    "nothing": ("", "'version 1'"),
    "no problem": ("version 1\n\n", "holds no problem"),
    "few fields": (scenarios("1 1 18 11"), "line 2 has 8 fields"),
    "off the map": (scenarios(GOOD, "1 1 20 1 3"), "line 3: its start or goal is not on"),
    "no number": (scenarios("1 x 1 1 3"), "'x' is no whole number"),
    "no length": (scenarios("1 1 2 1 nan"), "'nan' is no length"),
}


@pytest.mark.parametrize("name", BAD_PROBLEMS)
def test_bad_problems_are_refused(tmp_path: Path, name: str) -> None:
    text, said = BAD_PROBLEMS[name]
    file = str(write_octile(tmp_path))
    (tmp_path / "rooms.scen").write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        read_problems(str(tmp_path / "rooms.scen"), file, read_map(file))
    assert "\n" not in str(caught.value)


def test_problems_are_of_moving_ais_maps(tmp_path: Path) -> None:
    file = str(write_image(tmp_path / "map.png"))
    (tmp_path / "rooms.scen").write_text(scenarios(GOOD))
    with pytest.raises(InputError, match=r"a \.scen of a \.map"):
        read_problems(str(tmp_path / "rooms.scen"), file, read_map(file))
    with pytest.raises(InputError, match="no such file"):
        read_problems(str(tmp_path / "none.scen"), file, read_map(file))


@pytest.mark.parametrize("bad", ["1 1 1 2 2 2", "a 1 1 2 2 2 3 1", "1 1 1 2 2 99 3 1"])
def test_bad_problems_among_voxels_are_refused(tmp_path: Path, bad: str) -> None:
    file = str(tmp_path / "own.3dmap")
    Path(file).write_text(voxel_text(voxels()))
    Path(file + ".3dscen").write_text(f"version 1\nown.3dmap\n0 0 0 3 3 3 6 1\n{bad}\n")
    with pytest.raises(InputError, match="line 4"):
        read_problems(file + ".3dscen", file, read_map(file))


def test_drawings_are_as_they_say() -> None:
    assert {len(row) for row in rows_of(ROOMS)} == {20}
    assert octile().count("@") == occupied().sum()
