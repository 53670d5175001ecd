"""Planners without training in the real rooms of the folder of meshes."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_rooms import ROOMS, solved

pytestmark = pytest.mark.slow(minutes=2)


@pytest.mark.parametrize("room", ROOMS)
def test_fast_marching_solves_all_of_20(room: str, tmp_path: Path) -> None:
    """Of 100 it solves 99 at least, but takes a second for each."""
    assert solved(["-m", "bench"], room, "fmm", 20, tmp_path) == {"fmm": 20}
