"""Robots from URDF files, checked: what cannot be used is refused in one clear line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from envs.collision.shapes import Box, Cylinder, Mesh, PlacedShape, Solid, Sphere
from envs.errors import InputError, tell_once
from envs.files.mesh_file import read_mesh
from envs.files.paths import exists, safe_join
from envs.robots.arm import Part
from envs.robots.joint_graph import JointGraph
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.planning_group import PlanningGroup
from envs.robots.urdf_elements import parsed
from envs.robots.urdf_tree import limits_of, pose, tree_of

_NAMED = 8
"""Joints that stand still and are named."""


def read_urdf(
    file: Path, group: PlanningGroup | None = None
) -> tuple[KinematicTree, tuple[Part, ...]]:
    """Reads the kinematics and the collision geometry of a robot.

    Joints may be revolute, continuous, prismatic, planar or fixed, and may branch and mimic others.
    A planar joint is two that slide, NAME/x and NAME/y, of which its limits are, and a continuous
    one, NAME/theta. A continuous joint goes from -pi to pi and wraps; it ends there, and does not
    wrap, if another mimics it by a ratio that is no whole number, or slides by it. The limits of a
    joint that mimics another are those that follow from the other's. A limit that is left out
    beside another is 0, as URDF has it; soft limits are not used, and a line is logged that says
    so. Another says which joints stand still, and where.

    Visual geometry is ignored. Meshes may be open: they are surfaces. Their files are sought from
    the URDF's folder; those named package://NAME/REST or file://REST from each folder above it
    too, with NAME and without.

    Args:
        file: the URDF; lengths in metres, angles in radians.
        group: the joints that move; all by default.

    Returns:
        The tree, with its links in depth-first order from the base, which is the link that no
        joint carries; its frame is that of all poses. And the solids of the links in that order,
        each placed in the frame of its body.

    Raises:
        InputError: there is no such file, or it describes no robot that can be used, or the group
            names something else than it has.
    """
    try:
        robot = parsed(file)
        graph = JointGraph(robot)
        locked = (group or PlanningGroup()).locked(graph)
        tree = tree_of(graph, locked)
        parts = _parts(robot, tree, file.parent)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    _tell_of_soft_limits([graph.joints[joint.name] for joint in tree.coordinates], file)
    _tell_of_locked(locked, file)
    return tree, parts


def _tell_of_locked(locked: Mapping[str, float], file: Path) -> None:
    if locked:
        named = [f"{name!r} at {value:g}" for name, value in locked.items()]
        more = f", and {len(named) - _NAMED} more" if len(named) > _NAMED else ""
        tell_once(f"{file}: joints that stand still: {', '.join(named[:_NAMED])}{more}")


def _tell_of_soft_limits(joints: Sequence[Any], file: Path) -> None:
    """Says which joints a safety controller would hold back. MoveIt narrows their limits so, while
    Pinocchio and others do not, and some problems of MotionBenchMaker are beyond them."""
    limited = [joint.name for joint in joints if _has_tighter_soft_limits(joint)]
    if limited:
        named = ", ".join(map(repr, limited))
        tell_once(f"{file}: <safety_controller>'s soft limits are not used, only <limit>: {named}")


def _has_tighter_soft_limits(joint: Any) -> bool:
    soft = joint.safety_controller
    if soft is None:
        return False
    ends = soft.soft_lower_limit, soft.soft_upper_limit
    lower, upper = limits_of(joint)
    return ends != (None, None) and ((ends[0] or 0.0) > lower or (ends[1] or 0.0) < upper)


def _parts(robot: Any, tree: KinematicTree, folder: Path) -> tuple[Part, ...]:
    collisions = {link.name: link.collisions for link in robot.links}
    parts = []
    for link in tree.links:
        for collision in collisions.get(link.name, ()):  # of a planar joint's there are none
            try:
                solid = _solid(collision.geometry, folder)
            except ValueError as error:  # InputError, or a shape's own
                raise InputError(f"link {link.name!r}: {error}") from error
            placed = PlacedShape(solid, link.offset @ pose(collision.origin))
            parts.append(Part(link.body, placed, link.name))
    if not any(part.body > 0 for part in parts):
        raise InputError("no link that moves has collision geometry; add <collision> elements")
    return tuple(parts)


def _solid(geometry: Any, folder: Path) -> Solid:
    if geometry.box is not None:
        return Box(np.zeros(3), geometry.box.size)
    if geometry.cylinder is not None:
        return Cylinder(geometry.cylinder.radius, geometry.cylinder.length)
    if geometry.sphere is not None:
        if geometry.sphere.radius <= 0:
            raise InputError(f"a sphere's radius must be positive, not {geometry.sphere.radius}")
        return Sphere(geometry.sphere.radius)
    scale = 1.0 if geometry.mesh.scale is None else geometry.mesh.scale
    if np.any(np.equal(scale, 0)):
        raise InputError("a mesh's scale must not be 0")
    mesh = read_mesh(_mesh_file(geometry.mesh.filename, folder))
    return Mesh(mesh.vertices * scale, mesh.faces)


def _mesh_file(name: str, folder: Path) -> Path:
    """The file of a mesh that a URDF in a folder names: from there, or as a package's, from any
    folder above."""
    scheme, _, rest = name.rpartition("://")
    if not scheme:
        candidates = [safe_join(folder, rest)]
    else:
        relative = Path(rest.lstrip("/"))
        if ".." in relative.parts:
            raise InputError(f"{name} climbs out of where it is sought; put it there instead")
        without_package = Path(*relative.parts[1:])
        above = [folder, *folder.resolve().parents]
        candidates = [at / there for at in above for there in (relative, without_package)]
        if scheme == "file" and exists((folder / rest).is_file):
            return safe_join(folder, rest)
    for candidate in candidates:
        if exists(candidate.is_file):
            return candidate
    raise InputError(
        f"no such mesh: {name}, sought from {folder}; put it there or correct its name"
    )
