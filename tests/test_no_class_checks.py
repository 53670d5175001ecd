"""General code asks environments and robots; it does not look at what they are."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import bench
import envs
import planners

OF_WORLDS = ("envs.scenes.arm_world", "envs.scenes.point_world", "envs.robots.point")
"""Modules of kinds of environments and robots, which general code has no use for."""

ROBOTS = {"Robot", "Arm", "PointRobot"}


def files_of(package: object) -> list[Path]:
    return sorted(Path(package.__file__).parent.rglob("*.py"))  # type: ignore[attr-defined]


def environments() -> set[str]:
    """The names of the classes in `envs` that are environments, by what they are derived from."""
    bases = {
        node.name: {name for base in node.bases for name in names_in(base)}
        for file in files_of(envs)
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef)
    }
    found = {"Environment"}
    while more := {name for name, of in bases.items() if of & found} - found:
        found |= more
    return found


def names_in(tree: ast.AST) -> set[str]:
    """Names and attributes in an expression."""
    nodes = list(ast.walk(tree))
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    return attributes | {node.id for node in nodes if isinstance(node, ast.Name)}


def class_checks(source: str, classes: set[str]) -> list[int]:
    """Lines that ask of which kind an environment or a robot is, or import a kind of them."""
    return [node.lineno for node in ast.walk(ast.parse(source)) if asks(node, classes)]  # type: ignore[attr-defined]


def asks(node: ast.AST, classes: set[str]) -> bool:
    """Whether it is `isinstance(x, SomeWorld)`, `type(env)`, `hasattr(robot, name)` or such."""
    match node:
        case ast.Call(func=ast.Name("isinstance" | "issubclass"), args=[_, kinds]):
            return bool(names_in(kinds) & classes)
        case ast.Call(func=ast.Name("type" | "hasattr" | "getattr"), args=[subject, *_]):
            return bool(names_in(subject) & {"env", "world", "robot"})
        case ast.MatchClass(cls=kind):
            return bool(names_in(kind) & classes)
        case ast.ImportFrom(module=module, names=names):
            return module in OF_WORLDS or bool({alias.name for alias in names} & ROBOTS)
    return False


@pytest.mark.parametrize("package", [bench, planners])
def test_nothing_looks_at_the_class_of_an_environment_or_a_robot(package: object) -> None:
    classes = environments() | ROBOTS
    assert {"ArmWorld", "PointWorld", "MeshWorld", "Cluttered3D"} < classes
    found = [
        f"{file}:{line}"
        for file in files_of(package)
        for line in class_checks(file.read_text(encoding="utf-8"), classes)
    ]
    assert not found


@pytest.mark.parametrize(
    "source",
    [
        "isinstance(env, ArmWorld)",
        "isinstance(env, (int, scenes.ArmWorld))",
        "issubclass(cls, int | ArmWorld)",
        "match env:\n    case ArmWorld():\n        pass",
        "type(world) is kind",
        "type(self.env)",
        "hasattr(env.robot, 'chain')",
        "getattr(world, 'scene', None)",
        "from envs.scenes.arm_world import anything",
        "from envs.robots.arm import Arm",
    ],
)
def test_each_way_to_look_is_seen(source: str) -> None:
    assert class_checks(source, {"ArmWorld"})


@pytest.mark.parametrize(
    "source", ["isinstance(env, int)", "env.is_point_robot", "from envs import Environment"]
)
def test_other_code_is_let_pass(source: str) -> None:
    assert not class_checks(source, {"ArmWorld"})
