"""Solid shapes of scenes and robots, and what collision checking asks of a robot.

A kind of shape is a class of its own, which answers all that is asked of it (`Solid`); those of
which the sizes tell all are in `SIZED`, by which scene files name them.
"""

from envs.collision.shapes.placed_shape import (
    SURFACE_POINTS,
    Obstacle,
    PlacedShape,
    surface_points,
)
from envs.collision.shapes.robot import Pose, Robot
from envs.collision.shapes.sized import SIZED, Box, Cylinder, SizedSolid, Sphere
from envs.collision.shapes.solid import (
    BOX,
    CYLINDER,
    LARGEST,
    MESH,
    SPHERE,
    TRIANGLE,
    Solid,
    Spheres,
    rounded,
)
from envs.collision.shapes.triangle_mesh import Mesh

__all__ = [
    "BOX",
    "CYLINDER",
    "LARGEST",
    "MESH",
    "SIZED",
    "SPHERE",
    "SURFACE_POINTS",
    "TRIANGLE",
    "Box",
    "Cylinder",
    "Mesh",
    "Obstacle",
    "PlacedShape",
    "Pose",
    "Robot",
    "SizedSolid",
    "Solid",
    "Sphere",
    "Spheres",
    "rounded",
    "surface_points",
]
