"""Quick proofs of an arm's motions among obstacles, for `CollisionModel`."""

from __future__ import annotations

from collections.abc import Sequence
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from envs.collision.separation import contacts_array, shapes_of
from envs.collision.shapes import Obstacle
from envs.problem import Array
from envs.robots.arm import Arm, RobotArrays
from envs.robots.motion_proof import nothing_within, prove
from envs.robots.pair_tables import PairTables, split
from envs.robots.sphere_trees import SphereTrees, sphere_trees


class ArmProver:
    """See `envs.collision.fcl_model.Prover`.

    Args:
        arm: the robot.
        obstacles: fixed in the workspace.
        may_touch: (moving, obstacles) of bool, see `Environment.may_touch`.
    """

    def __init__(
        self, arm: Arm, obstacles: Sequence[Obstacle], may_touch: NDArray[np.bool_] | None
    ) -> None:
        self._arm = arm
        self._robot, self._trees, self._tables = _looked_up(arm)
        self._around, self._may_touch = shapes_of(obstacles), contacts_array(may_touch)

    def prove(self, a: Array, b: Array, asked: float, kept: float) -> tuple[float, bool]:
        [(tree, (begin, end))] = self._arm.tree.motions(np.array([a, b]))
        scene = self._around, self._may_touch
        robot = self._robot._replace(tree=tree)
        return prove(robot, self._trees, self._tables, *scene, begin, end, asked, kept)

    def nothing_within(self, q: Array) -> bool:
        return bool(nothing_within(self._arm.arrays, self._around, self._may_touch, q))


_KNOWN: WeakKeyDictionary[Arm, tuple[RobotArrays, SphereTrees, PairTables]] = WeakKeyDictionary()


def _looked_up(arm: Arm) -> tuple[RobotArrays, SphereTrees, PairTables]:
    """What proofs know of an arm, made once for as long as there is the arm: scenes of problem sets
    share one."""
    if arm not in _KNOWN:
        arrays = arm.arrays
        others, tables = split(arm)
        trees = sphere_trees([part.placed for part in arm.parts])
        _KNOWN[arm] = arrays._replace(branches=others), trees, tables
    return _KNOWN[arm]
