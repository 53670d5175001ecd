"""Pictures of an environment and of paths in it."""

from __future__ import annotations

from pathlib import Path

from bench.report import plane_scene, point_scene, robot_scene
from bench.report.chosen_paths import Shown
from envs import Environment


def draw(env: Environment, name: str, shown: Shown | None, file: Path) -> None:
    """Draws an environment, and paths in it if there are any, into an image file: of a point robot
    all paths in one picture, in the plane as a map, of others the robot along each in a panel of
    its own. `name` is that
    of the environment.

    Raises:
        InputError: the file cannot be written as an image.
    """
    if not env.is_point_robot:
        robot_scene.draw(env, name, shown, file)
    elif env.space.size == 2:
        plane_scene.draw(env, name, shown, file)
    else:
        point_scene.draw(env, name, shown, file)
