"""What is kept of data on the way is gone on from, or refused in one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from envs import InputError
from planners.fields.labels import Labels
from planners.learning import resumable_map
from planners.learning.resumable_map import Pieces, made_in_parallel
from planners.mpnet.imitation import Demonstrations

NONE = {"labels": Labels.none(3, 4), "demonstrations": Demonstrations.none(3)}
SOME: dict[str, Pieces] = {
    "labels": Labels(
        np.ones((2, 3), dtype=np.float32),
        np.ones((2, 4, 3), dtype=np.float32),
        np.ones((2, 4), dtype=np.float32),
    ),
    "demonstrations": Demonstrations(
        np.ones((5, 3)), np.array([2, 3]), np.array([0, 1]), np.array([4, 4])
    ),
}

DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda data: b"",
    "half": lambda data: data[: len(data) // 2],
    "no end": lambda data: data[:-30],
    "text": lambda data: b"not an archive",
    "a pickle": lambda data: b"\x80\x04N.",
    "one byte of numbers": lambda data: data[:150] + bytes([data[150] ^ 255]) + data[151:],
    "noise within": lambda data: data[:60] + bytes(range(256)) + data[316:],
}


@pytest.fixture(params=NONE)
def what(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def kept(what: str, tmp_path: Path) -> Path:
    file = tmp_path / "x.data.npz"
    resumable_map._write(file, SOME[what], 7.0)
    return file


def gone_on(none: Pieces, kept: Path) -> tuple[Pieces, float]:
    """With nothing left to make."""
    made, seconds = made_in_parallel(
        Forbidden, (), 2, none=none, block=1, kept=kept, report=lambda share: None
    )
    return made, seconds


class Forbidden:
    """Makes nothing."""


def test_what_was_kept_is_gone_on_from(what: str, kept: Path) -> None:
    made, seconds = gone_on(NONE[what], kept)
    assert 7.0 <= seconds < 8.0
    for name, values in vars(SOME[what]).items():
        np.testing.assert_array_equal(getattr(made, name), values)


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_files_are_refused_in_one_line(what: str, kept: Path, damage: str) -> None:
    data = DAMAGES[damage](kept.read_bytes())
    kept.write_bytes(data)
    with pytest.raises(InputError, match=r"cannot go on from .*x\.data\.npz, delete it") as caught:
        gone_on(NONE[what], kept)
    assert "\n" not in str(caught.value)
    assert kept.read_bytes() == data  # what may be hours of work is not thrown away unasked


def test_data_of_another_kind_are_refused(what: str, kept: Path) -> None:
    [other] = [name for name in NONE if name != what]
    with pytest.raises(InputError, match="cannot go on from"):
        gone_on(NONE[other], kept)


@pytest.mark.parametrize("none", [Labels.none(2, 4), Labels.none(3, 5)])
def test_data_of_other_shapes_are_refused(none: Labels, tmp_path: Path) -> None:
    file = tmp_path / "x.data.npz"
    resumable_map._write(file, SOME["labels"], 7.0)
    with pytest.raises(InputError, match="it holds something else"):
        gone_on(none, file)


@pytest.mark.parametrize(
    "wrong",
    [
        {"lengths": np.array([2, 9])},
        {"lengths": np.array([2, 3, 1])},
        {"scenes": np.array([0, 2])},
        {"scenes": np.array([-1, 1])},
        {"waypoints": np.full((5, 3), np.nan)},
        {"waypoints": np.ones((5, 2))},
        {"tried": np.array([4.5, 4.0])},
        {"lengths": np.array(2)},
    ],
)
def test_arrays_that_do_not_go_together_are_refused(
    wrong: dict[str, np.ndarray], tmp_path: Path
) -> None:
    file = tmp_path / "x.data.npz"
    resumable_map._write(file, Demonstrations(**{**vars(SOME["demonstrations"]), **wrong}), 7.0)
    with pytest.raises(InputError, match="it holds something else"):
        gone_on(NONE["demonstrations"], file)


@pytest.mark.parametrize("seconds", [np.nan, np.inf, -1.0])
def test_seconds_that_are_none_are_refused(what: str, kept: Path, seconds: float) -> None:
    resumable_map._write(kept, SOME[what], seconds)
    with pytest.raises(InputError, match="it holds something else"):
        gone_on(NONE[what], kept)
