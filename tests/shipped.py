"""Planners of the registry as they ship."""

from __future__ import annotations

import pytest

import planners
from envs import Environment
from planners import Planner
from planners.base import why_unsupported
from planners.learning.learned_planner import LearnedPlanner


def set_up(id: str, env: Environment) -> Planner:
    """A planner, ready to solve; the test is skipped if it does not plan in `env`, or would have
    to be trained first."""
    if id == "recorded":
        pytest.skip("it gives what a file has; tests/planners/test_recorded.py writes some")
    planner = planners.make(id)
    reason = why_unsupported(planner, env)
    if reason is None and isinstance(planner, LearnedPlanner) and not planner.weights_file(env):
        reason = "its weights do not ship"
    if reason is not None:
        pytest.skip(reason)
    planner.setup(env, seed=1)
    return planner
