"""What every registered environment must keep to."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import robometrics_files
import trimesh
from bad_urdfs import LIMIT, collision, joint, link, robot
from conftest import has_data
from map_files import write_ros
from omplapp_files import PLANAR, write_problem

import envs
from bench.conformance import (
    ENVIRONMENT_CHECKS,
    Check,
    EnvironmentEvidence,
    Outcome,
    environment_finding,
)
from envs import Environment

URDF = robot(
    *(link(name, "") for name in ("base", "carriage")),
    link("upper", collision('<cylinder radius="0.04" length="0.4"/>', '<origin xyz="0 0 0.2"/>')),
    link("fore", collision('<box size="0.06 0.06 0.3"/>', '<origin xyz="0 0 0.2"/>')),
    link("hand", collision('<cylinder radius="0.05" length="0.1"/>', '<origin xyz="0 0 0.1"/>')),
    joint("slide", "base", "carriage", "prismatic", '<limit lower="0" upper="0.3"/>', "1 0 0"),
    joint("shoulder", "carriage", "upper", axis="0 1 0"),
    joint("elbow", "upper", "fore", inside='<origin xyz="0 0 0.4"/>' + LIMIT, axis="0 1 0"),
    joint("wrist", "fore", "hand", "continuous", '<origin xyz="0 0 0.4"/>', "1 0 0"),
)
"""An arm on a slide, with joints of every kind."""

SCENE = """
obstacles:
  - box: [2, 2, 0.1]
    position: [0, 0, -0.3]
  - cylinder: [0.1, 1]
    position: [0.6, 0, 0.2]
  - sphere: 0.15
    position: [0, 0.1, 0.9]
  - mesh: block.stl
    position: [-0.5, 0, 0.3]
    rpy: [0.3, 0.2, 0.1]
"""

LARGE = ("bunny", "gibson-generated", "mbm", "omplapp", "rigid")
"""Whose meshes or problems take seconds."""

DIFFERENT = {"omplapp": 49, "mbm": 25, "robometrics": 25}
"""How many of 25 problems each of two seeds differ, where problem 0 or all are given."""

IDS = [
    pytest.param(spec.id, marks=pytest.mark.slow if spec.id in LARGE else ())
    for spec in envs.REGISTRY.specs()
    if not spec.id.startswith(("mbm-", "robometrics-"))  # which are these with arguments
]


def posed(n: int) -> list[dict[str, Any]]:
    """Problems of robometrics, in each of which the chain bends one way, about a cube."""
    bends = np.random.default_rng(0).uniform(0.1, 0.4, (n, robometrics_files.JOINTS))
    among = robometrics_files.obstacles(a=(0.4, -0.3, 0))
    return [robometrics_files.problem([bend.tolist()], among) for bend in bends]


@pytest.fixture(params=IDS, scope="module")
def entry(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A text that names an environment: a spec's id, with a file where it needs one."""
    folder = tmp_path_factory.mktemp("mesh")
    if request.param == "mesh":
        trimesh.creation.torus(2.0, 0.8).export(folder / "ring.ply")
        return f"mesh:file={folder / 'ring.ply'}"
    if request.param == "gibson":
        (folder / "Room").mkdir()
        room = trimesh.creation.box((8.0, 6.0, 5.0))
        room.invert()
        room.export(folder / "Room" / "mesh_z_up.obj")
        return f"gibson:root={folder},scene=Room"
    if request.param == "arm":
        (folder / "arm.urdf").write_text(URDF)
        trimesh.creation.box((0.3, 0.3, 0.3)).export(folder / "block.stl")
        (folder / "scene.yaml").write_text(SCENE)
        return f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}"
    if request.param == "grid":
        return f"grid:file={write_ros(folder)},radius=0.02"
    if request.param == "omplapp":
        return f"omplapp:file={write_problem(folder, PLANAR)}"
    if request.param == "robometrics":
        file = robometrics_files.write(folder, {"box_panda": posed(30)})
        return f"robometrics:file={file},urdf={folder / 'panda.urdf'}"
    if request.param == "bunny" and not has_data("bunny/bunny.ply"):
        pytest.skip("BENCH_DATA has no bunny")
    if request.param == "mbm" and not has_data("mbm/panda/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    return str(request.param)


@pytest.fixture(scope="module")
def evidence(entry: str) -> EnvironmentEvidence:
    """What an environment answers, asked once for all tests."""
    made = envs.REGISTRY.entry(entry)
    return EnvironmentEvidence(made, made.make(), seed=1)


@pytest.fixture(scope="module")
def env(evidence: EnvironmentEvidence) -> Environment:
    return evidence.env


@pytest.mark.parametrize("check", ENVIRONMENT_CHECKS, ids=lambda check: check.name)
def test_it_passes_each_check(
    check: Check[EnvironmentEvidence], evidence: EnvironmentEvidence
) -> None:
    result = environment_finding(check, evidence)
    assert result.outcome is Outcome.PASSED, result.text


def test_free_space_is_within_what_is_sampled(
    env: Environment, evidence: EnvironmentEvidence
) -> None:
    for scene in evidence.scenes:
        assert env.sampling_space.contains(scene.q[scene.clearances > 0]).all()


def test_clearance_and_fcl_agree_on_contact_however_close(evidence: EnvironmentEvidence) -> None:
    for scene in evidence.scenes:
        assert (scene.valid == (scene.clearances > 0)).all()
        assert 0 < scene.valid.mean() < 1


def test_depths_change_no_faster_than_the_motion_bound(evidence: EnvironmentEvidence) -> None:
    for scene in evidence.scenes:
        before, after = scene.motion_clearances
        assert (np.abs(after - before) <= scene.motion_bounds + 1e-9).all()


def test_problems_differ_from_each_other(evidence: EnvironmentEvidence, entry: str) -> None:
    both = evidence.problems + evidence.other_problems
    different = DIFFERENT.get(entry.partition(":")[0], 50)
    assert len({(*p.start, *p.goal) for p in both}) == different
    assert all(p.seed > 0 for p in both)


def test_ends_of_lists_of_problems_are_free(
    env: Environment, evidence: EnvironmentEvidence
) -> None:
    """Those that lists here have: the checks take them as they are."""
    for problem in evidence.problems if env.problem_count is not None else ():
        ends = np.array([problem.start, problem.goal])
        assert env.contains(ends).all()
        model = evidence.model_of(problem)
        assert all(model.is_valid(one) for one in ends)


def test_fingerprints_are_short(env: Environment) -> None:
    assert len(env.fingerprint) == 16
