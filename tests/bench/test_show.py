"""Whose paths `bench show` draws, and where."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.image import imread

from bench.report.chosen_paths import Shown, of_planners
from bench.report.html.geometry import Scene
from bench.report.scene import draw
from envs import InputError
from envs.collision.shapes import Box
from envs.scenes.boxes import BoxWorld

KNOWN = ["fmm", "mine:sizes=1", "rrtstar:range=2", "mpnet"]
RECORDS = pd.DataFrame({"planner": KNOWN})


@pytest.mark.parametrize(
    ("text", "ids"),
    [
        ("all", KNOWN),
        ("fmm", ["fmm"]),
        ("mine:sizes=1", ["mine:sizes=1"]),
        ("mine:sizes=1,fmm", ["fmm", "mine:sizes=1"]),
        ("rrt*:range=2", ["rrtstar:range=2"]),
        ("paper", ["fmm", "mpnet"]),
    ],
)
def test_planners_go_by_their_ids_in_the_run_known_here_or_not(text: str, ids: list[str]) -> None:
    assert of_planners(RECORDS, text, Path("run"))["planner"].tolist() == ids


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("fmt", "run holds no path of 'fmt'; did you mean 'fmm'"),
        ("mine", "'mine:sizes=1'"),
        ("rrtstar", "did you mean 'rrtstar:range=2'"),
        ("fmm:resolution=x", "not of type int"),
        ("ablations", "run holds no path of 'ablations'"),
    ],
)
def test_others_are_refused_with_the_nearest_that_are_there(text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        of_planners(RECORDS, text, Path("run"))
    assert said in str(caught.value)


class Room(BoxWorld):
    """Six boxes as walls, and free space that is said to be enclosed."""

    kind_of_problems = "room"
    is_interior = True

    def __init__(self) -> None:
        walls = []
        for axis, side in itertools.product(range(3), (-9.5, 9.5)):
            center, sides = np.zeros(3), np.full(3, 20.0)
            center[axis], sides[axis] = side, 1.0
            walls.append(Box(center, sides))
        super().__init__(walls, 0.01)

    def definition(self) -> dict[str, Any]:
        return {"class": "Room"}


def test_a_room_of_boxes_is_drawn_seen_through(tmp_path: Path) -> None:
    """Boxes do not tell which side of them is in the room, as the meshes of buildings do."""
    world = Room()
    path = np.array([[-5.0, 0, 0], [5, 5, 5]])
    shown = Shown(0, {"fmm": path}, frozenset())
    draw(world, "room", shown, tmp_path / "room.png")
    assert len({tuple(pixel) for pixel in imread(tmp_path / "room.png").reshape(-1, 4)}) > 100
    scene = Scene(world)
    data = scene.data()
    assert not data["enclosed"]
    assert data["meshes"][0]["many"] == 72
    assert scene.drawn(path)["curves"]


def test_what_is_no_path_is_left_out(tmp_path: Path) -> None:
    path = np.array([[-5.0, 0, 0], [5, 5, 5]])
    odd = {"wide": np.zeros((2, 5)), "far": path * 1e9, "none": path * np.nan}
    for name, paths in (("some", {**odd, "fmm": path}), ("alone", {"fmm": path}), ("odd", odd)):
        draw(Room(), "room", Shown(0, paths, frozenset()), tmp_path / f"{name}.png")
    some, alone, none = (imread(tmp_path / f"{name}.png") for name in ("some", "alone", "odd"))
    assert (some == alone).all()
    assert (some != none).any()
