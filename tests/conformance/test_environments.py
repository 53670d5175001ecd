"""What every registered environment must keep to."""

from __future__ import annotations

import json
import pickle
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
def env(entry: str) -> Environment:
    return envs.make(entry)


def test_bounds_are_a_box(env: Environment) -> None:
    assert env.lower.shape == env.upper.shape == (env.space.size,)
    assert (env.lower < env.upper).all()
    assert (env.lower == env.space.lower).all()
    assert (env.upper == env.space.upper).all()
    drawn = env.space.sample(np.random.default_rng(0), 100)
    assert env.contains(drawn).all()
    assert not env.contains(drawn + 3 * (env.upper - env.lower)).any()


def test_free_space_is_within_what_is_sampled(env: Environment) -> None:
    q = env.space.sample(np.random.default_rng(4), 500)
    free = q[env.clearance(q) > 0]
    assert env.sampling_space.contains(free).all()


def test_batches_and_single_configurations_agree(env: Environment) -> None:
    q = env.space.sample(np.random.default_rng(0), 200)
    whole = env.clearance(q)
    assert whole.shape == (200,)
    assert [env.clearance(one[None])[0] for one in q] == pytest.approx(whole)
    assert env.speed(q) == pytest.approx(env.speed_model(whole))
    assert (env.speed(q) > 0).all()


def test_clearance_and_fcl_agree_on_collision(env: Environment) -> None:
    q = env.space.sample(np.random.default_rng(1), 500)
    model = env.collision_model()
    valid = np.array([model.is_valid(one) for one in q])
    assert (valid == (env.clearance(q) > 0)).all()
    assert 0 < valid.mean() < 1


def test_clearance_changes_no_faster_than_the_motion_bound(env: Environment) -> None:
    rng = np.random.default_rng(2)
    a, other = env.space.sample(rng, 500), env.space.sample(rng, 500)
    b = env.space.interpolate(a, other, rng.uniform(0, 0.05, 500))
    change = np.abs(env.clearance(b) - env.clearance(a))
    bounds = np.array([env.robot.motion_bound(x, y) for x, y in zip(a, b, strict=True)])
    assert (change <= bounds + 1e-9).all()
    assert (bounds <= env.robot.rate_bound * env.space.distance(a, b) + 1e-9).all()


def test_problems_are_repeatable_and_their_ends_free(env: Environment, entry: str) -> None:
    first, second = env.sample_problems(20, 1), env.sample_problems(25, 1)
    model = env.collision_model()
    for index, (a, b) in enumerate(zip(first, second, strict=False)):
        if env.scenes_differ:
            model = env.scene_of(a).collision_model()
        assert a.index == index
        assert a.seed == b.seed > 0
        assert (a.start == b.start).all()
        assert (a.goal == b.goal).all()
        assert model.is_valid(a.start)
        assert model.is_valid(a.goal)
        assert env.contains(np.array([a.start, a.goal])).all()
    different = DIFFERENT.get(entry.partition(":")[0], 50)
    both = second + env.sample_problems(25, 2)
    assert len({(*p.start, *p.goal) for p in both}) == different


def test_one_that_was_used_can_be_sent_to_another_process(env: Environment) -> None:
    """Labels for training are made in several."""
    problems = env.sample_problems(1, seed=5)
    other = pickle.loads(pickle.dumps(env))
    assert other.fingerprint == env.fingerprint
    [problem] = other.sample_problems(1, seed=5)
    assert problem.start.tolist() == problems[0].start.tolist()


def test_the_fingerprint_is_that_of_the_definition(env: Environment, entry: str) -> None:
    again = envs.make(entry)
    assert again.fingerprint == env.fingerprint
    assert len(env.fingerprint) == 16
    json.dumps(env.definition(), allow_nan=False)
