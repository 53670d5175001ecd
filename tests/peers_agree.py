"""Asks another program's planner, in its own interpreter, which configurations are in collision.

Run as a file there: PYTHON peers_agree.py NAME FILE OURS PSUTIL, of which the last two are the
folders that hold our packages and psutil. FILE is what NumPy's `savez` writes: `data` and `numbers`
of a scene as `PlainScene.packed` gives them, and configurations `q` (n, d). Prints a 0 or 1 for
each.
"""

from __future__ import annotations

import json
import runpy
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np


def main(name: str, file: str, ours: str, psutil: str) -> None:
    """Prints the answers."""
    guest = runpy.run_path(str(Path(ours) / "bench" / "execution" / "guest.py"))
    sys.meta_path.insert(0, guest["Lent"](ours, "bench", "envs", "planners"))
    sys.meta_path.append(guest["Lent"](psutil, "psutil"))
    import planners
    from envs.plain_scene import PlainScene

    said = np.load(file)
    scene = PlainScene.of(json.loads(str(said["data"])), said["numbers"])
    planner: Any = planners.make(name)
    planner.setup(scene, seed=1)
    collides = _MODELS[name](planner)
    print("".join(str(int(collides(q))) for q in said["q"]))


def _in_mplib(planner: Any) -> Callable[[Any], bool]:
    def collides(q: Any) -> bool:
        planner._world.set_qpos_all(q[planner._order])
        return bool(planner._world.is_state_colliding())

    return collides


def _in_roboplan(planner: Any) -> Callable[[Any], bool]:
    scene = planner._scene
    return lambda q: bool(scene.hasCollisions(scene.toFullJointPositions("planned", q)))


_MODELS = {"mplib": _in_mplib, "roboplan": _in_roboplan}

if __name__ == "__main__":
    main(*sys.argv[1:])
