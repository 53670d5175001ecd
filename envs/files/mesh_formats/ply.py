"""Polygon file format (PLY), as text or binary."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.files.mesh_formats.polygons import Ints, Polygons, strips_to_triangles
from envs.files.mesh_formats.soup import Soup, UnreadableError, check_not_coarse, is_coarse
from envs.problem import Array

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
_MOST_LISTED = 1000  # characters of a header's line


@dataclass(frozen=True)
class _Property:
    name: str
    type: str
    count_type: str = ""  # of a list's length


@dataclass(frozen=True)
class _Element:
    name: str
    count: int
    properties: list[_Property]


_Column = Array | tuple[Ints, Ints]
"""Of a property: its values, or the lengths of its lists and all their values in turn."""


class _Text:
    """The words of a text, each a slot."""

    is_at_end = True  # more words are passed over

    def __init__(self, body: bytes) -> None:
        self.slots: NDArray[Any] = np.array(body.split(), dtype=np.float64)
        self.at = 0

    def width(self, type: str) -> int:
        """Slots of a value."""
        return 1

    def values(self, slots: NDArray[Any], type: str) -> NDArray[Any]:
        """(r, n) of slots (r, n times the width)."""
        return slots


class _Binary:
    """The bytes of a body, each a slot."""

    def __init__(self, body: bytes, order: str) -> None:
        self.slots: NDArray[Any] = np.frombuffer(body, dtype=np.uint8)
        self.at = 0
        self._order = order

    @property
    def is_at_end(self) -> bool:
        return self.at == len(self.slots)

    def width(self, type: str) -> int:
        """Slots of a value."""
        return int(type[1])

    def values(self, slots: NDArray[Any], type: str) -> NDArray[Any]:
        """(r, n) of slots (r, n times the width)."""
        return np.ascontiguousarray(slots).view(self._order + type)


def read(path: Path) -> Soup:
    """Faces of any number of corners, and triangle strips.

    Raises:
        UnreadableError: it is cut short, or its coordinates are too coarse.
    """
    data = path.read_bytes()
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise UnreadableError("it has no header of a PLY file")
    order, elements = _header(data[:end].decode("ascii", "replace"))
    body = data[data.find(b"\n", end) + 1 :]
    source = _Text(body) if order == "" else _Binary(body, order)
    columns = {element.name: _table(element, source) for element in elements}
    if not source.is_at_end:
        raise UnreadableError("it goes on after what its header says")
    vertices = _vertices(columns.get("vertex", {}), elements, order == "")
    counts, corners = _lists(columns.get("face", {}))
    soup = Polygons(vertices, counts, corners).cut()
    _, strips = _lists(columns.get("tristrips", {}))
    if len(strips) == 0:
        return soup
    triangles = strips_to_triangles(strips)
    return Soup(vertices, np.concatenate([soup.faces, triangles]), soup.notes)


def _header(text: str) -> tuple[str, list[_Element]]:
    order, elements = None, []
    for line in text.splitlines()[1:]:
        words = line[:_MOST_LISTED].split()
        if not words or words[0] in ("comment", "obj_info"):
            continue
        if words[0] == "format" and words[1] in _ORDERS:
            order = _ORDERS[words[1]]
        elif words[0] == "element":
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[0] == "property" and elements:
            elements[-1].properties.append(_property(words[1:]))
        else:
            raise UnreadableError(f"its header has the line {line[:80]!r}")
    if order is None:
        raise UnreadableError(f"its header names none of the formats {', '.join(_ORDERS)}")
    if any(element.count < 0 for element in elements):
        raise UnreadableError("it has negative counts")
    return order, elements


def _property(words: list[str]) -> _Property:
    try:
        if words[0] == "list":
            return _Property(words[3], _TYPES[words[2]], _TYPES[words[1]])
        return _Property(words[1], _TYPES[words[0]])
    except (KeyError, IndexError):
        raise UnreadableError(f"its header has the property {' '.join(words)[:80]!r}") from None


def _vertices(columns: dict[str, _Column], elements: list[_Element], is_text: bool) -> Array:
    if not all(isinstance(columns.get(axis), np.ndarray) for axis in "xyz"):
        raise UnreadableError("its vertices have no x, y and z")
    vertices = np.stack([np.asarray(columns[axis], dtype=np.float64) for axis in "xyz"], axis=1)
    types = {
        p.type for e in elements if e.name == "vertex" for p in e.properties if p.name in "xyz"
    }
    if types != {"f4"}:
        return vertices
    if not is_text:
        check_not_coarse(vertices)
        return vertices
    # Text has more digits than the type that it says, which matters far from the origin only.
    with np.errstate(over="ignore"):
        short = vertices.astype(np.float32).astype(np.float64)
    return vertices if is_coarse(short) else short


def _lists(columns: dict[str, _Column]) -> tuple[Ints, Ints]:
    """The lists of indices of vertices: lengths, and all in turn."""
    lists = {name: c for name, c in columns.items() if isinstance(c, tuple)}
    for name in ("vertex_indices", "vertex_index", *lists):
        if name in lists and (name.startswith("vert") or len(lists) == 1):
            return lists[name]
    return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)


def _table(element: _Element, source: _Text | _Binary) -> dict[str, _Column]:
    """The columns of an element, from where the source is on."""
    if element.count == 0 or not element.properties:
        return {}
    return _even_table(element, source) or _uneven_table(element, source)


def _slots(source: _Text | _Binary, at: int, count: int) -> NDArray[Any]:
    if at + count > len(source.slots):
        raise UnreadableError("it is cut short, or has fewer vertices and faces than it says")
    return source.slots[at : at + count]


def _even_table(element: _Element, source: _Text | _Binary) -> dict[str, _Column]:
    """The columns if all lists are as long as the first row's, else none."""
    lengths, at = [], source.at
    for one in element.properties:
        length = 1
        if one.count_type:
            length = _length(source, one, at)
            at += source.width(one.count_type)
        lengths.append(length)
        at += length * source.width(one.type)
    width = at - source.at
    if source.at + element.count * width > len(source.slots):
        return {}
    rows = _slots(source, source.at, element.count * width).reshape(element.count, width)
    columns: dict[str, _Column] = {}
    at = 0
    for one, length in zip(element.properties, lengths, strict=True):
        if one.count_type:
            after = at + source.width(one.count_type)
            counts = source.values(rows[:, at:after], one.count_type)[:, 0].astype(np.int64)
            if (counts != length).any():
                return {}
            at = after
        after = at + length * source.width(one.type)
        values = source.values(rows[:, at:after], one.type)
        at = after
        columns[one.name] = (counts, _whole(values)) if one.count_type else values[:, 0]
    source.at += element.count * width
    return columns


def _uneven_table(element: _Element, source: _Text | _Binary) -> dict[str, _Column]:
    """The columns, row by row; single values are passed over."""
    lists: dict[str, list[NDArray[Any]]] = {p.name: [] for p in element.properties if p.count_type}
    for _ in range(element.count):
        for one in element.properties:
            length = 1
            if one.count_type:
                length = _length(source, one, source.at)
                source.at += source.width(one.count_type)
            slots = _slots(source, source.at, length * source.width(one.type))
            source.at += len(slots)
            if one.count_type:
                lists[one.name].append(source.values(slots[None], one.type)[0])
    return {
        name: (np.array([len(row) for row in rows]), _whole(np.concatenate(rows)))
        for name, rows in lists.items()
    }


def _length(source: _Text | _Binary, one: _Property, at: int) -> int:
    slots = _slots(source, at, source.width(one.count_type))
    length = int(source.values(slots[None], one.count_type)[0, 0])
    if length < 0:
        raise UnreadableError("it has a list of less than nothing")
    return length


def _whole(values: NDArray[Any]) -> Ints:
    return values.reshape(-1).astype(np.int64)
