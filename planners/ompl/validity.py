"""What OMPL asks of us: the validity of states and motions in an environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from envs import Environment, InputError
from envs.collision.fcl_model import CollisionModel
from envs.errors import suggestion
from envs.problem import Array
from planners.ompl import parameters
from planners.ompl.state_space import StateSpace
from planners.ompl_common.checks import Checks
from planners.ompl_common.progress import Progress

_SAMPLES_EDGES = ("EITstar",)
"""Planners that never ask the motion validator and test states along an edge instead, with gaps
of up to two lengths of a valid segment, since they skip those of an earlier, sparser pass."""
_LONG_ITERATIONS = ("FMT",)
"""Planners one of whose iterations can check hundreds of motions, which takes seconds for robots of
many joints: when their time is over, no motion is proved any more, so that they end it."""

_SEGMENT_SHARE = 0.002
_MOST_MARGIN = 0.05
"""The length of a valid segment for them, as a share of the extent of the space; shorter where the
margin would be more than this share of the distance at which the speed begins to fall."""


_OMPL_RESOLUTION = 0.01
"""OMPL's default: the longest gap between states along a motion, as a share of the extent."""


class Validity(Checks):
    """States by an environment's FCL model, motions by its certified segment check.

    A planner that tests states along an edge itself gets a state check with a margin that closes
    the gaps between them.

    Args:
        si: OMPL's space information, which asks here from now on. It does not own what it asks:
            keep this object as long as that one.
        space: its states'.
        progress: is told of every question.

    Attributes:
        stats: what is worth saying with every attempt.
    """

    stats: Mapping[str, float] = MappingProxyType({})

    def __init__(
        self,
        si: Any,
        space: StateSpace,
        env: Environment,
        model: CollisionModel,
        algorithm: str,
        progress: Progress,
    ) -> None:
        base, _, _ = parameters.load()
        super().__init__(space.values, model, progress)
        self.ends_iterations = algorithm in _LONG_ITERATIONS
        self._state_checker = base.StateValidityCheckerFn(self.of_state)
        si.setStateValidityChecker(self._state_checker)
        self._check_motions(si, space, env, algorithm)

    def _check_motions(self, si: Any, space: StateSpace, env: Environment, algorithm: str) -> None:
        """Has OMPL ask here about motions, too."""
        if algorithm in _SAMPLES_EDGES:
            extent, rate = space.ompl.getMaximumExtent(), env.robot.rate_bound
            gap = min(_SEGMENT_SHARE * extent, _MOST_MARGIN * env.speed_model.d_max / rate)
            si.setStateValidityCheckingResolution(gap / extent)
            self.margin = gap * rate + self._model.tolerance
        self._motion_validator = _motion_validator(si, self)
        si.setMotionValidator(self._motion_validator)


class SampledValidity(Validity):
    """States by the same model, and motions by states along them, as OMPL itself has it: nothing is
    proved, and what is thin may be missed. For measuring what proofs cost, and what goes without.

    Args:
        resolution: the longest gap between states, as a share of the extent of the space.
    """

    def __init__(self, *of_validity: Any, resolution: float) -> None:
        self._resolution = resolution
        super().__init__(*of_validity)

    def _check_motions(self, si: Any, space: StateSpace, env: Environment, algorithm: str) -> None:
        si.setStateValidityCheckingResolution(self._resolution)
        self._si, self._space = si, space
        gap = self._resolution * space.ompl.getMaximumExtent()
        self.stats = {"checked_every": 2 * gap if algorithm in _SAMPLES_EDGES else gap}

    def of_edge(self, a: Array, b: Array) -> bool:
        start, end = self._space.state(a), self._space.state(b)  # which own what they give
        return bool(self._si.isValid(start()) and self._si.checkMotion(start(), end()))


CERTIFIED, SAMPLED = "certified", "sampled"
"""How motions are checked."""


def validity_by(
    validator: str, resolution: float | None, algorithm: str
) -> Callable[..., Validity]:
    """The class to make a planner's validity of, for a validator by name, with the resolution.

    Raises:
        InputError: there is none of that name, or it does not take that resolution.
    """
    if validator not in (CERTIFIED, SAMPLED):
        near = suggestion(validator, (CERTIFIED, SAMPLED))
        raise InputError(f"{algorithm}: unknown validator {validator!r}; {near}")
    if validator == CERTIFIED:
        if resolution is not None:
            raise InputError(f"{algorithm}: resolution is for validator=sampled; proofs have none")
        return Validity
    share = _OMPL_RESOLUTION if resolution is None else resolution
    if not 0 < share <= 1:
        raise InputError(f"{algorithm}: resolution must be above 0 and at most 1, not {share:g}")
    return partial(SampledValidity, resolution=share)


def _motion_validator(si: Any, validity: Validity) -> Any:
    base, _, _ = parameters.load()

    class CertifiedMotionValidator(base.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, a: Any, b: Any, last_valid: Any = None) -> bool:  # noqa: N802
            if validity.of_motion(a, b):
                return True
            if last_valid is not None:  # the part before it that is surely free: none of it
                last_valid.second = 0.0
            return False

    return CertifiedMotionValidator(si)
