"""The arms that ship, on cluttered tables, and users' own arms and scenes."""

from __future__ import annotations

from pathlib import Path

from envs.errors import InputError
from envs.robots.arm import Arm
from envs.robots.urdf import read_urdf
from envs.scenes.arm_world import ArmWorld
from envs.scenes.scene_file import read_scene
from envs.scenes.tabletop import tabletop

_MODELS = Path(__file__).parents[1] / "robots" / "models"


class ShippedArm(ArmWorld):
    """One of the arms that ship, at a table with shelves, posts and boxes. At least 60 % of the
    straight lines between the ends of its problems are blocked.

    Args:
        model: "arm4", "arm5" or "arm6".
        scene: the seed of what stands on the table, >= 0.
        self_collision: whether links must not touch each other; the paper ignores that.

    Raises:
        InputError: an argument is out of range.
    """

    most_free_of_five = 2

    def __init__(self, model: str, scene: int = 0, self_collision: bool = False) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"{model}: scene must be between 0 and 2^32 - 1, not {scene}")
        chain, parts = read_urdf(_MODELS / f"{model}.urdf")
        super().__init__(Arm(chain, parts, self_collision), tabletop(scene), model, (scene,))


class UserArm(ArmWorld):
    """An arm from a URDF file among the solids of a scene file.

    Args:
        urdf: a serial arm, see `envs.robots.urdf.read_urdf`.
        scene: a YAML file, see `envs.scenes.scene_file.read_scene`; without one, nothing is about.
        self_collision: whether links that are not neighbours must not touch each other.

    Raises:
        InputError: a file cannot be used.
    """

    def __init__(self, urdf: str = "", scene: str = "", self_collision: bool = True) -> None:
        if not urdf:
            raise InputError("arm: urdf=FILE is needed, and scene=FILE.yaml with the obstacles")
        chain, parts = read_urdf(Path(urdf))
        obstacles = read_scene(Path(scene)) if scene else []
        super().__init__(Arm(chain, parts, self_collision), obstacles, "arm")
