"""What is planned in: robots, scenes, collision checking, problems."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from envs.errors import InputError
from envs.registry import Registry, Spec
from envs.scenes.motion_bench_maker_sets import SETS
from envs.scenes.robometrics_scenes import SCENES

if TYPE_CHECKING:
    from envs.environment import Environment
    from envs.problem import Path, Problem

__all__ = ["Environment", "InputError", "Path", "Problem", "Spec", "REGISTRY", "make"]

_LATER = {
    "Environment": "envs.environment",
    "Path": "envs.problem",
    "Problem": "envs.problem",
}
"""Imported when they are asked for: whoever only lists what there is does without NumPy."""


def __getattr__(name: str) -> Any:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = getattr(import_module(_LATER[name]), name)
    return globals()[name]


REGISTRY: Registry[Environment] = Registry(
    "environment",
    [
        Spec(
            "c3d",
            "envs.scenes.cluttered:Cluttered3D",
            "point robot in a 20-unit cube among random boxes (scene, boxes, robot_radius)",
        ),
        Spec(
            "box",
            "envs.scenes.boxes:SingleBox",
            "point robot about one cube, the paper's box (side, robot_radius)",
        ),
        Spec(
            "maze",
            "envs.scenes.maze:Maze",
            "point robot between a maze's thin walls, in the plane or in space (scene, dimension, "
            "rooms, loops, corridor, robot_radius)",
        ),
        Spec(
            "bunny",
            "envs.scenes.bunny:Bunny",
            "point robot about the Stanford bunny, fetched once (robot_radius)",
        ),
        Spec(
            "gibson-generated",
            "envs.scenes.gibson:GeneratedHouse",
            "point robot in a generated, furnished house, scanned with flaws (scene, robot_radius, "
            "door)",
        ),
        Spec(
            "gibson",
            "envs.scenes.gibson:Gibson",
            "the same in a scene of the Gibson data set (root, scene, robot_radius); without a "
            "root it is gibson-generated",
            in_all=False,
            without={"root": "gibson-generated"},
        ),
        *(
            Spec(
                model,
                "envs.scenes.arms:ShippedArm",
                f"{joints} at a cluttered table (scene, self_collision, posts)",
                {"model": model},
            )
            for model, joints in (
                ("arm4", "arm of four joints, yaw and three pitch,"),
                ("arm5", "arm of five joints"),
                ("arm6", "arm of six joints, placed as in the UR5e,"),
            )
        ),
        Spec(
            "arm",
            "envs.scenes.arms:UserArm",
            "any robot from a URDF, or by name, among solids from a file (urdf, robot, scene, "
            "self_collision, geometry, srdf, group, tip, joints, state, pose)",
            in_all=False,
        ),
        Spec(
            "mesh",
            "envs.scenes.mesh_world:MeshWorld",
            "point robot about or within any triangle mesh (file, kind, robot_radius, scale)",
            in_all=False,
        ),
        Spec(
            "rigid",
            "envs.scenes.rigid_world:RigidWorld",
            "rigid body that turns, or only moves, in any world of a point robot (body, space, "
            "world, size)",
            in_all=False,
        ),
        Spec(
            "omplapp",
            "envs.scenes.omplapp:OmplApp",
            "rigid body in the world of one of OMPL.app's .cfg files, from its start to its goal "
            "(file, space, kind, weight)",
            in_all=False,
        ),
        Spec(
            "grid",
            "envs.scenes.grid_map:GridMap",
            "point robot, disc or ball in an occupancy grid: a map of ROS, an image, an array, or "
            "Moving AI's with its problems (file, scen, radius, resolution, unknown)",
            in_all=False,
        ),
        Spec(
            "mbm",
            "envs.scenes.motion_bench_maker:MotionBenchMaker",
            "a set of MotionBenchMaker's problems, each in a scene of its own (robot, set, scene)",
            in_all=False,
        ),
        *(
            Spec(
                f"mbm-{robot}-{name.replace('_', '-')}",
                "envs.scenes.motion_bench_maker:MotionBenchMaker",
                f"MotionBenchMaker's {name} for {robot} (scene)",
                {"robot": robot, "set": name},
                groups=(f"mbm-{robot}",),
                in_all=False,
            )
            for robot, names in SETS.items()
            for name in names
        ),
        Spec(
            "robometrics",
            "envs.scenes.robometrics:Robometrics",
            "robometrics' problems of Franka's Panda with lists of goals, each in a scene of its "
            "own, from a copy of its YAML (set, file, scene, problem, urdf, srdf, robot)",
            in_all=False,
        ),
        *(
            Spec(
                f"robometrics-{set}-{name.removesuffix('_panda').replace('_', '-')}",
                "envs.scenes.robometrics:Robometrics",
                f"robometrics' {name} of the set {set} (file, problem, urdf, srdf, robot)",
                {"set": set, "scene": name},
                groups=(f"robometrics-{set}",),
                in_all=False,
            )
            for set, names in SCENES.items()
            for name in names
        ),
    ],
    entry_point_group="bench.envs",
    base="envs.environment:Environment",
    of_files={
        ".urdf": "an arm is arm:urdf={}",
        ".scene": "an arm in it is arm:robot=NAME,scene={}",
        ".cfg": "a problem of OMPL.app is omplapp:file={}",
        **dict.fromkeys(
            (".3dmap", ".bmp", ".map", ".npy", ".pgm", ".png"), "an occupancy grid is grid:file={}"
        ),
        **dict.fromkeys((".dae", ".glb", ".obj", ".off", ".ply", ".stl"), "a mesh is mesh:file={}"),
    },
)


def make(text: str) -> Environment:
    """The environment that `name` or `name:key=value,...` names.

    Raises:
        InputError: a name or an argument is unknown or out of range.
    """
    return REGISTRY.make(text)
