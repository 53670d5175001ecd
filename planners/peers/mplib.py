"""MPlib: OMPL's RRT-Connect in C++ with FCL, which checks motions at states along them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from envs.plain_scene import PlainLink, PlainRobot, PlainScene, PlainSolid
from envs.problem import Array, Problem
from planners.base import Budget
from planners.peers.peer import NoPathError, Peer, shortest_ways
from planners.peers.urdf_text import kinematic_urdf, moving, srdf, touching


class Mplib(Peer):
    """RRT-Connect as MPlib has it, its path simplified on the clock, as MPlib does it by default.
    What follows there, a timing of the path, is left out.

    Args:
        range: the longest motion, in radians and metres, as MPlib's `rrt_range`; 0 for OMPL's own
            choice.
        simplify: whether the path is simplified.
        python: see `Guest`.
    """

    distribution = "mplib"
    packages = ("numpy", "mplib")

    def __init__(self, range: float = 0.1, simplify: bool = True, python: str = "") -> None:
        super().__init__(python)
        self._range, self._simplify = range, simplify

    def refuses(self, scene: PlainScene) -> str | None:
        follows = [joint.name for joint in scene.robot.joints if joint.follows]
        if follows:
            return f"MPlib has no joints that follow others, as {follows[0]!r} does"
        return super().refuses(scene)

    def setup(self, env: Any, *, seed: int) -> None:
        self.set_scene(env)

    def set_scene(self, env: Any) -> None:
        from mplib.pymp.planning import ompl

        self._world = self._world_of(env)
        self._wraps = env.wraps
        self._planner = ompl.OMPLPlanner(self._world)

    def _world_of(self, scene: PlainScene) -> Any:
        """The robot among the obstacles."""
        import mplib

        robot = scene.robot
        names = [joint.name for joint in moving(robot)]
        model = mplib.ArticulatedModel.create_from_urdf_string(
            kinematic_urdf(robot), srdf(robot), _objects(robot.links), joint_names=names
        )
        model.set_base_pose(mplib.Pose())  # which this way of making one leaves to chance
        model.set_move_group(_tips(robot))
        group = list(model.get_move_group_joint_names())
        self._order = [names.index(name) for name in group]
        obstacles = [_object(name, [solid]) for name, solid in scene.named_obstacles]
        world = mplib.PlanningWorld([model], obstacles)
        allowed = world.get_allowed_collision_matrix()
        pairs = [(link.name, name) for link in robot.links for name in link.touches_obstacles]
        for one, other in (*touching(robot), *pairs):
            allowed.set_entry(one, other, True)
        return world

    def planned(self, problem: Problem, budget: Budget) -> Array:
        import mplib

        mplib.set_global_seed(problem.seed)
        order = self._order
        goals = [goal[order] for goal in problem.all_goals]
        status, path = self._planner.plan(
            problem.start[order],
            goals,
            time=budget.remaining(),
            range=self._range,
            simplify=self._simplify,
        )
        if not status.startswith("Exact"):
            raise NoPathError(status)
        found = np.empty_like(path)
        found[:, order] = path
        return shortest_ways(found, self._wraps)


def _tips(robot: PlainRobot) -> list[str]:
    """The links that end the chains of joints that move."""
    parents = {joint.parent for joint in moving(robot)}
    return [joint.child for joint in moving(robot) if joint.child not in parents]


def _objects(links: Iterable[PlainLink]) -> list[Any]:
    return [_object(link.name, link.solids) for link in links if link.solids]


def _object(name: str, solids: Iterable[PlainSolid]) -> Any:
    import mplib
    from mplib.pymp.collision_detection import fcl

    pieces = [piece for solid in solids for piece in solid.pieces()]
    shapes = [fcl.CollisionObject(_geometry(piece)) for piece in pieces]
    poses = [mplib.Pose(piece.pose) for piece in pieces]
    return fcl.FCLObject(name, mplib.Pose(), shapes, poses)


def _geometry(solid: PlainSolid) -> Any:
    from mplib.pymp.collision_detection import fcl

    if solid.kind == "mesh":
        model = fcl.BVHModel()
        model.begin_model(len(solid.triangles), len(solid.vertices))
        model.add_sub_model(list(solid.vertices), list(solid.triangles.astype(np.int32)))
        model.end_model()
        return model
    sizes = {name: numbers[0] for name, numbers in solid.sizes.items()}
    if solid.kind == "box":
        return fcl.Box(np.array(solid.sizes["size"]))
    if solid.kind == "cylinder":
        return fcl.Cylinder(sizes["radius"], sizes["length"])
    return fcl.Sphere(sizes["radius"])
