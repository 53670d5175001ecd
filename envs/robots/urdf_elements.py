"""The elements of URDF files, checked one by one before anything is made of them."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import yourdfpy

from envs.collision.shapes import LARGEST
from envs.errors import InputError, reason
from envs.presence import is_there

_NEEDED = {
    "parent": ("link",),
    "child": ("link",),
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "sphere": ("radius",),
    "mesh": ("filename",),
}
"""Attributes that elements must have."""

_NUMBERS = {
    "xyz": (3,),
    "rpy": (3,),
    "size": (3,),
    "scale": (1, 3),
    "radius": (1,),
    "length": (1,),
    "lower": (1,),
    "upper": (1,),
}
"""Attributes that hold numbers, and how many."""

_MOST_BYTES = 2**21  # those of whole robots have some 100 kB

_DEEPEST = 100
"""Elements within each other; those of links have five, and yourdfpy's parser takes 256."""

_STUMBLES = (AttributeError, TypeError, ValueError, LookupError, SyntaxError, RecursionError)
"""What yourdfpy raises where it stumbles over something."""


def parsed(file: Path) -> Any:
    """The `yourdfpy.Robot` of a URDF file, of which every element that is used is complete.

    Raises:
        InputError: there is no such file, or it is not well-formed XML, or an element lacks what
            it must have or holds something else than finite numbers of at most `LARGEST`. Does not
            name the file.
    """
    if not is_there(file.is_file):
        raise InputError("no such file")
    size = file.stat().st_size
    if size > _MOST_BYTES:
        raise InputError(f"has {size} bytes; URDFs of at most {_MOST_BYTES} are read")
    try:
        root = ElementTree.parse(file, ElementTree.XMLParser(target=_ShallowTree())).getroot()
    except InputError:
        raise
    except ElementTree.ParseError as error:
        raise InputError(f"not well-formed XML ({error}); mend it there") from error
    except (OSError, ValueError, LookupError) as error:  # the last two: encodings
        raise InputError(f"cannot be read: {error}") from error
    _check_elements(root)
    try:
        # Not the file, which yourdfpy's own parser may read otherwise, or log that it cannot.
        read = io.BytesIO(ElementTree.tostring(root))
        return yourdfpy.URDF.load(read, build_scene_graph=False, load_meshes=False).robot
    except _STUMBLES as error:
        raise InputError(f"not valid URDF, mend it ({reason(error)})") from error


class _ShallowTree(ElementTree.TreeBuilder):
    """Refuses what is nested deeply."""

    _depth = 0

    def start(self, tag: Any, attrs: Any) -> ElementTree.Element:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise InputError(f"has more than {_DEEPEST} elements within each other")
        return super().start(tag, attrs)

    def end(self, tag: Any) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)


def _check_elements(root: ElementTree.Element) -> None:
    """What yourdfpy would stumble over, or read as something else than what was meant."""
    if any("xacro" in element.tag for element in root.iter()):
        raise InputError("has xacro macros in it; expand them first: xacro IN > OUT.urdf")
    if root.tag != "robot":
        raise InputError(f"has no <robot> but <{root.tag}> at its top; is it a URDF?")
    if not root.get("name"):
        raise InputError("its <robot> has no name; give it one")
    for tag in ("link", "joint"):
        for part in root.findall(tag):
            if not part.get("name"):
                raise InputError(f"has a <{tag}> without a name; give it one")
            try:
                _check_part(part)
            except InputError as error:
                raise InputError(f"{tag} {part.get('name')!r}: {error}") from error


def _check_part(part: ElementTree.Element) -> None:
    needed = ("parent", "child") if part.tag == "joint" else ()
    for tag in needed:
        if part.find(tag) is None:
            raise InputError(f"has no <{tag}>; say which link that is")
    for solid in part.findall("collision") + part.findall("visual"):
        shapes = solid.find("geometry")
        if shapes is None or len(shapes) != 1:
            raise InputError(f"its <{solid.tag}> needs one <geometry> with one shape in it")
    for element in part.iter():
        for key in _NEEDED.get(element.tag, ()):
            if not element.get(key):
                raise InputError(f"its <{element.tag}> has no {key}; add it")
        for key, text in element.items():
            if key in _NUMBERS:
                _check_numbers(key, text)


def _check_numbers(key: str, text: str) -> None:
    words = text.split()
    try:
        usable = all(abs(float(word)) <= LARGEST for word in words)
    except ValueError:
        usable = False
    counts = _NUMBERS[key]
    if not usable or len(words) not in counts:
        wanted = f"{' or '.join(map(str, counts))} finite numbers of at most {LARGEST:g}"
        raise InputError(f"{key}={text!r} must hold {wanted}, spaces between")
