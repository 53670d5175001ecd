"""Where along a path a robot first touches something."""

from __future__ import annotations

import numpy as np
import pytest
from html_reports import through
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.report.postures import along
from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.collision.first_contact import first_contact
from envs.collision.shapes import Box
from envs.robots.point import PointRobot


@settings(deadline=None)
@given(st.floats(0.01, 0.99), st.integers(1, 5))
def test_on_a_line_it_is_where_the_clearance_ends(wall: float, segments: int) -> None:
    path = np.linspace(0, 1, segments + 1)[:, None]
    lengths = np.full(segments, 1 / segments)
    place = first_contact(lambda q: wall - float(q[0]), path, lengths, lengths, 1e-3, 10**6)
    assert wall - 1e-3 - 1e-9 <= place.share <= wall
    assert place.q[0] == pytest.approx(place.share)


def test_a_collision_is_marked_where_the_path_enters_a_box(c3d: Environment) -> None:
    model = c3d.collision_model()
    path = through(c3d.obstacles[0], c3d)  # type: ignore[arg-type]
    place = model.first_contact(path, 50_000)
    assert place.clearance <= model.tolerance
    shares = np.linspace(0, place.share, 2000)[:-1]
    before = c3d.clearance(along(c3d.space, path, shares))
    assert (before > 0).all(), "nothing was touched earlier"
    assert np.allclose(place.q, along(c3d.space, path, np.array([place.share]))[0])
    assert c3d.clearance(place.q[None])[0] == pytest.approx(0, abs=2e-3)


def test_of_a_path_that_touches_nothing_the_closest_place_is_marked(c3d: Environment) -> None:
    corner = c3d.upper - 0.1
    path = np.array([corner, corner - [0.5, 0, 0]])
    place = c3d.collision_model().first_contact(path, 50_000)
    assert place.clearance == pytest.approx(c3d.clearance(path).min(), abs=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("waypoints", [2, 300])
def test_a_long_way_beside_a_wall_is_not_followed_for_ever(waypoints: int) -> None:
    """Twice the tolerance above a floor, to and fro, into a box at the end."""
    floor, box = (
        Box(np.zeros(3), np.array([200.0, 200, 1])),
        Box(np.array([95.0, 95, 1]), np.ones(3)),
    )
    model = CollisionModel(PointRobot(0.1), [floor, box], 1e-3)
    ways = np.linspace(-90, 90, waypoints)
    path = np.stack([np.tile([-80.0, 80.0], waypoints)[:waypoints], ways, 0 * ways], axis=1)
    path = np.concatenate([path + [0, 0, 0.602], [[95, 95, 1]]])
    place = model.first_contact(path, 50_000)
    assert place.clearance <= model.tolerance
    assert place.share > 0.5
    assert model.checks <= 50_000 + 2 * len(path)


def test_a_path_of_one_waypoint_has_a_place_too(c3d: Environment) -> None:
    place = c3d.collision_model().first_contact(c3d.upper[None] - 0.1, 50_000)
    assert place.share == 0
