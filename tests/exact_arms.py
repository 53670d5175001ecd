"""An independent exact check of arms: Pinocchio reads the URDF and moves it, coal tells how far
its links and the obstacles are apart. Nothing of ours but the rules is in it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio
import trimesh
from numpy.typing import NDArray

from envs.collision.shapes import Box, Capsule, Cylinder, Mesh, PlacedShape, Sphere
from envs.problem import Array

_ALWAYS = 2000
"""Configurations in which links are in contact that may be."""


class ExactArm:
    """An arm among obstacles.

    Args:
        file: its URDF, of a serial chain.
        obstacles: what is about it; the base may touch them.
        folders: where packages are.
    """

    def __init__(
        self, file: Path, obstacles: Sequence[PlacedShape], folders: Sequence[Path]
    ) -> None:
        file = _for_urdfdom(file)
        self._model = pinocchio.buildModelFromUrdf(str(file))
        self._data = self._model.createData()
        kind = pinocchio.GeometryType.COLLISION
        self._shapes = pinocchio.buildGeomFromUrdf(
            self._model, str(file), kind, package_dirs=list(map(str, folders))
        )
        for shape in self._geometries:
            if isinstance(shape.geometry, coal.BVHModelBase):
                shape.geometry = _read(shape.meshPath, np.array(shape.meshScale))
        self.links = [self._model.frames[g.parentFrame].name for g in self._geometries]
        self._joined = _joined(file, set(self.links))
        for number, obstacle in enumerate(obstacles):
            self._add(f"obstacle {number}", obstacle)
        # Insides are by numbers of our own: coal's meshes are surfaces.
        self._solids = [_Solid(g.geometry) for g in self._geometries]
        self._take_pairs()

    @property
    def _geometries(self) -> Sequence[Any]:
        return list(self._shapes.geometryObjects)

    def _add(self, name: str, placed: PlacedShape) -> None:
        turn, shift = placed.pose[:3, :3], placed.pose[:3, 3]
        if isinstance(placed.solid, Box):
            shift = shift + turn @ placed.solid.center
        pose = pinocchio.SE3(turn, shift)
        self._shapes.addGeometryObject(
            pinocchio.GeometryObject(name, 0, 0, pose, coal_geometry(placed.solid))
        )

    def _take_pairs(self) -> None:
        """All that must not touch: links and obstacles, and links that no joint joins and that are
        not always in contact."""
        joints = [g.parentJoint for g in self._geometries]
        for i, j in zip(*np.triu_indices(len(joints), 1), strict=True):
            a, b = (self.links[n] if n < len(self.links) else "" for n in (i, j))
            if joints[i] != joints[j] and (
                (not b and joints[i] > 0) or (a and b and (a, b) not in self._joined)
            ):
                self._shapes.addCollisionPair(pinocchio.CollisionPair(int(i), int(j)))
        every = self.pairs
        always = [pair for pair in every if pair[1] < len(self.links)]
        rng = np.random.default_rng(1)
        self._ask_of(always)
        for _ in range(_ALWAYS):
            if always != self.pairs:
                self._ask_of(always)
            always = list(self._touching(rng.uniform(*self.limits)))
        self._ask_of([pair for pair in every if pair not in always])

    def _ask_of(self, pairs: Sequence[tuple[int, int]]) -> None:
        self._shapes.removeAllCollisionPairs()
        for i, j in pairs:
            self._shapes.addCollisionPair(pinocchio.CollisionPair(i, j))
        self._found = self._shapes.createData()
        ways = [(a, b) for i, j in pairs for a, b in ((i, j), (j, i))]
        ways = [(a, b) for a, b in ways if self._solids[a].corners is not None]
        self._first, self._second = np.array(ways, dtype=int).reshape(-1, 2).T
        self._reach = np.array([self._solids[a].radius + self._solids[b].radius for a, b in ways])

    @property
    def limits(self) -> tuple[Array, Array]:
        """The joints' limits (2, d); those of joints that turn for ever are -pi and pi."""
        lower, upper = [], []
        for joint in list(self._model.joints)[1:]:
            endless = joint.nq == 2
            lower.append(-math.pi if endless else self._model.lowerPositionLimit[joint.idx_q])
            upper.append(math.pi if endless else self._model.upperPositionLimit[joint.idx_q])
        return np.array(lower), np.array(upper)

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Of geometries, by their numbers."""
        return [(p.first, p.second) for p in self._shapes.collisionPairs]

    @property
    def pairs_of_links(self) -> set[frozenset[str]]:
        """Names of links that must not touch."""
        among = [p for p in self.pairs if p[1] < len(self.links)]
        return {frozenset((self.links[i], self.links[j])) for i, j in among}

    def _configuration(self, q: Array) -> Array:
        found = pinocchio.neutral(self._model)
        for joint, value in zip(list(self._model.joints)[1:], q, strict=True):
            endless = joint.nq == 2
            ends = [math.cos(value), math.sin(value)] if endless else [value]
            found[joint.idx_q : joint.idx_q + joint.nq] = ends
        return found

    def meets(self, q: Array) -> bool:
        """Whether any surface meets one that it must not, at a configuration (d,)."""
        args = self._model, self._data, self._shapes, self._found, self._configuration(q)
        return bool(pinocchio.computeCollisions(*args, True))

    def touches(self, q: Array) -> bool:
        """The same, or whether anything is within what it must not touch."""
        return self.meets(q) or any(self._within())

    def distance(self, q: Array) -> float:
        """The least distance between surfaces (not above 0: in contact)."""
        args = self._model, self._data, self._shapes, self._found, self._configuration(q)
        pinocchio.computeDistances(*args)
        return min((r.min_distance for r in self._found.distanceResults), default=math.inf)

    def _touching(self, q: Array) -> Iterator[tuple[int, int]]:
        args = self._model, self._data, self._shapes, self._found, self._configuration(q)
        pinocchio.computeCollisions(*args, False)
        within = list(self._within())
        for pair, result in zip(self.pairs, self._found.collisionResults, strict=True):
            if result.isCollision() or pair in within:
                yield pair

    def _within(self) -> Iterator[tuple[int, int]]:
        """Pairs of which one lies within the other, a mesh, if their surfaces do not meet; where
        the last configuration was asked."""
        poses = self._found.oMg
        middles = np.array([poses[n].act(s.middle) for n, s in enumerate(self._solids)])
        apart = np.linalg.norm(middles[self._first] - middles[self._second], axis=1)
        for n in np.flatnonzero(apart < self._reach):
            mesh, other = int(self._first[n]), int(self._second[n])
            points = self._solids[other].points
            there = points @ poses[other].rotation.T + poses[other].translation
            local = (there - poses[mesh].translation) @ poses[mesh].rotation
            if self._solids[mesh].encloses(local):
                yield min(mesh, other), max(mesh, other)


class _Solid:
    """A point of each piece of a shape, a ball about it, and of a mesh its corners (m, 3, 3)."""

    def __init__(self, geometry: Any) -> None:
        geometry.computeLocalAABB()
        self.middle, self.radius = np.array(geometry.aabb_center), float(geometry.aabb_radius)
        self.points = np.zeros((1, 3))
        self.corners: Array | None = None
        if isinstance(geometry, coal.BVHModelBase):
            vertices = np.array(geometry.vertices())
            each = [geometry.tri_indices(n) for n in range(geometry.num_tris)]
            faces = np.array([[one[0], one[1], one[2]] for one in each])
            whole = trimesh.Trimesh(vertices, faces)  # merges corners of STL files
            pieces = whole.split(only_watertight=False)
            self.points = np.array([piece.vertices[0] for piece in pieces])
            self.corners = np.asarray(whole.triangles)
            self._low, self._high = whole.bounds

    def encloses(self, points: Array) -> bool:
        """Whether one of some points (n, 3) is within: by the sum of solid angles (Van Oosterom
        and Strackee 1983)."""
        assert self.corners is not None
        near = points[((points > self._low) & (points < self._high)).all(axis=1)]
        for point in near:
            a, b, c = np.moveaxis(self.corners - point, 1, 0)
            la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
            over = np.einsum("ni,ni->n", a, np.cross(b, c))
            under = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
            if abs(np.arctan2(over, under).sum()) > math.pi:  # half of 4 pi, by half angles
                return True
        return False


def coal_geometry(solid: Any) -> Any:
    if isinstance(solid, Box):
        return coal.Box(*solid.sides)
    if isinstance(solid, Cylinder):
        return coal.Cylinder(solid.radius, solid.length)
    if isinstance(solid, Capsule):
        return coal.Capsule(solid.radius, solid.length)
    if isinstance(solid, Sphere):
        return coal.Sphere(solid.radius)
    assert isinstance(solid, Mesh)
    return coal_mesh(solid.vertices, solid.faces)


def _for_urdfdom(file: Path) -> Path:
    """A copy, if need be, in which capsules are cylinders that Pinocchio is told to take for
    capsules: only the latest urdfdom reads them."""
    tree = ElementTree.parse(file)
    found = False
    for link in tree.getroot().findall("link"):
        for number, solid in enumerate(link.findall("collision")):
            capsule = solid.find("geometry/capsule")
            if capsule is not None:
                found, capsule.tag = True, "cylinder"
                name = solid.attrib["name"] = f"{link.attrib['name']}_{number}"
                told = ElementTree.SubElement(link, "collision_checking")
                ElementTree.SubElement(told, "capsule", name=name)
    if not found:
        return file
    copy = file.with_name("pinocchio.urdf")
    tree.write(copy)
    return copy


def _read(file: str, scale: Array) -> Any:
    """A mesh by trimesh. coal's own reader moves corners of OBJ files with several materials: a
    Panda's sixth link comes out up to 1 cm smaller."""
    mesh = trimesh.load_mesh(file, process=False)
    return coal_mesh(mesh.vertices * scale, mesh.faces)


def coal_mesh(vertices: Array, faces: NDArray[np.int64]) -> Any:
    """A surface for coal."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in vertices:
        points.append(np.array(vertex))
    for face in faces:
        triangles.append(coal.Triangle(*map(int, face)))
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(faces), len(vertices))
    model.addSubModel(points, triangles)
    model.endModel()
    return model


def _joined(file: Path, solid: set[str]) -> set[tuple[str, str]]:
    """Links that have no other with a solid on the way between them, both ways round."""
    above: dict[str, str] = {}
    for joint in ElementTree.parse(file).getroot().findall("joint"):
        parent, child = joint.find("parent"), joint.find("child")
        assert parent is not None
        assert child is not None
        above[child.attrib["link"]] = parent.attrib["link"]

    def upward(link: str) -> list[str]:
        return [link, *(upward(above[link]) if link in above else [])]

    found = set()
    for a in solid:
        for b in solid:
            one, other = upward(a), upward(b)
            shared = next(link for link in one if link in other)
            way = [*one[: one.index(shared) + 1], *other[: other.index(shared)]]
            if not solid & (set(way) - {a, b}):
                found.add((a, b))
    return found
