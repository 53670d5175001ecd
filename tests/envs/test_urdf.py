"""Arms from URDF files: their kinematics against Pinocchio's, their solids, what is refused."""

from __future__ import annotations

import logging
import math
from pathlib import Path

import numpy as np
import pinocchio
import pytest
import trimesh
from bad_meshes import BAD
from bad_urdfs import BAD_URDFS, LIMIT, collision, joint, link, robot, with_shape

from envs import InputError
from envs.collision.shapes import Box, Cylinder, Mesh, Sphere
from envs.robots.kinematic_tree import KinematicTree
from envs.robots.urdf import read_urdf


def written(folder: Path, text: str) -> Path:
    file = folder / "arm.urdf"
    file.write_text(text)
    return file


def random_arm(rng: np.random.Generator) -> str:
    """1 to 7 joints that move and fixed ones between them, beside them and at both ends."""
    moving = int(rng.integers(1, 8))
    types = [str(rng.choice(["revolute", "continuous", "prismatic"])) for _ in range(moving)]
    for _ in range(rng.integers(0, 5)):
        types.insert(int(rng.integers(0, len(types) + 1)), "fixed")
    elements = [link("l0")]
    for i, type in enumerate(types):
        elements.append(link(f"l{i + 1}"))
        elements.append(
            joint(f"j{i}", f"l{i}", f"l{i + 1}", type, _origin(rng) + LIMIT, _axis(rng))
        )
        if rng.random() < 0.3:
            elements += [link(f"tool{i}", ""), link(f"tip{i}", "")]
            elements.append(joint(f"held{i}", f"l{i + 1}", f"tool{i}", "fixed", _origin(rng)))
            elements.append(joint(f"end{i}", f"tool{i}", f"tip{i}", "fixed", _origin(rng)))
    rng.shuffle(elements)
    return robot(*elements)


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(v)) for v in values)


def _origin(rng: np.random.Generator) -> str:
    """Also with only one of its halves, or none."""
    xyz = f'xyz="{_numbers(rng.uniform(-1, 1, 3))}"' if rng.random() < 0.9 else ""
    rpy = f'rpy="{_numbers(rng.uniform(-4, 4, 3))}"' if rng.random() < 0.9 else ""
    return f"<origin {xyz} {rpy}/>" if rng.random() < 0.9 else ""


def _axis(rng: np.random.Generator) -> str:
    """Any, or one of the frame's, or the default."""
    if rng.random() < 0.6:
        return _numbers(rng.normal(size=3))
    return str(rng.choice(["1 0 0", "0 1 0", "0 0 1", "0 0 -1", ""]))


def reference(text: str, chain: KinematicTree, q: np.ndarray) -> np.ndarray:
    """Poses (n, links, 4, 4) of a chain's links by Pinocchio."""
    model = pinocchio.buildModelFromXML(text)
    data = model.createData()
    frames = [model.getFrameId(one.name, pinocchio.FrameType.BODY) for one in chain.links]
    places = [model.joints[model.getJointId(one.name)] for one in chain.joints]
    poses = []
    for values in q:
        there = pinocchio.neutral(model)
        for place, value in zip(places, values, strict=True):
            at = [value] if place.nq == 1 else [math.cos(value), math.sin(value)]
            there[place.idx_q : place.idx_q + place.nq] = at
        pinocchio.framesForwardKinematics(model, data, there)
        poses.append([data.oMf[frame].homogeneous for frame in frames])
    return np.array(poses)


@pytest.mark.parametrize("seed", range(40))
def test_forward_kinematics_agree_with_pinocchio(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    text = random_arm(rng)
    chain, parts = read_urdf(written(tmp_path, text))
    assert len(chain.links) == text.count("<link name")
    assert len(parts) == text.count("<collision>")
    q = rng.uniform(-3, 3, (20, chain.dimension))
    expected = reference(text, chain, q)
    assert np.abs(chain.forward(q) - expected).max() < 1e-9


def test_limits_and_axes(tmp_path: Path) -> None:
    names = "abcde"
    types = ["revolute", "continuous", "prismatic", "revolute"]
    limits = [LIMIT, LIMIT, LIMIT, '<limit upper="1"/>']
    text = robot(
        *(link(name) for name in names),
        *(
            joint(f"j{i}", names[i], names[i + 1], type, limits[i], "0 0 -5")
            for i, type in enumerate(types)
        ),
    )
    chain, _ = read_urdf(written(tmp_path, text))
    assert [(one.lower, one.upper) for one in chain.joints] == [
        (-2, 1.5),
        (-math.pi, math.pi),
        (-2, 1.5),
        (0, 1),
    ]
    assert [one.prismatic for one in chain.joints] == [False, False, True, False]
    assert all(one.axis.tolist() == [0, 0, -1] for one in chain.joints)


def test_links_and_solids_are_put_where_they_belong(tmp_path: Path) -> None:
    quarter = math.pi / 2
    shapes = collision('<box size="1 2 3"/>', '<origin xyz="0 0 1"/>')
    shapes += collision('<cylinder radius="0.2" length="0.7"/>', f'<origin rpy="0 {quarter} 0"/>')
    seen = '<visual><geometry><sphere radius="9"/></geometry></visual>'
    text = robot(
        joint("wrist", "plate", "hand", "prismatic", LIMIT, "0 0 1"),
        link("hand", seen + collision('<sphere radius="0.3"/>')),
        link("base"),
        link("plate", shapes),
        link("camera", ""),
        link("arm", ""),
        joint("eye", "arm", "camera", "fixed", '<origin xyz="9 0 0"/>'),
        joint("plated", "arm", "plate", "fixed", f'<origin xyz="1 0 0" rpy="0 0 {quarter}"/>'),
        joint("shoulder", "base", "arm", "continuous", '<origin xyz="0 0 5"/>', "0 0 1"),
    )
    chain, parts = read_urdf(written(tmp_path, text))
    named = [(one.name, one.body) for one in chain.links]
    assert named == [("base", 0), ("arm", 1), ("camera", 1), ("plate", 1), ("hand", 2)]
    assert [one.name for one in chain.joints] == ["shoulder", "wrist"]
    base, box, cylinder, ball = parts
    assert [part.body for part in parts] == [0, 1, 1, 2]
    assert base.placed.solid == Sphere(0.1)
    assert isinstance(box.placed.solid, Box)
    assert box.placed.solid.sides.tolist() == [1, 2, 3]
    assert box.placed.solid.center.tolist() == [0, 0, 0]
    turned = np.array([[0, -1, 0, 1], [1, 0, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1]])
    assert box.placed.pose == pytest.approx(turned, abs=1e-12)
    assert cylinder.placed.solid == Cylinder(0.2, 0.7)
    # The plate is turned about z and the cylinder's axis points along its x: the arm's y.
    lying = np.array([[0, -1, 0, 1], [0, 0, 1, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    assert cylinder.placed.pose == pytest.approx(lying, abs=1e-12)
    assert ball.placed.solid == Sphere(0.3)
    assert (ball.placed.pose == np.eye(4)).all()
    hand = chain.forward(np.array([[quarter, 0.5]]))[0, 4]
    assert hand[:3, 3] == pytest.approx([0, 1, 5.5], abs=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        "meshes/part.stl",
        "package://my_arm/meshes/part.stl",
        "package://elsewhere/meshes/part.stl",
        "file://meshes/part.stl",
        "file:///meshes/part.stl",
        "file://ROOT/my_arm/urdf/meshes/part.stl",
    ],
)
def test_meshes_are_found_and_scaled(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "my_arm" / "urdf"
    meshes = folder if "package" not in name else folder.parent
    (meshes / "meshes").mkdir(parents=True)
    folder.mkdir(exist_ok=True)
    trimesh.creation.box((1.0, 2.0, 3.0)).export(meshes / "meshes" / "part.stl")
    shape = f'<mesh filename="{name.replace("ROOT", str(tmp_path))}" scale="0.1 1 -2"/>'
    _, parts = read_urdf(written(folder, with_shape(shape)))
    solid = parts[1].placed.solid
    assert isinstance(solid, Mesh)
    assert np.ptp(solid.vertices, axis=0) == pytest.approx([0.1, 2, 6])


@pytest.mark.parametrize("scale, factor", [("", 1), ('scale="0.001"', 0.001)])
def test_meshes_have_one_scale_or_none(scale: str, factor: float, tmp_path: Path) -> None:
    trimesh.creation.box((1.0, 2.0, 3.0)).export(tmp_path / "part.obj")
    _, parts = read_urdf(written(tmp_path, with_shape(f'<mesh filename="part.obj" {scale}/>')))
    solid = parts[1].placed.solid
    assert isinstance(solid, Mesh)
    assert np.ptp(solid.vertices, axis=0) == pytest.approx(np.array([1, 2, 3]) * factor)


def refusal(file: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_urdf(file)
    said = str(caught.value)
    assert "\n" not in said
    assert said.startswith(f"{file}: ")
    return said


@pytest.mark.parametrize("name", BAD_URDFS)
def test_bad_files_are_refused_in_one_line(
    name: str,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    text, said = BAD_URDFS[name]
    trimesh.creation.box().export(tmp_path / "cube.stl")
    with caplog.at_level(logging.ERROR):
        assert said in refusal(written(tmp_path, text))
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes_are_refused_in_one_line(name: str, tmp_path: Path) -> None:
    content, said = BAD[name]
    (tmp_path / name).write_bytes(content)
    message = refusal(written(tmp_path, with_shape(f'<mesh filename="{name}"/>')))
    assert said in message
    assert name in message


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    assert "no such file" in refusal(tmp_path / "arm.urdf")
    assert "no such file" in refusal(tmp_path)
