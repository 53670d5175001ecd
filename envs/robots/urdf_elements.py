"""The elements of URDF files, checked one by one before anything is made of them."""

from __future__ import annotations

import codecs
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import yourdfpy

from envs.collision.shapes import LARGEST
from envs.errors import InputError, reason
from envs.files.git_lfs import check_is_no_pointer
from envs.files.paths import exists

_READ = {
    "robot": ("link", "joint"),
    "link": ("collision", "visual"),
    "collision": ("origin", "geometry"),
    "visual": ("origin", "geometry"),
    "mesh": ("drake:declare_convex",),
    "joint": ("parent", "child", "origin", "axis", "limit", "mimic", "safety_controller"),
}
"""Elements that are read, by the one that they are in; of a geometry, all."""

_READ_OF_JOINT = {
    "fixed": ("parent", "child", "origin"),
    "continuous": ("parent", "child", "origin", "axis", "limit", "mimic"),
}
"""Those of joints of some types: what was left in one when it was made fixed, say, is idle. Of the
limits of a continuous one only that of velocity is read."""

_NEEDED = {"parent": ("link",), "child": ("link",), "mimic": ("joint",)}
"""Attributes that elements of joints must have."""

_NUMBERS = {
    "xyz": 3,
    "rpy": 3,
    "lower": 1,
    "upper": 1,
    "multiplier": 1,
    "offset": 1,
    "soft_lower_limit": 1,
    "soft_upper_limit": 1,
}
"""Attributes of joints' elements that hold numbers, and how many."""

_MOST_BYTES = 2**21  # those of whole robots have some 100 kB

_DEEPEST = 100
"""Elements within each other; those of links have five, and yourdfpy's parser takes 256."""

_STUMBLES = (AttributeError, TypeError, ValueError, LookupError, SyntaxError, RecursionError)
"""What yourdfpy raises where it stumbles over something."""


def parsed(file: Path) -> tuple[Any, ElementTree.Element]:
    """The `yourdfpy.Robot` of a URDF file, of which every element that is used is complete, and
    the file's `<robot>` with the shapes of links, which are left to `urdf_geometry`.

    What is not read (see `_READ`) may be whatever it is. Namespaces are none of URDF's, so a prefix
    is part of a name, declared or not, as other readers of URDF have it.

    Raises:
        InputError: there is no such file, or it is not well-formed XML, or an element lacks what
            it must have or holds something else than finite numbers of at most `LARGEST`. Does not
            name the file.
    """
    read = _as_read(read_xml(file, "URDF"))
    _check_elements(read)
    try:
        # Not the file, which yourdfpy's own parser may read otherwise, or log that it cannot.
        text = io.BytesIO(ElementTree.tostring(_without_shapes(read)))
        loaded = yourdfpy.URDF.load(text, build_scene_graph=False, load_meshes=False)
    except _STUMBLES as error:
        raise InputError(f"not valid URDF, mend it ({reason(error)})") from error
    return loaded.robot, read


def read_xml(file: Path, kind: str) -> ElementTree.Element:
    """The <robot> of a file of a kind, URDF or SRDF, which is checked no further.

    Raises:
        InputError: there is no such file, or it is not well-formed XML, or holds something else.
            Does not name the file.
    """
    if not exists(file.is_file):
        raise InputError("no such file")
    if file.suffix == ".xacro":
        plain = file.with_suffix("").with_suffix(f".{kind.lower()}").name
        raise InputError(f"is a xacro file; expand it first: xacro {file.name} > {plain}")
    size = file.stat().st_size
    if size > _MOST_BYTES:
        raise InputError(f"has {size} bytes; {kind}s of at most {_MOST_BYTES} are read")
    try:
        content = file.read_bytes()
        check_is_no_pointer(content)
        root = _tree(_from_its_beginning(content))
    except InputError:
        raise
    except expat.ExpatError as error:
        raise InputError(f"not well-formed XML ({error}); mend it there") from error
    except (OSError, ValueError, LookupError) as error:  # the last two: encodings
        raise InputError(f"cannot be read: {error}") from error
    _check_root(root, kind)
    return root


def _from_its_beginning(content: bytes) -> bytes:
    """Without empty lines before an XML declaration, which others of URDF's readers pass over."""
    mark = codecs.BOM_UTF8 if content.startswith(codecs.BOM_UTF8) else b""
    return mark + content.removeprefix(mark).lstrip()


def _without_shapes(root: ElementTree.Element) -> ElementTree.Element:
    copy = ElementTree.Element(root.tag, root.attrib)
    for part in root:
        copy.append(ElementTree.Element("link", part.attrib) if part.tag == "link" else part)
    return copy


def _tree(content: bytes) -> ElementTree.Element:
    """The elements of an XML document, without their texts, of which URDF has none."""
    builder = _ShallowTree()
    parser = expat.ParserCreate()
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.SkippedEntityHandler = _refuse_undefined
    parser.ExternalEntityRefHandler = _refuse_external
    parser.Parse(content, True)
    return builder.close()


def _refuse_undefined(name: str, _of_parameters: bool) -> None:
    raise InputError(f"not well-formed XML (undefined entity &{name};); mend it there")


def _refuse_external(_context: str, _base: str | None, place: str | None, _id: str | None) -> int:
    raise InputError(f"wants what is elsewhere, {place}; put what is needed into it")


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


def _check_root(root: ElementTree.Element, kind: str) -> None:
    declared = (key for key, uri in root.items() if "xacro" in uri and key.startswith("xmlns:"))
    prefixes = ("xacro:", *(f"{key.removeprefix('xmlns:')}:" for key in declared))
    is_old = root.find("macro") is not None or root.find("include") is not None
    if is_old or any(element.tag.startswith(prefixes) for element in root.iter()):
        expanded = f"OUT.{kind.lower()}"
        raise InputError(f"has xacro macros in it; expand them first: xacro IN > {expanded}")
    if root.tag != "robot":
        raise InputError(f"has no <robot> but <{root.tag}> at its top; is this {kind}?")
    if not root.get("name"):
        raise InputError("its <robot> has no name; give it one")


def _as_read(element: ElementTree.Element) -> ElementTree.Element:
    """A copy without what is not read."""
    of_urdf = {key: value for key, value in element.items() if not _has_prefix(key)}
    copy = ElementTree.Element(element.tag, of_urdf)
    wanted = _READ.get(element.tag, ())
    if element.tag == "joint" and _turns_for_ever(element):
        copy.set("type", "continuous")
    if element.tag == "joint":
        wanted = _READ_OF_JOINT.get(copy.get("type", ""), wanted)
    for child in element:
        if child.tag in wanted or element.tag == "geometry":
            copy.append(_as_read(child))
    if copy.get("type") == "continuous":
        for limit in copy.findall("limit"):
            limit.attrib = {key: text for key, text in limit.items() if key == "velocity"}
    return copy


def _turns_for_ever(joint: ElementTree.Element) -> bool:
    """Whether a revolute joint has limits that are none: what SDFormat has for those, 1e16 or
    infinity, is in URDFs that were made from its files."""
    limit = joint.find("limit")
    if joint.get("type") != "revolute" or limit is None:
        return False
    try:
        lower, upper = (float(limit.get(key, "0")) for key in ("lower", "upper"))
    except ValueError:
        return False
    return lower <= -_NO_LIMIT and upper >= _NO_LIMIT


_NO_LIMIT = 1e16


def _has_prefix(name: str) -> bool:
    return ":" in name or name == "xmlns"


def _check_elements(root: ElementTree.Element) -> None:
    """What yourdfpy would stumble over, or read as something else than what was meant."""
    for tag in ("link", "joint"):
        for part in root.findall(tag):
            if not part.get("name"):
                raise InputError(f"has a <{tag}> without a name; give it one")
    for joint in root.findall("joint"):
        _check_joint(joint)


def _check_joint(joint: ElementTree.Element) -> None:
    try:
        _check_elements_of(joint)
    except InputError as error:
        raise InputError(f"joint {joint.get('name')!r}: {error}") from error


def _check_elements_of(joint: ElementTree.Element) -> None:
    for tag in ("parent", "child"):
        if joint.find(tag) is None:
            raise InputError(f"has no <{tag}>; say which link that is")
    for element in joint.iter():
        if element.tag == "origin":
            check_origin(element)
        for key in _NEEDED.get(element.tag, ()):
            if not element.get(key):
                raise InputError(f"its <{element.tag}> has no {key}; add it")
        for key, text in element.items():
            if key in _NUMBERS:
                numbers_of(key, text, (_NUMBERS[key],))
            elif key == "velocity":
                _check_velocity(text)


def _check_velocity(text: str) -> None:
    """Raises InputError unless a limit of velocity is a number, which may be infinite: that is
    none."""
    try:
        float(text)
    except ValueError as error:
        raise InputError(f"velocity={text!r} must be a number{xacro_hint(text)}") from error


def check_origin(origin: ElementTree.Element) -> None:
    """Raises InputError if a place is given by anything else than xyz and rpy."""
    for key in sorted(set(origin.attrib) - {"xyz", "rpy"}):
        raise InputError(f"its <origin> has {key}, which is not read; turn it by rpy")


def numbers_of(key: str, text: str, counts: Sequence[int] = (1,)) -> list[float]:
    """The numbers that an attribute holds.

    Args:
        key, text: the attribute.
        counts: how many they may be.

    Raises:
        InputError: they are others, or not finite numbers of at most `LARGEST`.
    """
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) not in counts or not all(abs(number) <= LARGEST for number in numbers):
        wanted = f"{' or '.join(map(str, counts))} finite numbers of at most {LARGEST:g}"
        raise InputError(f"{key}={text!r} must hold {wanted}, spaces between{xacro_hint(text)}")
    return numbers


def xacro_hint(text: str) -> str:
    """What to add to a message about a text that only xacro understands."""
    is_of_xacro = "${" in text or "$(" in text
    return "; this is xacro's, expand the file first: xacro IN > OUT" if is_of_xacro else ""
