"""Learned planners in the real rooms of the folder of meshes, briefly trained."""

from __future__ import annotations

from pathlib import Path

import briefly_trained
import pytest
from real_rooms import ROOMS, solved

pytestmark = pytest.mark.training(minutes=8)


@pytest.mark.parametrize("room", ROOMS)
def test_ntfields_solves_95_of_100_after_an_eighth_of_its_training(
    room: str, tmp_path: Path
) -> None:
    counts = solved([briefly_trained.__file__], room, "ntfields", tmp_path)
    assert counts["ntfields"] >= 95
