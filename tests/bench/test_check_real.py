"""`bench check` on real runs: a planner that was weakened fails it, the same planner does not."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path

import planners_that_fail
import pytest
from conftest import Cli

import planners
from envs import Spec

GOOD = dataclasses.replace(
    planners.REGISTRY.entry("rrtconnect").spec, id="changing", aliases=(), groups=()
)
WEAK = planners_that_fail.spec(planners_that_fail.Straight, "changing")


def use(spec: Spec) -> None:
    """The planner that is being changed becomes another one."""
    planners.REGISTRY.unregister(spec.id)
    planners.REGISTRY.register(spec)


@pytest.fixture
def changing() -> Iterator[None]:
    planners.REGISTRY.register(GOOD)
    yield
    planners.REGISTRY.unregister(GOOD.id)


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers", "changing")
def test_a_weakened_planner_fails_and_the_same_again_does_not(bench: Cli, tmp_path: Path) -> None:
    baseline = tmp_path / "baseline.csv"

    def run(name: str) -> Path:
        arguments = ("--planners", "changing", "--problems", 20, "--stop", "first", "--seed", 2)
        code, _, err = bench("run", "--env", "c3d", *arguments, "--out", tmp_path / name)
        assert code == 0, err
        return tmp_path / name

    assert bench("check", run("before"), "--baseline", baseline, "--update")[0] == 0
    code, out, _ = bench("check", run("again"), "--baseline", baseline)
    assert code == 0, out
    use(WEAK)
    code, out, _ = bench("check", run("weakened"), "--baseline", baseline)
    assert code == 1, out
    assert "- regression: `changing` in `c3d`: success from 100.0 % to " in out
