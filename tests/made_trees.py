"""Kinematic trees at random, and where Pinocchio has their links."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio
from bad_urdfs import collision, joint, link, robot

from envs.collision.separation import separations
from envs.collision.shapes import Mesh, PlacedShape
from envs.problem import Array
from envs.robots.arm import Arm, Part
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.urdf import read_urdf

_KINDS = ("revolute", "revolute", "continuous", "prismatic", "fixed")


def made_tree(seed: int, joints: int = 8) -> str:
    """A URDF: joints of all kinds on links that were there before, of which some mimic others, and
    those others again; solids that stay apart at times."""
    rng = np.random.default_rng(seed)
    elements, moving = [link("l0", _solid(rng))], []
    for n in range(1, joints + 1):
        kind = str(rng.choice(_KINDS)) if n > 1 else "revolute"
        parent = f"l{rng.integers(max(0, n - 4), n)}"
        mimic = ""
        if moving and kind != "fixed" and rng.random() < 0.3:
            ratio = rng.choice([-1.0, 2.0, 0.5])
            mimic = f'<mimic joint="{rng.choice(moving)}" multiplier="{ratio}" offset="0.1"/>'
        if kind != "fixed":
            moving.append(f"j{n}")
        place = " ".join(f"{x:.3f}" for x in rng.uniform(-0.4, 0.4, 3))
        turn = " ".join(f"{x:.3f}" for x in rng.uniform(-3, 3, 3))
        axis = " ".join(f"{x:.3f}" for x in rng.normal(size=3))
        most = 0.3 if kind == "prismatic" else 2.5
        inside = f'<origin xyz="{place}" rpy="{turn}"/>' + mimic
        inside += f'<limit lower="-{most}" upper="{most}" effort="1" velocity="1"/>'
        elements.append(link(f"l{n}", _solid(rng) if rng.random() < 0.8 or n == 1 else ""))
        elements.append(joint(f"j{n}", parent, f"l{n}", kind, inside, axis))
    return robot(*elements)


def _solid(rng: np.random.Generator) -> str:
    a, b, c = rng.uniform(0.03, 0.15, 3)
    shapes = [
        f'<box size="{a:.3f} {b:.3f} {c:.3f}"/>',
        f'<sphere radius="{a:.3f}"/>',
        f'<cylinder radius="{a / 2:.3f}" length="{b:.3f}"/>',
    ]
    place = " ".join(f"{x:.3f}" for x in rng.uniform(-0.15, 0.15, 3))
    return collision(shapes[rng.integers(3)], f'<origin xyz="{place}"/>')


def made_arm(folder: Path, seed: int, meshes: float) -> Arm:
    """Of a made tree, a share of whose solids are meshes of the same shape."""
    file = folder / f"{seed}.urdf"
    file.write_text(made_tree(seed))
    tree, parts = read_urdf(file)
    rng = np.random.default_rng(seed)
    made = [Part(p.body, _as_mesh(p.placed) if rng.random() < meshes else p.placed) for p in parts]
    return Arm(tree, made, self_collision=True)


def _as_mesh(placed: PlacedShape) -> PlacedShape:
    surface = placed.solid.triangulate()
    return PlacedShape(Mesh(surface.vertices, surface.faces), placed.pose)


def distances_of(arm: Arm, i: int, j: int, q: Array) -> Array:
    """The distances (n,) of two parts at configurations (n, d)."""
    bodies = [arm.parts[part].body for part in (i, j)]
    poses = np.array([arm.body_poses(one)[bodies] for one in q])
    return np.asarray(separations(arm.arrays.shapes, i, j, poses, np.inf))


def values_of(text: str, chosen: Mapping[str, float]) -> dict[str, float]:
    """The values of a URDF's joints, of which those that mimic no other are chosen."""
    mimics = {
        element.attrib["name"]: element.find("mimic")
        for element in ElementTree.fromstring(text).findall("joint")
        if element.attrib["type"] != "fixed"
    }

    def value(name: str) -> float:
        mimic = mimics.get(name)
        if mimic is None:
            return chosen.get(name, 0.0)
        ratio, offset = (float(mimic.get(k, d)) for k, d in (("multiplier", 1), ("offset", 0)))
        return ratio * value(mimic.attrib["joint"]) + offset

    return {name: value(name) for name in mimics}


def by_pinocchio(text: str, links: Sequence[str], values: Mapping[str, float]) -> Array:
    """Poses (links, 4, 4) of links of a URDF, whose joints have these values."""
    model = pinocchio.buildModelFromXML(text)
    data, q = model.createData(), pinocchio.neutral(model)
    for name, place in zip(list(model.names)[1:], list(model.joints)[1:], strict=True):
        value = values[name]
        ends = [math.cos(value), math.sin(value)] if place.nq == 2 else [value]
        q[place.idx_q : place.idx_q + place.nq] = ends
    pinocchio.framesForwardKinematics(model, data, q)
    frames = [model.getFrameId(name, pinocchio.FrameType.BODY) for name in links]
    return np.array([data.oMf[frame].homogeneous for frame in frames])


def assert_as_in_pinocchio(
    text: str, tree: KinematicTree, q: Array, locked: Mapping[str, float] | None = None
) -> None:
    """All links are where Pinocchio has them at configurations (n, d)."""
    names = [one.name for one in tree.links]
    for one, poses in zip(q, tree.forward(q), strict=True):
        chosen = {**(locked or {}), **dict(zip(_moving(tree), one, strict=True))}
        expected = by_pinocchio(text, names, values_of(text, chosen))
        assert np.abs(poses - expected).max() < 1e-12


def _moving(tree: KinematicTree) -> list[str]:
    return [one.name for one in tree.coordinates]
