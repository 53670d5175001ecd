"""Collada 1.4 and 1.5 (.dae): the polygons of its scene, placed by its nodes.

Read here and not through pycollada, which has numbers in 32 bits, passes over polygons with holes
and knows nothing of accessors' offsets.

As URDFs' readers have it, the unit is applied (RViz, Gazebo) and the up axis is not (RViz, MoveIt,
Pinocchio): coordinates stay along the axes that they are written in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from envs.errors import brief
from envs.files.mesh_formats.polygons import Ints, Polygons, fans_to_triangles, strips_to_triangles
from envs.files.mesh_formats.soup import (
    MOST_FACES,
    Soup,
    UnreadableError,
    joined,
    moved,
    vertices_of_flat_faces,
)
from envs.problem import Array

_MOST_NODES = 100_000
"""Instances of nodes may stand for many more than a file has."""

_LINES = ("lines", "linestrips")
_FACES = ("triangles", "polylist", "polygons", "tristrips", "trifans")

_TO_Y_UP = {
    "X_UP": np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]),
    "Y_UP": np.eye(3),
    "Z_UP": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
}
"""The turns that take the up axis to y."""


def read(path: Path) -> Soup:
    """The triangles and polygons that the scene shows, in metres.

    Raises:
        UnreadableError: it refers to what is not there or in other files, a skin or a morph poses
            a mesh, it has polygons with holes or surfaces that are no polygons, or it is larger
            than can be checked.
    """
    document = _Document(_tree(path))
    soups: dict[Element, Soup] = {}
    placed, faces = [], 0
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused afterwards
        for geometry, pose in document.instances():
            if geometry not in soups:
                soups[geometry] = _geometry(geometry)
            faces += len(soups[geometry].faces)
            if faces > MOST_FACES:
                raise UnreadableError(f"it has more than {MOST_FACES} faces: simplify it")
            placed.append(moved(soups[geometry], pose))
        soup = joined(placed)
        return Soup(soup.vertices * document.unit, soup.faces, (*soup.notes, *document.notes))


def turn_to_y_up(path: Path) -> Array:
    """The rotation (3, 3) that assimp applies to a file that `read` reads, so that y is up.

    Raises:
        UnreadableError: the file is no Collada, or its up axis is none.
    """
    axis = _Document(_tree(path)).up_axis
    if axis not in _TO_Y_UP:
        raise UnreadableError(f"its up_axis is {brief(axis)}, not X_UP, Y_UP or Z_UP")
    return _TO_Y_UP[axis]


def drawn_vertices(path: Path) -> Array:
    """The vertices (n, 3) that renderers have of a file that `read` reads, in the same frame: of
    each group of faces or lines each place once for each normal that it has there. Groups without
    normals have those of their faces."""
    document = _Document(_tree(path))
    drawn: dict[Element, Array] = {}
    placed = [np.zeros((0, 3))]
    for geometry, pose in document.instances():
        if geometry not in drawn:
            drawn[geometry] = _drawn_geometry(geometry)
        placed.append(drawn[geometry] @ pose[:3, :3].T + pose[:3, 3])
    return np.concatenate(placed) * document.unit


def _tree(path: Path) -> Element:
    """The root, all names without their namespace."""
    try:
        root = ElementTree.parse(path).getroot()
    except ElementTree.ParseError as error:
        raise UnreadableError(f"it is not well-formed XML ({error})") from error
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    if root.tag != "COLLADA":
        raise UnreadableError(f"it has no <COLLADA> but <{brief(root.tag)}> at its top")
    return root


class _Document:
    """What a file's root has: its unit, and its scene's instances of geometry."""

    def __init__(self, root: Element) -> None:
        self._root = root
        self._by_id = {
            (element.tag, element.get("id")): element
            for element in root.iter()
            if element.tag in ("geometry", "node", "visual_scene")
        }

    @property
    def unit(self) -> float:
        """Its length in metres."""
        unit = self._root.find("asset/unit")
        meter = 1.0 if unit is None else float(unit.get("meter", "1"))
        if not 1e-12 <= meter <= 1e12:
            raise UnreadableError(f"its unit is {meter} metres, which cannot be")
        return meter

    @property
    def up_axis(self) -> str:
        return (self._root.findtext("asset/up_axis") or "Y_UP").strip()

    @property
    def notes(self) -> tuple[str, ...]:
        if self.up_axis == "Z_UP":
            return ()
        axis = brief(self.up_axis)
        return (f"its up_axis {axis} is not applied: coordinates are as they are written",)

    def instances(self) -> Iterator[tuple[Element, Array]]:
        """The geometries of the scene, and their poses (4, 4)."""
        waiting = [(node, np.eye(4)) for node in self._scene().findall("node")]
        visited = 0
        while waiting:
            node, above = waiting.pop()
            visited += 1
            if visited > _MOST_NODES:
                raise UnreadableError(
                    f"its nodes stand for more than {_MOST_NODES}, or for themselves"
                )
            pose = above @ _local(node)
            for child in reversed(node):
                if child.tag == "node":
                    waiting.append((child, pose))
                elif child.tag == "instance_node":
                    waiting.append((self._named("node", child), pose))
                elif child.tag == "instance_geometry":
                    yield self._named("geometry", child), pose
                elif child.tag == "instance_controller":
                    raise UnreadableError(
                        "a skin or a morph poses its mesh, which is not supported; export it posed"
                    )

    def _scene(self) -> Element:
        instance = self._root.find("scene/instance_visual_scene")
        if instance is not None:
            return self._named("visual_scene", instance)
        scenes = self._root.findall("library_visual_scenes/visual_scene")
        if len(scenes) != 1:
            raise UnreadableError("it does not say which scene it shows; export one")
        return scenes[0]

    def _named(self, kind: str, instance: Element) -> Element:
        """What an instance is of."""
        url = instance.get("url", "")
        if not url.startswith("#"):
            raise UnreadableError(f"it wants another file, {url!r}; put what is needed into it")
        if (kind, url[1:]) not in self._by_id:
            raise UnreadableError(f"it has no {kind} {brief(url[1:])}, of which it has an instance")
        return self._by_id[kind, url[1:]]


def _local(node: Element) -> Array:
    """A node's pose (4, 4) in its parent's frame: its transforms, the first of them outermost."""
    pose = np.eye(4)
    for element in node:
        if element.tag in ("lookat", "skew"):
            raise UnreadableError(f"it has a <{element.tag}>, which is not supported; use <matrix>")
        if element.tag in _TRANSFORMS:
            count, transform = _TRANSFORMS[element.tag]
            numbers = _floats(element.text)
            if len(numbers) != count:
                raise UnreadableError(f"its <{element.tag}> must hold {count} numbers")
            pose = pose @ transform(numbers)
    return pose


def _translation(by: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = by
    return pose


def _rotation(about: Array) -> Array:
    """By an axis and an angle in degrees (4,)."""
    length = float(np.linalg.norm(about[:3]))
    pose = np.eye(4)
    if length > 0:
        turn = Rotation.from_rotvec(np.deg2rad(about[3]) / length * about[:3])
        pose[:3, :3] = turn.as_matrix()
    return pose


_TRANSFORMS: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "matrix": (16, lambda numbers: numbers.reshape(4, 4)),
    "translate": (3, _translation),
    "rotate": (4, _rotation),
    "scale": (3, lambda by: np.diag([*by, 1.0])),
}


def _geometry(geometry: Element) -> Soup:
    mesh = geometry.find("mesh")
    if mesh is None:
        inside = ", ".join(f"<{child.tag}>" for child in geometry) or "nothing"
        raise UnreadableError(f"it has a geometry of {inside}; export polygons (<mesh>)")
    vertices = {
        element.get("id"): _positions(mesh, element) for element in mesh.findall("vertices")
    }
    soups = []
    for element in mesh:
        if element.tag in _FACES:
            stride, offset, source = _inputs(element)
            if source not in vertices:
                raise UnreadableError(f"its <{element.tag}> have no vertices {brief(source)}")
            soups.append(_faces(element, vertices[source], stride, offset))
        elif element.tag not in (*_LINES, "source", "vertices", "extra"):
            raise UnreadableError(f"it has a <{brief(element.tag)}>, which is not supported")
    return joined(soups)


def _positions(mesh: Element, vertices: Element) -> Array:
    """(n, 3)."""
    name = next(
        (one.get("source", "") for one in vertices if one.get("semantic") == "POSITION"), ""
    )
    found = _source(mesh, name)
    if found is None:
        raise UnreadableError(f"it has vertices without positions ({brief(name)})")
    return found


def _source(mesh: Element, name: str) -> Array | None:
    """The points (n, 3) that a mesh has under the name #ID, if it has them."""
    for source in mesh.findall("source"):
        array, accessor = source.find("float_array"), source.find("technique_common/accessor")
        if source.get("id") == name[1:] and array is not None and accessor is not None:
            return _accessed(_floats(array.text), accessor)
    return None


def _accessed(numbers: Array, accessor: Element) -> Array:
    """The points (n, 3) that an accessor takes of an array: of its parameters, those without a name
    are passed over, unless none has one."""
    named = [n for n, param in enumerate(accessor.findall("param")) if param.get("name")]
    columns = (named or [0, 1, 2])[:3]
    count, stride, offset = (
        int(accessor.get(key, default))
        for key, default in (("count", "0"), ("stride", "1"), ("offset", "0"))
    )
    if len(columns) < 3 or stride <= max(columns) or min(count, offset) < 0:
        raise UnreadableError("its positions are not of three numbers")
    last = offset + (count - 1) * stride + max(columns)
    if count and last >= len(numbers):
        raise UnreadableError("it has an array that is shorter than it says")
    rows = offset + stride * np.arange(count)[:, None] + np.array(columns)
    found: Array = numbers[rows]
    return found


def _inputs(faces: Element) -> tuple[int, int, str]:
    """How many indices a corner has, which of them is the vertex's, and of which vertices."""
    inputs = faces.findall("input")
    offsets = [int(one.get("offset", "0")) for one in inputs]
    for one, offset in zip(inputs, offsets, strict=True):
        if one.get("semantic") == "VERTEX" and min(offsets) >= 0:
            return max(offsets) + 1, offset, one.get("source", "")[1:]
    raise UnreadableError(f"its <{faces.tag}> have no vertices")


def _drawn_geometry(geometry: Element) -> Array:
    """See `drawn_vertices`; of a geometry that `_geometry` reads."""
    mesh = geometry.find("mesh")
    assert mesh is not None
    groups = [_drawn_group(mesh, one) for one in mesh if one.tag in (*_FACES, *_LINES)]
    return np.concatenate([np.zeros((0, 3)), *groups])


def _drawn_group(mesh: Element, group: Element) -> Array:
    stride, offset, name = _inputs(group)
    shared = next(one for one in mesh.findall("vertices") if one.get("id") == name)
    vertices = _positions(mesh, shared)
    corners = vertices[_all_corners(group, stride, offset)]
    normals, at = _normals(mesh, group, shared)
    if normals is not None:
        of_corners = normals[_all_corners(group, stride, offset if at is None else at)]
        rows = np.column_stack([corners, of_corners + 0.0])  # -0 is 0
        drawn: Array = np.unique(rows, axis=0)[:, :3]
        return drawn
    if group.tag in _LINES:
        return np.unique(corners, axis=0)
    return vertices_of_flat_faces(vertices, _faces(group, vertices, stride, offset).faces)


def _all_corners(group: Element, stride: int, offset: int) -> Ints:
    runs = (_corners(p.text, stride, offset) for p in group.findall("p"))
    return np.concatenate([np.zeros(0, dtype=np.int64), *runs])


def _normals(mesh: Element, group: Element, vertices: Element) -> tuple[Array | None, int | None]:
    """The normals (n, 3) that a group's corners have, or the vertices that it is of, and which of a
    corner's indices is theirs; None where that is the vertex's."""
    for one in group.findall("input"):
        if one.get("semantic") == "NORMAL":
            return _source(mesh, one.get("source", "")), int(one.get("offset", "0"))
    for one in vertices.findall("input"):
        if one.get("semantic") == "NORMAL":
            return _source(mesh, one.get("source", "")), None
    return None, None


def _faces(element: Element, vertices: Array, stride: int, offset: int) -> Soup:
    if element.find("ph") is not None:
        raise UnreadableError("it has polygons with holes (<ph>); export it cut into triangles")
    runs = [_corners(p.text, stride, offset) for p in element.findall("p")]
    if element.tag in ("tristrips", "trifans"):
        cut = strips_to_triangles if element.tag == "tristrips" else fans_to_triangles
        none = np.zeros((0, 3), dtype=np.int64)
        soup = Soup(vertices, np.concatenate([none, *map(cut, runs)]))
        soup.check()
        return soup
    corners = np.concatenate([np.zeros(0, dtype=np.int64), *runs])
    if element.tag == "polygons":
        counts = np.array([len(run) for run in runs], dtype=np.int64)
    elif element.tag == "polylist":
        counts = _integers(element.findtext("vcount"))
    else:
        counts = np.full(len(corners) // 3, 3)
    if counts.min(initial=0) < 0 or counts.sum() != len(corners):
        raise UnreadableError(f"its <{element.tag}> have {len(corners)} corners, not as it says")
    return Polygons(vertices, counts, corners).cut()


def _corners(text: str | None, stride: int, offset: int) -> Ints:
    indices = _integers(text)
    if len(indices) % stride:
        raise UnreadableError(f"it has {len(indices)} indices of corners of {stride} each")
    return indices[offset::stride]


def _integers(text: str | None) -> Ints:
    return np.array((text or "").split(), dtype=np.int64)


def _floats(text: str | None) -> Array:
    return np.array((text or "").split(), dtype=np.float64)
