"""The arrays that checks of motions work in, made once: to make them takes longer than most
checks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from envs.problem import Array
from envs.robots.arm import RobotArrays
from envs.robots.motion_places import BODY, PLACES, POINT
from envs.robots.sphere_proofs import STACK, Bodies, Bounds

_SHARES = 4
"""Shares of a motion, for each part and pair of parts and each place, that may be left to ask."""


class Room(NamedTuple):
    """Of an arm with m joints and k parts and pairs of parts. One motion is checked in it at a
    time.

    Attributes:
        order: (k,) numbers of parts, those farthest out first, as what moves most touches first;
            then of pairs.
        none: (m,) zeros.
        end, out: (d,) of a motion; to where spheres do not tell enough of it.
        speeds, turned: (m,) of joints, (1 + m,) see `motion_proof.turns_of`.
        bends, moves: (k,) see `motion_proof.bound`; negative where they have not been asked.
        roots: (parts, POINT) centres of the spheres that hold them.
        looked: (parts,) in which look they were found; the number of looks comes last.
        at: the bodies at a configuration.
        still: the bounds of a motion that goes nowhere; what is asked is all kept.
        near, states: (obstacles,), (k,) see `next_in_doubt`.
        waiting: (STACK,) spheres.
        bodies, turns: see `bodies_at_places`.
        point, other: (POINT,) centres of spheres.
        reaches: (PLACES,) how far about `other` something may matter.
        apart, nearing: (PLACES,) distances, and by how much they may lessen.
        shares, items: (2, n) which shares are asked, of which parts and pairs, and which next.
        left: (n,) masks of what is left of them.
    """

    order: NDArray[np.int64]
    none: Array
    end: Array
    out: Array
    speeds: Array
    turned: Array
    bends: Array
    moves: Array
    roots: Array
    looked: NDArray[np.int64]
    at: Bodies
    still: Bounds
    near: NDArray[np.int64]
    states: NDArray[np.int64]
    waiting: NDArray[np.int64]
    bodies: Array
    turns: Array
    point: Array
    other: Array
    reaches: Array
    apart: Array
    nearing: Array
    shares: NDArray[np.int64]
    items: NDArray[np.int64]
    left: NDArray[np.int64]

    @staticmethod
    def of(arm: RobotArrays, obstacles: int, tolerance: float) -> Room:
        """Room for an arm among so many obstacles; for the tolerance see `ArmMotionCheck`."""
        joints, pairs, d = len(arm.tree.parents), len(arm.branches), len(arm.tree.wraps)
        k = arm.moving + pairs
        n = _SHARES * PLACES * k
        return Room(
            np.array([*range(arm.moving)[::-1], *range(arm.moving, k)], dtype=np.int64),
            np.zeros(joints),
            np.empty(d),
            np.empty(d),
            np.empty(joints),
            np.empty(1 + joints),
            np.empty(k),
            np.empty(k),
            np.empty((len(arm.bodies), POINT)),
            np.zeros(len(arm.bodies) + 1, dtype=np.int64),
            Bodies(*(np.empty((1 + joints, *shape)) for shape in ((3, 4), (3,), (3,)))),
            Bounds(0.0, np.zeros(k), np.zeros(k), tolerance, tolerance),
            np.empty(obstacles, dtype=np.int64),
            np.empty(k, dtype=np.int64),
            np.empty(STACK, dtype=np.int64),
            np.empty((1 + joints) * BODY),
            np.empty(2 * PLACES),
            np.empty(POINT),
            np.empty(POINT),
            np.empty(PLACES),
            np.empty(PLACES),
            np.empty(PLACES),
            np.empty((2, n), dtype=np.int64),
            np.empty((2, n), dtype=np.int64),
            np.empty(n, dtype=np.int64),
        )
