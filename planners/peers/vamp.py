"""VAMP: RRT-Connect over spheres, many states at once (Thomason, Kingston and Kavraki, "Motions in
Microseconds via Vectorized Sampling-Based Planning", ICRA 2024)."""

from __future__ import annotations

from typing import Any

import numpy as np

from envs.errors import InputError, suggestion
from envs.plain_scene import PlainScene, PlainSolid
from envs.problem import Array, Problem
from planners.base import Budget
from planners.peers.kinematics import link_poses
from planners.peers.peer import NoPathError, Peer, shortest_ways
from planners.peers.urdf_text import moving, roll_pitch_yaw

_ROBOTS = ("baxter", "fetch", "panda", "ur5")
"""Those that it is compiled for, and that MotionBenchMaker's problems are of."""

_SAMPLERS = ("halton", "xorshift")
_CYLINDERS = ("capsule", "box")

_NEAR = 2e-3
"""Metres, and in rotations, by which the end effector may be elsewhere than by our kinematics: its
own are of rounded numbers."""


class Vamp(Peer):
    """VAMP's RRT-Connect, for the robots that it is compiled for, as MotionBenchMaker has them.

    It has spheres for links, and checks motions at states along them. It has no clock: an attempt
    that needs more iterations than its time allows is ended by the harness.

    Args:
        range: the longest motion, in radians and metres; 0 for VAMP's own choice for the robot.
        simplify: whether the path is simplified by VAMP, on the clock.
        sampler: "halton", a sequence that is the same each time, or "xorshift".
        cylinders: what stands for cylinders, which it does not have: a "capsule" about each, as its
            authors have it, or a "box", as they have it in the set "box".
        python: see `Peer`.

    Raises:
        InputError: there is no such sampler or shape.
    """

    distribution = "vamp-planner"
    packages = ("vamp", "numpy")

    def __init__(
        self,
        range: float = 0.0,
        simplify: bool = False,
        sampler: str = "halton",
        cylinders: str = "capsule",
        python: str = "",
    ) -> None:
        super().__init__(python)
        for what, chosen, known in (
            ("sampler", sampler, _SAMPLERS),
            ("shape for cylinders", cylinders, _CYLINDERS),
        ):
            if chosen not in known:
                raise InputError(f"vamp: unknown {what} {chosen!r}; {suggestion(chosen, known)}")
        self._range, self._simplify = range, simplify
        self._sampler, self._cylinders = sampler, cylinders

    def refuses(self, scene: PlainScene) -> str | None:
        if scene.robot.name not in _ROBOTS:
            named = scene.robot.name or "without a name"
            return f"VAMP is compiled for {', '.join(_ROBOTS)}, not for a robot {named}"
        kinds = {solid.kind for solid in scene.obstacles} - {"box", "sphere", "cylinder", "capsule"}
        return f"VAMP has no obstacle that is a {min(kinds)}" if kinds else None

    def setup(self, env: Any, *, seed: int) -> None:
        """Makes the planner for a robot.

        Raises:
            RuntimeError: VAMP's robot of that name is another.
        """
        import vamp

        options = {"range": self._range} if self._range else {}
        configured = vamp.configure_robot_and_planner_with_kwargs(env.robot.name, "rrtc", **options)
        self._robot, self._plan, self._settings, self._simplifying = configured
        names = [joint.name for joint in moving(env.robot)]
        theirs = list(self._robot.joint_names())
        if sorted(names) != sorted(theirs):
            raise RuntimeError(f"VAMP's {env.robot.name} moves {theirs}, this one {names}")
        self._order = [names.index(name) for name in theirs]
        self._check_place(env)
        self._rng = getattr(self._robot, self._sampler)()
        self.set_scene(env)

    def _check_place(self, scene: PlainScene) -> None:
        """Raises RuntimeError if its robot's end effector is elsewhere than this one's."""
        tip = str(self._robot.end_effector())
        if tip not in {link.name for link in scene.robot.links}:
            return
        for share in (0.25, 0.5, 0.75):
            q = scene.lower + share * (scene.upper - scene.lower)
            theirs = np.asarray(self._robot.eefk(self._numbers(q)))
            off = float(np.abs(theirs - link_poses(scene.robot, q)[tip]).max())
            if off > _NEAR:
                raise RuntimeError(
                    f"VAMP's {scene.robot.name} is another robot: its {tip} is {off:.3g} off"
                )

    def set_scene(self, env: Any) -> None:
        import vamp

        self._wraps = env.wraps
        self._scene = vamp.Environment()
        for name, solid in env.named_obstacles:
            self._add(name, solid)

    def _add(self, name: str, solid: PlainSolid) -> None:
        import vamp

        place, turn = solid.pose[:3, 3].tolist(), roll_pitch_yaw(solid.pose).tolist()
        sizes = [number for numbers in solid.sizes.values() for number in numbers]
        boxed = solid.kind == "cylinder" and self._cylinders == "box"
        if solid.kind == "sphere":
            made, add = vamp.Sphere(place, sizes[0]), self._scene.add_sphere
        elif solid.kind == "box" or boxed:
            full = [2 * sizes[0], 2 * sizes[0], sizes[1]] if boxed else sizes
            halves = [side / 2 for side in full]
            made, add = vamp.Cuboid(place, turn, halves), self._scene.add_cuboid
        else:
            made, add = vamp.Cylinder(place, turn, *sizes), self._scene.add_capsule
        made.name = name
        add(made)

    def _numbers(self, q: Array) -> Any:
        """A configuration as VAMP has it."""
        return q[self._order].astype(np.float32)

    def planned(self, problem: Problem, budget: Budget) -> Array:
        self._rng.reset()
        start, goals = self._numbers(problem.start), [*map(self._numbers, problem.all_goals)]
        goal = goals if len(goals) > 1 else goals[0]
        found = self._plan(start, goal, self._scene, self._settings, self._rng)
        if len(found.path) < 2:
            raise NoPathError(f"none in {found.iterations} iterations")
        if self._simplify:
            found = self._robot.simplify(found.path, self._scene, self._simplifying, self._rng)
        theirs = np.asarray(found.path.numpy(), dtype=np.float64)
        path = np.empty_like(theirs)
        path[:, self._order] = theirs
        return shortest_ways(_with_ends(path, problem), self._wraps)


def _with_ends(path: Array, problem: Problem) -> Array:
    """A path of float32 from where the problem is, rather than from what that is rounded to, to the
    nearest goal."""
    goals = problem.all_goals
    nearest = int(np.linalg.norm(goals - path[-1], axis=1).argmin())
    path[0], path[-1] = problem.start, goals[nearest]
    return path
