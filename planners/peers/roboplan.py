"""RoboPlan: RRT-Connect in C++ with Pinocchio and coal, which checks motions at states along
them."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from envs.plain_scene import PlainScene, PlainSolid
from envs.problem import Array, Problem
from planners.base import Budget
from planners.peers.peer import NoPathError, Peer, shortest_ways
from planners.peers.urdf_text import GROUP, moving, srdf, urdf, with_names_apart, write_mesh

_MOST_NODES = 10_000_000  # more than any time allows
_WORLD = "universe"  # as Pinocchio has it
_GREY = np.array([0.5, 0.5, 0.5, 1.0])


class RoboPlan(Peer):
    """RRT-Connect as RoboPlan has it, with as many nodes as the time allows; of several goals the
    first.

    Args:
        range: the longest motion, in radians and metres, as RoboPlan's `max_connection_distance`.
        step: between states that are checked, as its `collision_check_step_size`.
        shortcut: whether the path is shortened by its `PathShortcutter`, on the clock.
        python: see `Guest`.
    """

    distribution = "roboplan"
    packages = ("numpy", "roboplan")

    def __init__(
        self, range: float = 3.0, step: float = 0.05, shortcut: bool = False, python: str = ""
    ) -> None:
        super().__init__(python)
        self._range, self._shortcut = range, shortcut
        self.checked_every = self._step = step

    def setup(self, env: Any, *, seed: int) -> None:
        self.set_scene(env)

    def set_scene(self, env: Any) -> None:
        from roboplan import core

        robot = with_names_apart(env.robot)
        self._names = [joint.name for joint in moving(robot)]
        self._wraps = env.wraps
        with TemporaryDirectory() as folder:
            text = urdf(robot, Path(folder))
            described = core.loadUrdfSceneDescriptionFromXml(text)
            self._scene = core.Scene(robot.name or "robot", described)
            self._scene.importSrdf(srdf(robot))
            _add_obstacles(self._scene, env, Path(folder))

    def planned(self, problem: Problem, budget: Budget) -> Array:
        from roboplan import core, rrt

        options = rrt.RRTOptions(
            group_name=GROUP,
            max_nodes=_MOST_NODES,
            max_connection_distance=self._range,
            collision_check_step_size=self._step,
            max_planning_time=budget.remaining(),
            rrt_connect=True,
        )
        planner = rrt.RRT(self._scene, options)
        planner.setRngSeed(problem.seed)
        ends = (core.JointConfiguration(self._names, q) for q in (problem.start, problem.goal))
        try:
            path = planner.plan(*ends)
        except RuntimeError as error:
            raise NoPathError(str(error)) from error
        if self._shortcut:
            options = core.PathShortcuttingOptions(GROUP, self._step, seed=problem.seed)
            path = core.PathShortcutter(self._scene, options).shortcut(path)
        order = [path.joint_names.index(name) for name in self._names]
        return shortest_ways(np.array(path.positions)[:, order], self._wraps)


def _add_obstacles(scene: Any, told: PlainScene, folder: Path) -> None:
    """Puts them into a scene, in which they may touch each other, and what else they may."""
    added: list[str] = []
    solid_links = [link for link in told.robot.links if link.solids]
    for number, (name, solid) in enumerate(told.named_obstacles):
        touching = [link.name for link in solid_links if name in link.touches_obstacles]
        for part, piece in enumerate(solid.pieces()):
            of = f"{name}-{part}"
            place = np.asfortranarray(piece.pose)
            _add(scene, of, _WORLD, piece, place, folder / f"obstacle-{number}.obj")
            scene.setCollisions([(of, other) for other in (*added, *touching)], False)
            added.append(of)


def _add(scene: Any, name: str, frame: str, solid: PlainSolid, place: Array, file: Path) -> None:
    from roboplan import core

    sizes = [number for numbers in solid.sizes.values() for number in numbers]
    if solid.kind == "mesh":
        write_mesh(solid, file)
        scene.addMeshGeometry(name, frame, core.Mesh(file), place, _GREY)
    elif solid.kind == "box":
        scene.addBoxGeometry(name, frame, core.Box(*sizes), place, _GREY)
    elif solid.kind == "cylinder":
        scene.addCylinderGeometry(name, frame, core.Cylinder(*sizes), place, _GREY)
    else:
        scene.addSphereGeometry(name, frame, core.Sphere(*sizes), place, _GREY)
