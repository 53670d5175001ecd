"""Learned planners in the real rooms of the folder of meshes, briefly trained."""

from __future__ import annotations

from pathlib import Path

import briefly_trained
import pytest
from real_rooms import ROOMS, solved

pytestmark = pytest.mark.training(minutes=4)


@pytest.mark.parametrize("room", ROOMS)
def test_of_100_ntfields_solves_95_after_a_32nd_of_its_training_and_rrt_connect_99(
    room: str, tmp_path: Path
) -> None:
    chosen = "ntfields,rrtconnect"
    counts = solved([briefly_trained.__file__], room, chosen, 100, tmp_path)
    assert counts["ntfields"] >= 95
    assert counts["rrtconnect"] >= 99
