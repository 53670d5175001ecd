"""The greatest speed along a path within limits of velocity and acceleration, compiled.

H. Pham, Q.-C. Pham: A New Approach to Time-Optimal Path Parameterization Based on Reachability
Analysis, IEEE Transactions on Robotics 34(3), 2018. With x the squared speed along the path and u
half its derivative, velocities are q' sqrt(x) and accelerations q' u + q'' x; between two places u
is constant, and the limits hold at both. A pass backward finds the greatest x at each place from
which the rest can be done (controllable sets); one forward takes the greatest u that leads to such.
All that is limited is 0 at rest, so that sets begin at x = 0 and only their ends have to be found,
each by a few steps: the package `toppra` solves two linear programs at every place, which takes
thirty times as long.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.compiled import njit_cached, njit_hot

_NONE = 1e-9
"""Up to which a slope is none: of a path's parameter that is about its length it says no more than
rounding, and by it nothing would be found but how large numbers are."""


@njit_cached
def greatest_speeds(
    places: Any, slopes: Any, bends: Any, velocities: Any, accelerations: Any
) -> Any:
    """Speeds (n,) along a path, from rest to rest.

    Args:
        places: (n,) parameters of the path, in ascending order.
        slopes, bends: (n, d) its first and second derivatives there.
        velocities, accelerations: (d,) limits of their sizes, positive.
    """
    n = len(places)
    most, found = np.zeros(n), np.zeros(n)
    for i in range(n - 2, 0, -1):
        limits = slopes, bends, accelerations, i, 2.0 * (places[i + 1] - places[i])
        most[i] = _greatest_controllable(limits, _fastest(slopes[i], velocities), most[i + 1])
    for i in range(n - 1):
        double = 2.0 * (places[i + 1] - places[i])
        limits = slopes, bends, accelerations, i, double
        _, _, at, slope = _range(limits, found[i], most[i + 1])
        found[i + 1] = min(max(found[i] + double * (at + slope * found[i]), 0.0), most[i + 1])
    return np.sqrt(found)


@njit_hot
def _fastest(slope: Any, velocities: Any) -> float:
    """The greatest squared speed within limits of velocity."""
    found = np.inf
    for k in range(len(slope)):
        if slope[k] != 0.0:
            found = min(found, (velocities[k] / slope[k]) ** 2)
    return found


@njit_hot
def _greatest_controllable(limits: Any, fastest: float, next_most: float) -> float:
    """The greatest x, at most `fastest`, for which some u is within limits and leads to at most
    `next_most`. What room they leave is a concave function of x, whose line is followed down to
    where it has none, again and again: each time to another line or to the end."""
    x = _steady(limits, fastest)
    for _ in range(4 * len(limits[2]) + 4):
        low, low_slope, high, high_slope = _range(limits, x, next_most)
        room, slope = high - low, high_slope - low_slope
        if room + slope * x >= 0.0 or slope >= 0.0:
            break
        x = max(-room / slope, 0.0)
    return x


@njit_hot
def _steady(limits: Any, fastest: float) -> float:
    """The greatest x, at most `fastest`, by the limits that u has no part in."""
    slopes, bends, accelerations, i, double = limits
    x = fastest
    for k in range(len(accelerations)):
        for there in range(2):
            bend = bends[i + there, k]
            slope = slopes[i + there, k] + there * double * bend
            if abs(slope) <= _NONE and bend != 0.0:
                x = min(x, accelerations[k] / abs(bend))
    return x


@njit_hot
def _range(limits: Any, x: float, next_most: float) -> tuple[float, float, float, float]:
    """Between which u is within limits at x: the least is low + low_slope x, the greatest
    high + high_slope x, by the lines that count there."""
    slopes, bends, accelerations, i, double = limits
    # At the next place x is x + double u: from 0 to what can be done from there.
    low, low_slope, high, high_slope = 0.0, -1.0 / double, next_most / double, -1.0 / double
    for k in range(len(accelerations)):
        for there in range(2):
            bend = bends[i + there, k]
            slope = slopes[i + there, k] + there * double * bend
            if abs(slope) <= _NONE:
                continue
            room, tilt = accelerations[k] / abs(slope), -bend / slope
            if -room + tilt * x > low + low_slope * x:
                low, low_slope = -room, tilt
            if room + tilt * x < high + high_slope * x:
                high, high_slope = room, tilt
    return low, low_slope, high, high_slope
