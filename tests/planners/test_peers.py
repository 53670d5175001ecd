"""Other programs' planners: what is asked of them, and what they are told."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import mbm_files as made
import numpy as np
import psutil
import pytest
from conftest import Cli, Refused, has_data, records_of
from documents import block_after
from hypothesis import given
from hypothesis import strategies as st
from interpreters import interpreter_with, made_interpreter, packages_of
from made_robots import let_links_touch_obstacles, made_tree_world
from scipy.spatial.transform import Rotation

import envs
import planners
from bench.execution import guest
from bench.storage.record import checked_every
from envs import Environment
from envs.errors import InputError
from envs.problem import Problem
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from planners import Budget
from planners.peers import urdf_text
from planners.peers.kinematics import link_poses
from planners.peers.peer import shortest_ways
from planners.peers.vamp import Vamp

PEERS = ("mplib", "roboplan", "vamp")
STAND_INS = Path(__file__).parents[1] / "stand_ins"


def missing(package: str) -> bool:
    return importlib.util.find_spec(package) is None


@pytest.mark.parametrize("name", PEERS)
def test_one_that_is_not_installed_says_how_to_install_it(name: str) -> None:
    if not missing(name):
        pytest.skip(f"{name} is installed here")
    scene: Any = envs.make("arm6").plain_scene
    said = str(planners.make(name).unsupported(scene))
    assert f"pip install {name}" in said
    assert "python=PATH" in said
    assert "\n" not in said


@pytest.mark.parametrize(
    "arguments, said",
    [
        ("python=/no/such/python", "is no program"),
        ("python=/tmp", "is no program"),
        ("pyton=/bin/true", "python"),
        ("range=far", "range"),
    ],
)
@pytest.mark.parametrize("name", PEERS)
def test_wrong_arguments_are_refused_in_a_line(
    refused: Refused, name: str, arguments: str, said: str
) -> None:
    run = ("run", "--env", "arm6", "--problems", 1)
    assert said in refused(*run, "--planners", f"{name}:{arguments}")


@pytest.mark.parametrize(
    "arguments, near", [("sampler=haltn", "halton"), ("cylinders=boxes", "box")]
)
def test_vamp_suggests_what_was_meant(arguments: str, near: str) -> None:
    with pytest.raises(InputError, match=near):
        planners.make(f"vamp:{arguments}")


def test_an_interpreter_without_the_package_is_told_apart(bench: Cli, tmp_path: Path) -> None:
    python = made_interpreter(tmp_path / "venv")
    planner = planners.make(f"mplib:python={python}")
    said = str(planner.unsupported(envs.make("arm6").plain_scene))  # type: ignore[arg-type]
    assert f"{python} -m pip install numpy mplib" in said


def test_the_worker_needs_numpy_and_psutil_alone() -> None:
    code = (
        "import sys; import bench.execution.worker, planners.peers.mplib, planners.peers.roboplan,"
        "planners.peers.vamp;"
        "print(*sorted({m.partition('.')[0] for m in sys.modules} - sys.stdlib_module_names))"
    )
    asked = [sys.executable, "-c", code]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.split()
    known = {"bench", "envs", "planners", "numpy", "psutil"}
    # What a site-packages folder imports at the start of any program is not ours.
    started = [sys.executable, "-c", "import sys; print(*sys.modules)"]
    before = subprocess.run(started, capture_output=True, text=True, check=True).stdout.split()
    assert set(said) - {m.partition(".")[0] for m in before} <= known


def test_nothing_but_what_is_lent_is_found_in_the_lent_folder(tmp_path: Path) -> None:
    for name in ("lent", "other"):
        (tmp_path / f"{name}.py").write_text("")
    finder = guest.Lent(str(tmp_path), "lent")
    assert finder.find_spec("lent") is not None
    assert finder.find_spec("other") is None


@given(st.lists(st.lists(st.floats(-3.1, 3.1), min_size=2, max_size=2), min_size=2, max_size=6))
def test_numbers_that_wrap_do_not_go_round_the_other_way(path: list[list[float]]) -> None:
    wraps = np.array([True, False])
    q = np.array(path)
    made = shortest_ways(q, wraps)
    assert np.abs(np.diff(made[:, 0])).max() < np.pi
    assert np.array_equal(made[0], q[0])
    kept = iter(made.tolist())
    assert all(place in kept for place in q.tolist()), "in their order"


@given(st.tuples(*3 * [st.floats(-3.2, 3.2)]))
def test_angles_turn_as_urdf_has_them(angles: tuple[float, float, float]) -> None:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", angles).as_matrix()
    found = urdf_text.roll_pitch_yaw(pose)
    again = Rotation.from_euler("xyz", found).as_matrix()
    np.testing.assert_allclose(again, pose[:3, :3], atol=1e-7)


@pytest.mark.parametrize("seed", range(12))
def test_the_urdf_that_programs_read_is_the_robot(tmp_path: Path, seed: int) -> None:
    """Read by us, it has the same links in the same places."""
    text, _ = made_tree_world(tmp_path, seed)
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    robot = env.plain_scene.robot
    if any(joint.kind == "spherical" for joint in robot.joints):
        pytest.skip("no URDF can say it")
    (tmp_path / "meshes").mkdir()
    (tmp_path / "again.urdf").write_text(urdf_text.urdf(robot, tmp_path / "meshes"))
    tree, parts = read_urdf(tmp_path / "again.urdf")
    names = [joint.name for joint in tree.coordinates]
    order = [[j.name for j in urdf_text.moving(robot)].index(name) for name in names]
    pieces = sum(len(solid.pieces()) for link in robot.links for solid in link.solids)
    assert len(parts) == pieces
    number = {link.name: n for n, link in enumerate(tree.links)}
    for q in env.space.sample(np.random.default_rng(seed), 4):
        poses = tree.forward(q[order][None])[0]
        for name, pose in link_poses(robot, q).items():
            np.testing.assert_allclose(poses[number[name]], pose, atol=1e-6)


WALL = made.box("wall", made.pose(0.3, 1.2), 0.4, 0.1, 1)
CAN = {
    "id": "can",
    "primitives": [{"type": "cylinder", "dimensions": [0.3, 0.05]}],
    "primitive_poses": [made.pose(-0.9, -0.9)],
}
EVERYWHERE = made.box("everywhere", made.pose(0, 1.3), 0.1, 0.1, 1)
PAIRS = [
    (made.scene(WALL, CAN), made.request([0.0, 0.0], [0.6, -0.5])),
    (made.scene(WALL), made.request([0.0, 0.1], [-0.5, 0.3])),
    (made.scene(EVERYWHERE), made.request([0.0, 0.1], [-0.5, 0.3])),
]


@pytest.fixture
def small_set(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot of two joints by the name of panda, with three problems."""
    monkeypatch.setenv("BENCH_DATA", str(tmp_path / "data"))
    made.write(tmp_path / "data" / "mbm" / "panda", {"box_panda": PAIRS})


@pytest.fixture
def stand_in(tmp_path: Path) -> Path:
    """An interpreter that has NumPy, and a stand-in for VAMP."""
    python = made_interpreter(tmp_path / "venv")
    shutil.copytree(STAND_INS / "vamp", packages_of(tmp_path / "venv") / "vamp")
    return python


@pytest.mark.slow
@pytest.mark.usefixtures("small_set")
def test_vamp_plans_in_an_interpreter_that_has_numpy_alone(
    bench: Cli, stand_in: Path, tmp_path: Path
) -> None:
    run = ("run", "--env", "mbm-panda-box", "--problems", 3, "--stop", "first")
    planner = f"vamp:python={stand_in}"
    code, _, err = bench(*run, "--planners", planner, "--out", tmp_path / "run")
    assert code == 0, err
    rows = records_of(tmp_path / "run")
    assert rows["outcome"].tolist() == ["VALID", "VALID", "TIMEOUT"]
    assert "vamp-planner" in rows["stats"][0]
    assert "none in 7 iterations" in rows["stats"][2]
    assert rows["scene_s"].notna().all()


@pytest.fixture
def stand_in_here(monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """The stand-in for VAMP, in this process."""
    monkeypatch.syspath_prepend(str(STAND_INS))
    assert "vamp" not in sys.modules
    yield importlib.import_module("vamp")
    del sys.modules["vamp"]


@pytest.mark.usefixtures("small_set", "stand_in_here")
def test_vamp_is_told_the_scene_and_its_paths_come_in_our_order() -> None:
    env = envs.make("mbm-panda-box")
    problem, other, _ = env.sample_problems(3, 0)
    planner = Vamp(range=0.5)
    scene: Any = env.scene_of(problem).plain_scene
    assert planner.unsupported(scene) is None
    planner.setup(scene, seed=1)
    by_name = {shape.name: shape for shape in planner._scene.shapes}
    assert by_name["wall"].sizes[2] == [0.2, 0.05, 0.5], "halves"
    assert by_name["can"].sizes[2:] == (0.05, 0.3), "radius and length"
    assert planner._settings.range == 0.5
    path = np.asarray(planner.solve(problem, Budget(perf_counter() + 1)).path)
    np.testing.assert_array_equal(path[[0, -1]], [problem.start, problem.goal])
    np.testing.assert_allclose(path[1], (problem.start + problem.goal) / 2, atol=1e-6)
    planner.set_scene(env.scene_of(other).plain_scene)
    assert [shape.name for shape in planner._scene.shapes] == ["wall"]
    several = Problem(other.start, other.goal, goals=np.array([other.goal, problem.goal]))
    path = np.asarray(planner.solve(several, Budget(perf_counter() + 1)).path)
    np.testing.assert_array_equal(path[-1], problem.goal)
    boxed = Vamp(cylinders="box", simplify=True)
    boxed.setup(scene, seed=1)
    [can] = [shape for shape in boxed._scene.shapes if shape.name == "can"]
    assert can.sizes[2] == [0.05, 0.05, 0.15]
    assert len(np.asarray(boxed.solve(problem, Budget(perf_counter() + 1)).path)) == 2


@pytest.mark.usefixtures("small_set")
def test_vamp_refuses_another_robot_of_the_same_name(
    monkeypatch: pytest.MonkeyPatch, stand_in_here: Any
) -> None:
    env = envs.make("mbm-panda-box")
    scene: Any = env.scene_of(env.sample_problems(1, 0)[0]).plain_scene
    monkeypatch.setattr(stand_in_here.panda, "eefk", staticmethod(lambda q: np.eye(4)))
    with pytest.raises(RuntimeError, match="is another robot"):
        Vamp().setup(scene, seed=1)
    monkeypatch.setattr(
        stand_in_here.panda, "joint_names", staticmethod(lambda: ["elbow", "wrist"])
    )
    with pytest.raises(RuntimeError, match="wrist"):
        Vamp().setup(scene, seed=1)
    arm: Any = envs.make("arm6").plain_scene
    assert "not for a robot arm6" in str(Vamp().unsupported(arm))


@pytest.mark.slow
def test_a_planner_of_your_own_is_told_plain_data_elsewhere(bench: Cli, tmp_path: Path) -> None:
    file = tmp_path / "elsewhere.py"
    file.write_text(block_after("planner from data"), encoding="utf-8")
    python = made_interpreter(tmp_path / "venv")
    both = f"elsewhere,elsewhere:python={python}"
    run = ("run", "--env", "c3d", "--problems", 6, "--stop", "first", "--planner-file", file)
    code, _, err = bench(*run, "--planners", both, "--out", tmp_path / "run")
    assert code == 0, err
    rows = records_of(tmp_path / "run")
    assert len(rows) == 12
    here, there = (group for _, group in rows.groupby("planner"))
    assert here.sort_values("problem")["outcome"].tolist() == (
        there.sort_values("problem")["outcome"].tolist()
    )
    assert set(rows["outcome"]) == {"VALID", "COLLISION"}


@pytest.fixture(scope="module", params=["mplib", "roboplan"])
def installed(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, Path]:
    """A real package, by its name, and an interpreter that has it."""
    name: str = request.param
    return name, interpreter_with(tmp_path_factory.mktemp(name) / "venv", [name])


@pytest.mark.slow(minutes=2)
def test_the_real_package_plans_what_the_judge_can_check(
    bench: Cli, tmp_path: Path, installed: tuple[str, Path]
) -> None:
    """Its paths are such as come of checking states along motions: some touch."""
    name, python = installed
    run = ("run", "--env", "arm6,arm6:self_collision=true", "--problems", 10, "--stop", "first")
    planner = f"{name}:python={python}"
    code, _, err = bench(*run, "--planners", planner, "--out", tmp_path / "run")
    assert code == 0, err
    rows = records_of(tmp_path / "run")
    assert (rows["status"] == "EXACT_SOLUTION").mean() >= 0.9
    assert set(rows["outcome"]) <= {"VALID", "COLLISION", "TIMEOUT"}
    assert (rows["outcome"] == "VALID").mean() >= 0.3
    assert rows["stats"].str.contains(f"{name} [0-9]").all()
    told = rows["stats"].map(checked_every).tolist()
    assert told == [0.05 if name == "roboplan" else None] * len(rows)


def agreement(env: Environment, installed: tuple[str, Path], folder: Path) -> None:
    """At random configurations its collision model has what ours has."""
    name, python = installed
    q = env.space.sample(np.random.default_rng(3), 300)
    scene: Any = env.plain_scene
    data, numbers = scene.packed()
    np.savez(folder / "scene.npz", data=json.dumps(data), numbers=numbers, q=q)
    ours, lent = (str(Path(module.__file__ or "").parents[1]) for module in (envs, psutil))
    script = Path(__file__).parents[1] / "peers_agree.py"
    asked = [python, script, name, folder / "scene.npz", ours, lent]
    said = subprocess.run(asked, capture_output=True, text=True, check=True).stdout.split()[-1]
    expected = env.clearance(q) <= 0
    assert 0.02 < expected.mean() < 0.98
    assert said == "".join(str(int(one)) for one in expected)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_the_real_package_has_the_same_collisions_of_any_tree(
    installed: tuple[str, Path], tmp_path: Path, seed: int
) -> None:
    text, _ = made_tree_world(tmp_path, seed)
    if seed % 2:
        let_links_touch_obstacles(tmp_path, seed)
    env = envs.make(text)
    planner: Any = planners.make(installed[0])
    reason = planner.refuses(env.plain_scene)
    if reason:
        pytest.skip(reason)
    agreement(env, installed, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("robot", ["panda", "ur5", "fetch", "baxter"])
def test_the_real_package_has_the_same_collisions_of_real_robots(
    installed: tuple[str, Path], tmp_path: Path, robot: str
) -> None:
    if not has_data(f"mbm/{robot}/problems.tar.bz2"):
        pytest.skip("BENCH_DATA names no folder with mbm")
    sets = {"baxter": "bookshelf_tall_both_arms_easy"}
    env = envs.make(f"mbm:robot={robot},set={sets.get(robot, 'box')}")
    agreement(env.scene_of(env.problems_at([3], 0)[0]), installed, tmp_path)
