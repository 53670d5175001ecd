"""A shape that nobody else knows: one class in a file of its own and one line that registers it,
read from a URDF and a scene, judged, planned among and drawn."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import coal
import numpy as np
import pytest
from bad_urdfs import LIMIT, collision, joint, link, robot
from scipy.spatial.transform import Rotation

import envs
import planners
from bench.judging.judge import Judge
from bench.report.scene import draw
from bench.storage.record import Verdict
from envs import Environment, InputError, Problem
from envs.collision.separation import separations, shapes_of
from envs.collision.shapes import SIZED, Cylinder, PlacedShape
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from planners import Budget, Status

LOZENGE = '''
from dataclasses import dataclass

import fcl
import numpy as np
import trimesh

from envs.collision.shapes import BOX, SIZED, Box, SizedSolid, make_row


@dataclass(frozen=True)
class Lozenge(SizedSolid):
    """All points no farther than a radius from a box."""

    kind = "lozenge"
    sizes = {"size": 3, "radius": 1}

    x: float
    y: float
    z: float
    radius: float

    def __post_init__(self):
        if self.radius > 1:
            raise ValueError("a lozenge of a radius over 1 is none")

    @property
    def _around(self):
        return Box(np.zeros(3), np.array([self.x, self.y, self.z]) + 2 * self.radius)

    def definition(self):
        return [self.kind, self.x, self.y, self.z, self.radius]

    def bounding_sphere(self):
        return np.zeros(3), np.hypot(np.hypot(self.x, self.y), self.z) / 2 + self.radius

    def sphere_cover(self, slack):
        return self._around.sphere_cover(slack)

    def distance_row(self, pose):
        half = np.array([self.x, self.y, self.z]) / 2
        return make_row(BOX, pose[:3, :3], pose[:3, 3], half, self.radius)

    def triangulate(self):
        ball = trimesh.creation.icosphere(subdivisions=2, radius=self.radius).vertices
        corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
        corners *= [self.x, self.y, self.z]
        return trimesh.convex.convex_hull((corners[:, None] + ball).reshape(-1, 3))

    def fcl_geometry(self):
        hull = self.triangulate()
        faces = np.column_stack([np.full(len(hull.faces), 3), hull.faces]).ravel()
        return fcl.Convex(hull.vertices, len(hull.faces), faces)


SIZED[Lozenge.kind] = Lozenge
'''


@pytest.fixture
def lozenge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Its class; it is forgotten afterwards."""
    before = dict(SIZED)
    file = tmp_path / "lozenge.py"
    file.write_text(LOZENGE)
    spec = importlib.util.spec_from_file_location("lozenge", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "lozenge", module)
    spec.loader.exec_module(module)
    yield module.Lozenge
    SIZED.clear()
    SIZED.update(before)


SHAPE = '<lozenge size="0.04 0.04 0.3" radius="0.03"/>'


def world(folder: Path) -> Environment:
    """A hand that turns about the z axis, 0.3 to 0.7 m from it, and a lozenge in its way."""
    (folder / "arm.urdf").write_text(
        robot(
            link("base", ""),
            link("post", ""),
            link("hand", collision(SHAPE, '<origin xyz="0.5 0 0" rpy="0 1.5707963267948966 0"/>')),
            joint("turn", "base", "post", "revolute", LIMIT, "0 0 1"),
            joint("tilt", "post", "hand", "revolute", LIMIT, "0 1 0"),
        )
    )
    (folder / "scene.yaml").write_text(
        "obstacles: [{lozenge: [0.1, 0.2, 0.1, 0.05], position: [0, 0.5, 0]}]"
    )
    return envs.make(f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}")


@pytest.mark.slow
def test_it_is_read_judged_planned_among_and_drawn(lozenge: Any, tmp_path: Path) -> None:
    env = world(tmp_path)
    assert [type(shape) for shape in env.robot.shapes] == [lozenge]
    assert [type(one.solid) for one in env.obstacles] == [lozenge]
    assert env.robot.shapes[0].definition() == ["lozenge", 0.04, 0.04, 0.3, 0.03]
    # Above the obstacle, which ends at 0.1; the hand is 0.05 thick to either side.
    straight = np.array([[0.5, 0.0], [1.4, 0.0]])
    assert env.clearance(straight)[0] > 0.1
    assert not env.collision_model().is_valid(np.array([1.5, 0.0]))
    problem = Problem(np.array([0.2, 0.0]), np.array([1.45, -1.0]))
    judge = Judge(env)
    through = np.array([problem.start, [1.45, 0.0], problem.goal])
    over = np.array([problem.start, [0.2, -1.0], problem.goal])
    assert judge(problem, through).verdict is Verdict.COLLISION
    assert judge(problem, over).verdict is Verdict.VALID
    for name in ("rrtconnect", "fmm"):
        planner = planners.make(name)
        planner.setup(env, seed=0)
        result = planner.solve(problem, Budget(perf_counter() + 20))
        assert result.status is Status.EXACT_SOLUTION
        assert judge(problem, np.asarray(result.path)).verdict is Verdict.VALID
    assert len(env.sample_problems(5, 0)) == 5
    assert isinstance(env, ArmWorld)
    draw(env, "arm", None, tmp_path / "arm.png")
    assert (tmp_path / "arm.png").stat().st_size > 10_000


@pytest.mark.slow
def test_its_distances_are_those_of_coals_swept_box(lozenge: Any) -> None:
    rng = np.random.default_rng(0)
    box = coal.Box(0.3, 0.2, 0.1)
    box.setSweptSphereRadius(0.05)
    solids = (lozenge(0.3, 0.2, 0.1, 0.05), Cylinder(0.1, 0.4))
    shapes = shapes_of([PlacedShape(one, np.eye(4)) for one in solids])
    compared = 0
    for turn in Rotation.random(500, rng=rng).as_matrix():
        shift = rng.normal(size=3) * 0.4
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        at = coal.Transform3s(np.ascontiguousarray(turn), shift)
        exact = coal.distance(box, coal.Transform3s(), coal.Cylinder(0.1, 0.4), at, request, result)
        pose = np.array([[np.eye(3, 4), np.column_stack([turn, shift])]])
        found = separations(shapes, 0, 1, pose, np.inf)[0]
        assert found == pytest.approx(max(exact, 0), abs=3e-6)
        compared += exact > 0
    assert compared > 200


def test_its_own_checks_and_those_of_all_shapes_are_one_line(lozenge: Any, tmp_path: Path) -> None:
    world(tmp_path)
    file = tmp_path / "arm.urdf"
    good = file.read_text()
    for odd, said in (
        ('<lozenge size="1 1 1"/>', "link 'hand': its <lozenge> has no radius; add it"),
        ('<lozenge size="1 1" radius="1"/>', "size='1 1' must hold 3 finite numbers"),
        ('<lozenge size="1 1 1" radius="2"/>', "link 'hand': a lozenge of a radius over 1 is none"),
        ('<lozenge size="1 1 1" radius="0"/>', "its <lozenge>'s radius must be positive, not 0"),
        ('<lozeng size="1 1 1" radius="1"/>', "did you mean 'lozenge'"),
    ):
        file.write_text(good.replace(SHAPE, odd))
        with pytest.raises(InputError, match=said):
            read_urdf(file)
    scene = tmp_path / "scene.yaml"
    for entry, said in (
        ("{lozenge: [1, 1, 1]}", "obstacle 1: lozenge must be a list of 4 numbers"),
        ("{lozenge: [1, 1, 1, 2]}", "obstacle 1: a lozenge of a radius over 1 is none"),
        ("{lozeng: [1, 1, 1, 1]}", "did you mean 'lozenge'"),
    ):
        scene.write_text(f"obstacles: [{entry}]")
        file.write_text(good)
        with pytest.raises(InputError, match=said):
            envs.make(f"arm:urdf={file},scene={scene}")
