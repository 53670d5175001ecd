"""What the two sides of a mesh's faces look into, however the faces are written.

A surface divides space into cells, one of them unbounded. They are found from the faces alone: at
each edge the sides that face each other, with no other face between them, look into the same cell.
All sides that hang together so are a shell. How often and which way faces are written tells nothing
here, and many may meet at an edge (cf. Zhou et al. 2016, Mesh Arrangements for Solid Geometry,
section 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from trimesh.grouping import unique_rows

from envs.problem import Array

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_FLAT = 1e-10  # of one minus the cosine: faces continue each other
_SAME_ANGLE = 1e-7  # radians


@dataclass(frozen=True, eq=False)
class Shells:
    """The shells of a set of faces.

    Attributes:
        faces: (m, 3), each place once, with the winding of the first that was written there.
        votes: (m,), how often a face was written with this winding, less how often with the other.
        part: (m,), numbers of the connected parts.
        front, back: (m,), the shells that a face's sides belong to; `front` is where its normal
            points to.
        volume: (s,) of shells: that of the cell within, or negative where a shell surrounds its
            part from outside. A shell that has both sides of all its faces has none.
        open_edges: (n, 2), vertices of the edges with a single face, and `has_border` (p,), which
            parts have some.
        is_doubtful: (m,), faces of parts where faces lie on one another in part, so that their
            shells may be wrong.
    """

    faces: Ints
    votes: Ints
    part: Ints
    front: Ints
    back: Ints
    volume: Array
    open_edges: Ints
    has_border: Bools
    is_doubtful: Bools

    @property
    def closed(self) -> bool:
        """Whether each face parts two cells."""
        return bool((self.front != self.back).all())

    def largest_is_outward(self, vertices: Array) -> bool:
        """Whether the boundary of the largest cell is mostly written outward, by its area, or as
        often as inward."""
        largest = self.volume.argmax()
        outward = (self.back == largest).astype(np.int64) - (self.front == largest)
        return bool((areas(vertices[self.faces]) * outward * self.votes).sum() >= 0)

    def surround(self) -> Bools:
        """Which shells (s,) surround a part from outside: of each part the one with the least
        volume."""
        part = np.empty(len(self.volume), dtype=np.int64)
        part[self.front], part[self.back] = self.part, self.part
        order = np.lexsort((self.volume, part))
        first = np.append(True, np.diff(part[order]) != 0)
        outside = np.zeros(len(part), dtype=np.bool_)
        outside[order[first]] = True
        return outside


def areas(triangles: Array) -> Array:
    """Of triangles (m, 3, 3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    area: Array = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
    return area


def shells(vertices: Array, faces: Ints) -> Shells:
    """The shells of faces (m, 3) among vertices (n, 3); vertices at one place count as one."""
    distinct, votes = _distinct(faces, _places(vertices))
    vertices = vertices - vertices.mean(axis=0)
    edges = _Edges(distinct)
    if edges.count.max() > 2:
        distinct, votes = _without_second_coverings(vertices, distinct, votes, edges)
        edges = _Edges(distinct)
    sides, tied = _linked_sides(vertices, distinct, edges)
    count = len(distinct)
    nodes = np.arange(count)
    # Sides that meet in an edge without a face between them look at the same cell: a shell is what
    # hangs together so. Fronts are 0, 1, ..., backs come after them.
    linked = coo_matrix((np.ones(len(sides)), sides.T), shape=(2 * count, 2 * count))
    _, shell = connected_components(linked, directed=False)
    joined = np.concatenate([sides, np.stack([nodes, nodes + count], axis=1)]) % count
    whole = coo_matrix((np.ones(len(joined)), joined.T), shape=(count, count))
    parts, part = connected_components(whole, directed=False)
    # By the divergence theorem: signed tetrahedra from the mean, positive for a cell that normals
    # point out of.
    six = np.linalg.det(vertices[distinct]) / 6
    volume = np.bincount(shell, np.concatenate([-six, six])).astype(np.float64)
    border = edges.count == 1
    has_border = np.zeros(parts, dtype=np.bool_)
    has_border[part[edges.face[border[edges.number]]]] = True
    return Shells(
        faces=distinct,
        votes=votes,
        part=part,
        front=shell[:count],
        back=shell[count:],
        volume=volume,
        open_edges=edges.ends[border],
        has_border=has_border,
        is_doubtful=np.isin(part, part[tied]),
    )


class _Edges:
    """The edges of faces (m, 3): which corner of which face is at which edge.

    Attributes:
        number: (3 m,) of an edge for each half-edge, those of corners 0 first.
        ends: (e, 2), the edges' vertices, the lower number first.
        count: (e,), faces at an edge.
    """

    def __init__(self, faces: Ints) -> None:
        half = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        most = int(faces.max()) + 1
        low, high = half.min(axis=1), half.max(axis=1)
        keys, number, count = np.unique(low * most + high, return_inverse=True, return_counts=True)
        self.number: Ints = number.reshape(-1)
        self.ends: Ints = np.stack([keys // most, keys % most], axis=1)
        self.count: Ints = count
        self.face: Ints = np.tile(np.arange(len(faces)), 3)
        self.opposite: Ints = faces[:, [2, 0, 1]].T.reshape(-1)
        self.upward: Bools = half[:, 0] < half[:, 1]

    def pairs(self) -> Ints:
        """(p, 2) half-edges of the edges with two faces."""
        of_two = np.flatnonzero(self.count[self.number] == 2)
        return of_two[np.argsort(self.number[of_two], kind="stable")].reshape(-1, 2)

    def across(self, vertices: Array, half: Ints) -> Array:
        """Unit vectors (h, 3) in the face of a half-edge, away from the edge and normal to it."""
        start, end = (vertices[self.ends[self.number[half], i]] for i in (0, 1))
        along = _unit(end - start)
        out = vertices[self.opposite[half]] - start
        return _unit(out - (out * along).sum(axis=1, keepdims=True) * along)


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    unit: Array = vectors / np.where(size > 0, size, 1)
    return unit


def _places(vertices: Array) -> Ints:
    """For each vertex (n, 3) the number of one at the same place, the same for all there."""
    order = np.lexsort(vertices.T)
    new = np.append(True, (np.diff(vertices[order], axis=0) != 0).any(axis=1))
    place = np.empty(len(vertices), dtype=np.int64)
    place[order] = order[np.maximum.accumulate(np.where(new, np.arange(len(order)), 0))]
    return place


def _distinct(faces: Ints, place: Ints) -> tuple[Ints, Ints]:
    """Faces (m, 3) by vertices' places, each once, and their votes."""
    faces = place[faces]
    faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    first, same = unique_rows(np.sort(faces, axis=1))  # type: ignore[no-untyped-call]
    least_first = np.take_along_axis(
        faces, (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1
    )
    direction = np.where(least_first[:, 1] < least_first[:, 2], 1, -1)
    votes = np.bincount(same, direction).astype(np.int64) * direction[first]
    order = np.argsort(first)
    return faces[first[order]], votes[order]


def _without_second_coverings(
    vertices: Array, faces: Ints, votes: Ints, edges: _Edges
) -> tuple[Ints, Ints]:
    """Faces (m, 3) without flat patches that others cover, cut into triangles in another way."""
    pairs = edges.pairs()
    flat = (edges.across(vertices, pairs[:, 0]) * edges.across(vertices, pairs[:, 1])).sum(1)
    joined = edges.face[pairs[flat < -1 + _FLAT]]
    link = coo_matrix((np.ones(len(joined)), joined.T), shape=(len(faces), len(faces)))
    count, patch = connected_components(link, directed=False)
    # Edges within a patch are there twice and leave nothing of themselves.
    marks = np.random.default_rng(0).integers(1, 2**63, len(edges.ends), dtype=np.uint64)
    border = np.zeros(count, dtype=np.uint64)
    np.bitwise_xor.at(border, patch[edges.face], marks[edges.number])
    _, first, same = np.unique(border, return_index=True, return_inverse=True)
    covered_by = np.where(border == 0, np.arange(count), first[same.reshape(-1)])
    area = np.cross(*np.moveaxis(np.diff(vertices[faces], axis=1), 1, 0))
    normal = np.stack([np.bincount(patch, a, count) for a in area.T], axis=1)
    mean_vote = np.bincount(patch, votes, count) / np.bincount(patch, minlength=count)
    alike = np.sign((normal * normal[covered_by]).sum(axis=1))
    others = np.where(covered_by == np.arange(count), 0, mean_vote * alike)
    added = np.bincount(covered_by, others, count)
    keep = (covered_by == np.arange(count))[patch]
    return faces[keep], (votes + np.rint(added).astype(np.int64)[patch])[keep]


def _linked_sides(vertices: Array, faces: Ints, edges: _Edges) -> tuple[Ints, Ints]:
    """Pairs (l, 2) of sides that look at each other across no face: front sides are numbered as
    their faces, back sides m further. And faces (t,) that lie on others at an edge, so that which
    of them comes first is chance."""
    edge = _with_closed_patches_split(faces, edges)
    angle = _angles(vertices, edges, edge)
    order = np.lexsort((angle, edge))
    edge, angle = edge[order], angle[order]
    new = np.append(True, edge[1:] != edge[:-1])
    start = np.flatnonzero(new)
    following = np.arange(1, len(edge) + 1)
    following[np.append(start[1:], len(edge)) - 1] = start
    count, face, up = len(faces), edges.face[order], edges.upward[order]
    # About the edge, from its lower to its higher vertex, angles grow to the front of a face that
    # runs along it the same way.
    ahead = face + np.where(up, 0, count)
    behind = face + np.where(up, count, 0)
    at_one_angle = (angle[following] - angle < _SAME_ANGLE) & (angle > 0) & (angle[following] > 0)
    tied = face[at_one_angle & (following > np.arange(len(edge)))]
    return np.stack([ahead, behind[following]], axis=1), tied


def _with_closed_patches_split(faces: Ints, edges: _Edges) -> Ints:
    """Numbers of edges (3 m,) for half-edges, with one more for each patch that closes by itself:
    what touches it along an edge is not linked with it."""
    if edges.count.max() <= 2:
        return edges.number
    joined = edges.face[edges.pairs()]
    link = coo_matrix((np.ones(len(joined)), joined.T), shape=(len(faces), len(faces)))
    count, patch = connected_components(link, directed=False)
    key = edges.number * count + patch[edges.face]
    _, same, here = np.unique(key, return_inverse=True, return_counts=True)
    closes = np.ones(count, dtype=np.bool_)
    closes[patch[edges.face[here[same.reshape(-1)] != 2]]] = False
    own = np.where(closes[patch[edges.face]], patch[edges.face] + 1, 0)
    _, number = np.unique(edges.number * (count + 1) + own, return_inverse=True)
    apart: Ints = number.reshape(-1)
    return apart


def _angles(vertices: Array, edges: _Edges, edge: Ints) -> Array:
    """The angles (3 m,) of half-edges' faces about edges that more than two share, else 0."""
    angle = np.zeros(len(edge))
    many = np.flatnonzero(np.bincount(edge)[edge] > 2)
    if len(many):
        many = many[np.argsort(edge[many], kind="stable")]
        first = many[np.searchsorted(edge[many], edge[many])]
        along = _unit(np.diff(vertices[edges.ends[edges.number[many]]], axis=1)[:, 0])
        zero, out = edges.across(vertices, first), edges.across(vertices, many)
        turned = np.arctan2((np.cross(along, zero) * out).sum(1), (zero * out).sum(1))
        angle[many] = np.mod(turned + 2 * _SAME_ANGLE, 2 * np.pi)
    return angle
