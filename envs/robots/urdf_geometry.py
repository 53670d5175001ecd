"""The shapes of URDF links, checked: any kind of solid that `SIZED` has, and meshes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Protocol
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from trimesh import transformations

from envs.collision.shapes import SIZED, ConvexHull, Mesh, PlacedShape, Solid
from envs.errors import InputError, UnknownNameError, suggestion
from envs.files.mesh_file import read_mesh, read_points
from envs.files.paths import exists, safe_join
from envs.problem import Array
from envs.robots.urdf_elements import check_origin, numbers_of, xacro_hint

GEOMETRIES = ("collision", "visual")
"""Elements of links that hold geometry."""

_MESH_SCALES = (1, 3)
"""How many numbers a scale may have."""


def check_geometry_name(name: str) -> None:
    """Raises InputError unless it is one of `GEOMETRIES`."""
    if name not in GEOMETRIES:
        raise UnknownNameError("geometry", name, GEOMETRIES)


class Surface(Protocol):
    """What is read of a mesh's file.

    Attributes:
        vertices: (n, 3).
        faces: (m, 3), indices of vertices.
    """

    @property
    def vertices(self) -> Array: ...

    @property
    def faces(self) -> NDArray[np.int64]: ...


Read = Callable[[Path], Surface]


def shapes_of_link(
    link: ElementTree.Element, geometry: str, folder: Path, read: Read = read_mesh
) -> list[PlacedShape]:
    """The shapes of a link, each in the link's frame, in the file's order.

    Args:
        link: the element.
        geometry: which of its elements hold them, "collision" or "visual".
        folder: where the URDF is.
        read: reads the file of a mesh.

    Raises:
        InputError: one of them cannot be used; names the link.
    """
    try:
        return [_placed(element, folder, read) for element in link.findall(geometry)]
    except ValueError as error:  # InputError, or a shape's own
        raise InputError(f"link {link.get('name')!r}: {error}") from error


def _placed(element: ElementTree.Element, folder: Path, read: Read) -> PlacedShape:
    shapes = element.find("geometry")
    if shapes is None or len(shapes) != 1:
        raise InputError(f"its <{element.tag}> needs one <geometry> with one shape in it")
    pose = _pose(element.find("origin"))
    return PlacedShape(_solid(shapes[0], folder, read), pose)


def _pose(origin: ElementTree.Element | None) -> Array:
    if origin is None:
        return np.eye(4)
    check_origin(origin)
    xyz, rpy = (numbers_of(key, origin.get(key, "0 0 0"), (3,)) for key in ("xyz", "rpy"))
    pose: Array = transformations.compose_matrix(  # type: ignore[no-untyped-call]
        translate=xyz, angles=rpy
    )
    return pose


def _solid(shape: ElementTree.Element, folder: Path, read: Read) -> Solid:
    if shape.tag == "mesh":
        return _mesh(shape, folder, read)
    if shape.tag not in SIZED:
        nearest = suggestion(shape.tag.rpartition(":")[2], (*SIZED, "mesh"))
        raise InputError(f"a <{shape.tag}> is not read (a mesh can stand for any); {nearest}")
    cls = SIZED[shape.tag]
    return cls.of_sizes(_sizes(shape, cls.sizes))


def _sizes(shape: ElementTree.Element, wanted: Mapping[str, int]) -> list[float]:
    sizes = []
    for key, count in wanted.items():
        values = numbers_of(key, _needed(shape, key), (count,))
        if min(values) <= 0:
            raise InputError(f"its <{shape.tag}>'s {key} must be positive, not {shape.get(key)}")
        sizes += values
    return sizes


def _needed(shape: ElementTree.Element, key: str) -> str:
    text = shape.get(key)
    if not text:
        raise InputError(f"its <{shape.tag}> has no {key}; add it")
    return text


def _mesh(shape: ElementTree.Element, folder: Path, read: Read) -> Mesh:
    """A mesh file scaled; where that mirrors it, its faces are turned round, so that what was
    outward stays outward. Of one that is declared convex, as Drake has it, the hull is meant."""
    scale = np.array(numbers_of("scale", shape.get("scale", "1"), _MESH_SCALES))
    if (scale == 0).any():
        raise InputError("a mesh's scale must not be 0")
    scale = np.broadcast_to(scale, 3)
    file = _mesh_file(_needed(shape, "filename"), folder)
    if shape.find("drake:declare_convex") is not None:
        return ConvexHull.of_points(read_points(file) * scale)
    mesh = read(file)
    return Mesh(mesh.vertices * scale, mesh.faces[:, :: int(np.sign(scale.prod()))])


def _mesh_file(name: str, folder: Path) -> Path:
    """The file of a mesh that a URDF in a folder names: from there, or as a package's, from any
    folder above."""
    scheme, _, rest = name.rpartition("://")
    if not scheme:
        candidates = [safe_join(folder, rest)]
    else:
        relative = Path(rest.lstrip("/"))
        if ".." in relative.parts:
            raise InputError(f"{name} climbs out of where it is sought; put it there instead")
        without_package = Path(*relative.parts[1:])
        above = [folder, *folder.resolve().parents]
        candidates = [at / there for at in above for there in (relative, without_package)]
        if scheme == "file" and exists((folder / rest).is_file):
            return safe_join(folder, rest)
    for candidate in candidates:
        if exists(candidate.is_file):
            return candidate
    raise InputError(
        f"no such mesh: {name}, sought from {folder}; put it there or correct its name"
        f"{xacro_hint(name)}"
    )
