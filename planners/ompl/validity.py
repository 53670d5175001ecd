"""What OMPL asks of us: the validity of states and motions in an environment. And the progress of
its best path.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

from envs import Environment, InputError
from envs.collision.fcl_model import CollisionModel
from envs.errors import suggestion
from envs.problem import Array
from planners.ompl import parameters
from planners.ompl.state_space import StateSpace

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


class Validity:
    """States by an environment's FCL model, motions by its certified segment check.

    A planner that tests states along an edge itself gets a state check with a margin that closes
    the gaps between them.

    Args:
        si: OMPL's space information, which asks here from now on. It does not own what it asks:
            keep this object as long as that one.
        space: its states'.
        progress: is told of every question.

    Attributes:
        seconds: that all answers took, in Python.
    """

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
        self._model = model
        self._progress = progress
        self._values = space.values
        self._margin = 0.0
        self._ends_iterations = algorithm in _LONG_ITERATIONS
        self._deadline = math.inf
        self.seconds = 0.0
        self._state_checker = base.StateValidityCheckerFn(self.of_state)
        si.setStateValidityChecker(self._state_checker)
        self._check_motions(si, space, env, algorithm)

    def _check_motions(self, si: Any, space: StateSpace, env: Environment, algorithm: str) -> None:
        """Has OMPL ask here about motions, too."""
        if algorithm in _SAMPLES_EDGES:
            extent, rate = space.ompl.getMaximumExtent(), env.robot.rate_bound
            gap = min(_SEGMENT_SHARE * extent, _MOST_MARGIN * env.speed_model.d_max / rate)
            si.setStateValidityCheckingResolution(gap / extent)
            self._margin = gap * rate + self._model.tolerance
        self._motion_validator = _motion_validator(si, self)
        si.setMotionValidator(self._motion_validator)

    def stop_at(self, deadline: float) -> None:
        """When the planner's time is over, on `time.perf_counter`."""
        self._deadline = deadline

    def of_state(self, state: Any) -> bool:
        """Whether a state of OMPL's touches nothing, by the margin where there is one."""
        begin = perf_counter()
        self._progress.tick(begin)
        q = self._values(state)
        free = self._model.keeps(q, self._margin) if self._margin else self._model.may_plan_at(q)
        self.seconds += perf_counter() - begin
        return free

    def of_motion(self, a: Any, b: Any) -> bool:
        """Whether the shortest motion between two states of OMPL's, one of which it has found to be
        valid, is proved free."""
        begin = perf_counter()
        self._progress.tick(begin)
        if self._ends_iterations and begin > self._deadline:
            return False
        free = self._model.stays_free(self._values(a), self._values(b))
        self.seconds += perf_counter() - begin
        return free

    def of_edge(self, a: Array, b: Array) -> bool:
        """As `of_motion`, of configurations (d,) neither of which need be valid."""
        return self._model.segment_is_free(a, b)


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


class Progress:
    """Best path length over time, read from the planner whenever it checks a state or a motion.

    Read in the planner's own thread: PRM* evaluates its termination condition in a second one,
    from which no Python may be called.
    """

    _INTERVAL_S = 0.01

    def __init__(self) -> None:
        self.history: list[list[float]] = []
        self._cost: Any = None
        self._next = math.inf
        self._action: Callable[[], None] | None = None
        self._action_at = math.inf

    def begin(self, planner: Any) -> None:
        """Starts a new history of [seconds, path length] for `planner`."""
        properties = planner.getPlannerProgressProperties()
        # Not a mapping to Python: iterating it gives entries, not names.
        names = list(properties.keys())
        best = next((name for name in names if name.startswith("best cost")), None)
        self._cost = properties[best] if best else None
        self.history = []
        self._begin = perf_counter()
        self._next = self._begin if best else math.inf

    def at(self, time: float, action: Callable[[], None]) -> None:
        """Has the planner's own thread do something once, when it first checks a state or a motion
        after `time`, on `time.perf_counter`."""
        self._action, self._action_at = action, time

    def tick(self, now: float) -> None:
        """Notes an improvement, at most every hundredth of a second; `now` is of
        `time.perf_counter`."""
        if now >= self._next:
            self._note()
        if self._action is not None and now >= self._action_at:
            action, self._action = self._action, None
            action()

    def end(self) -> None:
        """Notes the last improvement and lets go of the planner."""
        self._action = None
        if self._cost is not None:
            self._note()
        self._cost, self._next = None, math.inf

    def _note(self) -> None:
        now = perf_counter()
        self._next = now + self._INTERVAL_S
        cost = float(self._cost())
        if math.isfinite(cost) and (not self.history or cost < self.history[-1][1]):
            self.history.append([now - self._begin, cost])
