"""Certified checks along the shortest ways of spaces that wrap and turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Box, Obstacle, PlacedShape, Solid, Sphere
from envs.problem import Array
from envs.spaces import Coordinates, Rotations, Space

TOLERANCE = 1e-3
PI = np.pi


class Body:
    """A box of sides (2, 0.3, 0.2) that moves and turns, in the plane or in space."""

    moving = 1
    pairs: tuple[tuple[int, int], ...] = ()

    def __init__(self, space: Space) -> None:
        self._space = space
        self._box = Box([0, 0, 0], [2, 0.3, 0.2])
        self._radius = float(np.linalg.norm([1, 0.15, 0.1]))

    @property
    def shapes(self) -> tuple[Solid, ...]:
        return (self._box,)

    @property
    def rate_bound(self) -> float:
        place, turn = self._space.parts
        return max(1 / place.weight, self._radius / turn.weight)

    def poses(self, q: Array) -> Array:
        if len(q) == 3:
            turn, place = Rotation.from_euler("z", q[2]), np.array([q[0], q[1], 0.0])
        else:
            turn, place = Rotation.from_quat(q[3:]), q[:3]
        return np.column_stack([turn.as_matrix(), place])[None]

    def motion_bound(self, a: Array, b: Array) -> float:
        """No point is farther from the middle than the radius, however it turns."""
        velocity = self._space.difference(a, b)
        places = self._space.parts[0].dimension
        shift, turn = velocity[:places], velocity[places:]
        return float(np.linalg.norm(shift) + self._radius * np.linalg.norm(turn))


SE2 = Space([Coordinates([-3, -3], [3, 3]), Coordinates([-PI], [PI], wraps=[True], weight=0.5)])
SE3 = Space([Coordinates([-3] * 3, [3] * 3), Rotations(weight=0.5)])
SPACES = {"SE(2)": SE2, "SE(3)": SE3}


def among(space: Space, obstacles: Sequence[Obstacle]) -> CollisionModel:
    return CollisionModel(Body(space), obstacles, TOLERANCE, space=space)


def balls(rng: np.random.Generator, space: Space, count: int) -> list[Obstacle]:
    """Of the plane, if the body does not leave it."""
    places = rng.uniform(-3, 3, (count, 3)) * [1, 1, space is SE3]
    return [_at(Sphere(rng.uniform(0.1, 0.8)), place) for place in places]


def _at(solid: Solid, place: Array) -> PlacedShape:
    pose = np.eye(4)
    pose[:3, 3] = place
    return PlacedShape(solid, pose)


def test_it_turns_the_short_way_across_pi() -> None:
    """What stands where it would point half way round the other way is not met."""
    beside = [_at(Sphere(0.3), np.array([0.0, y, 0])) for y in (0.9, -0.9)]
    a, b = np.array([0.0, 0, 2.9]), np.array([0.0, 0, -2.9])
    model = among(SE2, beside)
    assert model.segment_is_free(a, b)
    assert model.min_clearance(np.array([a, b])) == pytest.approx(
        min(model.clearance(np.array([0, 0, x])) for x in np.linspace(2.9, 2 * PI - 2.9, 2001)),
        abs=TOLERANCE,
    )
    round_about = np.array([[0, 0, 2.9], [0, 0, 0.5], [0, 0, -0.5], [0, 0, -2.9]])
    assert model.min_clearance(round_about) <= TOLERANCE


def test_a_body_that_turns_on_the_spot_is_where_it_points() -> None:
    """From along x to along y about z: it meets a ball on the diagonal, and no other."""
    a = np.array([0, 0, 0, 0, 0, 0, 1.0])
    b = np.array([0, 0, 0, 0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    diagonal, other = np.array([0.6, 0.6, 0]), np.array([-0.6, 0.6, 0])
    met = among(SE3, [_at(Sphere(0.1), diagonal)])
    assert not met.segment_is_free(a, b)
    assert among(SE3, [_at(Sphere(0.1), other)]).segment_is_free(a, b)
    place = met.first_contact(np.array([a, b]), 10_000)
    angle = Rotation.from_quat(place.q[3:]).magnitude()
    # The ball's middle is sqrt(0.72) away; the side, 0.15 off the middle line, comes to it at
    # pi / 4 - asin(0.25 / sqrt(0.72)).
    assert angle == pytest.approx(PI / 4 - np.arcsin(0.25 / np.sqrt(0.72)), abs=2e-3)
    assert place.share == pytest.approx(angle / (PI / 2))
    away = np.concatenate([a[:3] + [0, 0, 1], a[3:]])  # comes from above, by a length of 1
    place = met.first_contact(np.array([away, a, b]), 10_000)
    turned = SE3.parts[1].weight * angle
    whole = 1 + SE3.parts[1].weight * PI / 2
    assert place.share == pytest.approx((1 + turned) / whole, abs=1e-3)


@pytest.mark.parametrize("name", SPACES)
@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_accepted_that_samples_refute_nor_refused_beyond_the_tolerance(
    name: str, seed: int
) -> None:
    space = SPACES[name]
    rng = np.random.default_rng(seed)
    model = among(space, balls(rng, space, 8 if space is SE3 else 4))
    t = np.linspace(0, 1, 401)
    found = {True: 0, False: 0}
    for a, b in zip(space.sample(rng, 12), space.sample(rng, 12), strict=True):
        way = space.interpolate(np.tile(a, (401, 1)), np.tile(b, (401, 1)), t)
        least = min(model.clearance(q) for q in way)
        free = model.segment_is_free(a, b)
        found[free] += 1
        # Between two samples no point moves farther than this.
        step = model.robot.motion_bound(a, b) / 400
        if free:
            assert least > TOLERANCE / 2
            assert model.min_clearance(np.array([a, b])) == pytest.approx(
                least, abs=TOLERANCE + step
            )
        else:
            assert least <= TOLERANCE + step
            assert model.min_clearance(np.array([a, b])) <= TOLERANCE
    assert all(found.values()), "free motions and others"


@pytest.mark.parametrize("name", SPACES)
def test_of_many_waypoints_the_motion_is_bounded_by_their_distances(name: str) -> None:
    space = SPACES[name]
    rng = np.random.default_rng(0)
    ends = space.sample(rng, 2)
    t = np.linspace(0, 1, 12_000)
    path = space.interpolate(np.tile(ends[0], (len(t), 1)), np.tile(ends[1], (len(t), 1)), t)
    far = among(space, [_at(Sphere(0.1), np.array([0, 0, 9.0]))])
    whole, coarse = far.min_clearance(ends), far.min_clearance(path)
    assert coarse == pytest.approx(whole, abs=2 * TOLERANCE)
