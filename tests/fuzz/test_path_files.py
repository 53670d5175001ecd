"""Files of paths, as any program may have written them."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from documents import block_after
from fuzzing import fuzzed
from hypothesis import strategies as st
from mutations import contents

from planners.recorded import path_file
from planners.recorded.path_file import PathFile

JSON = (
    block_after("paths: json"),
    '{"environment": "7e7d5e2e", "paths": [{"waypoints": [[1e-3, -2], [3, 4], [5.5, 6]]}]}',
    "[[0.5, 1], [2, 3]]",
)
CSV = (
    block_after("paths: csv"),
    '# seed: 3\npath,problem,failure,q1,q2\na,0,,1,2\na,0,,3,4\nb,1,"no, none",,\n',
    "0.5,1\n2,3\n\n4,5\n6,7\n",
)
MATRICES = (block_after("paths: txt"), "0.5 1 \n2 3 \n\n4 5 \n6 7 \n\n")


def reader(file: Path) -> Callable[[bytes], PathFile]:
    """Reads what it is given from a file."""

    def parse(content: bytes) -> PathFile:
        file.write_bytes(content)
        return path_file.read(file)

    return parse


def check(found: PathFile) -> None:
    assert found.paths
    for path in found.paths:
        assert path.problem is None or path.problem >= 0
        assert path.solve_s is None or 0 <= path.solve_s < np.inf
        assert path.failure.isprintable()
        if path.waypoints is not None:
            assert path.waypoints.dtype == np.float64
            assert len(path.waypoints) >= 2
            assert np.isfinite(path.waypoints).all()


def test_json(tmp_path: Path) -> None:
    fuzzed("paths as JSON", contents(JSON), reader(tmp_path / "paths.json"), check)


def test_csv(tmp_path: Path) -> None:
    fuzzed("paths as CSV", contents(CSV), reader(tmp_path / "paths.csv"), check)


def test_matrices(tmp_path: Path) -> None:
    fuzzed("paths as matrices", contents(MATRICES), reader(tmp_path / "paths.txt"), check)


@pytest.fixture(scope="module")
def archive() -> bytes:
    file = BytesIO()
    paths = {"waypoints": np.arange(8.0).reshape(4, 2), "lengths": [2, 0, 2]}
    np.savez(file, **paths, problem=[0, 1, 2], status=["", "TIMEOUT", ""], seed=3)
    return file.getvalue()


def test_arrays(tmp_path: Path, archive: bytes) -> None:
    """With one byte changed, or cut short."""

    def changed(place: tuple[int, int]) -> bytes:
        at, byte = place[0] % len(archive), place[1]
        return archive[:at] + (b"" if byte >= 250 else bytes([byte]) + archive[at + 1 :])

    places = st.tuples(st.integers(0, len(archive) - 1), st.integers(0, 255)).map(changed)
    fuzzed("paths as arrays", [places], reader(tmp_path / "paths.npz"), check)
