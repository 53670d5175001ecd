"""Planning scenes as MoveIt writes them in text, into files that end in .scene.

    name of the scene
    * name of an object
    0.5 0 0.2              position of the object, not in files from before MoveIt 1.1
    0 0 0 1                its orientation x, y, z, w, neither
    1                      how many shapes it has
    box
    0.6 1.2 0.05           its sizes: of a box the sides, of a sphere the radius, of a cylinder or a
                           cone radius and length; of a mesh how many vertices and triangles, then
                           the vertices, then three numbers of vertices for each triangle
    0 0 0                  where the shape is, from the object (before: in the world)
    0 0 0 1
    0 0 0 0                its colour, red, green, blue and opacity
    0                      how many subframes the object has, not in files from before: a name, a
                           position and an orientation each
    .

Numbers that belong together are on one line; else line breaks matter about names only.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from envs.collision.shapes import LARGEST, PlacedShape, Solid
from envs.errors import InputError, brief
from envs.files import planning_scene
from envs.files.planning_scene import SIZES, PlanningScene
from envs.files.yaml_text import rotation_of
from envs.problem import Array

_NUMBER = re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)


def read_scene_text(text: bytes) -> PlanningScene:
    """Reads a scene, whose world is the frame that its poses are in. Nothing in it says what may
    touch what; colours and subframes are passed over.

    Raises:
        InputError: it is none, or has something that is not supported; names the line.
    """
    try:
        lines = text.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise InputError("it is no text in UTF-8") from error
    words = _Words(lines)
    words.line("the scene's name")
    try:
        found = list(_objects(words, _has_poses(lines)))
    except InputError as error:
        raise InputError(f"line {words.number}: {error}") from error
    return PlanningScene(tuple(one for _, one in found), tuple(name for name, _ in found))


@dataclass
class _Words:
    """The words of a file, one after another.

    Attributes:
        number: of the line that was looked at last, from 1.
    """

    lines: list[str]
    number: int = 0

    def __post_init__(self) -> None:
        self._rest: list[str] = []

    def line(self, what: str) -> str:
        """What is left of the current line; where nothing is, the next one."""
        if not self._rest:
            self._next(what)
        found, self._rest = " ".join(self._rest), []
        return found

    def word(self, what: str) -> str:
        """The next one; `what` it should be, for messages."""
        while not self._rest:
            self._next(what)
        return self._rest.pop(0)

    def _next(self, what: str) -> None:
        if self.number >= len(self.lines):
            raise InputError(f"the file ends where {what} should be; a scene ends with a line '.'")
        self._rest = self.lines[self.number].split()
        self.number += 1

    def numbers(self, count: int, what: str) -> Array:
        """The next numbers (count,), all on one line: else one that is missing would be taken from
        the next."""
        found = [self._value(self.word(what), what)]
        while len(found) < count:
            if not self._rest:
                raise InputError(f"{what} must be {count} numbers on a line, not {len(found)}")
            found.append(self._value(self.word(what), what))
        return np.array(found)

    def _value(self, word: str, what: str) -> float:
        value = float(word) if _NUMBER.fullmatch(word) else np.nan
        if not abs(value) <= LARGEST:
            wanted = f"finite numbers of at most {LARGEST:g}"
            raise InputError(f"{what} must be {wanted}, not {brief(word)}")
        return value

    def count(self, what: str) -> int:
        """The next whole number, from 0."""
        word = self.word(what)
        if not (word.isascii() and word.isdigit() and len(word) < 10):
            raise InputError(f"{what} must be a whole number, not {brief(word)}")
        return int(word)

    def pose(self, what: str) -> Array:
        """(4, 4), of a position and a quaternion x, y, z, w."""
        pose = np.eye(4)
        pose[:3, 3] = self.numbers(3, f"the position of {what}")
        turn = f"the orientation x, y, z, w of {what}"
        pose[:3, :3] = rotation_of(self.numbers(4, turn), turn)
        return pose


def _has_poses(lines: list[str]) -> bool:
    """Whether objects have poses: then several numbers follow the first object's name, and not how
    many shapes it has."""
    first = next((n for n, line in enumerate(lines) if line.startswith("*")), len(lines))
    return first + 1 < len(lines) and len(lines[first + 1].split()) > 1


def _objects(words: _Words, have_poses: bool) -> Iterator[tuple[str, PlacedShape]]:
    names: set[str] = set()
    while (mark := words.word("an object or the end")) != ".":
        if mark != "*":
            wanted = "an object begins with '* ' and its name, and the scene ends with '.'"
            raise InputError(f"{wanted}, not with {brief(mark)}")
        name = words.line("an object's name")
        if name in names:
            raise InputError(f"two objects are called {name!r}; rename one")
        names.add(name)
        what = f"object {name!r}"
        pose = words.pose(what) if have_poses else np.eye(4)
        for _ in range(words.count(f"how many shapes {what} has")):
            yield name, _shape(words, name, pose)
        for _ in range(words.count(f"how many subframes {what} has") if have_poses else 0):
            if words.line(f"a subframe's name of {what}").startswith("*"):
                raise InputError(f"{what} has fewer subframes than it says")
            words.pose(f"a subframe of {what}")


def _shape(words: _Words, name: str, within: Array) -> PlacedShape:
    kind = words.word(f"a shape of object {name!r}")
    solid = _mesh(words, name) if kind == "mesh" else _primitive(words, kind, name)
    there = within @ words.pose(f"a {kind} of object {name!r}")
    words.numbers(4, f"the colour of object {name!r}")
    return PlacedShape(solid, there)


def _primitive(words: _Words, kind: str, name: str) -> Solid:
    planning_scene.check_kind(kind, name)
    sizes = words.numbers(SIZES[kind], f"the sizes of object {name!r}").tolist()
    return planning_scene.primitive(kind, sizes, name)


def _mesh(words: _Words, name: str) -> Solid:
    of_mesh = f"of the mesh of object {name!r}"
    points = words.count(f"how many vertices {of_mesh}")
    triangles = words.count(f"how many triangles {of_mesh}")
    vertices = [words.numbers(3, f"a vertex {of_mesh}") for _ in range(points)]
    corner = f"a triangle's vertex {of_mesh}"
    faces = [[words.count(corner) for _ in range(3)] for _ in range(triangles)]
    corners = np.array(faces, dtype=np.int64).reshape(-1, 3)
    return planning_scene.mesh(np.array(vertices).reshape(-1, 3), corners, name)
