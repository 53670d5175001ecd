"""What OMPL asks of an environment: whether a state is valid, and whether a motion is."""

from __future__ import annotations

from typing import Any

from envs import Environment
from envs.collision.fcl_model import CollisionModel
from planners import ompl_import
from planners.ompl_progress import Progress
from planners.ompl_space import values

_SAMPLES_EDGES = ("EITstar",)
"""Planners that never ask the motion validator and test states along an edge instead, with gaps
of up to two lengths of a valid segment, since they skip those of an earlier, sparser pass."""
_SEGMENT_SHARE = 0.002
_MOST_MARGIN = 0.05
"""The length of a valid segment for them, as a share of the extent of the space; shorter where the
margin would be more than this share of the distance at which the speed begins to fall."""


class Validity:
    """States by an environment's FCL model, motions by its certified segment check.

    A planner that tests states along an edge itself gets a state check with a margin that closes
    the gaps between them.

    Args:
        si: OMPL's space information, which asks here from now on. It does not own what it asks:
            keep this object as long as that one.
        progress: is told of every question.
    """

    def __init__(
        self, si: Any, env: Environment, model: CollisionModel, algorithm: str, progress: Progress
    ) -> None:
        base, _, _ = ompl_import.load()
        self._model = model
        self._progress = progress
        space = si.getStateSpace()
        self._dimension = space.getDimension()
        self._margin = 0.0
        if algorithm in _SAMPLES_EDGES:
            extent, rate = space.getMaximumExtent(), env.robot.rate_bound
            gap = min(_SEGMENT_SHARE * extent, _MOST_MARGIN * env.speed_model.d_max / rate)
            si.setStateValidityCheckingResolution(gap / extent)
            self._margin = gap * rate + model.tolerance
        self._asked = base.StateValidityCheckerFn(self.of_state), _motion_validator(si, self)
        si.setStateValidityChecker(self._asked[0])
        si.setMotionValidator(self._asked[1])

    def of_state(self, state: Any) -> bool:
        """Whether a state of OMPL's touches nothing, by the margin where there is one."""
        self._progress.tick()
        q = values(state, self._dimension)
        if self._margin:
            return self._model.clearance(q) > self._margin
        return self._model.is_valid(q)

    def of_motion(self, a: Any, b: Any) -> bool:
        """Whether the straight motion between two states of OMPL's is proved free."""
        self._progress.tick()
        start, end = values(a, self._dimension), values(b, self._dimension)
        return self._model.segment_is_free(start, end)


def _motion_validator(si: Any, validity: Validity) -> Any:
    base, _, _ = ompl_import.load()

    class CertifiedMotionValidator(base.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, a: Any, b: Any, last_valid: Any = None) -> bool:  # noqa: N802
            if validity.of_motion(a, b):
                return True
            if last_valid is not None:  # the part before it that is surely free: none of it
                last_valid.second = 0.0
            return False

    return CertifiedMotionValidator(si)
