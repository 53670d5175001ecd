"""Files of occupancy grids."""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
from fuzzing import flipped, fuzzed
from hypothesis import strategies as st
from map_files import (
    YAML,
    occupied,
    scenarios,
    voxel_text,
    voxels,
    write_image,
    write_octile,
)
from mutations import contents

from envs.files.map_file import read_map, read_problems
from envs.files.map_formats.cells import Cells
from envs.files.map_formats.moving_ai import Scenarios


def check(cells: Cells) -> None:
    assert cells.occupied.dtype == np.bool_
    assert cells.occupied.ndim in (2, 3)
    assert 0 < cells.occupied.sum() < cells.occupied.size
    assert 0 <= cells.unknown <= 1
    assert cells.resolution >= 0
    assert cells.origin is None or np.isfinite(cells.origin).all()


def test_maps_of_ros(tmp_path: Path) -> None:
    write_image(tmp_path / "map.pgm")
    file = tmp_path / "map.yaml"
    yaml = YAML.format(image="map.pgm")

    def parse(content: bytes) -> Cells:
        file.write_bytes(content)
        return read_map(str(file))

    fuzzed("maps of ROS", contents([yaml, yaml + "mode: scale\n"]), parse, check)


def test_maps_of_moving_ai(tmp_path: Path) -> None:
    file = tmp_path / "own.map"

    def parse(content: bytes) -> Cells:
        file.write_bytes(content)
        return read_map(str(file))

    rng = np.random.default_rng(0)
    rows = ["".join(rng.choice(list("GSTOW"), 5)) for _ in range(20)]  # words, that may be others
    text = "\n".join(["type octile", "height 20", "width 5", "map", *rows])
    fuzzed("maps of Moving AI", contents([text]), parse, check)


def test_voxels_of_moving_ai(tmp_path: Path) -> None:
    file = tmp_path / "own.3dmap"

    def parse(content: bytes) -> Cells:
        file.write_bytes(content)
        return read_map(str(file))

    few = "voxel 3 4 5\n0 1 2\n2 3 4\n"
    fuzzed("voxels of Moving AI", contents([few, voxel_text(voxels()[:5, :3, :3])]), parse, check)


def test_images_and_arrays(tmp_path: Path) -> None:
    images = [write_image(tmp_path / f"map.{ending}") for ending in ("pgm", "png", "bmp")]
    np.save(tmp_path / "cubes.npy", voxels())
    np.save(tmp_path / "chances.npy", occupied().astype(np.float64))
    files = [*images, tmp_path / "cubes.npy", tmp_path / "chances.npy"]
    samples = [(file.suffix, file.read_bytes()) for file in files]

    def parse(given: tuple[str, bytes]) -> Cells:
        ending, content = given
        file = tmp_path / f"own{ending}"
        file.unlink(missing_ok=True)  # one that is mapped into memory stays as it is
        file.write_bytes(content)
        return read_map(str(file))

    def changed(seed: bytes) -> tuple[str, bytes]:
        ending, content = random.Random(seed).choice(samples)
        return ending, flipped(seed[::-1], content)

    inputs = st.binary(min_size=8, max_size=8).map(changed)
    fuzzed("images and arrays of maps", [inputs], parse, check)


def test_problems_of_moving_ai(tmp_path: Path) -> None:
    of_map = str(write_octile(tmp_path))
    cells, file = read_map(of_map), tmp_path / "rooms.scen"

    def parse(content: bytes) -> Scenarios:
        file.write_bytes(content)
        return read_problems(str(file), of_map, cells)

    def check_problems(found: Scenarios) -> None:
        assert ((found.ends >= 0) & (found.ends < cells.occupied.shape)).all()
        assert (np.isfinite(found.lengths) & (found.lengths >= 0)).all()
        assert len(found.ends) == len(found.lengths) == len(found.lines)

    text = scenarios("1 1 18 11 30.5", "3 2 1 1 2.41421356")
    spaced = text.replace("\t", " ")
    fuzzed("problems of Moving AI", contents([text, spaced]), parse, check_problems)
