"""Collada files for tests."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from envs.problem import Array

NAMESPACE = "http://www.collada.org/2005/11/COLLADASchema"


def numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def indices(values: Iterable[int]) -> str:
    """Of corners that name a normal after their vertex, which is always the first."""
    return " ".join(f"{value} 0" for value in values)


INPUTS = (
    '<input semantic="VERTEX" source="#g-vertices" offset="0"/>'
    '<input semantic="NORMAL" source="#g-normals" offset="1"/>'
)


def source(id: str, values: Sequence[float], stride: int = 3, offset: int = 0) -> str:
    count = (len(values) - offset) // stride
    params = "".join(f'<param name="{name}" type="float"/>' for name in "XYZ")
    return (
        f'<source id="{id}"><float_array id="{id}-array" count="{len(values)}">{numbers(values)}'
        f'</float_array><technique_common><accessor source="#{id}-array" count="{count}" '
        f'stride="{stride}" offset="{offset}">{params}</accessor></technique_common></source>'
    )


def polylist(faces: Sequence[Sequence[int]]) -> str:
    counts = " ".join(str(len(face)) for face in faces)
    corners = indices(i for face in faces for i in face)
    inside = f"{INPUTS}<vcount>{counts}</vcount><p>{corners}</p>"
    return f'<polylist count="{len(faces)}">{inside}</polylist>'


def polygons(faces: Sequence[Sequence[int]]) -> str:
    each = "".join(f"<p>{indices(face)}</p>" for face in faces)
    return f'<polygons count="{len(faces)}">{INPUTS}{each}</polygons>'


def triangles(faces: Sequence[Sequence[int]]) -> str:
    corners = indices(i for face in faces for i in face)
    return f'<triangles count="{len(faces)}">{INPUTS}<p>{corners}</p></triangles>'


def geometry(vertices: Array, primitives: str, id: str = "g") -> str:
    positions = source("g-positions", vertices.ravel().tolist())
    normals = source("g-normals", [0.0, 0.0, 1.0])
    named = (
        '<vertices id="g-vertices"><input semantic="POSITION" source="#g-positions"/></vertices>'
    )
    return f'<geometry id="{id}"><mesh>{positions}{normals}{named}{primitives}</mesh></geometry>'


def instance(id: str = "g") -> str:
    return f'<instance_geometry url="#{id}"/>'


def node(inside: str, id: str = "") -> str:
    return f'<node id="{id}">{inside}</node>' if id else f"<node>{inside}</node>"


def dae(
    geometries: str,
    nodes: str = node(instance()),
    library: str = "",
    asset: str = "<up_axis>Z_UP</up_axis>",
) -> bytes:
    """A document with a scene of these nodes, and a library of others."""
    return (
        f'<?xml version="1.0" encoding="utf-8"?><COLLADA xmlns="{NAMESPACE}" version="1.4.1">'
        f"<asset>{asset}</asset><library_geometries>{geometries}</library_geometries>"
        f"<library_nodes>{library}</library_nodes><library_visual_scenes>"
        f'<visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>'
    ).encode()
