"""How the best path of an attempt came about, as planners that improve tell it."""

from __future__ import annotations

import json

import numpy as np

from envs.problem import Array


def cost_history(stats: str) -> Array:
    """(n, 2), in order of time: seconds since the start of `solve`, and the length of the best path
    so far in the environment's unit, both finite. Empty if the planner keeps none.

    Args:
        stats: JSON, as in `bench.record.Record`.
    """
    history = json.loads(stats).get("cost_history") or []
    told = np.array(history, dtype=np.float64).reshape(-1, 2)
    finite = told[np.isfinite(told).all(axis=1)]
    return finite[np.argsort(finite[:, 0], kind="stable")]
