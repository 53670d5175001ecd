"""The examples in the docstrings of contracts are run."""

from __future__ import annotations

import doctest
import importlib

import pytest

CONTRACTS = (
    "bench.api",
    "planners.base",
    "planners.learning.learned_planner",
    "envs.environment",
    "envs.spaces",
    "envs.collision.shapes.robot",
)


@pytest.mark.parametrize("name", CONTRACTS)
def test_examples_come_out_as_shown(name: str) -> None:
    module = importlib.import_module(name)
    failed, tried = doctest.testmod(module)
    assert tried > 0
    assert not failed
