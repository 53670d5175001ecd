"""Rigid bodies in the scenes of point robots."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

import envs
from bench.judging.judge import Judge
from bench.storage.record import Verdict
from envs import Environment, InputError, Problem
from envs.problem import Array
from envs.scenes.rigid_world import RigidWorld

IDENTITY = [0.0, 0, 0, 1]


def made(text: str) -> RigidWorld:
    env = envs.make(text)
    assert isinstance(env, RigidWorld)
    return env


@pytest.fixture(scope="module", params=["se3", "se2", "r3"])
def world(request: pytest.FixtureRequest) -> RigidWorld:
    return made(f"rigid:space={request.param},scene=3")


def test_the_spaces_are_what_they_are_called() -> None:
    corner = np.linalg.norm([1, 1, 0.3])  # of a piano of 2 units, of its keyboard
    radius = made("rigid").robot.radius
    assert corner <= radius <= 1.05 * corner
    assert str(made("rigid:space=r3").space) == "R^3"
    assert str(made("rigid:space=se2").space) == f"R^2 x {radius:.3g} S^1"
    assert str(made("rigid").space) == f"R^3 x {radius:.3g} SO(3)"
    assert str(made("rigid:weight=1").space) == "R^3 x SO(3)"


@pytest.mark.slow
def test_spheres_are_never_farther_from_things_than_the_body(world: RigidWorld) -> None:
    q = world.space.sample(np.random.default_rng(0), 400)
    exact, rough = world.clearance(q), world.approximate_clearance(q)
    free = exact > 0
    assert (rough[free] <= exact[free] + 1e-9).all()
    assert (rough[~free] <= 0).all()
    off = (exact - rough)[free & (exact < 0.5)]
    assert np.median(off) < 0.1 * world.robot.radius


def test_ends_of_problems_are_apart_free_and_of_this_environment(world: RigidWorld) -> None:
    problems = world.sample_problems(6, 1)
    ends = np.array([[p.start, p.goal] for p in problems])
    assert (world.clearance(ends.reshape(12, -1)) >= world.min_clearance).all()
    places = 2 if len(world.lower) == 3 and not world.space.is_flat else 3
    apart = np.linalg.norm(ends[:, 0, :places] - ends[:, 1, :places], axis=1)
    assert (apart >= world.min_separation).all()
    other = made("rigid:space=se3,scene=4").sample_problems(1, 1)[0]
    assert other.start.shape == (7,)
    assert not np.isin(other.start[:3], ends).any()


def test_what_paths_are_proved_free_are_free_for_the_judge(world: RigidWorld) -> None:
    rng = np.random.default_rng(2)
    judge = Judge(world)
    paths = [world.space.sample(rng, 3) for _ in range(60)]
    free = world.paths_are_free(paths, world.planning_tolerance)
    assert 0 < free.sum() < 60
    for path in (path for path, ok in zip(paths, free, strict=True) if ok):
        judged = judge(Problem(path[0], path[-1]), path)
        assert judged.verdict is Verdict.VALID, judged.reason


def corner_of(env: RigidWorld) -> Array:
    """Where a body of 2 units can be far from the cube of `box` in all ways."""
    return np.array([-7.0, -7.0, -7.0])


def test_the_judge_follows_the_shortest_turn() -> None:
    """Along a side of the box a bar fits that points along it, and cannot turn round."""
    env = made("rigid:world=box,side=8,body=box,space=se2")
    judge = Judge(env)
    beside = -4.0 - 0.45  # the bar is 0.4 wide to each side; turned, it reaches out 1
    free = np.array([[-2.0, beside, 0.0], [2.0, beside, 0.0]])
    turned = np.array([[-2.0, beside, 0.0], [2.0, beside, 3.1]])
    a_little = np.array([[-2.0, beside, 3.14], [2.0, beside, -3.14]])  # 0.003 by way of pi
    found = [judge(Problem(p[0], p[-1]), p).verdict for p in (free, turned, a_little)]
    assert found == [Verdict.VALID, Verdict.COLLISION, Verdict.VALID]


def test_the_judge_measures_ends_and_lengths_in_the_space() -> None:
    env = made("rigid:world=box,body=l,weight=2")
    judge = Judge(env)
    start = np.array([*corner_of(env), *IDENTITY])
    turn = Rotation.from_euler("z", 0.5).as_quat()
    goal = np.array([*corner_of(env) + [0, 0, 1], *turn])
    judged = judge(Problem(start, goal), np.array([start, -goal * [-1, -1, -1, 1, 1, 1, 1]]))
    assert judged.verdict is Verdict.VALID, judged.reason
    assert judged.length == pytest.approx(1 + 2 * 0.5)
    off = goal.copy()
    off[3:] = Rotation.from_euler("z", 0.5001).as_quat()
    judged = judge(Problem(start, goal), np.array([start, off]))
    assert judged.verdict is Verdict.WRONG_ENDPOINT
    assert "0.0002 off" in judged.reason
    stretched = np.array([start, goal * [1, 1, 1, 1.1, 1.1, 1.1, 1.1]])
    assert judge(Problem(start, goal), stretched).verdict is not Verdict.VALID
    short = np.array([start[:6], goal[:6]])
    judged = judge(Problem(start, goal), short)
    assert judged.verdict is Verdict.MALFORMED
    assert "6 coordinates, not 7" in judged.reason


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("meshes")
    hollow = trimesh.creation.box((2, 2, 2))
    inner = trimesh.creation.box((1.8, 1.8, 1.8))
    inner.invert()
    trimesh.util.concatenate([hollow, inner]).export(folder / "hollow.stl")
    trimesh.creation.box((2, 2, 2)).export(folder / "block.stl")
    room = trimesh.creation.box((20, 20, 6))
    room.invert()
    room.export(folder / "room.stl")
    trimesh.creation.icosphere(2, 3.0).export(folder / "ball.stl")
    return folder


@pytest.mark.slow
def test_a_body_within_a_solid_or_about_a_small_one_touches(files: Path) -> None:
    """Surfaces alone do not tell: of a mesh the inside is known."""
    ball = f"world=mesh,file={files / 'ball.stl'},kind=solid,scale=1"
    small = made(f"rigid:body=box,size=1,{ball}")
    large = made(f"rigid:body={files / 'block.stl'},size=12,{ball}")
    at_middle = np.array([[0.0, 0, 0, *IDENTITY]])
    for env in (small, large):
        assert env.clearance(at_middle)[0] < 0
        assert not env.collision_model().is_valid(at_middle[0])
        assert not env.paths_are_free([np.repeat(at_middle, 2, 0)], 1e-3)[0]
    aside = np.array([[0.0, 0, 5, *IDENTITY]])
    assert small.clearance(aside)[0] == pytest.approx(5 - 0.1 - 3, abs=0.05)


def test_within_a_shell_a_body_is_free_as_a_point_robot_is(files: Path) -> None:
    env = made(f"rigid:body=box,size=1,world=mesh,file={files / 'ball.stl'},kind=shell,scale=1")
    at_middle = np.array([[0.0, 0, 0, *IDENTITY]])
    assert env.clearance(at_middle)[0] > 2
    assert env.collision_model().is_valid(at_middle[0])
    assert env.paths_are_free([np.repeat(at_middle, 2, 0)], 1e-3)[0]
    across = np.array([at_middle[0], at_middle[0] + [5, 0, 0, 0, 0, 0, 0]])
    assert not env.paths_are_free([across], 1e-3)[0]


@pytest.mark.slow
def test_in_a_room_a_body_stays_inside(files: Path) -> None:
    env = made(f"rigid:body=cross,size=2,world=mesh,file={files / 'room.stl'},kind=interior")
    inside, outside = np.array([[0.0, 0, 0, *IDENTITY]]), np.array([[0.0, 0, 8, *IDENTITY]])
    assert env.clearance(inside)[0] == pytest.approx(3 - 1, abs=1e-6)
    assert env.clearance(outside)[0] < 0
    assert env.is_interior
    _, upper = env.free_bounds
    assert upper[2] == pytest.approx(3 + env.robot.radius)
    assert (env.sampling_space.upper == upper).all()
    assert env.sample_problems(2, 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rigid:space=se4", "no space is called 'se4'; did you mean 'se3' or 'se2'"),
        ("rigid:body=crss", "no body is called 'crss'; did you mean 'cross'"),
        ("rigid:world=arm4", "has a robot of its own"),
        ("rigid:world=c4d", "unknown environment 'c4d'; did you mean 'c3d'"),
        ("rigid:scnee=3", "no argument 'scnee'; did you mean 'scene'.*its own are body, space"),
        ("rigid:size=-1", "size must be between 0.02 and 20, not -1"),
        ("rigid:size=100", "size must be between"),
        ("rigid:weight=-1", "weight must be between 0 and 1000"),
        ("rigid:space=se2,z=11", "z must be between -10 and 10, not 11"),
        ("rigid:scene=x", "'x' is not"),
    ],
)
def test_what_cannot_be_is_said_in_a_line(text: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        envs.make(text)


def test_no_problems_are_said_with_what_to_do() -> None:
    env = envs.make("rigid:size=11,world=box,side=16")
    with pytest.raises(InputError, match="make the body smaller"):
        env.sample_problems(1, 0)


def test_a_world_with_arguments_of_its_own_is_the_same() -> None:
    one, other = made("rigid:world=c3d:scene=3,body=l"), made("rigid:scene=3,body=l")
    assert one.fingerprint == other.fingerprint
    assert one.fingerprint != made("rigid:scene=3,body=l,size=3").fingerprint
    assert one.fingerprint != made("rigid:scene=3,body=l,space=se2").fingerprint
    assert one.fingerprint != made("rigid:scene=3,body=l,weight=1").fingerprint


def sampled_clearance(env: Environment, a: Array, b: Array, count: int) -> float:
    """The least exact clearance at equal steps of a motion."""
    shares = np.linspace(0, 1, count)
    ends = np.repeat(a[None], count, 0), np.repeat(b[None], count, 0)
    return float(env.clearance(env.space.interpolate(*ends, shares)).min())


@pytest.mark.slow
def test_no_motion_is_accepted_that_fine_sampling_refutes(world: RigidWorld) -> None:
    model = world.collision_model()
    rng = np.random.default_rng(5)
    accepted = 0
    for a, b in zip(world.space.sample(rng, 60), world.space.sample(rng, 60), strict=True):
        b = world.space.between(a, b, 0.3)
        least = sampled_clearance(world, a, b, 200)
        if model.segment_is_free(a, b):
            accepted += 1
            assert least > 0
        else:
            assert least <= 2 * world.tolerance
    assert 5 < accepted < 60
