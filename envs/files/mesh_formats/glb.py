"""Binary glTF 2.0 (GLB): the triangles of its scene, and the arrays of numbers in it."""

from __future__ import annotations

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from envs.errors import brief
from envs.files.mesh_formats.polygons import Ints, fans_to_triangles, strips_to_triangles
from envs.files.mesh_formats.soup import (
    MOST_FACES,
    Soup,
    UnreadableError,
    check_corners,
    check_not_coarse,
    joined,
    moved,
)
from envs.problem import Array

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_TRIANGLES, _STRIP, _FAN = 4, 5, 6

_HONOURED = ("KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld")
_SHADING = (
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "ADOBE_materials_",
)
"""Of extensions that change what a mesh looks like, not where it is."""


def read(path: Path) -> Soup:
    """The triangles, strips and fans that the default scene shows, placed by its nodes.

    Raises:
        UnreadableError: it wants extensions, other files or posing that are not supported, or it is
            larger than can be checked.
    """
    content, binary = _chunks(path.read_bytes())
    for name in content.get("extensionsRequired", []):
        if name not in _HONOURED and not str(name).startswith(_SHADING):
            raise UnreadableError(
                f"it requires the glTF extension {brief(name)}, which is not supported; "
                "export it without"
            )
    accessors = Accessors(content, binary)
    placed = _placed(content)
    _check_size(content, [mesh for mesh, _ in placed])
    meshes = {mesh: _mesh(content, mesh, accessors) for mesh, _ in placed}
    return joined([moved(meshes[mesh], pose) for mesh, pose in placed])


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The description, and the numbers that it describes."""
    if len(data) < 20 or data[:4] != b"glTF":
        raise UnreadableError("it has no header of a GLB file")
    _, version, _, size, kind = struct.unpack_from("<4sIIII", data)
    if version != 2 or kind != _JSON or 20 + size > len(data):
        raise UnreadableError(f"it is no whole GLB file of version 2 (its version is {version})")
    content = json.loads(data[20 : 20 + size])
    if not isinstance(content, dict):
        raise UnreadableError("its description is not an object")
    rest = data[20 + size :]
    if len(rest) < 8:
        return content, b""
    size, kind = struct.unpack_from("<II", rest)
    if kind != _BIN or 8 + size > len(rest):
        raise UnreadableError("it is cut short")
    return content, rest[8 : 8 + size]


def _placed(content: dict[str, Any]) -> list[tuple[int, Array]]:
    """The meshes of the scene's nodes, and their poses (4, 4)."""
    nodes = content.get("nodes", [])
    scenes = content.get("scenes", [])
    roots = scenes[content.get("scene", 0)].get("nodes", []) if scenes else _roots(nodes)
    waiting = [(root, np.eye(4)) for root in roots]
    placed, seen = [], set()
    while waiting:
        number, above = waiting.pop()
        if number in seen:
            raise UnreadableError(f"its nodes are no tree: node {number} is reached twice")
        seen.add(number)
        node = nodes[number]
        pose = above @ _local(node)
        waiting += [(child, pose) for child in node.get("children", [])]
        if "mesh" in node:
            _check_plain(content, node)
            placed.append((node["mesh"], pose))
    return placed


def _roots(nodes: list[dict[str, Any]]) -> list[int]:
    children = {child for node in nodes for child in node.get("children", [])}
    return [number for number in range(len(nodes)) if number not in children]


def _local(node: dict[str, Any]) -> Array:
    """A node's pose (4, 4) in its parent's frame, from its matrix, column by column, or from
    translation, rotation (x, y, z, w) and scale."""
    if "matrix" in node:
        matrix: Array = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        return matrix
    pose = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0, 0, 0, 1])).as_matrix()
    pose[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), dtype=np.float64)
    pose[:3, 3] = node.get("translation", [0, 0, 0])
    return pose


def _check_plain(content: dict[str, Any], node: dict[str, Any]) -> None:
    """Raises UnreadableError if a node's mesh is not where its vertices say."""
    if "EXT_mesh_gpu_instancing" in node.get("extensions", {}):
        raise UnreadableError(
            "it uses the glTF extension EXT_mesh_gpu_instancing, which is not supported; export "
            "each instance"
        )
    if "skin" in node:
        raise UnreadableError("a skin poses its mesh, which is not supported; export it posed")
    weights = node.get("weights", content["meshes"][node["mesh"]].get("weights", []))
    if any(weights):
        raise UnreadableError(
            "morph targets shape its mesh, which is not supported; export it shaped"
        )


def _check_size(content: dict[str, Any], meshes: list[int]) -> None:
    """Raises UnreadableError before more is made than can be checked."""
    total = 0
    for number in meshes:
        for primitive in content["meshes"][number]["primitives"]:
            if primitive.get("mode", _TRIANGLES) < _TRIANGLES:
                continue
            named = [primitive["attributes"]["POSITION"], primitive.get("indices")]
            counts = [content["accessors"][n]["count"] for n in named if n is not None]
            total += max(counts)
            if total > 3 * MOST_FACES:
                raise UnreadableError(f"it has more than {MOST_FACES} faces: simplify it")


def _mesh(content: dict[str, Any], number: int, accessors: Accessors) -> Soup:
    soups = []
    for primitive in content["meshes"][number]["primitives"]:
        mode = primitive.get("mode", _TRIANGLES)
        if mode < _TRIANGLES:  # points and lines
            continue
        for name in primitive.get("extensions", {}):
            if "draco" in name:
                raise UnreadableError(
                    f"it uses the glTF extension {brief(name)}, which is not supported; export it "
                    "without compression"
                )
        vertices = accessors.read(primitive["attributes"]["POSITION"]).astype(np.float64)
        if vertices.shape[1:] != (3,):
            raise UnreadableError("its positions are not of three numbers")
        check_not_coarse(vertices)
        if "indices" in primitive:
            order = accessors.read(primitive["indices"]).reshape(-1).astype(np.int64)
        else:
            order = np.arange(len(vertices))
        check_corners(order, vertices)
        soups.append(Soup(vertices, _triangles(order, mode)))
    return joined(soups)


def _triangles(order: Ints, mode: int) -> Ints:
    if mode == _STRIP:
        return strips_to_triangles(order)
    if mode == _FAN:
        return fans_to_triangles(order)
    if mode != _TRIANGLES or len(order) % 3:
        raise UnreadableError(f"it has {len(order)} corners of triangles (mode {mode})")
    return order.reshape(-1, 3)


_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DATA = "data:"


class Accessors:
    """Reads accessors as the specification of glTF 2.0 has them (section 3.6), with strides,
    normalised integers and sparse values.

    Args:
        content: the file's description.
        binary: the numbers that come with it.
    """

    def __init__(self, content: dict[str, Any], binary: bytes) -> None:
        self._content, self._binary = content, binary

    def read(self, number: int) -> NDArray[Any]:
        """An accessor's values (n, columns); normalised integers as what they stand for.

        Raises:
            UnreadableError: it leaves its buffer, or has no values.
        """
        accessor = self._content["accessors"][number]
        dtype = np.dtype(_TYPES[accessor["componentType"]])
        columns, count = _COLUMNS[accessor["type"]], accessor["count"]
        if "bufferView" in accessor:
            values = self._values(accessor, dtype, count, columns)
        elif "sparse" in accessor:
            if not 0 <= count <= 3 * MOST_FACES:
                raise UnreadableError(f"it has an array of {count} values")
            values = np.zeros((count, columns), dtype=dtype)
        else:
            raise UnreadableError(
                "it has an array without values, which only extensions could give it"
            )
        if "sparse" in accessor:
            values = self._replaced(values, accessor["sparse"])
        return _as_meant(values) if accessor.get("normalized") else values

    def _replaced(self, values: NDArray[Any], sparse: dict[str, Any]) -> NDArray[Any]:
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        at = self._values(where, np.dtype(_TYPES[where["componentType"]]), count, 1)[:, 0]
        if len(at) and at.max() >= len(values):
            raise UnreadableError("it has sparse values beyond their array")
        values = values.copy()
        values[at] = self._values(what, values.dtype, count, values.shape[1])
        return np.asarray(values)

    def _values(
        self, place: dict[str, Any], dtype: np.dtype[Any], count: int, columns: int
    ) -> NDArray[Any]:
        view = self._content["bufferViews"][place["bufferView"]]
        buffer = self._buffer(view["buffer"])
        start = view.get("byteOffset", 0) + place.get("byteOffset", 0)
        size = columns * dtype.itemsize
        stride = view.get("byteStride", size)
        end = view.get("byteOffset", 0) + view["byteLength"]
        last = start + (count - 1) * stride + size if count else start
        if min(start, count, view.get("byteOffset", 0)) < 0 or stride < size:
            raise UnreadableError("it has an array of negative size or stride")
        if last > min(end, len(buffer)):
            raise UnreadableError("it has an array that leaves its buffer")
        values: NDArray[Any] = np.ndarray(
            (count, columns), dtype, buffer, start, (stride, dtype.itemsize)
        )
        return np.array(values)

    def _buffer(self, number: int) -> bytes:
        uri = self._content["buffers"][number].get("uri")
        if uri is None and number > 0:
            raise UnreadableError("it has a buffer without content, which only extensions fill")
        if uri is None:
            return self._binary
        if not uri.startswith(_DATA):
            raise UnreadableError(f"it wants another file, {uri!r}; put what is needed into it")
        return base64.b64decode(uri.partition(",")[2])


def _as_meant(values: NDArray[Any]) -> NDArray[Any]:
    """Fractions for normalised integers, by the specification's equations."""
    if values.dtype.kind == "f":
        return values
    fractions: NDArray[Any] = values / float(np.iinfo(values.dtype).max)
    return np.asarray(np.maximum(fractions, -1.0))
