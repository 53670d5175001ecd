"""Prints how far our distances from meshes, and FCL's, are off coal's:
python tests/benchmarks/mesh_distances.py [POSES]

Of random poses near contact and far, of meshes of good triangles and of slivers; in metres.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import coal
import fcl
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]

from coal_shapes import coal_mesh  # noqa: E402

from envs.collision.separation import separations, shapes_of  # noqa: E402
from envs.collision.shapes import Box, Cylinder, Mesh, PlacedShape, Solid, Sphere  # noqa: E402

EGG = trimesh.creation.icosphere(subdivisions=2).apply_scale([0.1, 0.06, 0.13])
ROD = trimesh.creation.cylinder(0.02, 0.4, sections=48)  # of slivers
BLOCK = trimesh.creation.box((0.1, 0.2, 0.03))


def main(poses: int) -> None:
    meshes = {"egg": EGG, "rod": ROD, "block": BLOCK}
    solids: dict[str, Any] = {
        "box": (Box(np.zeros(3), np.array([0.2, 0.1, 0.04])), coal.Box(0.2, 0.1, 0.04)),
        "cylinder": (Cylinder(0.03, 0.3), coal.Cylinder(0.03, 0.3)),
        "ball": (Sphere(0.05), coal.Sphere(0.05)),
    }
    solids |= {
        name: (_mesh(one), coal_mesh(one.vertices, one.faces)) for name, one in meshes.items()
    }
    for name, mesh in meshes.items():
        for other, (solid, theirs) in solids.items():
            compare(f"{name} and {other}", _mesh(mesh), solid, theirs, poses)


def _mesh(one: trimesh.Trimesh) -> Mesh:
    return Mesh(one.vertices, one.faces)


def compare(name: str, mesh: Mesh, solid: Solid, theirs: Any, poses: int) -> None:
    rng = np.random.default_rng(0)
    shapes = shapes_of([PlacedShape(mesh, np.eye(4)), PlacedShape(solid, np.eye(4))])
    surface, still = coal_mesh(mesh.vertices, mesh.faces), np.eye(3, 4)
    bodies = _of_fcl(mesh), _of_fcl(solid)
    ours, by_fcl = [], []
    for turn in Rotation.random(poses, rng=rng).as_matrix():
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        pose = np.column_stack([turn, rng.uniform(0.02, 0.5) * way])
        exact = _by_coal(surface, theirs, pose)
        if rng.random() < 0.5 and exact > 0:  # most likely still apart there, by very little
            pose[:, 3] -= (exact - 10 ** rng.uniform(-6, -2)) * way
            exact = _by_coal(surface, theirs, pose)
        if exact > 0:
            ours.append(separations(shapes, 0, 1, np.array([[still, pose]]), np.inf)[0] - exact)
            bodies[1].setTransform(fcl.Transform(turn, pose[:, 3]))
            request, result = fcl.DistanceRequest(), fcl.DistanceResult()
            by_fcl.append(fcl.distance(*bodies, request, result) - exact)
    print(
        f"{name}: {len(ours)} apart; ours {min(ours):.1e} to {max(ours):.1e}, "
        f"FCL {min(by_fcl):.1e} to {max(by_fcl):.1e}",
        flush=True,
    )


def _by_coal(surface: Any, theirs: Any, pose: np.ndarray) -> float:
    at = coal.Transform3s(np.ascontiguousarray(pose[:, :3]), pose[:, 3])
    result = coal.DistanceResult()
    return float(
        coal.distance(surface, coal.Transform3s(), theirs, at, coal.DistanceRequest(), result)
    )


def _of_fcl(solid: Solid) -> fcl.CollisionObject:
    if isinstance(solid, Box):
        return fcl.CollisionObject(fcl.Box(*solid.sides))
    if isinstance(solid, Cylinder):
        return fcl.CollisionObject(fcl.Cylinder(solid.radius, solid.length))
    if isinstance(solid, Sphere):
        return fcl.CollisionObject(fcl.Sphere(solid.radius))
    model = fcl.BVHModel()
    model.beginModel(len(solid.vertices), len(solid.faces))
    model.addSubModel(solid.vertices, solid.faces)
    model.endModel()
    return fcl.CollisionObject(model)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
