"""Scenes of the Gibson data set, which its licence keeps with its users, and generated houses,
scanned with flaws, which stand in for them where they are not at hand.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

from envs.errors import InputError, suggestion
from envs.files.mesh_file import FileMesh, read_mesh
from envs.files.paths import exists
from envs.scenes.floor_plan import DOOR, NARROWEST, WIDEST, Plan, make_plan
from envs.scenes.mesh_world import MeshWorld
from envs.scenes.scan import scanned

_MESH = "mesh_z_up.obj"


class Gibson(MeshWorld):
    """A sphere-shaped robot within a scanned building.

    Free space is what the scan encloses; its holes are closed, see `cap_holes`. Problems have both
    ends more than 1.0 from every surface, in the 20-unit scale.

    Args:
        root: the data set's folder, with a folder for each scene.
        scene: its name, as in "Allensville".
        robot_radius: in metres; 0 for `mesh_world.DEFAULT_RADIUS`.

    Raises:
        InputError: there is no such scene, or an argument is out of range.
    """

    min_clearance = 1.0
    kind_of_problems = "gibson"

    def __init__(self, root: str, scene: str = "", robot_radius: float = 0.0) -> None:
        folder = Path(root)
        if not exists(folder.is_dir):
            raise InputError(f"gibson: no such folder: {root}")
        scenes = sorted(found.parent.name for found in folder.glob(f"*/{_MESH}"))
        if scene not in scenes:
            hint = suggestion(scene, scenes) if scenes else f"it holds no SCENE/{_MESH}"
            raise InputError(f"gibson: no scene {scene!r} in {root}; {hint}")
        read = read_mesh(folder / scene / _MESH)
        self._build(read, "interior", robot_radius, 0.0, f"gibson, {scene}")


class GeneratedHouse(MeshWorld):
    """A sphere-shaped robot within a furnished house.

    Problems have both ends more than 1.0 from every surface, in the 20-unit scale, inside the
    house and in one component of free space.

    Args:
        scene: the seed, >= 0; even ones have one level, odd ones two.
        robot_radius: in metres; 0 for `mesh_world.DEFAULT_RADIUS`.
        door: the width of doors in metres, to the nearest 0.12: the narrower, the harder.

    Raises:
        InputError: an argument is out of range.
    """

    min_clearance = 1.0
    kind_of_problems = "house"

    def __init__(self, scene: int = 0, robot_radius: float = 0.0, door: float = DOOR) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"gibson-generated: scene must be between 0 and 2^32 - 1, not {scene}")
        if not NARROWEST <= door <= WIDEST:
            raise InputError(
                f"gibson-generated: door must be from {NARROWEST:g} to {WIDEST:g} m wide, "
                f"not {door:g}"
            )
        self.scene = scene
        self.plan, scan = _house(scene, door)
        name = f"gibson-generated, scene {scene}"
        self._build(scan, "interior", robot_radius, 0.0, name)

    @property
    def scene_seeds(self) -> tuple[int, ...]:
        return (self.scene,)

    def definition(self) -> dict[str, Any]:
        return {**super().definition(), "class": "GeneratedHouse"}


@lru_cache(maxsize=2)
def _house(scene: int, door: float) -> tuple[Plan, FileMesh]:
    plan = make_plan(scene, door)
    return plan, scanned(plan, scene)
