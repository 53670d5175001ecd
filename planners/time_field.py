"""Planners that know how long it takes from anywhere to anywhere."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from envs.problem import Array


@runtime_checkable
class TimeFieldPlanner(Protocol):
    """A planner, once set up, whose field of arrival times can be looked at."""

    def times_and_speeds(self, source: Array, q: Array) -> tuple[Array, Array]:
        """Arrival times (n,) from `source` (d,) at configurations (n, d), and the speeds (n,)
        that the field implies there, 1 / |grad T|."""
