"""Object file format (Geomview's OFF)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from envs.files.mesh_formats.polygons import Polygons
from envs.files.mesh_formats.soup import Soup, UnreadableError
from envs.problem import Array

_HEADER = re.compile(r"\s*((?:ST)?C?N?)(4?n?)OFF\b[ \t]*(BINARY)?")


def read(path: Path) -> Soup:
    """Faces of any number of corners, on one line or over several; colours, normals and texture
    coordinates are passed over.

    Raises:
        UnreadableError: it is binary or of another dimension, or cut short.
    """
    text = re.sub(r"#[^\n]*", "", path.read_text("utf-8", "replace"))
    header = _HEADER.match(text)
    if header is None:
        raise UnreadableError("it does not begin with OFF")
    if header[2] or header[3]:
        raise UnreadableError(f"{header[0].strip()} is not supported; write it as text in 3-D")
    lines = (line.split() for line in text[header.end() :].splitlines())
    rows = (words for words in lines if words)
    try:
        vertex_count, face_count = map(int, _taken(rows, 2)[:2])
        if min(vertex_count, face_count) < 0:
            raise UnreadableError("it has negative counts")
        vertices = np.array([_taken(rows, 3) for _ in range(vertex_count)], dtype=np.float64)
        faces = [_face(rows) for _ in range(face_count)]
    except StopIteration:
        raise UnreadableError(
            "it is cut short, or has fewer vertices and faces than it says"
        ) from None
    return _polygons(vertices.reshape(-1, 3), faces).cut()


def _taken(rows: Iterator[list[str]], count: int) -> list[str]:
    """The next so many words; the rest of the line that they end on is passed over."""
    words = next(rows)
    while len(words) < count:
        words = words + next(rows)
    return words[:count]


def _face(rows: Iterator[list[str]]) -> list[int]:
    words = next(rows)
    count = int(words[0])
    if count < 0:
        raise UnreadableError("it has a face of less than no corners")
    words = words[1:]
    while len(words) < count:
        words = words + next(rows)
    return [int(word) for word in words[:count]]


def _polygons(vertices: Array, faces: list[list[int]]) -> Polygons:
    return Polygons(
        vertices,
        np.array([len(face) for face in faces], dtype=np.int64),
        np.array([corner for face in faces for corner in face], dtype=np.int64),
    )
