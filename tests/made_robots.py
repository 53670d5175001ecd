"""Robots and scenes at random, with solids of every kind, for checks against others: kinematic
trees as URDF and SRDF files, and rigid bodies."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import trimesh
import yaml
from bad_urdfs import collision, joint, link, robot
from exact_robots import RobotFiles
from scipy.spatial.transform import Rotation

_KINDS = ("revolute", "revolute", "revolute", "continuous", "continuous", "prismatic", "fixed")

_SOLIDS = ("box", "cylinder", "capsule", "ball", "mesh", "mesh", "mesh")

_SPACES = ("se3", "se3", "se2", "r3")

_BODIES = ("box", "l", "cross", "piano", "mesh", "mesh", "mesh")


def made_tree_world(folder: Path, seed: int) -> tuple[str, RobotFiles]:
    """Writes a kinematic tree and a scene into a folder.

    Returns:
        The environment's text, and what else is to be known of the robot.
    """
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(5, 10))
    movable = _tree(folder, rng, joints)
    scene = made_scene(folder, rng, (0.0, 0.0, 0.4), 1.0)
    files = RobotFiles(folder / "robot.urdf")
    text = f"arm:urdf={files.urdf},scene={scene}"
    if rng.random() < 0.3:
        turn = rng.uniform(-3, 3, 3).round(3)
        place = rng.uniform(-0.2, 0.2, 3).round(3)
        files = replace(files, stands=(*place, *Rotation.from_euler("xyz", turn).as_quat()))
        text += f',base="{",".join(map(str, [*place, *turn]))}"'
    if rng.random() < 0.6:
        drives = str(rng.choice(["", "", "planar", "floating"]))
        group = bool(drives) or (len(movable) > 3 and rng.random() < 0.5)
        files = replace(files, srdf=folder / "robot.srdf", state="there" * group, drives=drives)
        (folder / "robot.srdf").write_text(_srdf(rng, joints, movable, drives))
        text += f",srdf={files.srdf}" + ",group=some,state=there" * group
        text += ',volume="-0.6,-0.6,-0.6,0.6,0.6,0.6"' * bool(drives)
    return text, files


def let_links_touch_obstacles(folder: Path, seed: int) -> list[tuple[str, int]]:
    """Rewrites the scene that a made tree is in so that about half of the pairs of its links and
    obstacles may touch.

    Returns:
        These pairs, the obstacles by their numbers.
    """
    rng = np.random.default_rng([seed, 1])
    scene = yaml.safe_load((folder / "scene.yaml").read_text())
    for number, obstacle in enumerate(scene["obstacles"]):
        obstacle["name"] = f"thing {number}"
    root = ElementTree.parse(folder / "robot.urdf").getroot()
    pairs = product((one.attrib["name"] for one in root.iter("link")), range(number + 1))
    found = [pair for pair in pairs if rng.random() < 0.5]
    told = [rng.permutation([name, f"thing {number}"]).tolist() for name, number in found]
    scene["allowed_collisions"] = told
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    return found


def _tree(folder: Path, rng: np.random.Generator, joints: int) -> list[str]:
    """Writes robot.urdf; returns the names of the joints that move and mimic no other."""
    lengths = rng.uniform(0.12, 0.3, joints + 1)
    elements = [link("l0", _solid(folder, rng, "l0", lengths[0]))]
    parents: list[int] = []
    movable: list[tuple[str, str]] = []  # with their types
    for n in range(1, joints + 1):
        parent = n - 1 if n == 1 or rng.random() < 0.65 else int(rng.integers(0, n - 1))
        kind = str(rng.choice(_KINDS)) if n > 1 else "revolute"
        mimic = ""
        if movable and kind != "fixed" and rng.random() < 0.25:
            mimic = _mimic(rng, *movable[rng.integers(len(movable))], kind)
        elif kind != "fixed":
            movable.append((f"j{n}", kind))
        beside = parent in parents
        parents.append(parent)
        elements.append(link(f"l{n}", _solids(folder, rng, f"l{n}", lengths[n])))
        inside = _inside(rng, lengths[parent], kind, beside) + mimic
        axis = " ".join(f"{x:.3f}" for x in rng.normal(size=3) + [0, 0, 1e-3])
        elements.append(joint(f"j{n}", f"l{parent}", f"l{n}", kind, inside, axis))
    (folder / "robot.urdf").write_text(robot(*elements))
    return [name for name, _ in movable]


def _mimic(rng: np.random.Generator, name: str, followed: str, kind: str) -> str:
    """What slides by an angle, or turns by a length, does so by little."""
    ratios = [-1.0, 2.0, 0.5] if (kind == "prismatic") == (followed == "prismatic") else [0.05]
    return f'<mimic joint="{name}" multiplier="{rng.choice(ratios)}" offset="0.1"/>'


def _inside(rng: np.random.Generator, length: float, kind: str, beside: bool) -> str:
    """Where a joint is: beyond the solids of the link that it is on, or beside them, if another
    joint is beyond; and its limits."""
    x, y, z = 0.0, 0.0, length + rng.uniform(0.03, 0.08) + 0.1 * (kind == "prismatic")
    roll, pitch, yaw = rng.normal(0, 0.3, 3)
    if beside:
        way, z = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 1) * length
        x, y, pitch, yaw = 0.13 * np.cos(way), 0.13 * np.sin(way), 1.2, way
    origin = f'<origin xyz="{x:.4f} {y:.4f} {z:.4f}" rpy="{roll:.4f} {pitch:.4f} {yaw:.4f}"/>'
    if kind in ("fixed", "continuous"):
        return origin
    most = 0.09 if kind == "prismatic" else rng.uniform(1.5, 3.1)
    return origin + f'<limit lower="{-most:.4f}" upper="{most:.4f}" effort="1" velocity="1"/>'


def _srdf(rng: np.random.Generator, joints: int, movable: list[str], drives: str) -> str:
    """Two pairs of links that may touch; a group of most joints, and where the others stand; and
    how the base moves, if it does."""
    pairs = rng.integers(0, joints + 1, (2, 2))
    lines = [f'<disable_collisions link1="l{a}" link2="l{b}"/>' for a, b in pairs if a != b]
    moving = list(rng.permutation(movable)[: max(2, 2 * len(movable) // 3)])
    still = [name for name in movable if name not in moving]
    if drives:
        ends = 'parent_frame="world" child_link="l0"'
        lines.append(f'<virtual_joint name="drives" type="{drives}" {ends}/>')
        moving.append("drives")
    lines += ['<group name="some">', *(f'<joint name="{name}"/>' for name in moving), "</group>"]
    values = [f'<joint name="{name}" value="{rng.uniform(-0.08, 0.08):.3f}"/>' for name in still]
    lines += ['<group_state name="there" group="some">', *values, "</group_state>"]
    return '<robot name="arm">' + "\n".join(lines) + "</robot>"


def _solids(folder: Path, rng: np.random.Generator, name: str, length: float) -> str:
    """Of a link: one along it, none, or several."""
    if rng.random() < 0.1:
        return ""
    found = _solid(folder, rng, name, length)
    for n in range(int(rng.choice([0, 0, 0, 1, 2]))):
        x, y = rng.uniform(-0.06, 0.06, 2)
        at = f'<origin xyz="{x:.4f} {y:.4f} {rng.uniform(0.2, 0.8) * length:.4f}" rpy="1 0.5 0"/>'
        shape = rng.choice(_SOLIDS)
        found += collision(_shape(folder, rng, f"{name}_{n}", shape, 0.025, 0.08), at)
    return found


def _solid(folder: Path, rng: np.random.Generator, name: str, length: float) -> str:
    """A solid that reaches up from the origin of its link."""
    at = f'<origin xyz="0 0 {length / 2:.4f}" rpy="{rng.normal(0, 0.05):.4f} 0 0"/>'
    width = rng.uniform(0.02, 0.05)
    return collision(_shape(folder, rng, name, rng.choice(_SOLIDS), width, length), at)


def _shape(
    folder: Path, rng: np.random.Generator, name: str, kind: str, width: float, length: float
) -> str:
    if kind == "box":
        return f'<box size="{width:.4f} {2 * width:.4f} {length:.4f}"/>'
    if kind == "cylinder":
        return f'<cylinder radius="{width:.4f}" length="{length:.4f}"/>'
    if kind == "capsule":
        return f'<capsule radius="{width:.4f}" length="{length - width:.4f}"/>'
    if kind == "ball":
        return f'<sphere radius="{min(length / 2, 2 * width):.4f}"/>'
    made_mesh(rng, width, length).export(folder / f"{name}.stl")
    return f'<mesh filename="{name}.stl"/>'


def made_mesh(rng: np.random.Generator, width: float, length: float) -> trimesh.Trimesh:
    """A closed surface about the origin, along z; convex or not, of one piece or two."""
    kind = rng.choice(["egg", "block", "rod", "angle", "ring", "pair"])
    if kind == "egg":
        egg = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
        return egg.apply_scale([2 * width, 3 * width, length])
    if kind == "block":
        return trimesh.creation.box((width, 3 * width, length))
    if kind == "rod":
        return trimesh.creation.cylinder(width, length, sections=12)
    if kind == "ring":
        return trimesh.creation.annulus(width, 2 * width, length / 2, sections=16)
    if kind == "pair":
        ends = [trimesh.creation.icosphere(subdivisions=1, radius=length / 5) for _ in range(2)]
        for end, z in zip(ends, (-0.3 * length, 0.3 * length), strict=True):
            end.apply_translation([0, 0, z])
        return trimesh.util.concatenate(ends)
    # An angle of two arms, not convex.
    t, w, h = width / 2, 2 * width, length / 2
    outline = np.array([[-w, -h], [w, -h], [w, -h + t], [-w + t, -h + t], [-w + t, h], [-w, h]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    angle = trimesh.creation.extrude_triangulation(outline, faces, height=width)
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0])
    return angle.apply_transform(turn)


def made_scene(
    folder: Path, rng: np.random.Generator, around: tuple[float, float, float], reach: float
) -> Path:
    """Writes a scene of some solids about a place, in metres, within reach."""
    made_mesh(rng, 0.08 * reach, 0.4 * reach).export(folder / "rock.ply")
    shapes = {"box": [0.1, 0.3, 0.2], "cylinder": [0.05, 0.5], "capsule": [0.06, 0.4]}
    sized = {kind: [round(reach * size, 4) for size in sizes] for kind, sizes in shapes.items()}
    solids = [*sized.items(), ("sphere", round(0.12 * reach, 4)), ("mesh", "rock.ply")]
    entries = []
    for n in rng.integers(len(solids), size=rng.integers(2, 9)):
        way = rng.normal(size=3)
        place = around + reach * rng.uniform(0.35, 0.8) * way / np.linalg.norm(way)
        where = f"position: {place.round(4).tolist()}, rpy: {rng.uniform(-3, 3, 3).tolist()}"
        entries.append(f"  - {{{solids[n][0]}: {solids[n][1]}, {where}}}")
    (folder / "scene.yaml").write_text("obstacles:\n" + "\n".join(entries))
    return folder / "scene.yaml"


def made_body_world(folder: Path, seed: int) -> str:
    """Writes what a rigid body and its world need into a folder; returns the environment's text."""
    rng = np.random.default_rng(seed)
    space, body = rng.choice(_SPACES), str(rng.choice(_BODIES))
    if body == "mesh":
        body = str(folder / "body.stl")
        made_mesh(rng, 0.3, 2.0).export(body)
    world = f"c3d,scene={seed}"
    if rng.random() < 0.5:
        world = f"mesh,kind=solid,scale=1,file={folder / 'rocks.ply'}"
        rocks = []
        for _ in range(12):
            rock = made_mesh(rng, rng.uniform(0.5, 1.5), rng.uniform(2, 8))
            rock.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
            rocks.append(rock.apply_translation(rng.uniform(-8, 8, 3)))
        # Those that others overlap are not rocks of one surface each.
        trimesh.util.concatenate(_apart(rocks)).export(folder / "rocks.ply")
    return f"rigid:space={space},body={body},size={rng.uniform(1.5, 3):.3f},world={world}"


def _apart(rocks: list[trimesh.Trimesh]) -> list[trimesh.Trimesh]:
    """Of some meshes, those whose bounding boxes overlap no earlier one's."""
    kept: list[trimesh.Trimesh] = []
    for rock in rocks:
        low, high = rock.bounds
        if all((low > o.bounds[1]).any() or (high < o.bounds[0]).any() for o in kept):
            kept.append(rock)
    return kept
