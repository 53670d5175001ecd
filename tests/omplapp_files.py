"""Problem files in the form of OMPL.app's, with meshes: an L that goes through a doorway."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from dae_files import dae, geometry, polylist
from mesh_files import WALL, prism

ELL = [(0, 0), (3, 0), (3, 1), (1, 1), (1, 3), (0, 3)]
"""Each corner of its prism has three normals, so that the mean of the vertices is that of the
corners: (4/3, 4/3, 1/2), where the middle of the bounding box is (3/2, 3/2, 1/2)."""

CENTER = np.array([4 / 3, 4 / 3, 1 / 2])

SPATIAL = {
    "robot": "ell.dae",
    "world": "wall.dae",
    "start.x": 1,
    "start.y": 1.5,
    "start.z": -2,
    "start.theta": 0,
    "goal.x": 4,
    "goal.y": 1.5,
    "goal.z": 3,
    "goal.theta": 1.5,
    "start.axis.x": 1,
    "start.axis.y": 0,
    "start.axis.z": 0,
    "goal.axis.x": 0,
    "goal.axis.y": 1,
    "goal.axis.z": 0,
    "volume.min.x": 0,
    "volume.min.y": 0,
    "volume.min.z": -3,
    "volume.max.x": 5,
    "volume.max.y": 3,
    "volume.max.z": 4,
}
"""Through the doorway of a wall of 5 by 3 units, from z = 0 to 1, with y up."""

PLANAR = {
    "robot": "flat.obj",
    "world": "walls.obj",
    "start.x": -3,
    "start.y": -3,
    "start.theta": 0,
    "goal.x": 3,
    "goal.y": 3,
    "goal.theta": 2.5,
    "volume.min.x": -5,
    "volume.min.y": -5,
    "volume.max.x": 5,
    "volume.max.y": 5,
}
"""Through the gap between two walls along x."""

Values = dict[str, object]


def cfg(values: Values) -> str:
    lines = [f"{key} = {value}" for key, value in values.items()]
    return "\n".join(["[problem]", "name = own", *lines, "", "[planner]", "rrt=", "rrt.range=1"])


def collada(outline: Sequence[tuple[int, int]], scale: float, asset: str) -> bytes:
    """The prism of an outline, without normals."""
    vertices, faces = prism(list(outline))
    shape = geometry(scale * vertices, polylist(faces))
    plain = shape.replace('<input semantic="NORMAL" source="#g-normals" offset="1"/>', "")
    return dae(plain.replace(' offset="0"/><vcount>', ' offset="0"/>' + _SECOND), asset=asset)


_SECOND = '<input semantic="TEXCOORD" source="#g-normals" offset="1"/><vcount>'
"""The corners' second index has to be of something."""


def write_meshes(folder: Path, up: str = "Y_UP") -> None:
    """The body and the wall, in Collada; the flat ones, which are symmetrical in z, in OBJ."""
    asset = f"<up_axis>{up}</up_axis>"
    (folder / "ell.dae").write_bytes(collada(ELL, 0.3, asset))
    (folder / "wall.dae").write_bytes(collada(WALL, 1.0, asset))
    vertices, faces = prism(ELL)
    ell = trimesh.Trimesh(0.5 * vertices - [0, 0, 0.25], _fans(faces))
    ell.export(folder / "flat.obj")
    walls = [
        trimesh.creation.box((4, 0.5, 2)).apply_translation((middle, 0, 0))
        for middle in (-3.0, 3.0)
    ]
    trimesh.util.concatenate(walls).export(folder / "walls.obj")


def _fans(faces: Sequence[Sequence[int]]) -> list[list[int]]:
    """Triangles of faces that are star-shaped about their first corner, the inner one of an L."""
    fans = []
    for face in faces:
        first = next((n for n, i in enumerate(face) if len(face) == 6 and i in (3, 9)), 0)
        turned = [*face[first:], *face[:first]]
        fans += [[turned[0], turned[n], turned[n + 1]] for n in range(1, len(face) - 1)]
    return fans


def write_problem(folder: Path, values: Values, name: str = "own.cfg", up: str = "Y_UP") -> Path:
    write_meshes(folder, up)
    (folder / name).write_text(cfg(values))
    return folder / name
