"""Distances between convex solids: what they are known to be, and never above the truth."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from envs.collision.gjk import distance, moved
from envs.collision.shapes import ROW, Box, Capsule, Cylinder, Sphere
from envs.problem import Array

Convex = Box | Capsule | Cylinder | Sphere

ORIGIN = np.zeros(3)
TILT = (0.3, -0.5, 0.7)
SQUARE = Box(ORIGIN, np.full(3, 2.0))
ROD = Cylinder(0.1, 2.0)
PILL = Capsule(0.1, 2.0)
ROOM = 1e-9
"""For rounding."""


def at(xyz: ArrayLike = (0, 0, 0), rpy: ArrayLike = (0, 0, 0)) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
    pose[:3, 3] = np.asarray(xyz)
    return pose


def between(a: Convex, pose_a: Array, b: Convex, pose_b: Array, most: float = np.inf) -> float:
    return float(distance(a.distance_row(pose_a), b.distance_row(pose_b), most))


@numba.njit
def _fill(a: Any, b: Any, most: float, found: Any) -> None:
    for i in range(len(a)):
        found[i] = distance(a[i], b[i], most)


def distances(a: Array, b: Array, most: float) -> Array:
    """Of pairs of rows (n, ROW)."""
    found = np.empty(len(a))
    _fill(a, b, most, found)
    return found


KNOWN: dict[str, tuple[Convex, Array, Convex, Array, float]] = {
    "spheres": (Sphere(0.5), at((1, 0, 0)), Sphere(0.3), at((1, 3, 4)), 4.2),
    "sphere over a face": (Sphere(0.5), at((0.3, 0.2, 2)), SQUARE, at(), 0.5),
    "sphere off a corner": (Sphere(0.5), at((2, 2, 2)), SQUARE, at(), math.sqrt(3) - 0.5),
    "sphere beside a rod": (Sphere(0.5), at((1, 0, 0.7)), ROD, at(), 0.4),
    "sphere off a rim": (Sphere(0.5), at((0.4, 0, 1.4)), ROD, at(), 0.0),
    "faces": (SQUARE, at(), SQUARE, at((0.4, -0.7, 2.25)), 0.25),
    "faces, turned": (SQUARE, at(), SQUARE, at((0.4, -0.7, 2.25), (0, 0, 0.6)), 0.25),
    "faces whose edges meet": (SQUARE, at(), SQUARE, at((2, 2, 2.25)), 0.25),
    "edges": (SQUARE, at(), SQUARE, at((5, 6, 0.5)), 5.0),
    "corners": (SQUARE, at(), SQUARE, at((3, 4, 4)), 3.0),
    "edges that cross": (
        SQUARE,
        at((0, 0, -math.sqrt(2)), (math.pi / 4, 0, 0)),
        SQUARE,
        at((0, 0, math.sqrt(2) + 0.3), (0, math.pi / 4, 0)),
        0.3,
    ),
    "a box off its frame": (Box(np.array([3.0, 0, 0]), np.full(3, 2.0)), at(), SQUARE, at(), 1.0),
    "rods side by side": (ROD, at(), ROD, at((0.5, 0, 0.7)), 0.3),
    "rods end to end": (ROD, at(), ROD, at((0.05, 0, 2.5)), 0.5),
    "rods that cross": (ROD, at(), ROD, at((0.5, 0, 0), (math.pi / 2, 0, 0)), 0.3),
    "rods that cross askew": (ROD, at(), ROD, at((0.5, 0, 0), (0.4, 0, 0)), 0.3),
    "rod's end on another's side": (ROD, at(), ROD, at((1.4, 0, 0), (0, math.pi / 2, 0)), 0.3),
    "rims": (ROD, at(), ROD, at((0.5, 0, 2.4)), 0.5),
    "rod's side by a face": (ROD, at((1.4, 0.2, 0.1)), SQUARE, at(), 0.3),
    "rod's end over a face": (ROD, at((0.2, 0.1, 2.3)), SQUARE, at(), 0.3),
    "rod's rim over a face": (
        ROD,
        at((0, 0, 2 + math.cos(0.5) + 0.1 * math.sin(0.5)), (0, 0.5, 0)),
        SQUARE,
        at(),
        1.0,
    ),
    "rod's rim off an edge": (ROD, at((1.4, 0, 2.4)), SQUARE, at(), 0.5),
    "capsules side by side": (PILL, at(), PILL, at((0.5, 0, 0.7)), 0.3),
    "capsules end to end": (PILL, at(), PILL, at((0, 0, 2.5)), 0.3),
    "capsules askew": (PILL, at(), PILL, at((0.5, 0, 0), (0.4, 0, 0)), 0.3),
    "capsule's end over a face": (PILL, at((0.2, 0.1, 2.3)), SQUARE, at(), 0.2),
    "capsule's end off a corner": (PILL, at((2, 2, 3)), SQUARE, at(), math.sqrt(3) - 0.1),
    "capsule and sphere": (PILL, at(), Sphere(0.3), at((3, 0, 5)), 4.6),
    # libccd: 0.234
    "rod over a board": (
        Cylinder(0.04, 0.26),
        at(),
        Box(ORIGIN, np.array([0.3, 0.6, 0.02])),
        at((-0.011, -0.374, -0.046), (-0.878, 0.426, -0.672)),
        0.0839206,
    ),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_distances_in_any_frame(name: str) -> None:
    a, pose_a, b, pose_b, expected = KNOWN[name]
    close = pytest.approx(expected, rel=1e-7, abs=1.1e-7)
    for motion in (at(), at((0.3, -0.8, 0.2), TILT), at((-5, 2, 1), (3, -1, 2))):
        assert between(a, motion @ pose_a, b, motion @ pose_b) == close
        assert between(b, motion @ pose_b, a, motion @ pose_a) == close


@pytest.mark.parametrize("tilt", [1e-3, 1e-5, 1e-7, 1e-9, 1e-12])
def test_nearly_parallel_faces(tilt: float) -> None:
    disc, motion = Cylinder(0.4, 0.02), at((0.1, 0.2, 0.3), TILT)
    for a, reach in ((SQUARE, 1.0), (disc, 0.4)):
        height = a.sides[2] / 2 if isinstance(a, Box) else a.length / 2
        pose = at((0, 0, 1.5 + height), (0, tilt, 0))
        truth = 0.5 + height - height * math.cos(tilt) - reach * math.sin(tilt)
        found = between(a, motion @ pose, SQUARE, motion)
        assert truth - 1.1e-7 < found < truth + ROOM


# -- against an independent upper bound --


def random_solid(rng: np.random.Generator) -> Convex:
    kind = rng.integers(8)
    if kind == 0:
        return Box(ORIGIN, rng.uniform(0.02, 0.6, 3))
    if kind == 1:
        return Box(ORIGIN, np.array([0.8, 0.5, 0.01]))
    if kind == 5:
        return Sphere(0.1)
    if kind >= 6:
        return (Capsule(0.05, 1.0), Capsule(*rng.uniform(0.03, 0.5, 2)))[kind - 6]
    return (Cylinder(0.05, 1.0), Cylinder(0.4, 0.02), Cylinder(*rng.uniform(0.03, 0.5, 2)))[
        kind - 2
    ]


def random_pairs(n: int, spread: float) -> tuple[Array, Array]:
    """Rows (n, ROW) of solids, a third of the pairs nearly aligned."""
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(n):
        first = at(rng.uniform(-spread, spread, 3), rng.uniform(-3, 3, 3))
        second = at(rng.uniform(-spread, spread, 3), rng.uniform(-3, 3, 3))
        if rng.random() < 1 / 3:
            nudge = Rotation.from_rotvec(10 ** rng.uniform(-12, -2) * rng.normal(size=3))
            quarters = Rotation.from_euler("xyz", rng.integers(4, size=3) * math.pi / 2)
            second[:3, :3] = first[:3, :3] @ (nudge * quarters).as_matrix()
        rows.append((random_solid(rng).distance_row(first), random_solid(rng).distance_row(second)))
    pairs = np.array(rows)
    return pairs[:, 0].copy(), pairs[:, 1].copy()


def projected(rows: Array, points: Array) -> Array:
    """The points (n, 3) of solids, rows (n, ROW), nearest to given points."""
    axes, size = rows[:, :9].reshape(-1, 3, 3), rows[:, 12:15]
    local = np.einsum("nij,nj->ni", axes, points - rows[:, 9:12])
    box = np.clip(local, -size, size)
    aside = np.maximum(np.hypot(local[:, 0], local[:, 1]), 1e-300)
    rod = local * np.minimum(1, size[:, 0] / aside)[:, None]
    rod[:, 2] = np.clip(local[:, 2], -size[:, 1], size[:, 1])
    core = np.choose(rows[:, 16].astype(int)[:, None], [box, rod, np.zeros_like(local)])
    out = np.maximum(np.linalg.norm(local - core, axis=1), 1e-300)
    nearest = core + (local - core) * np.minimum(1, rows[:, 17] / out)[:, None]
    back: Array = np.einsum("nij,ni->nj", axes, nearest) + rows[:, 9:12]
    return back


def upper_bounds(a: Array, b: Array, steps: int) -> Array:
    """Distances (n,) between points of both solids, the least found.

    Alternating projections, a gradient descent on half the squared distance to b, hastened by
    Nesterov's momentum that starts anew where it points uphill (O'Donoghue and Candes, 2015).
    """
    x = projected(a, b[:, 9:12])
    ahead, momentum = x.copy(), np.ones(len(a))
    least = np.full(len(a), np.inf)
    for _ in range(steps):
        other = projected(b, ahead)
        after = projected(a, other)
        least = np.minimum(least, np.linalg.norm(after - other, axis=1))
        uphill = ((ahead - after) * (after - x)).sum(axis=1) > 0
        momentum[uphill] = 1
        grown = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
        ahead = after + ((momentum - 1) / grown)[:, None] * (after - x)
        x, momentum = after, grown
    return least


@pytest.mark.slow
@pytest.mark.parametrize("spread", [0.3, 1.0])
def test_never_above_the_distance_and_close_below(spread: float) -> None:
    a, b = random_pairs(1500, spread)
    found, least = distances(a, b, np.inf), upper_bounds(a, b, 1500)
    slow = least > found + 1e-6
    assert slow.sum() < 20
    least[slow] = upper_bounds(a[slow], b[slow], 10000)
    assert (found <= least + ROOM).all()
    apart = found > 0
    assert 200 < apart.sum() < 1500
    assert (found >= least - 1e-6)[apart].all()
    assert least[~apart].max() < 1e-6


def test_symmetric_and_the_same_in_any_frame() -> None:
    a, b = random_pairs(3000, 0.6)
    found = distances(a, b, np.inf)
    motion = at((0.7, -1.2, 0.4), TILT)[:3]
    turned_a, turned_b = np.empty_like(a), np.empty_like(b)
    for n in range(len(a)):
        moved(a[n], motion, turned_a[n])
        moved(b[n], motion, turned_b[n])
    np.testing.assert_allclose(distances(b, a, np.inf), found, rtol=2e-7, atol=2e-7)
    np.testing.assert_allclose(distances(turned_a, turned_b, np.inf), found, rtol=2e-7, atol=2e-7)


def test_at_least_most_where_that_is_proved_and_else_the_distance() -> None:
    a, b = random_pairs(3000, 0.6)
    exact = distances(a, b, np.inf)
    for most in (0.01, 0.1, 0.5):
        found = distances(a, b, most)
        far = exact >= most
        assert 0 < far.sum() < len(a)
        assert (found[far] >= most).all()
        assert (found <= exact + 2.5e-7).all()
        np.testing.assert_array_equal(found[~far], exact[~far])


@pytest.mark.parametrize("b", [SQUARE, ROD, Cylinder(0.5, 0.02), Sphere(0.2)], ids=repr)
@pytest.mark.parametrize("a", [SQUARE, ROD, PILL, Sphere(0.1)], ids=repr)
def test_no_distance_where_they_overlap(a: Convex, b: Convex) -> None:
    rng = np.random.default_rng(0)
    assert between(a, at(), b, at()) == 0
    for _ in range(50):
        pose = at(rng.uniform(-0.07, 0.07, 3), rng.uniform(-3, 3, 3))
        assert between(a, at(), b, pose) == 0
        assert between(a, at(), b, pose, 0.1) == 0


@pytest.mark.parametrize("solid", [SQUARE, Box(np.array([0.1, 0.2, 0.3]), np.ones(3)), ROD])
def test_moved_rows_are_those_of_moved_solids(solid: Convex) -> None:
    offset, pose = at((0.1, 0.2, -0.3), (0.2, 0.4, 1.0)), at((0.7, -1.2, 0.4), TILT)
    out = np.empty(ROW)
    moved(solid.distance_row(offset), pose[:3], out)
    np.testing.assert_allclose(out, solid.distance_row(pose @ offset), atol=1e-14)
