"""Arms: how fast they move, how near they are to obstacles and to themselves."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from bad_urdfs import LIMIT, collision, joint, link, robot
from scipy.spatial.transform import Rotation

import envs
from envs import Environment
from envs.collision.containment import Containment
from envs.collision.covering import Spheres
from envs.collision.fcl_model import CollisionModel
from envs.collision.shapes import Box, Cylinder, Placed, Solid, Sphere
from envs.collision.surface import triangulated
from envs.problem import Array
from envs.robots import arm_clearance
from envs.robots.arm import Arm, ArmView, Part, part_bounds
from envs.robots.chain import Chain, Joint, Link
from envs.scenes.arm_world import ArmWorld

ARMS = ("arm4", "arm5", "arm6")


def at(x: float, y: float, z: float, *rpy: float) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", rpy or (0, 0, 0)).as_matrix()
    pose[:3, 3] = x, y, z
    return pose


def turning(axis: str, origin: Array | None = None) -> Joint:
    direction = np.eye(3)["xyz".index(axis)]
    return Joint("turns", at(0, 0, 0) if origin is None else origin, direction, False, -3.0, 3.0)


def sliding(axis: str, upper: float = 1.0) -> Joint:
    return Joint("slides", np.eye(4), np.eye(3)["xyz".index(axis)], True, 0.0, upper)


def arm_of(joints: list[Joint], *parts: Part, self_collision: bool = False) -> Arm:
    links = tuple(Link(f"l{body}", body, np.eye(4)) for body in range(len(joints) + 1))
    return Arm(Chain(tuple(joints), links), parts, self_collision)


def ball(body: int, radius: float, x: float, y: float = 0, z: float = 0) -> Part:
    return Part(body, Placed(Sphere(radius), at(x, y, z)))


def fcl_only(env: Environment) -> CollisionModel:
    return CollisionModel(env.robot, env.obstacles, allowed=env.allowed)


def configurations(env: Environment, n: int, seed: int) -> Array:
    return np.random.default_rng(seed).uniform(env.lower, env.upper, (n, env.dimension))


# How fast parts move


def random_arm(rng: np.random.Generator) -> Arm:
    """Joints of both kinds in any places, solids of every kind."""
    joints, parts = [], []
    for body in range(1, int(rng.integers(2, 7))):
        axis = rng.normal(size=3)
        origin = at(*rng.uniform(-0.5, 0.5, 3), *rng.uniform(-3, 3, 3))
        slides = bool(rng.random() < 0.3)
        limit = 0.5 if slides else 3.0
        unit = axis / np.linalg.norm(axis)
        joints.append(Joint(f"j{body}", origin, unit, slides, -limit, limit))
        for _ in range(rng.integers(0, 3)):
            pose = at(*rng.uniform(-0.3, 0.3, 3), *rng.uniform(-3, 3, 3))
            parts.append(Part(body, Placed(random_solid(rng), pose)))
    parts.append(ball(len(joints), 0.05, 0.2))
    return arm_of(joints, *parts)


def random_solid(rng: np.random.Generator) -> Solid:
    a, b, c = rng.uniform(0.02, 0.3, 3)
    solids: list[Solid] = [Sphere(a), Cylinder(a, b), Box(np.zeros(3), np.array([a, b, c]))]
    return solids[rng.integers(3)]


def greatest_speeds(arm: Arm, a: Array, b: Array, steps: int = 40) -> Array:
    """Of points on each moving part's surface, (moving,): the longest chords by the time they
    take, which is never more than the highest speed."""
    parts = arm.parts[: arm.moving]
    links = tuple(Link("", part.body, part.placed.pose) for part in parts)
    t = np.linspace(0, 1, steps + 1)[:, None]
    poses = Chain(arm.chain.joints, links).forward(a + t * (b - a))
    found = []
    for number, part in enumerate(parts):
        points = triangulated(Placed(part.placed.solid, np.eye(4))).vertices
        turn, shift = poses[:, number, :3, :3], poses[:, number, None, :3, 3]
        places = points @ turn.transpose(0, 2, 1) + shift
        found.append(steps * np.linalg.norm(np.diff(places, axis=0), axis=2).max())
    return np.array(found)


def bounds_of(arm: Arm, a: Array, b: Array) -> Array:
    bounds = np.empty(arm.moving)
    part_bounds(arm.view, a, b, bounds)
    return bounds


def assert_bounded(arm: Arm, a: Array, b: Array) -> Array:
    speeds, bounds = greatest_speeds(arm, a, b), bounds_of(arm, a, b)
    assert (speeds <= bounds + 1e-9).all()
    assert arm.motion_bound(a, b) == bounds.max()
    assert bounds.max() <= arm.rate_bound * np.linalg.norm(b - a) + 1e-9
    assert bounds == pytest.approx(bounds_of(arm, b, a))
    return speeds / bounds


@pytest.mark.parametrize("seed", range(15))
def test_no_point_of_a_random_arm_outruns_its_bound(seed: int) -> None:
    rng = np.random.default_rng(seed)
    arm = random_arm(rng)
    lower = np.array([one.lower for one in arm.chain.joints])
    for length in 10 ** rng.uniform(-2, 0, 12):
        a, b = rng.uniform(lower, -lower, (2, len(lower)))
        assert_bounded(arm, a, a + length * (b - a))


@pytest.mark.parametrize("name", ARMS)
def test_bounds_on_speeds_are_kept_and_not_far_off(name: str) -> None:
    env, rng = envs.make(name), np.random.default_rng(1)
    shares = []
    for a in configurations(env, 60, 2):
        step = rng.normal(size=env.dimension)
        b = a + 10 ** rng.uniform(-2, 0.5) * step / np.linalg.norm(step)
        shares.append(assert_bounded(env.robot, a, b))
    assert np.median(shares) > 0.6
    assert np.max(shares) > 0.95


def test_speeds_of_one_joint_are_known() -> None:
    """A ball 0.3 off an axis and 0.2 along it: its far side is 0.35 from the axis."""
    arm = arm_of([turning("z", at(1, 2, 3, 0.1, 0.2, 0.3))], ball(1, 0.05, 0.3, 0, 0.2))
    assert arm.rate_bound == pytest.approx(0.35)
    for a, b in ((0.2, 0.7), (1.5, -1.5)):
        bound = arm.motion_bound(np.array([a]), np.array([b]))
        assert bound == pytest.approx(0.35 * abs(b - a))
    (fastest,) = greatest_speeds(arm, np.array([0.2]), np.array([0.7]))
    assert fastest == pytest.approx(0.35 * 0.5, rel=0.02)


def test_speeds_of_a_slide_are_known() -> None:
    arm = arm_of([sliding("x")], ball(1, 0.05, 0.3), Part(1, Placed(Cylinder(0.1, 5.0), np.eye(4))))
    assert arm.rate_bound == 1
    assert bounds_of(arm, np.array([0.9]), np.array([0.2])) == pytest.approx([0.7, 0.7])


@pytest.mark.parametrize(("elbow", "reach"), [(0.0, 0.75), (math.pi / 2, 0.55), (math.pi, 0.15)])
def test_a_folded_arm_is_known_to_be_slower(elbow: float, reach: float) -> None:
    """Upper arm 0.4, a ball of radius 0.05 at 0.3 beyond the elbow; the shoulder alone moves."""
    arm = arm_of([turning("z"), turning("z", at(0.4, 0, 0))], ball(2, 0.05, 0.3))
    a, b = np.array([0.1, elbow]), np.array([0.5, elbow])
    assert arm.motion_bound(a, b) == pytest.approx(0.4 * reach)
    both = np.array([0.5, elbow + 0.2])
    assert arm.motion_bound(a, both) <= 0.4 * 0.75 + 0.2 * 0.35 + 1e-12
    assert arm.rate_bound == pytest.approx(math.hypot(0.75, 0.35))


def test_what_does_not_move_is_never_too_fast() -> None:
    arm = arm_of([turning("z"), turning("y", at(0.4, 0, 0))], ball(1, 0.1, 0.2), ball(2, 0.1, 0.3))
    first, second = bounds_of(arm, np.array([0.3, 0.1]), np.array([0.3, 1.1]))
    assert first == 0
    assert second == pytest.approx(0.4)
    still = np.array([0.3, 0.1])
    assert bounds_of(arm, still, still).tolist() == [0, 0]


# How near they are to obstacles


def spheres_within(solid: Solid, slack: float) -> Spheres:
    """Spheres that lie within a solid and touch its sides, in place of some that cover it."""
    if isinstance(solid, Sphere):
        return Spheres(np.zeros((1, 3)), np.array([solid.radius]))
    assert isinstance(solid, Cylinder | Box)
    if isinstance(solid, Box):
        radius, half = solid.sides.min() / 2, solid.sides / 2
    else:
        half = np.array([0, 0, solid.length / 2])
        radius = min(solid.radius, half[2])
    room = np.maximum(half - radius, 0)
    axes = [np.linspace(-r, r, 1 + math.ceil(2 * r / radius)) for r in room]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Spheres(centers, np.full(len(centers), radius))


def within(arm: Arm) -> ArmView:
    """An arm's view by spheres within its solids: clearances from these are never less than the
    true ones."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("envs.robots.arm.cover", spheres_within)
        view = Arm(arm.chain, arm.parts, arm.self_collision).view
    return view._replace(pairs=arm.view.pairs)


@pytest.mark.parametrize("scene", [0, 3])
@pytest.mark.parametrize("name", ARMS)
def test_fcl_finds_clearances_between_those_of_spheres_about_and_within(
    name: str, scene: int
) -> None:
    env = envs.make(f"{name}:scene={scene}")
    model = fcl_only(env)
    q = configurations(env, 800, 3)
    exact = np.array([model.clearance(one) for one in q])
    rough = env.rough_clearance(q)
    above = arm_clearance.clearances(within(env.robot), env.scene, q)
    free = exact > 0
    assert 200 < free.sum() < 700
    assert (rough[free] <= exact[free] + 1e-9).all()
    assert (rough[~free] <= 0).all()
    assert (above[free] > 0).all()
    assert (exact[free] <= above[free] + 1e-3).all(), "FCL may be a little off among cylinders"
    gap = (exact - rough)[free]
    assert np.median(gap) < 0.002
    assert np.quantile(gap, 0.99) < 0.015
    assert gap.max() < 0.02


@pytest.mark.parametrize("text", ["arm4", "arm6:scene=1", "arm5:self_collision=true"])
def test_a_collision_model_with_bounds_agrees_with_fcl_alone(text: str) -> None:
    env = envs.make(text)
    with_bounds, alone = env.collision_model(), fcl_only(env)
    q = configurations(env, 500, 4)
    valid = [alone.is_valid(one) for one in q]
    assert [with_bounds.is_valid(one) for one in q] == valid
    assert 100 < sum(valid) < 400
    exact = np.array([alone.clearance(one) for one in q])
    assert ((exact > 0) == valid).all()
    found = np.array([with_bounds.clearance(one) for one in q])
    assert found[valid] == pytest.approx(exact[valid], abs=1e-6)
    assert (found[np.logical_not(valid)] <= 0).all()


def test_clearances_of_many_are_those_of_each() -> None:
    env = envs.make("arm4")
    q = configurations(env, 10_000, 5)  # several blocks
    whole = env.rough_clearance(q)
    picked = np.random.default_rng(0).choice(len(q), 100)
    for text in ("arm4", "arm4:self_collision=true"):
        each = envs.make(text)
        parts = np.empty(each.robot.moving)
        found = each.rough_clearance(q[picked])
        for one, least in zip(q[picked], found, strict=True):
            view = each.robot.view
            assert arm_clearance.part_clearances(view, each.scene, one, parts) == parts.min()
            assert least == pytest.approx(parts.min(), abs=1e-12)
    assert env.rough_clearance(q[picked]) == pytest.approx(whole[picked], abs=1e-12)
    assert env.rough_clearance(q[:0]).shape == (0,)


def test_a_box_with_a_centre_of_its_own_is_where_it_says() -> None:
    """And so are spheres that cover it; obstacles as well."""
    off = Box(np.array([1.0, 0, 0]), np.full(3, 0.2))
    obstacle = Placed(Box(np.array([0.0, 0, 0.5]), np.full(3, 0.2)), at(2, 0, -0.5))
    world = ArmWorld(arm_of([turning("z")], Part(1, Placed(off, np.eye(4)))), [obstacle], "test")
    q = np.zeros((1, 1))
    assert 0.6 < world.rough_clearance(q)[0] <= 0.8
    assert fcl_only(world).clearance(q[0]) == pytest.approx(0.8, abs=1e-6)


def test_clearances_are_never_above_the_truth() -> None:
    """Between a rod and a board, points of which are 0.0839206 apart."""
    rod, board = Cylinder(0.04, 0.26), Box(np.zeros(3), np.array([0.3, 0.6, 0.02]))
    there = at(-0.011, -0.374, -0.046, -0.878, 0.426, -0.672)
    arm = arm_of([turning("z")], Part(1, Placed(rod, np.eye(4))))
    model = CollisionModel(arm, [Placed(board, there)])
    assert model.clearance(np.zeros(1)) < 0.0839206 + 1e-4


# Meshes


def written(folder: Path, urdf: str, *obstacles: str) -> Environment:
    """The world of a URDF and of obstacles as in a scene file."""
    trimesh.creation.box((0.4, 0.4, 0.4)).export(folder / "block.stl")
    trimesh.creation.icosphere(subdivisions=2, radius=0.2).export(folder / "ball.ply")
    (folder / "arm.urdf").write_text(urdf)
    (folder / "scene.yaml").write_text(f"obstacles: [{', '.join(obstacles)}]")
    return envs.make(
        f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'},self_collision=false"
    )


def slider(shape: str) -> str:
    """Its hand slides along x, from 0 to 2."""
    hand = link("hand", collision(shape))
    limit = '<limit lower="0" upper="2"/>'
    return robot(link("base", ""), hand, joint("j", "base", "hand", "prismatic", limit, "1 0 0"))


SMALL, HOLLOW = '<sphere radius="0.05"/>', '<mesh filename="ball.ply"/>'


@pytest.mark.parametrize(
    ("hand", "obstacle"),
    [
        (SMALL, "{mesh: block.stl, position: [1, 0, 0]}"),
        (HOLLOW, "{sphere: 0.05, position: [1, 0, 0]}"),
        (HOLLOW, "{mesh: ball.ply, scale: 0.1, position: [1, 0, 0]}"),
        (HOLLOW, "{box: [1, 1, 1], position: [1, 0, 0]}"),
        (HOLLOW, "{mesh: block.stl, scale: 2, position: [1, 0, 0]}"),
    ],
)
def test_one_solid_within_another_is_a_collision(hand: str, obstacle: str, tmp_path: Path) -> None:
    world = written(tmp_path, slider(hand), obstacle)
    beside, within = np.array([0.05]), np.array([1.0])
    for model in (world.collision_model(), fcl_only(world)):
        assert model.is_valid(beside)
        assert model.clearance(beside) > 0.1
        assert not model.is_valid(within)
        assert model.clearance(within) < 0
        assert not model.segment_is_free(within, within + 1e-3)
        assert not model.segment_is_free(beside, within)
        assert model.min_clearance(np.array([within, within + 1e-3])) < 0
    assert (world.clearance(np.array([beside, within])) > 0).tolist() == [True, False]


def test_only_meshes_have_an_inside_of_their_own() -> None:
    arm = arm_of([sliding("x")], ball(1, 0.05, 0))
    assert not Containment(arm, [Box(np.zeros(3), np.ones(3))]).possible
    assert envs.make("arm4").allowed is None


def test_a_piece_of_a_mesh_of_many_is_found_within(tmp_path: Path) -> None:
    """Two small cubes in one file, the second of them within the block."""
    pair = [trimesh.creation.box((0.02,) * 3).apply_translation((x, 0, 0)) for x in (0, 0.3)]
    trimesh.util.concatenate(pair).export(tmp_path / "pair.ply")
    block = "{mesh: block.stl, position: [1.3, 0, 0]}"
    world = written(tmp_path, slider('<mesh filename="pair.ply"/>'), block)
    model = world.collision_model()
    assert not model.is_valid(np.array([1.0]))
    assert model.is_valid(np.array([0.6]))


def test_clearances_to_meshes_are_lower_bounds_by_little(tmp_path: Path) -> None:
    block = "{mesh: block.stl, position: [0.7, 0, 0], rpy: [0.3, 0.4, 0.5]}"
    world = written(tmp_path, slider(SMALL), block)
    q = np.linspace(0, 0.4, 50)[:, None]
    exact, rough = world.clearance(q), world.rough_clearance(q)
    short = (exact - rough)[exact > 0]
    assert len(short) > 30
    assert (short >= 0).all()
    assert short.max() < 2 * math.sqrt(3) * 0.02 * 2 * (1 + 2 * 0.125)


def test_a_ball_that_touches_a_mesh_has_no_clearance(tmp_path: Path) -> None:
    block = "{mesh: block.stl, position: [0.7, 0, 0], rpy: [0.3, 0.4, 0.5]}"
    world = written(tmp_path, slider(SMALL), block)
    model = fcl_only(world)
    q = np.linspace(0.3, 1.1, 200)[:, None]
    touching = [one for one in q if not model.is_valid(one)]
    assert len(touching) > 100
    assert max(model.clearance(one) for one in touching) <= 0


@pytest.mark.parametrize("kind", ["slide", "mast"])
def test_meshes_are_seen_wherever_an_arm_can_reach(kind: str, tmp_path: Path) -> None:
    mesh = "{mesh: block.stl, position: [POSITION]}"
    if kind == "slide":
        limit = '<limit lower="0" upper="4"/>'
        hand = link("hand", collision(SMALL))
        one = joint("j", "base", "hand", "prismatic", limit, "1 0 0")
        text, mesh = robot(link("base", ""), hand, one), mesh.replace("POSITION", "3, 0, 0")
    else:
        up = '<origin xyz="0 0 2"/>' + LIMIT
        hand = link("hand", collision(SMALL, '<origin xyz="0.3 0 0"/>'))
        mast = link("mast", "")
        turns = joint("turn", "base", "mast", axis="0 0 1")
        nods = joint("nod", "mast", "hand", inside=up, axis="0 0 1")
        text = robot(link("base", ""), mast, hand, turns, nods)
        mesh = mesh.replace("POSITION", "0.53, 0, 2")
    world = written(tmp_path, text, mesh)
    touching = np.array([[2.76]]) if kind == "slide" else np.zeros((1, 2))
    assert not fcl_only(world).is_valid(touching[0])
    assert world.rough_clearance(touching)[0] <= 0
    assert not world.collision_model().is_valid(touching[0])


def test_no_path_begins_with_an_obstacle_within_a_link(tmp_path: Path) -> None:
    world = written(tmp_path, slider(HOLLOW), "{sphere: 0.02, position: [1, 0, 0]}")
    path = np.array([[1.0], [1.01]])
    assert not world.paths_are_free([path], 1e-3)[0]


# How near they are to themselves


def gripper(self_collision: bool) -> Environment:
    """Upper arm 0.4 up from a shoulder at a height of 0.2, forearm of 0.5 with a ball at its end:
    folded back by pi, the ball is in the base."""
    arm = arm_of(
        [turning("y", at(0, 0, 0.2)), turning("y", at(0, 0, 0.4))],
        Part(1, Placed(Cylinder(0.03, 0.3), at(0, 0, 0.25))),
        ball(1, 0.06, 0, 0, 0.4),
        ball(2, 0.06, 0, 0, 0.02),  # touches the upper arm at all times
        ball(2, 0.05, 0, 0, 0.5),
        ball(0, 0.1, 0, 0, 0),
        self_collision=self_collision,
    )
    return ArmWorld(arm, [Placed(Sphere(0.1), at(5, 0, 0))], "test")


STRAIGHT, FOLDED = np.array([0.0, 0.0]), np.array([0.0, math.pi])


def test_a_folded_arm_hits_itself() -> None:
    world = gripper(self_collision=True)
    for model in (world.collision_model(), fcl_only(world)):
        assert model.is_valid(STRAIGHT)
        assert not model.is_valid(FOLDED)
        assert model.clearance(FOLDED) <= 0
        assert not model.segment_is_free(STRAIGHT, FOLDED)
        assert model.segment_is_free(STRAIGHT, FOLDED / 2)
    assert world.clearance(FOLDED[None])[0] < 0
    assert world.rough_clearance(FOLDED[None])[0] < 0
    paths = [np.array([STRAIGHT, FOLDED]), np.array([STRAIGHT, FOLDED / 2])]
    assert world.paths_are_free(paths, 1e-3).tolist() == [False, True]


def test_without_self_collision_a_folded_arm_does_not() -> None:
    world = gripper(self_collision=False)
    assert world.robot.pairs == ()
    model = world.collision_model()
    assert model.is_valid(FOLDED)
    assert model.segment_is_free(STRAIGHT, FOLDED)
    assert world.rough_clearance(FOLDED[None])[0] > 4
    assert len(world.robot.parts) == world.robot.moving == 4, "the base meets nothing"


def test_clearances_between_links_are_known() -> None:
    """The far ball of the forearm and the base. The near one cannot come there: it is left out."""
    world = gripper(self_collision=True)
    model = fcl_only(world)
    assert model.clearance(STRAIGHT) == pytest.approx(1.1 - 0.15)
    for bend in (2.6, 2.9, 3.0):
        tip = np.array([0.5 * math.sin(bend), 0.6 + 0.5 * math.cos(bend)])
        expected = np.linalg.norm(tip) - 0.15
        found = model.clearance(np.array([0, bend]))
        assert found == pytest.approx(expected, abs=1e-9) if bend < 3 else found <= 0
        rough = world.rough_clearance(np.array([[0, bend]]))[0]
        assert rough == pytest.approx(expected, abs=1e-9), "of spheres it is exact"


def test_neighbours_may_touch() -> None:
    arm = gripper(self_collision=True).robot
    parts = arm.parts
    named = {(parts[a].body, parts[b].body) for a, b in arm.pairs}
    assert named == {(2, 0)}
    assert all(a < arm.moving for a, _ in arm.pairs)
    assert len(arm.pairs) == 1, "the ball at the elbow cannot come to the base"


def test_links_without_solids_between_them_do_not_part_neighbours() -> None:
    joints = [turning("y", at(0, 0, 0.1)) for _ in range(4)]
    solids = [ball(0, 0.1, 0), ball(2, 0.1, 0), ball(4, 0.1, 0)]
    arm = arm_of(joints, *solids, self_collision=True)
    assert [(arm.parts[a].body, arm.parts[b].body) for a, b in arm.pairs] == [(4, 0)]


def folding(base: Part) -> Arm:
    """A forearm of 0.2 above a base at first, and in it when the elbow is turned by pi."""
    return arm_of(
        [turning("z", at(0, 0, 0.05)), turning("y", at(0, 0, 0.1))],
        ball(1, 0.02, 0, 0, 0.05),
        Part(2, Placed(Cylinder(0.02, 0.2), at(0, 0, 0.15))),
        base,
        self_collision=True,
    )


def test_links_that_always_touch_do_not_count() -> None:
    """The ball of the base goes up to the elbow and beyond."""
    arm = folding(ball(0, 0.25, 0))
    assert arm.pairs == ()
    assert CollisionModel(arm, []).is_valid(np.zeros(2))


def test_links_that_touch_at_times_count() -> None:
    """A wide and flat base."""
    arm = folding(Part(0, Placed(Cylinder(0.3, 0.02), np.eye(4))))
    model = CollisionModel(arm, [])
    assert model.is_valid(np.zeros(2))
    assert not model.is_valid(np.array([0, math.pi]))


def test_a_part_that_moves_is_needed() -> None:
    with pytest.raises(ValueError, match="no link that moves"):
        arm_of([turning("z")], ball(0, 0.1, 0))


def test_clearance_changes_no_faster_than_the_motion_bound_among_links() -> None:
    env = envs.make("arm4:self_collision=true")
    rng = np.random.default_rng(6)
    for a in configurations(env, 200, 7):
        b = a + rng.normal(0, 0.1, env.dimension)
        change = np.abs(np.diff(env.clearance(np.array([a, b]))))[0]
        assert change <= env.robot.motion_bound(a, b) + 1e-4


# Paths


@pytest.mark.parametrize("name", ["arm4", "arm6"])
def test_paths_that_are_proved_free_are_free(name: str) -> None:
    env = envs.make(name)
    model = fcl_only(env)
    free = configurations(env, 3000, 8)
    free = free[env.rough_clearance(free) > 0.01][:25]
    steps = np.random.default_rng(9).normal(0, 0.15, (len(free), 2, env.dimension))
    paths = [np.array([q, *(q + step)]) for q, step in zip(free, steps, strict=True)]
    found = env.paths_are_free(paths, 2e-3)
    for path, is_free in zip(paths, found, strict=True):
        if is_free:
            assert model.min_clearance(path) > 5e-4
    assert 3 < found.sum() < 23
    assert env.paths_are_free([], 2e-3).shape == (0,)


def test_a_path_of_one_waypoint_may_collide() -> None:
    env = envs.make("arm4")
    q = configurations(env, 100, 10)
    c = env.rough_clearance(q)
    paths = [q[c.argmin()][None], q[c.argmax()][None]]
    assert env.paths_are_free(paths, 1e-3).tolist() == [False, True]
