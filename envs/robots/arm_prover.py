"""Quick proofs of an arm's motions among obstacles, for `CollisionModel`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from envs.collision.motion_check import (
    MOTION_FREE,
    MOTION_NEARS,
    MOTION_OPEN,
    MOTION_TOUCHES,
    MotionCheck,
)
from envs.collision.separation import contacts_array, shapes_of
from envs.collision.shapes import Obstacle
from envs.compiled import compiled_for
from envs.problem import Array
from envs.robots.arm import Arm
from envs.robots.arm_motion_check import ArmMotionCheck, QuickArmCheck
from envs.robots.motion_proof import nothing_within, prove
from envs.robots.pair_tables import PairTables, split, tables_of
from envs.robots.sphere_trees import SphereTrees, sphere_trees
from envs.robots.table_proofs import fill
from envs.robots.working_room import Room


class ArmProver:
    """See `envs.collision.fcl_model.Prover`.

    Args:
        arm: the robot.
        obstacles: fixed in the workspace.
        may_touch: (moving, obstacles) of bool, see `Environment.may_touch`.
        tabled: up to what is kept tables of the arm's pairs are asked, in workspace units. Planners
            ask for little, always the same; a judge for more, and of each path something else, for
            which cells would have to be asked again.

    Attributes:
        known: of the arm, whatever is around it.
    """

    def __init__(
        self,
        arm: Arm,
        obstacles: Sequence[Obstacle],
        may_touch: NDArray[np.bool_] | None,
        tabled: float,
    ) -> None:
        self._arm, self._tabled = arm, tabled
        self.known = known = _looked_up(arm)
        self._around, self._may_touch = shapes_of(obstacles), contacts_array(may_touch)
        self._with_tables, self._without_tables = (
            (
                arm.arrays._replace(branches=pairs),
                known.trees,
                tables,
                self._around,
                self._may_touch,
            )
            for pairs, tables in (known.tabled, known.untabled)
        )
        self._turns = bool(arm.arrays.tree.wraps.any() or arm.arrays.tree.spherical.any())

    @cached_property
    def _compiled(self) -> Callable[..., tuple[float, bool]]:
        q = np.zeros(self._arm.tree.space.size)
        return compiled_for(prove, *self._with_tables, q, q, 1.0, 1.0)

    @cached_property
    def _quick(self) -> MotionCheck | None:
        """What is told quickly of planners' motions, to their tolerance."""
        check = self._checked_to(self._tabled)
        return None if check is None else MotionCheck(QuickArmCheck(check))

    def told(self, a: Array, b: Array, tolerance: float) -> int:
        if tolerance == self._tabled and self._quick is not None:
            told = self._quick.told(a, b)
            if told != MOTION_OPEN:
                return told
        place, touches = self.prove(a, b, tolerance, tolerance / 2)
        if place < 0:
            return MOTION_FREE
        return MOTION_TOUCHES if touches else MOTION_NEARS

    def prove(self, a: Array, b: Array, asked: float, kept: float) -> tuple[float, bool]:
        robot, *rest = self._with_tables if kept <= self._tabled else self._without_tables
        begin, end = np.array([a, b], dtype=np.float64)
        if self._turns:
            [(tree, (begin, end))] = self._arm.tree.motions(np.array([a, b]))
            robot = robot._replace(tree=tree)
        return self._compiled(robot, *rest, begin, end, float(asked), float(kept))

    def motion_check(self, tolerance: float) -> MotionCheck | None:
        """See `Environment.motion_check`; None of robots with spherical joints."""
        check = self._checked_to(tolerance)
        return None if check is None else MotionCheck(check)

    def _checked_to(self, tolerance: float) -> ArmMotionCheck | None:
        """What checks of motions to a tolerance know; None of robots with spherical joints."""
        arrays = self._arm.arrays
        if arrays.tree.spherical.any():
            return None
        pairs, tables = self.known.tabled if tolerance / 2 <= self._tabled else self.known.untabled
        robot = arrays._replace(branches=pairs)
        fill(robot, tables, float(tolerance) / 2)
        known = self.known.trees, tables, self._around, self._may_touch
        room = Room.of(robot, len(self._around.rows), float(tolerance))
        return ArmMotionCheck(robot, *known, float(tolerance), room)

    def nothing_within(self, q: Array) -> bool:
        return bool(nothing_within(self._arm.arrays, self._around, self._may_touch, q))


class Known(NamedTuple):
    """What proofs know of an arm; and its pairs, those without tables and the tables of the others,
    where these are asked, and where they are not."""

    trees: SphereTrees
    tabled: tuple[NDArray[np.int64], PairTables]
    untabled: tuple[NDArray[np.int64], PairTables]


_KNOWN: WeakKeyDictionary[Arm, Known] = WeakKeyDictionary()


def _looked_up(arm: Arm) -> Known:
    """Made once for as long as there is the arm: scenes of problem sets share one."""
    if arm not in _KNOWN:
        trees = sphere_trees([part.placed for part in arm.parts])
        untabled = arm.arrays.branches, tables_of(arm, [])
        _KNOWN[arm] = Known(trees, split(arm), untabled)
    return _KNOWN[arm]
