"""Data that is kept on the way: gone on from if it is whole, refused in one line if it is not."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from envs import InputError
from planners.fields.labels import Labels
from planners.mpnet.demonstrations import Demonstrations
from planners.parallel import made_in_parallel


def labels(n: int) -> dict[str, Any]:
    shapes = {"sources": (n, 3), "goals": (n, 5, 3), "stretch": (n, 5)}
    return {name: np.zeros(shape, dtype=np.float32) for name, shape in shapes.items()}


def make() -> Any:
    return lambda item: Labels(**labels(1))


def finished(file: Path) -> Labels:
    made, _ = made_in_parallel(
        make, (), 3, none=Labels.none(3, 5), block=1, kept=file, report=lambda share: None
    )
    return made


def npz(**arrays: Any) -> bytes:
    held = io.BytesIO()
    np.savez(held, **arrays)
    return held.getvalue()


WHOLE = npz(seconds=1.0, **labels(2))
DAMAGED = {
    "empty": b"",
    "text": b"not an archive",
    "half": WHOLE[: len(WHOLE) // 2],
    "cut by a byte": WHOLE[:-1],
    "another byte": WHOLE[:150] + bytes([WHOLE[150] ^ 255]) + WHOLE[151:],
    "an array alone": WHOLE[30:200],
    "no arrays": npz(seconds=1.0),
    "one missing": npz(seconds=1.0, **{k: v for k, v in labels(2).items() if k != "goals"}),
    "no seconds": npz(**labels(2)),
    "seconds are text": npz(seconds="long", **labels(2)),
    "seconds are many": npz(seconds=np.ones(3), **labels(2)),
    "seconds are none": npz(seconds=np.nan, **labels(2)),
    "objects": npz(seconds=1.0, **{**labels(2), "goals": np.array([{}, []], dtype=object)}),
    "doubles": npz(seconds=1.0, **{k: v.astype(float) for k, v in labels(2).items()}),
    "another dimension": npz(seconds=1.0, **{**labels(2), "goals": np.zeros((2, 5, 4), "f4")}),
    "a number": npz(seconds=1.0, **{**labels(2), "goals": np.float32(3)}),
    "unlike lengths": npz(seconds=1.0, **{**labels(2), "stretch": labels(1)["stretch"]}),
    "more than asked for": npz(seconds=1.0, **labels(9)),
    "not finite": npz(seconds=1.0, **{**labels(2), "stretch": np.full((2, 5), np.nan, "f4")}),
}


@pytest.mark.usefixtures("in_this_process")
@pytest.mark.parametrize("content", DAMAGED.values(), ids=DAMAGED)
def test_damaged_data_is_named(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "x.data.npz"
    file.write_bytes(content)
    with pytest.raises(InputError) as caught:
        finished(file)
    said = str(caught.value)
    assert said.startswith(f"cannot go on from {file}, delete it: ")
    assert "\n" not in said
    assert file.read_bytes() == content, "it is the user's to delete"


@pytest.mark.usefixtures("in_this_process")
def test_whole_data_is_gone_on_from(tmp_path: Path) -> None:
    file = tmp_path / "x.data.npz"
    file.write_bytes(WHOLE)
    assert finished(file).finished == 3
    file.unlink()
    file.mkdir()
    with pytest.raises(InputError, match="cannot"):
        finished(file)


@pytest.mark.parametrize(
    "other",
    [
        {"lengths": np.array([2, 2])},
        {"lengths": np.array([1, 4])},
        {"scenes": np.array([0, 7])},
        {"scenes": np.array([0])},
        {"waypoints": np.zeros((4, 3))},
    ],
)
def test_demonstrations_know_what_belongs_together(other: dict[str, Any]) -> None:
    parts = {
        "waypoints": np.zeros((5, 3)),
        "lengths": np.array([2, 3]),
        "scenes": np.array([0, 1]),
        "tried": np.array([4, 4]),
    }
    assert Demonstrations(**parts).is_consistent()
    assert not Demonstrations(**{**parts, **other}).is_consistent()
