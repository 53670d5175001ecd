"""What is about a robot that translates in 3-D, looked up in compiled code."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary, ref

import numpy as np

from envs import Environment
from envs.compiled import njit_cached_quick, njit_quick, parallel_for
from envs.grid import RegularGrid, central_differences, trilinear
from envs.problem import Array
from envs.speed_model import NormalizedSpeed, speed_at
from planners.learning.normalizer import Normalizer

_SPACING = 0.07
"""Between the nodes of the grid of clearances, by d_max, unless there would be too many."""

_MOST_NODES = 8e6
"""Of that grid, to bound its time and memory."""

_BLOCK = 512
"""Straight lines that a thread takes at a time."""

_SAMPLES_PER_REACH = 10
"""Of the speed along a straight line, per d_max."""


class ClearanceField(NamedTuple):
    """Clearances as compiled code sees them.

    Lengths and positions are in the networks' space, clearances are by d_max.

    Attributes:
        grid: of clearances, in single precision.
        reach: d_max.
        speed: by clearance.
    """

    grid: RegularGrid
    reach: float
    speed: NormalizedSpeed

    @staticmethod
    def none() -> ClearanceField:
        """Where nothing is looked up."""
        nodes = np.zeros((2, 2, 2), dtype=np.float32)
        grid = RegularGrid(nodes, np.zeros(3), np.ones(3), np.ones(3))
        return ClearanceField(grid, 0.0, NormalizedSpeed(1.0, 1.0))


def normalized_clearance(env: Environment) -> Callable[[Array], Array]:
    """Approximate clearances by d_max (n,) at (n, d) in the networks' space."""
    scale, d_max = Normalizer.of(env), env.speed_model.d_max
    return lambda x: env.approximate_clearance(scale.denormalize(x)) / d_max


class ClearanceMap:
    """Clearances on a grid, of a robot that only translates in three dimensions.

    Attributes:
        lower, upper: (3,) corners of what holds all of free space, in the networks' space.
        field: what compiled code is given; made when it is first asked for, which takes seconds.

    Raises:
        ValueError: the environment has another dimension.
    """

    def __init__(self, env: Environment) -> None:
        if env.dimension != 3:
            raise ValueError(f"only for three dimensions, not {env.dimension}")
        self.lower, self.upper = (
            Normalizer.of(env).normalize(corner) for corner in env.free_bounds
        )
        self._env = ref(env)  # by which these are kept: it would never go

    @cached_property
    def field(self) -> ClearanceField:
        env = self._env()
        assert env is not None, "who asks for what is about it keeps it"
        scale, model = Normalizer.of(env), env.speed_model
        reach = model.d_max / scale.extent
        volume = float(np.prod(self.upper - self.lower))
        grid = RegularGrid.sampled(
            normalized_clearance(env),
            self.lower,
            self.upper,
            max(_SPACING * reach, (volume / _MOST_NODES) ** (1 / 3)),
        )
        return ClearanceField(grid, reach, model.normalized)

    def __deepcopy__(self, memo: Any) -> ClearanceMap:
        return self  # nothing in it changes

    def clearance(self, x: Array) -> Array:
        """Clearances (n,) at (n, 3), by d_max."""
        found: Array = _clearances(self.field, np.ascontiguousarray(x, dtype=np.float64))
        return found

    def straight_times(self, a: Array, b: Array) -> Array:
        """Travel times (...) along the straight lines from (..., 3) to (..., 3), infinite where
        something is in the way."""
        a, b = np.broadcast_arrays(a, b)
        begin, end = (np.ascontiguousarray(x.reshape(-1, 3), dtype=np.float64) for x in (a, b))
        times = np.empty(len(begin))

        def fill(part: slice) -> None:
            times[part] = straight_times(self.field, begin[part], end[part])

        parallel_for(fill, len(begin), _BLOCK)
        return times.reshape(a.shape[:-1])


_made: WeakKeyDictionary[Environment, ClearanceMap] = WeakKeyDictionary()


def clearance_map_of(env: Environment) -> ClearanceMap:
    """Those of an environment: made once, kept as long as it is."""
    if env not in _made:
        _made[env] = ClearanceMap(env)
    return _made[env]


@njit_quick
def clearance_at(field: Any, x: float, y: float, z: float) -> float:
    """Clearance by d_max; beyond the grid, its border goes on."""
    clearance: float = trilinear(field.grid, x, y, z)
    return clearance


@njit_quick
def uphill(field: Any, x: Any, slope: Any) -> None:
    """Writes the gradient (3,) of the clearance at (3,), per length."""
    central_differences(clearance_at, field, field.grid.per_unit, x[0], x[1], x[2], slope)


@njit_cached_quick
def room_outward(field: Any, x: Any, missing: float, step: Any) -> None:
    """Writes a step (3,) uphill from (3,), as long as the clearance that is missing, by d_max."""
    uphill(field, x, step)
    steepness = max(math.sqrt((step**2).sum()), 1e-3 / field.reach)
    for axis in range(3):
        step[axis] *= missing * field.reach / steepness


@njit_cached_quick
def _clearances(field: Any, x: Any) -> Any:
    found = np.empty(len(x))
    for n in range(len(x)):
        found[n] = clearance_at(field, x[n, 0], x[n, 1], x[n, 2])
    return found


@njit_cached_quick
def straight_times(field: Any, a: Any, b: Any) -> Any:
    """See `ClearanceMap.straight_times`, for ends (n, 3)."""
    times = np.empty(len(a))
    for n in range(len(a)):
        length = math.sqrt(((b[n] - a[n]) ** 2).sum())
        samples = 2 + int(_SAMPLES_PER_REACH * length / field.reach)
        slowness = 0.0
        free = True
        for s in range(samples):
            t = (s + 0.5) / samples
            x, y, z = a[n] + t * (b[n] - a[n])
            clearance = clearance_at(field, x, y, z)
            if clearance <= 0:
                free = False
                break
            slowness += 1 / speed_at(field.speed, clearance)
        times[n] = length * slowness / samples if free else math.inf
    return times
