"""Solid shapes of scenes and robots, and what collision checking asks of a robot.

A kind of shape is a class of its own, which answers all that is asked of it (`Solid`). One of which
a few lengths tell all (`SizedSolid`) is read from URDFs and scene files once it is in `SIZED`.
"""

from envs.collision.shapes.capsule import Capsule
from envs.collision.shapes.convex_hull import ConvexHull
from envs.collision.shapes.placed_shape import (
    SURFACE_POINTS,
    Obstacle,
    PlacedShape,
    surface_points,
)
from envs.collision.shapes.robot import Bodies, Robot
from envs.collision.shapes.sized import Box, Cylinder, SizedSolid, Sphere
from envs.collision.shapes.solid import (
    BOX,
    CYLINDER,
    LARGEST,
    MESH,
    POINT,
    ROW,
    TRIANGLE,
    Solid,
    Spheres,
    make_row,
    rounded,
)
from envs.collision.shapes.triangle_mesh import Mesh

SIZED: dict[str, type[SizedSolid]] = {cls.kind: cls for cls in (Box, Sphere, Cylinder, Capsule)}
"""Shapes of a few lengths, by the kinds by which files name them."""

__all__ = [
    "BOX",
    "CYLINDER",
    "LARGEST",
    "MESH",
    "POINT",
    "ROW",
    "SIZED",
    "SURFACE_POINTS",
    "TRIANGLE",
    "Bodies",
    "Box",
    "Capsule",
    "ConvexHull",
    "Cylinder",
    "Mesh",
    "Obstacle",
    "PlacedShape",
    "Robot",
    "SizedSolid",
    "Solid",
    "Sphere",
    "Spheres",
    "make_row",
    "rounded",
    "surface_points",
]
