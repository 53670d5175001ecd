"""Shared fixtures."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import faulty_planners
import pytest

import envs
import planners
from bench import cli
from envs import Environment

Cli = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="session")
def c3d() -> Environment:
    """Scene 0."""
    return envs.make("c3d")


@pytest.fixture
def bench(capfd: pytest.CaptureFixture[str]) -> Cli:
    """The command line, in this process: arguments to exit code, stdout and stderr."""

    def call(*arguments: object) -> tuple[int, str, str]:
        code = cli.main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return code, out, err

    return call


@pytest.fixture
def faulty() -> Iterator[list[str]]:
    """The names of planners written to misbehave, registered for the length of a test."""
    for spec in faulty_planners.SPECS:
        planners.REGISTRY.register(spec)
    yield [spec.id for spec in faulty_planners.SPECS]
    for spec in faulty_planners.SPECS:
        planners.REGISTRY.unregister(spec.id)
