"""Generated houses, scanned with flaws: what stands in for Gibson where it is not at hand."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from envs.errors import InputError
from envs.scenes.floor_plan import Plan, make_plan
from envs.scenes.mesh_file import FileMesh
from envs.scenes.mesh_world import MeshWorld
from envs.scenes.scan import scanned


class GeneratedHouse(MeshWorld):
    """A sphere-shaped robot within a furnished house.

    Problems have both ends more than 1.0 from every surface, in the 20-unit scale, inside the
    house and in one component of free space.

    Args:
        scene: the seed, >= 0; even ones have one level, odd ones two.
        robot_radius: in metres; 0 for `mesh_world.DEFAULT_RADIUS`.

    Raises:
        InputError: an argument is out of range.
    """

    min_clearance = 1.0
    kind_of_problems = "house"

    def __init__(self, scene: int = 0, robot_radius: float = 0.0) -> None:
        if not 0 <= scene < 2**32:
            raise InputError(f"gibson-generated: scene must be between 0 and 2^32 - 1, not {scene}")
        self.scene = scene
        self.plan, scan = _house(scene)
        name = f"gibson-generated, scene {scene}"
        self._build(scan, "interior", robot_radius, 0.0, name)

    @property
    def scene_seeds(self) -> tuple[int, ...]:
        return (self.scene,)

    def definition(self) -> dict[str, Any]:
        return {**super().definition(), "class": "GeneratedHouse"}


@lru_cache(maxsize=2)
def _house(scene: int) -> tuple[Plan, FileMesh]:
    plan = make_plan(scene)
    return plan, scanned(plan, scene)
