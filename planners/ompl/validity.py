"""What OMPL works with: its state space and objective, the validity of states and motions in an
environment, and the progress of its best path.

OMPL's bindings look for an override in Python at every virtual call of an object that Python made.
Planners call the distance of a space and the cost of a motion millions of times, so that most of
their time went into looking. What OMPL makes of its own accord is called directly.
"""

from __future__ import annotations

import math
from time import perf_counter
from typing import Any

import numpy as np

from envs import Environment
from envs.collision.fcl_model import CollisionModel
from envs.problem import Array
from planners.ompl import parameters

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
        base, _, _ = parameters.load()
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
    base, _, _ = parameters.load()

    class CertifiedMotionValidator(base.MotionValidator):  # type: ignore[misc, name-defined]
        def checkMotion(self, a: Any, b: Any, last_valid: Any = None) -> bool:  # noqa: N802
            if validity.of_motion(a, b):
                return True
            if last_valid is not None:  # the part before it that is surely free: none of it
                last_valid.second = 0.0
            return False

    return CertifiedMotionValidator(si)


def box_space(lower: Array, upper: Array) -> Any:
    """The `RealVectorStateSpace` between two corners (d,).

    OMPL makes one for the positions of SE(2), which takes further dimensions. It has none for a
    single one: that is made here, and is slower.
    """
    base, _, _ = parameters.load()
    dimension = len(lower)
    if dimension == 1:
        space = base.RealVectorStateSpace(1)
    else:
        space = base.SE2StateSpace().getSubspace(0)
        for _ in range(dimension - 2):
            space.addDimension(0.0, 1.0)
    bounds = base.RealVectorBounds(dimension)
    for axis in range(dimension):
        bounds.setLow(axis, float(lower[axis]))
        bounds.setHigh(axis, float(upper[axis]))
    space.setBounds(bounds)
    return space


def space_information(space: Any) -> Any:
    """A `SpaceInformation` of a space, not yet set up."""
    _, geometric, _ = parameters.load()
    return geometric.SimpleSetup(space).getSpaceInformation()


def path_length(si: Any) -> Any:
    """The objective of path length: what a planner chooses for a problem without one.

    Args:
        si: set up.
    """
    base, geometric, _ = parameters.load()
    definition = base.ProblemDefinition(si)
    space = si.getStateSpace()
    anywhere = state_of(np.zeros(space.getDimension()), space)
    definition.setStartAndGoalStates(anywhere, anywhere)
    planner = geometric.RRTstar(si)
    planner.setProblemDefinition(definition)
    planner.setup()
    return definition.getOptimizationObjective()


def values(state: Any, dimension: int) -> Array:
    """A state's values (d,)."""
    return np.array([state[axis] for axis in range(dimension)])


def state_of(q: Array, space: Any) -> Any:
    """A state with values (d,)."""
    base, _, _ = parameters.load()
    state = base.State(space)
    for axis, value in enumerate(q):
        state()[axis] = float(value)
    return state


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

    def tick(self) -> None:
        """Notes an improvement, at most every hundredth of a second."""
        if perf_counter() >= self._next:
            self._note()

    def end(self) -> None:
        """Notes the last improvement and lets go of the planner."""
        if self._cost is not None:
            self._note()
        self._cost, self._next = None, math.inf

    def _note(self) -> None:
        now = perf_counter()
        self._next = now + self._INTERVAL_S
        cost = float(self._cost())
        if math.isfinite(cost) and (not self.history or cost < self.history[-1][1]):
            self.history.append([now - self._begin, cost])
