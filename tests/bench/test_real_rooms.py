"""Planners without training in the real rooms of the folder of meshes."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_rooms import ROOMS, solved

pytestmark = pytest.mark.slow(minutes=4)


@pytest.mark.parametrize("room", ROOMS)
def test_fast_marching_solves_99_of_100(room: str, tmp_path: Path) -> None:
    assert solved(["-m", "bench"], room, "fmm", 100, tmp_path)["fmm"] >= 99
