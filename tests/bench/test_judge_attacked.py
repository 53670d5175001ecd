"""The judge under attack: paths whose truth is known, in a world of each kind about one cube.

Whatever touches must be refused, whatever keeps more than the tolerance must be accepted; in
between either will do.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_urdfs import collision, joint, link, robot

import envs
from bench.judging.judge import ENDPOINT_TOLERANCE, Judge
from bench.storage.record import Verdict
from envs import Environment, Problem
from envs.collision.continuous import DEFAULT_TOLERANCE
from envs.problem import Array

OUTSIDE, INSIDE = "outside", "inside"


@dataclass(frozen=True)
class World:
    """An environment about a cube.

    Attributes:
        middle: (3,) of the cube.
        half: of its side.
        radius: of the robot, which is a ball.
        free: on which sides of the cube's surface the robot may be.
    """

    env: Environment
    middle: Array
    half: float
    radius: float
    free: tuple[str, ...]

    @cached_property
    def judge(self) -> Judge:
        return Judge(self.env)

    def verdict(self, path: Array) -> Verdict:
        """On a path for its own ends."""
        ends = [np.nan_to_num(end, nan=0.0, posinf=0.0, neginf=0.0) for end in (path[0], path[-1])]
        return self.judge(Problem(*ends), path).verdict

    def at(self, x: float, y: float, z: float) -> Array:
        """A place (3,) by its coordinates from the cube's middle, in half sides."""
        return self.middle + self.half * np.array([x, y, z])


def of_box(folder: Path) -> World:
    return World(envs.make("box"), np.zeros(3), 4.0, 0.01, (OUTSIDE,))


def of_mesh(kind: str, half: float, free: tuple[str, ...]) -> Callable[[Path], World]:
    def made(folder: Path) -> World:
        trimesh.creation.box((1, 1, 1)).export(folder / "cube.ply")
        env = envs.make(f"mesh:file={folder / 'cube.ply'},kind={kind}")
        return World(env, np.zeros(3), half, 0.01, free)

    return made


def of_arm(folder: Path) -> World:
    """A ball on three slides, in metres."""
    ball = '<sphere radius="0.05"/>'
    limit = '<limit lower="-1" upper="1"/>'
    slides = [
        joint(f"j{axis}", parent, child, "prismatic", limit, axis)
        for axis, parent, child in (("1 0 0", "base", "a"), ("0 1 0", "a", "b"))
    ]
    last = joint("jz", "b", "hand", "prismatic", limit, "0 0 1")
    links = [link(name, "") for name in ("base", "a", "b")]
    (folder / "arm.urdf").write_text(robot(*links, link("hand", collision(ball)), *slides, last))
    (folder / "scene.yaml").write_text("obstacles: [{box: [0.8, 0.8, 0.8]}]")
    env = envs.make(f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}")
    return World(env, np.zeros(3), 0.4, 0.05, (OUTSIDE,))


MAKERS = {
    "box": of_box,
    "solid": of_mesh("solid", 6.0, (OUTSIDE,)),
    "shell": of_mesh("shell", 6.0, (OUTSIDE, INSIDE)),
    "interior": of_mesh("interior", 10.0, (INSIDE,)),
    "arm": of_arm,
}


@pytest.fixture(scope="module", params=MAKERS)
def world(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> World:
    return MAKERS[request.param](tmp_path_factory.mktemp("world"))


GAPS = [
    *(-0.3, -1e-2, -1e-3, -1e-4, -1e-6, -1e-9, -1e-12, -1e-15, 0.0),
    *(1e-12, 1e-6, 5e-4, 1.01e-3, 1.1e-3, 2e-3, 1e-2, 0.3),
]
"""Distances between the robot's surface and the cube's, in the world's unit."""

FACES = list(product(range(3), (-1, 1)))


def along_face(world: World, side: str, axis: int, sign: int, gap: float) -> Array:
    """Straight along a face, on one of its sides, at a distance of the robot's surface from it, and
    across its diagonals. The check takes as long as the path is."""
    outward = 1 if side == OUTSIDE else -1
    away = world.half + outward * (world.radius + gap)
    ends = np.zeros((2, 3))
    ends[:, axis] = sign * away
    ends[:, (axis + 1) % 3] = world.half * np.array([-0.2, 0.15])
    ends[:, (axis + 2) % 3] = world.half * np.array([0.05, -0.1])
    return world.middle + ends


def expected(gap: float) -> set[Verdict]:
    if gap <= 0:
        return {Verdict.COLLISION}
    return {Verdict.VALID} if gap > DEFAULT_TOLERANCE else {Verdict.VALID, Verdict.COLLISION}


@pytest.mark.slow(minutes=3)
@pytest.mark.parametrize("gap", GAPS)
def test_paths_that_graze_a_face(world: World, gap: float) -> None:
    if gap < -world.radius and len(world.free) == 2:
        pytest.skip("beyond the surface of a shell it is free again")
    for side in world.free:
        for axis, sign in FACES:
            path = along_face(world, side, axis, sign, gap)
            if world.env.contains(path).all():
                assert world.verdict(path) in expected(gap), (side, axis, sign)


@pytest.mark.parametrize("gap", GAPS)
def test_paths_that_graze_an_edge(world: World, gap: float) -> None:
    """Across the diagonal in front of an edge, which is nearest in the middle."""
    if OUTSIDE not in world.free or (gap < -world.radius and INSIDE in world.free):
        pytest.skip("edges point into no free space here")
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        path = np.zeros((2, 3))
        past = np.sqrt(2) * (world.radius + gap)
        path[0, [i, j]] = world.half + past + 0.2 * world.half, world.half - 0.2 * world.half
        path[1, [i, j]] = world.half - 0.2 * world.half, world.half + past + 0.2 * world.half
        assert world.verdict(world.middle + path) in expected(gap), axis


def through(world: World, rng: np.random.Generator) -> Array:
    """A motion through two opposite faces, or out through one where inside is free."""
    axis, sign = FACES[rng.integers(6)]
    a, b = rng.uniform(-0.9, 0.9, (2, 3))
    far = 1.1 + world.radius / world.half
    a[axis] = -sign * (0.0 if INSIDE in world.free else far)
    b[axis] = sign * far
    return world.middle + world.half * np.array([a, b])


def test_nothing_tunnels_from_one_side_to_the_other(world: World) -> None:
    rng = np.random.default_rng(1)
    for _ in range(60):
        path = through(world, rng)
        if not world.env.contains(path).all():  # out of a room is out of bounds, too
            path = world.env.lower + (path - world.env.lower).clip(
                0, world.env.upper - world.env.lower
            )
        assert world.verdict(path) is Verdict.COLLISION


def free_place(world: World) -> Array:
    return world.at(0.1, -0.2, 0.3) if INSIDE in world.free else world.at(0.1, -0.2, 1.3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_no_path(world: World, bad: float) -> None:
    for waypoint, coordinate in product(range(3), range(3)):
        path = np.repeat(free_place(world)[None], 3, axis=0)
        path[waypoint, coordinate] = bad
        assert world.verdict(path) is Verdict.MALFORMED


def test_standing_still_and_repeating_is_allowed_where_it_is_free(world: World) -> None:
    place = free_place(world)
    for count in (2, 3, 1000):
        path = np.repeat(place[None], count, axis=0)
        assert world.verdict(path) is Verdict.VALID
        path[count // 2] += 5e-324  # what is too small to matter
        assert world.verdict(path) is Verdict.VALID


def test_denormal_numbers_are_numbers(world: World) -> None:
    tiny = np.array([5e-324, -2.2e-308, 0.0])
    path = np.array([tiny, -tiny])
    inside = {Verdict.VALID} if INSIDE in world.free else {Verdict.COLLISION}
    assert world.verdict(path) in inside


@pytest.mark.parametrize("excess", [1e-6, 1e-3, 1.0, 1e9, 1e300])
def test_outside_the_bounds_is_no_place(world: World, excess: float) -> None:
    place = free_place(world)
    for axis, sign in FACES:
        path = np.repeat(place[None], 3, axis=0)
        end = world.env.upper[axis] if sign > 0 else world.env.lower[axis]
        path[1, axis] = end + sign * excess * max(abs(end), 1.0)
        assert world.verdict(path) is Verdict.OUT_OF_BOUNDS


def test_ends_must_be_the_problems(world: World) -> None:
    place = free_place(world)
    problem = Problem(place, place)
    for end, axis in product((0, 1), range(3)):
        path = np.repeat(place[None], 2, axis=0)
        path[end, axis] += 2 * ENDPOINT_TOLERANCE
        assert world.judge(problem, path).verdict is Verdict.WRONG_ENDPOINT
        path[end, axis] = place[axis] + ENDPOINT_TOLERANCE / 2
        assert world.judge(problem, path).verdict is Verdict.VALID


@pytest.mark.slow
def test_one_bad_waypoint_among_very_many_is_found() -> None:
    world = of_box(Path())
    turns = np.linspace(0, 60 * np.pi, 1_000_000)
    path = 8 * np.column_stack([np.cos(turns), np.sin(turns), 0 * turns])
    assert world.verdict(path) is Verdict.VALID
    fewer = path[::10].copy()
    fewer[77_777] = 3.9, 0, 0
    assert world.verdict(fewer) is Verdict.COLLISION


@pytest.mark.slow
@pytest.mark.parametrize("thickness", [1e-2, 1e-4, 1e-6])
def test_thin_walls_are_walls(thickness: float, tmp_path: Path) -> None:
    trimesh.creation.box((1, 1, thickness)).export(tmp_path / "wall.ply")
    world = World(
        envs.make(f"mesh:file={tmp_path / 'wall.ply'},kind=solid"), np.zeros(3), 6, 0.01, (OUTSIDE,)
    )
    rng = np.random.default_rng(2)
    for _ in range(20):
        a, b = rng.uniform(-5.5, 5.5, (2, 3))
        a[2], b[2] = np.array([1, -1]) * (6 * thickness + rng.uniform(0.02, 3, 2))
        assert world.verdict(np.array([a, b])) is Verdict.COLLISION
        b[2] = a[2]
        assert world.verdict(np.array([a, b])) is Verdict.VALID


def crane(folder: Path, type: str) -> World:
    """A boom that turns about z, and a post at an angle of 0."""
    boom = collision(
        '<cylinder radius="0.02" length="1"/>', '<origin xyz="0.5 0 0" rpy="0 1.5708 0"/>'
    )
    limit = '<limit lower="-2.5" upper="2.5"/>' if type == "revolute" else ""
    turn = joint("turn", "base", "boom", type, limit, "0 0 1")
    (folder / "arm.urdf").write_text(robot(link("base", ""), link("boom", boom), turn))
    (folder / "scene.yaml").write_text("obstacles: [{cylinder: [0.05, 1], position: [0.8, 0, 0]}]")
    env = envs.make(f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}")
    return World(env, np.zeros(1), 1, 0, (OUTSIDE,))


@pytest.mark.parametrize(
    ("type", "path", "verdict"),
    [
        ("continuous", [1.0, 3.0], Verdict.VALID),
        ("continuous", [1.0, -1.0], Verdict.COLLISION),
        # Across pi, which is -pi, it is behind the post; the long way has to be said.
        ("continuous", [1.0, np.pi, -np.pi, -1.0], Verdict.VALID),
        ("continuous", [3.0, -3.0], Verdict.VALID),
        ("continuous", [3.0, 0.0, -3.0], Verdict.COLLISION),
        ("continuous", [3.0, 2.0, 1.0, -1.0, -3.0], Verdict.COLLISION),
        ("continuous", [3.0, 3.3], Verdict.OUT_OF_BOUNDS),
        ("continuous", [1.0, 1.0 + 2 * np.pi], Verdict.OUT_OF_BOUNDS),
        ("revolute", [1.0, 2.5], Verdict.VALID),
        ("revolute", [1.0, 2.6], Verdict.OUT_OF_BOUNDS),
        ("revolute", [2.4, -2.4], Verdict.COLLISION),
        ("revolute", [0.5, 0.08], Verdict.COLLISION),
        ("revolute", [0.5, 0.12], Verdict.VALID),
    ],
)
def test_joints_go_the_way_that_the_path_says(
    type: str, path: list[float], verdict: Verdict, tmp_path: Path
) -> None:
    assert crane(tmp_path, type).verdict(np.array(path)[:, None]) is verdict


@pytest.mark.slow
@pytest.mark.parametrize("text", ["c3d", "c3d:scene=3,robot_radius=0.3", "box"])
def test_no_segment_is_accepted_that_1000_samples_refute(text: str) -> None:
    """10,000 motions in all; clearances of boxes are exact in closed form."""
    env, n = envs.make(text), 3400
    judge, rng = Judge(env), np.random.default_rng(3)
    a = rng.uniform(env.lower, env.upper, (n, 3))
    way = rng.normal(size=(n, 3)) * 10 ** rng.uniform(-2, 0.7, (n, 1))
    b = np.clip(a + way, env.lower, env.upper)
    t = np.linspace(0, 1, 1000)[:, None]
    accepted = 0
    for start, goal in zip(a, b, strict=True):
        path = np.array([start, goal])
        least = float(env.clearance(start + t * (goal - start)).min())
        if judge(Problem(start, goal), path).verdict is Verdict.VALID:
            accepted += 1
            assert least > 0
        else:
            # Between samples it may be nearer by half of what the robot moves from one to the next.
            assert least <= DEFAULT_TOLERANCE + np.linalg.norm(goal - start) / 1998 + 1e-9
    assert 0.3 * n < accepted < 0.95 * n
