"""How the best path of an attempt came about, as planners that improve tell it."""

from __future__ import annotations

import json

import numpy as np

from bench.stats.curves import readable_history
from envs.problem import Array


def cost_history(stats: str) -> Array:
    """(n, 2), in order of time: seconds since the start of `solve`, and the length of the best path
    so far in the environment's unit, both finite. Empty if the planner keeps none, or one that
    cannot be read, as in stores of before such were refused.

    Args:
        stats: JSON, as in `bench.record.Record`.
    """
    stored = json.loads(stats)
    told = readable_history(stored.get("cost_history")) if isinstance(stored, dict) else None
    if told is None:
        return np.zeros((0, 2))
    finite = told[np.isfinite(told).all(axis=1)]
    return finite[np.argsort(finite[:, 0], kind="stable")]
