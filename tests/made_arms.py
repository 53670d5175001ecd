"""Arms and scenes at random, with links of every kind of solid, for checks against others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from bad_urdfs import collision, joint, link, robot


def made_arm(folder: Path, seed: int) -> str:
    """Writes an arm and a scene into a folder; returns the environment's text."""
    rng = np.random.default_rng(seed)
    elements = [link("l0", _solid(folder, rng, "l0", 0.1))]
    height = 0.14
    for n in range(1, int(rng.integers(3, 7))):
        length = rng.uniform(0.12, 0.35)
        name = f"l{n}"
        empty = rng.random() < 0.15 and n > 1
        elements.append(link(name, "" if empty else _solid(folder, rng, name, length)))
        elements.append(_joint(rng, n, height))
        height = length + rng.uniform(0.01, 0.05)
        if rng.random() < 0.3:
            elements.append(link(f"side{n}", _solid(folder, rng, f"side{n}", 0.06)))
            away = f'<origin xyz="{rng.uniform(0.08, 0.15):.4f} 0 {length / 2:.4f}"/>'
            elements.append(joint(f"holds{n}", name, f"side{n}", "fixed", away))
    last = link("tip", _solid(folder, rng, "tip", 0.12))
    elements += [last, joint("tips", name, "tip", "revolute", _inside(height, 2.0), "0 1 0")]
    (folder / "arm.urdf").write_text(robot(*elements))
    (folder / "scene.yaml").write_text(_scene(folder, rng))
    return f"arm:urdf={folder / 'arm.urdf'},scene={folder / 'scene.yaml'}"


def _inside(height: float, limit: float) -> str:
    ends = f'lower="-{limit}" upper="{limit}" effort="1" velocity="1"'
    return f'<origin xyz="0 0 {height:.4f}" rpy="0.1 0.2 0"/><limit {ends}/>'


def _joint(rng: np.random.Generator, n: int, height: float) -> str:
    kind = rng.choice(["revolute", "revolute", "revolute", "continuous", "prismatic"])
    axis = rng.choice(["0 0 1", "0 1 0", "1 0 0", "0.6 0.8 0"])
    if kind == "prismatic":
        return joint(f"j{n}", f"l{n - 1}", f"l{n}", kind, _inside(height + 0.1, 0.09), "0 0 1")
    return joint(f"j{n}", f"l{n - 1}", f"l{n}", kind, _inside(height, 2.5), axis)


def _solid(folder: Path, rng: np.random.Generator, name: str, length: float) -> str:
    """A solid that reaches up from the origin of its link."""
    width = rng.uniform(0.02, 0.05)
    at = f'<origin xyz="0 0 {length / 2:.4f}" rpy="{rng.normal(0, 0.05):.4f} 0 0"/>'
    kind = rng.choice(["box", "cylinder", "capsule", "ball", "mesh", "mesh", "mesh"])
    if kind == "box":
        return collision(f'<box size="{width:.4f} {2 * width:.4f} {length:.4f}"/>', at)
    if kind == "cylinder":
        return collision(f'<cylinder radius="{width:.4f}" length="{length:.4f}"/>', at)
    if kind == "capsule":
        return collision(f'<capsule radius="{width:.4f}" length="{length - width:.4f}"/>', at)
    if kind == "ball":
        return collision(f'<sphere radius="{min(length / 2, 2 * width):.4f}"/>', at)
    mesh = _mesh(rng, width, length)
    mesh.export(folder / f"{name}.stl")
    return collision(f'<mesh filename="{name}.stl"/>', at)


def _mesh(rng: np.random.Generator, width: float, length: float) -> trimesh.Trimesh:
    kind = rng.choice(["egg", "block", "rod", "angle", "ring"])
    if kind == "egg":
        egg = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
        return egg.apply_scale([2 * width, 3 * width, length])
    if kind == "block":
        return trimesh.creation.box((width, 3 * width, length))
    if kind == "rod":
        return trimesh.creation.cylinder(width, length, sections=12)
    if kind == "ring":
        return trimesh.creation.annulus(width, 2 * width, length / 2, sections=16)
    # An angle of two arms, not convex.
    t, w, h = width / 2, 2 * width, length / 2
    outline = np.array([[-w, -h], [w, -h], [w, -h + t], [-w + t, -h + t], [-w + t, h], [-w, h]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    angle = trimesh.creation.extrude_triangulation(outline, faces, height=width)
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0])
    return angle.apply_transform(turn)


def _scene(folder: Path, rng: np.random.Generator) -> str:
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1)
    ball.export(folder / "rock.ply")
    shapes = ["box: [0.1, 0.3, 0.2]", "sphere: 0.12", "cylinder: [0.05, 0.5]", "mesh: rock.ply"]
    shapes.append("capsule: [0.06, 0.4]")
    entries = []
    for shape in rng.permutation(shapes)[: rng.integers(1, 4)]:
        way = rng.normal(size=3)
        x, y, z = rng.uniform(0.35, 0.7) * way / np.linalg.norm(way) + [0, 0, 0.4]
        r, p, w = rng.uniform(-3, 3, 3)
        place = f"position: [{x:.4f}, {y:.4f}, {z:.4f}], rpy: [{r:.4f}, {p:.4f}, {w:.4f}]"
        entries.append(f"  - {{{shape}, {place}}}")
    return "obstacles:\n" + "\n".join(entries)
