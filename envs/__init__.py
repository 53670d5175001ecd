"""What is planned in: robots, scenes, collision checking, problems."""

from envs.base import Environment
from envs.errors import InputError
from envs.problem import Path, Problem
from envs.registry import Registry, Spec

__all__ = ["Environment", "InputError", "Path", "Problem", "Spec", "REGISTRY", "make"]

REGISTRY: Registry[Environment] = Registry(
    "environment",
    [
        Spec(
            "c3d",
            "envs.scenes.cluttered:Cluttered3D",
            "point robot in a 20-unit cube among random boxes (scene, boxes, robot_radius)",
        ),
        Spec(
            "mesh",
            "envs.scenes.mesh_world:MeshWorld",
            "point robot about or within any triangle mesh (file, kind, robot_radius, scale)",
        ),
    ],
    entry_point_group="bench.envs",
)


def make(text: str) -> Environment:
    """The environment that `name` or `name:key=value,...` names.

    Raises:
        InputError: a name or an argument is unknown or out of range.
    """
    return REGISTRY.make(text)
