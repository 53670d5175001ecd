"""Titles of pictures: names of users' environments are long."""

from __future__ import annotations

import pytest

from bench.report.chosen_paths import Shown
from bench.report.picture_title import in_lines, picture_title


@pytest.mark.parametrize(
    ("text", "most", "lines"),
    [
        ("c3d:scene=3", 20, ["c3d:scene=3"]),
        ("c3d:scene=3", 11, ["c3d:scene=3"]),
        ("c3d:scene=3", 10, ["c3d:", "scene=3"]),
        (
            "arm:urdf=/a/folder/arm.urdf,tip=hand",
            16,
            ["arm:urdf=/a/", "folder/arm.urdf,", "tip=hand"],
        ),
        ("arm4, problem 12", 11, ["arm4,", "problem 12"]),
        ("a=1234567890,b", 5, ["a=123", "45678", "90,b"]),
        ("x", 1, ["x"]),
        ('arm:volume="-1,-1,1,1",tip=a', 23, ['arm:volume="-1,-1,1,1",', "tip=a"]),
    ],
)
def test_lines_end_where_a_name_has_joints(text: str, most: int, lines: list[str]) -> None:
    assert in_lines(text, most).split("\n") == lines


def test_a_title_is_as_wide_as_its_picture() -> None:
    name = 'arm:base="0.2,0,0.2",scene=/some/folder/scene.yaml,urdf=/some/folder/arm.urdf'
    shown = Shown(3, {}, frozenset())
    narrow, wide = (picture_title(name, shown, inches, 12.0) for inches in (4.8, 20.0))
    assert wide == f"{name}, problem 3"
    assert narrow.count("\n") == 2
    assert max(map(len, narrow.split("\n"))) <= 45, "which take 4.8 inches"
    assert narrow.replace("\n", "") == wide.replace(" problem", "problem")
