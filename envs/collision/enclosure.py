"""Which points a surface encloses, whichever way and however often its faces are written.

Generalised winding numbers (Jacobson et al. 2013) are 1 inside a closed surface wound outward, -1
in one wound inward, 0 outside, and change steadily through holes. Those of several parts add up, so
a sum says what is inside only if the parts are wound as they are meant. Here each closed part,
found by `shells`, is wound as its meaning wants it; what is not closed counts as it is written.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from envs.collision.shapes import Mesh
from envs.collision.shells import Bools, Ints, areas, shells
from envs.collision.winding import EVERYWHERE, Sides, sides_of
from envs.problem import Array

_FEW = 0.1  # of an open surface's area: faces written both ways that may count as holes
_FLAT = 1e-3  # of volume by area to the power of 1.5, which is 0.09 for a ball
_BESIDE = 1e-3  # of a face's size: points on its sides
_BENEATH = 0.01  # of a part's volume by its area, which is half of a plate's thickness


@dataclass(frozen=True, eq=False)
class Winding:
    """Generalised winding numbers by a surface, those of its faces times a sign.

    Called with points (n, 3) it gives theirs, (n,).
    """

    surface: Mesh
    sign: float = 1.0

    def __call__(self, points: Array) -> Array:
        numbers: Array = self._tree.winding_number(np.ascontiguousarray(points))
        return self.sign * numbers

    @cached_property
    def _tree(self) -> igl.FastWindingNumberBVH:
        tree = igl.FastWindingNumberBVH()
        # Copies: libigl wants arrays that it may write to.
        tree.init(np.array(self.surface.vertices), np.array(self.surface.faces))
        return tree


Ranges = tuple[Winding, list[tuple[float, float]]]
"""Winding numbers, and the ranges in one of which they must lie: one or two."""

_NOWHERE = np.inf, np.inf


@dataclass(frozen=True, eq=False)
class Enclosure:
    """What a surface encloses.

    Attributes:
        encloses: points (n, 3) to how far they are enclosed, (n,); more than half is within.
        has_holes: whether some of the surface is not closed, so that this changes steadily there.
        known: False where nothing tells: a surface with holes is of several pieces that are written
            both ways, or faces lie on one another in part, or have one side only.
        free: by a level, where winding numbers must lie: of a solid, so that points are enclosed by
            less, of a room, by more.
        solids: parts that count as solid in a room.
    """

    encloses: Callable[[Array], Array]
    has_holes: bool
    known: bool
    free: Callable[[float], list[Ranges]]
    solids: int = 0

    def sides(self, level: float, gap: float, lids: Sequence[Mesh]) -> Sides:
        """Where points are `free`, for compiled code: everywhere if there are no holes through
        which motions might come to the other side.

        Args:
            gap: half of the widest hole, in workspace units.
            lids: what closes wider ones.
        """
        if not self.has_holes:
            return EVERYWHERE
        of_each = self.free(level)
        ranges = [  # by the faces as they are written
            np.sort(number.sign * np.array([*some, _NOWHERE][:2]), axis=1)
            for number, some in of_each
        ]
        return sides_of([number.surface for number, _ in of_each], ranges, gap, lids)


NO_INSIDE = Enclosure(lambda points: np.zeros(len(points)), False, True, lambda level: [])
"""That of a surface with free space on both sides."""


def filled(mesh: Mesh) -> Enclosure:
    """The union of what closed parts of a surface surround, cavities and parts within parts
    included, and of what its open parts enclose together."""
    surface = Surface(mesh)
    terms = [surface.winding(turn) for turn in (surface.closed, surface.open) if turn.any()]

    def encloses(points: Array) -> Array:
        most = np.zeros(len(points))
        for term in terms:
            most = np.maximum(most, np.abs(term(points)))
        return most

    def free(level: float) -> list[Ranges]:
        return [(term, [(-level, level)]) for term in terms]

    return Enclosure(encloses, surface.has_holes, surface.known, free)


def room(mesh: Mesh) -> Enclosure:
    """What the largest part of a surface surrounds, without the solids that stand in it.

    Parts within the room, overlapping it or sharing faces with it are solid throughout; closed ones
    apart from it are rooms as well.
    """
    surface = Surface(mesh)
    cells = _Cells(surface)
    if abs(surface.spanned()) > cells.largest:
        return _open_room(surface)
    is_solid = cells.are_solid()
    inside = surface.winding(*cells.turns(np.where(is_solid, -1, 1)))
    blocking = np.where(surface.is_flat, 0, surface.open)
    blocked = surface.winding(blocking) if blocking.any() else None

    def encloses(points: Array) -> Array:
        how_far: Array = np.maximum(inside(points), 0)
        return how_far if blocked is None else np.minimum(how_far, 1 - np.abs(blocked(points)))

    def free(level: float) -> list[Ranges]:
        found: list[Ranges] = [(inside, [(level, np.inf)])]
        return found if blocked is None else [*found, (blocked, [(level - 1, 1 - level)])]

    return Enclosure(encloses, surface.has_holes, surface.known, free, int(is_solid.sum()))


def _open_room(surface: Surface) -> Enclosure:
    """A room with holes, such as a scan: all of its surface counts together, closed parts in the
    room wound against it."""
    found, closed = surface.shells, np.flatnonzero(surface.closed)
    sign = np.sign(surface.spanned())
    stands = np.zeros(found.part.max() + 1, dtype=np.bool_)
    if len(closed):
        corners = surface.mesh.vertices[found.faces[closed]]
        within = sign * surface.winding(surface.open)(corners.mean(axis=1)) > 0.5
        stands[found.part[closed[within]]] = True
    winding = surface.winding(
        surface.open + surface.closed * np.where(stands[found.part], -sign, sign).astype(int)
    )

    # Below nothing it is within two solids, or within one that reaches out of the room.
    def encloses(points: Array) -> Array:
        number = winding(points)
        how_far: Array = np.where(sign * number < -0.5, 0, np.abs(number))
        return how_far

    def free(level: float) -> list[Ranges]:
        ranges = np.sort(sign * np.array([(level, np.inf), (-0.5, -level)]), axis=1)
        return [(winding, list(map(tuple, ranges.tolist())))]

    return Enclosure(encloses, surface.has_holes, surface.known, free, int(stands.sum()))


class Surface:
    """The closed and the open faces of a mesh.

    Which of its distinct faces count, and which way, is told by `turns` (m,): 1 for as it was first
    written, -1 for turned round, 0 for left out.

    Attributes:
        found: its distinct faces, and the shells of their sides.
        closed: turns of the outer boundaries of closed parts, outward.
        open: turns of the faces that have the outside on both sides, and `has_holes` if any.
        is_flat: (m,) of bool, faces in open pieces that span no volume.
        known: see `Enclosure`.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.shells = shells(mesh.vertices, mesh.faces)
        outside = self.shells.surround()
        front, back = outside[self.shells.front], outside[self.shells.back]
        self.closed: Ints = front.astype(np.int64) - back
        loose = front & back
        self.has_holes = bool(loose.any())
        self.open: Ints = np.where(loose, np.sign(self.shells.votes), 0)
        self.is_flat: Bools = np.zeros(len(loose), dtype=np.bool_)
        # Without an edge that nothing closes a part has two sides, unless faces lie on one another.
        self.known = bool(self.shells.has_border[self.shells.part[loose]].all())
        if self.has_holes:
            self._wind(np.flatnonzero(loose))
        doubtful = np.flatnonzero(self.shells.is_doubtful & ~loose)
        self.known = self.known and self._holds(doubtful)

    def _wind(self, loose: Ints) -> None:
        """Turns of the open faces: as they are written or, if many are written both ways, as most
        of the piece that they belong to."""
        faces, votes = self.shells.faces[loose], self.shells.votes[loose]
        corners = self.mesh.vertices[faces]
        turned, piece = igl.bfs_orient(faces)
        alike = np.where((turned == faces).all(axis=1), 1, -1)
        area = areas(corners)
        whole = np.bincount(piece, area)
        flat = np.abs(np.bincount(piece, alike * _cones(corners, piece))) < _FLAT * whole**1.5
        self.is_flat[loose] = flat[piece]
        if area[votes == 0].sum() > _FEW * area.sum():
            balance = np.bincount(piece, area * votes * alike)
            self.open[loose] = alike * np.where(balance < 0, -1, 1)[piece]
            told = np.abs(balance) > _FEW * whole
            self.known &= bool((told | flat).all() or (~flat).sum() == 1)

    def _holds(self, faces: Ints) -> bool:
        """Whether each of some faces has something enclosed beside it, as it must have if it parts
        two cells."""
        if len(faces) == 0:
            return True
        corners = self.mesh.vertices[self.shells.faces[faces]]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        # By a part of the face's size.
        step = _BESIDE * normal / np.sqrt(np.linalg.norm(normal, axis=1, keepdims=True))
        beneath, above = (corners.mean(axis=1) + side * step for side in (-1, 1))
        winding = self.winding(self.closed)
        below, over = (np.abs(winding(points)) > 0.5 for points in (beneath, above))
        turn = self.closed[faces]
        return bool((np.where(turn > 0, True, over) & np.where(turn < 0, True, below)).all())

    def spanned(self) -> float:
        """The volume between the open faces and their middle, negative if they are wound inward."""
        loose = np.flatnonzero(self.open)
        corners = self.mesh.vertices[self.shells.faces[loose]]
        return float((self.open[loose] * _cones(corners, np.zeros(len(loose), dtype=int))).sum())

    def winding(self, *turns: Ints) -> Winding:
        """Those by faces with the sum of turns."""
        faces, total = self.shells.faces, np.sum(turns, axis=0)
        for sign in (1, -1):
            if (total == sign * self.shells.votes).all():
                # As it is written, if maybe inside out: no need for another surface.
                return Winding(self.mesh, sign)
        soup = [np.where(t[:, None] < 0, faces[:, ::-1], faces)[t != 0] for t in turns]
        return Winding(Mesh(self.mesh.vertices, np.concatenate(soup)))


class _Cells:
    """The cells that a surface divides bounded space into, the largest first.

    Attributes:
        largest: its volume, 0 if there is none.
    """

    def __init__(self, surface: Surface) -> None:
        self._surface, found = surface, surface.shells
        bounded = np.flatnonzero(found.volume > 0)
        bounded = bounded[np.argsort(-found.volume[bounded], kind="stable")]
        self._volume = found.volume[bounded]
        self.largest = float(self._volume.max(initial=0))
        cell = np.full(len(found.volume), -1)
        cell[bounded] = np.arange(len(bounded))
        front, back = cell[found.front], cell[found.back]
        between = found.front != found.back
        self._front, self._back = np.where(between, front, -1), np.where(between, back, -1)

    def turns(self, of_cell: Ints) -> tuple[Ints, Ints]:
        """Turns (m,) of faces, by their fronts and by their backs, for cells (c,) that are taken
        outward (1), inward (-1) or not at all (0)."""
        of = np.append(of_cell, 0)  # the last for what is no cell's
        return -of[self._front], of[self._back]

    def are_solid(self) -> Bools:
        """Whether cells (c,) are solids in a room that larger ones are."""
        part = np.zeros(len(self._volume), dtype=np.int64)
        for cells in (self._front, self._back):
            part[cells[cells >= 0]] = self._surface.shells.part[cells >= 0]
        points, of_cell = self._beneath()
        solid = np.zeros(len(part), dtype=np.bool_)
        left = np.ones(len(part), dtype=np.bool_)
        while left.any():
            room = int(left.argmax())
            left[room] = False
            one = np.zeros(len(part), dtype=np.int64)
            one[room] = 1
            asked = left[of_cell]
            within = np.abs(self._surface.winding(*self.turns(one))(points[asked])) > 0.5
            found = left & (part == part[room])
            found[of_cell[asked][within]] = True
            solid |= found
            left &= ~found
        return solid

    def _beneath(self) -> tuple[Array, Ints]:
        """A point (n, 3) within a cell beneath each of its faces, and the cells (n,)."""
        corners = self._surface.mesh.vertices[self._surface.shells.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        size = np.linalg.norm(normal, axis=1)
        normal /= np.where(size > 0, size, 1)[:, None]
        points, cells = [], []
        for cell, sign in ((self._front, 1.0), (self._back, -1.0)):
            at = np.flatnonzero(cell >= 0)
            area = np.bincount(cell[at], size[at] / 2, len(self._volume))
            depth = _BENEATH * self._volume / np.where(area > 0, area, 1)
            points.append(corners[at].mean(axis=1) + sign * depth[cell[at], None] * normal[at])
            cells.append(cell[at])
        return np.concatenate(points), np.concatenate(cells)


def _cones(corners: Array, piece: Ints) -> Array:
    """Signed volumes (m,) between triangles (m, 3, 3) and the middles of the pieces (m,) that they
    belong to."""
    middles = corners.mean(axis=1)
    count = np.maximum(np.bincount(piece), 1)
    middle = np.stack([np.bincount(piece, column) / count for column in middles.T], axis=1)
    volumes: Array = np.linalg.det(corners - middle[piece, None]) / 6
    return volumes
