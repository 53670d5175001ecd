"""Planners without training in the real rooms of the folder of meshes."""

from __future__ import annotations

from pathlib import Path

import pytest
from real_rooms import ROOMS, solved

pytestmark = pytest.mark.slow(minutes=5)


@pytest.mark.parametrize("room", ROOMS)
def test_classical_planners_solve_99_of_100(room: str, tmp_path: Path) -> None:
    counts = solved(["-m", "bench"], room, "fmm,rrtconnect", tmp_path)
    assert counts["fmm"] >= 99
    assert counts["rrtconnect"] >= 99
