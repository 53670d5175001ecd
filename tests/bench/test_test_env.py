"""`bench test-env`: each bad environment fails the checks that it should, and no other."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import environments_that_fail
import numpy as np
import pytest
from conftest import Cli, Refused

import envs
from bench import conformance
from bench.conformance import EnvironmentEvidence, Outcome
from envs.scenes.boxes import BoxWorld

OF_ALL_CLEARANCES = ("batches", "clearance", "motion", "speed")
"""Checks that ask for clearances, and fail where there are none."""


@pytest.fixture(autouse=True)
def registered() -> Iterator[None]:
    specs = environments_that_fail.specs()
    for spec in specs:
        envs.REGISTRY.register(spec)
    yield
    for spec in specs:
        envs.REGISTRY.unregister(spec.id)


def lines_of(out: str) -> dict[str, tuple[str, str]]:
    """By the name of the check its outcome, and what is said."""
    found = [
        (line[:16].strip(), *line[16:].split(maxsplit=1))
        for line in out.splitlines()
        if not line.startswith(" ")
    ]
    assert [name for _, name, _ in found] == [c.name for c in conformance.ENVIRONMENT_CHECKS]
    return {name: (outcome, said) for outcome, name, said in found}


@pytest.mark.parametrize("text", ["Faultless", "Faultless:walls=3", "Faultless --seed 7"])
def test_a_good_environment_passes(bench: Cli, text: str) -> None:
    code, out, err = bench("test-env", *text.split())
    assert (code, err) == (0, ""), out
    assert {outcome for outcome, _ in lines_of(out).values()} == {"passed"}


@pytest.mark.parametrize(
    ("name", "checks", "said"),
    [
        ("WiderSpace", ("bounds",), "those of `space` [-20, -20, -20] to [20, 20, 20]"),
        ("NoJson", ("definition",), "not JSON data: TypeError: Object of type ndarray"),
        ("NanInDefinition", ("definition",), "not JSON data: ValueError: Out of range float"),
        ("Counts", ("definition",), "made again, it differs: its 'number' is"),
        ("HidesArgument", ("definition",), "HidesArgument:walls=3 has the same definition, and "),
        ("FarTooLarge", ("clearance",), "`clearance` is up to 1.3 too large"),
        ("TooLarge", ("clearance",), "`clearance` is up to 0.2 too large"),
        ("TooSmall", ("clearance",), "`clearance` is up to 0.2 too small"),
        ("ForgetsAWall", ("clearance",), "where the collision model finds contact"),
        ("ProvesTooMuch", ("proofs",), "planners' proof takes the motion from ["),
        ("SearchesTooLittle", ("proofs",), "the judge's proof takes the motion from ["),
        ("WrongInScenes", ("clearance",), "in the scene of problem 1: `clearance` is up to 0.2"),
        ("Raises", OF_ALL_CLEARANCES, r"KeyError: 'no\nsuch wall'"),
        ("Column", OF_ALL_CLEARANCES, "`clearance` of (200, 3) gave float64 (200, 1)"),
        ("NotANumber", ("batches", "speed"), "`clearance` is NaN at ["),
        ("WritesToConfigurations", ("batches",), "writes to the configurations"),
        ("OfTheBatch", ("batches", "clearance", "motion"), "among 200 configurations, and "),
        ("SlowRobot", ("motion", "proofs"), "where `robot.motion_bound` is"),
        ("Chance", ("problems", "pickle"), "problem 0 of seed 0 is"),
        ("IgnoresSeed", ("problems",), "25 of 25 problems are the same of the seeds 0 and 1"),
        ("StartsInCollision", ("problems",), "the start of problem 3, [-5, 3, 0], is in collision"),
        ("GoesNowhere", ("problems",), "problem 0 ends where it starts"),
        ("Unpicklable", ("pickle",), "TypeError: cannot pickle '_thread.lock' object"),
        ("LosesItsWalls", ("pickle",), "a pickled copy differs: its 'boxes' is []"),
        ("NoSpeedAtContact", ("speed",), "and must be positive"),
    ],
)
def test_a_fault_fails_its_checks(bench: Cli, name: str, checks: Any, said: str) -> None:
    code, out, err = bench("test-env", name)
    assert (code, err) == (1, "")
    found = lines_of(out)
    failed = [check for check, (outcome, _) in found.items() if outcome == "failed"]
    assert failed == list(checks)
    assert said in found[checks[0]][1]
    assert out.count("why it matters") == len(checks)


def test_a_wrong_clearance_is_told_with_a_configuration_that_shows_it(bench: Cli) -> None:
    said = lines_of(bench("test-env", "FarTooLarge")[1])["clearance"][1]
    found = re.search(r"says (\S+) at (\[.*?\]), where the collision model finds contact", said)
    assert found is not None
    q = np.array([json.loads(found[2])])
    right = BoxWorld.clearance(environments_that_fail.Faultless(), q)[0]
    assert right <= 0
    assert float(found[1]) == pytest.approx(right + 1.3, abs=1e-3)
    assert float(found[1]) > 1.2, "the largest"


def test_no_fingerprint_is_compared_where_there_is_none(bench: Cli) -> None:
    assert lines_of(bench("test-env", "NoJson")[1])["pickle"][0] == "not applicable"


def test_in_an_environment_without_free_space_no_distances_are_compared() -> None:
    entry = envs.REGISTRY.entry("Faultless")
    full = environments_that_fail.Faultless()
    [check] = [check for check in conformance.ENVIRONMENT_CHECKS if check.name == "clearance"]
    evidence = EnvironmentEvidence(entry, full, 0)
    [scene] = evidence.scenes
    scene.__dict__["q"] = np.repeat(full.obstacles[:1][0].center[None], 5, axis=0)
    result = conformance.environment_finding(check, evidence)
    assert result.outcome is Outcome.NOT_APPLICABLE
    assert "no random configuration is free" in result.what


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("c4d",), "unknown environment 'c4d'; did you mean 'c3d'?"),
        (("c3d:scne=1",), "c3d has no argument 'scne'; did you mean 'scene'"),
        (("box,c3d",), "box,c3d"),
        (("c3d", "--seed", -1), "--seed must be between 0 and"),
        (("c3d", "--sede", 1), "did you mean '--seed'"),
        (("CannotBeMade",), "CannotBeMade cannot be made: ZeroDivisionError: walls"),
        ((), "Missing argument"),
    ],
)
def test_mistakes_are_one_clear_line(refused: Refused, arguments: Any, said: str) -> None:
    assert said in refused("test-env", *arguments)


def test_names_fit_their_column() -> None:
    assert all(len(check.name) < 12 for check in conformance.ENVIRONMENT_CHECKS)
