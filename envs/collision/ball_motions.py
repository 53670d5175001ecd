"""Motions of balls: point robots and discs, compiled."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from envs.collision.ball_distances import ball_to_shapes, none_nearest, room_for_ball
from envs.collision.continuous import compiled_is_covered
from envs.collision.distance_fields import to_boxes
from envs.collision.motion_check import array_at, checks_motions, known_as
from envs.collision.occupancy import CellTree, nearest_cell, stack_for
from envs.collision.separation import Shapes
from envs.collision.winding import Sides, stays_on_the_right_side
from envs.compiled import njit_cached, njit_hot
from envs.problem import Array


class BallAmongBoxes(NamedTuple):
    """A ball among boxes along the axes.

    Attributes:
        centers, halves: (m, 3) of the boxes, see `distance_fields.box_arrays`.
        radius: of the ball.
        tolerance: as of the others in workspace units.
    """

    centers: Array
    halves: Array
    radius: float
    tolerance: float


@checks_motions(BallAmongBoxes)
def _ball_is_free_among_boxes(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "BallAmongBoxes")
    return bool(ball_is_free_among_boxes(check, array_at(a, size), array_at(b, size)))


@njit_cached
def ball_is_free_among_boxes(check: Any, a: Any, b: Any) -> bool:
    """See `motion_check.motion_is_free`."""
    if _misses_grown_boxes(check, a, b):
        return True
    x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    return bool(
        compiled_is_covered(_room_among_boxes, (check, a, b), np.sqrt(x * x + y * y + z * z))
    )


@njit_hot
def _misses_grown_boxes(check: Any, a: Any, b: Any) -> bool:
    """Whether the middle of the ball misses all boxes grown by its radius and the tolerance to
    every side, which is a proof: what is within the radius of a box is in the grown one. By the
    overlap of the intervals of t in which it is between two faces of a box (Kay and Kajiya 1986).
    All boxes are asked, without a branch that would keep them from being asked together."""
    grown = check.radius + check.tolerance
    hits = False
    for n in range(len(check.centers)):
        low, high = 0.0, 1.0
        for i in range(3):
            way = b[i] - a[i]
            near = check.centers[n, i] - check.halves[n, i] - grown - a[i]
            far = check.centers[n, i] + check.halves[n, i] + grown - a[i]
            if way == 0.0:
                if near > 0.0 or far < 0.0:
                    low = 2.0
            else:
                s, t = near / way, far / way
                low, high = max(low, min(s, t)), min(high, max(s, t))
        hits |= low <= high
    return not hits


@njit_hot
def _room_among_boxes(motion: Any, t: float) -> float:
    check, a, b = motion
    x, y, z = a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])
    found = to_boxes(x, y, z, check.centers, check.halves) - check.radius
    return -1.0 if found <= check.tolerance else found - check.tolerance / 2


class BallAmongShapes(NamedTuple):
    """A ball among shapes of any kind.

    Attributes:
        ball: the only one of `Shapes`, about the origin.
        around: the others.
        sides: of surfaces that the ball may be on.
        tolerance: in workspace units.
    """

    ball: Shapes
    around: Shapes
    sides: Sides
    tolerance: float


@checks_motions(BallAmongShapes)
def _ball_is_free_among_shapes(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "BallAmongShapes")
    return bool(ball_is_free_among_shapes(check, array_at(a, size), array_at(b, size)))


@njit_cached
def ball_is_free_among_shapes(check: Any, a: Any, b: Any) -> bool:
    """See `motion_check.motion_is_free`."""
    bound = 0.0
    for i in range(len(a)):
        bound += (b[i] - a[i]) ** 2
    # Of each motion anew: what it is told must not depend on what was asked before.
    nearest = none_nearest(check.around)
    motion = check, a, b, np.sqrt(bound), nearest, np.zeros(3), room_for_ball()
    # What is in the way of a motion is nearly always in the way at its end, too.
    if _room_among_shapes(motion, 1.0) < 0:
        return False
    if not compiled_is_covered(_room_among_shapes, motion, np.sqrt(bound)):
        return False
    return len(check.sides.roots) == 0 or stays_on_the_right_side(check.sides, a, b)


@njit_cached
def _room_among_shapes(motion: Any, t: float) -> float:
    check, a, b, bound, nearest, place, room = motion
    for i in range(len(a)):
        place[i] = a[i] + t * (b[i] - a[i])
    most = bound + 2 * check.tolerance  # proves all of the motion, and more than the tolerance
    found = ball_to_shapes(check.ball, check.around, nearest, place, room, most)
    return -1.0 if found <= check.tolerance else float(found - check.tolerance / 2)


class BallAmongCells(NamedTuple):
    """A disc or ball among the cells of a map.

    Attributes:
        cells: those that are occupied.
        origin: (2,) or (3,), where the map begins.
        side: of a cell.
        radius: of the robot.
        tolerance: as of the others in workspace units.
    """

    cells: CellTree
    origin: Array
    side: float
    radius: float
    tolerance: float


@checks_motions(BallAmongCells)
def _ball_is_free_among_cells(known: Any, a: Any, b: Any, size: int) -> bool:
    check = known_as(known, "BallAmongCells")
    return bool(ball_is_free_among_cells(check, array_at(a, size), array_at(b, size)))


@njit_cached
def ball_is_free_among_cells(check: Any, a: Any, b: Any) -> bool:
    """See `motion_check.motion_is_free`."""
    squared = 0.0
    for i in range(len(a)):
        squared += (b[i] - a[i]) ** 2
    # What is in the way of a motion is nearly always in the way at its end, too.
    motion = check, a, b, np.full(3, 0.5), stack_for(check.cells)
    if _room_among_cells(motion, 1.0) < 0:
        return False
    return bool(compiled_is_covered(_room_among_cells, motion, np.sqrt(squared)))


@njit_cached
def _room_among_cells(motion: Any, t: float) -> float:
    check, a, b, place, stack = motion  # a plane is a layer of cells, in whose middle it is
    for i in range(len(a)):
        place[i] = (a[i] + t * (b[i] - a[i]) - check.origin[i]) / check.side
    away = np.sqrt(nearest_cell(place[0], place[1], place[2], check.cells, stack))
    found = check.side * away - check.radius
    return -1.0 if found <= check.tolerance else float(found - check.tolerance / 2)
