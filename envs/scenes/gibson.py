"""Scenes of the Gibson data set, which its licence keeps with its users."""

from __future__ import annotations

from pathlib import Path

from envs.errors import InputError, suggestion
from envs.presence import is_there
from envs.scenes.mesh_file import read_mesh
from envs.scenes.mesh_world import MeshWorld

_MESH = "mesh_z_up.obj"


class Gibson(MeshWorld):
    """A sphere-shaped robot within a scanned building.

    Free space is what the scan encloses; its holes are closed, see `lids`. Problems have both
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
        if not is_there(folder.is_dir):
            raise InputError(f"gibson: no such folder: {root}")
        scenes = sorted(found.parent.name for found in folder.glob(f"*/{_MESH}"))
        if scene not in scenes:
            hint = suggestion(scene, scenes) if scenes else f"it holds no SCENE/{_MESH}"
            raise InputError(f"gibson: no scene {scene!r} in {root}; {hint}")
        read = read_mesh(folder / scene / _MESH)
        self._build(read, "interior", robot_radius, 0.0, f"gibson, {scene}")
