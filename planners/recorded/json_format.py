"""Paths as JSON.

    {"environment": "7e7d5e2ec55fe2d0", "seed": 0, "paths": [
      {"problem": 0, "solve_s": 0.012, "waypoints": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]},
      {"problem": 1, "status": "TIMEOUT"}]}

All but `paths` may be left out. A list of waypoints alone is one path.
"""

from __future__ import annotations

import json
from typing import Any

from envs.errors import brief
from envs.files.json_text import parsed_json
from planners.base import Status
from planners.recorded.path_file import OF_FILES, PathFile, Raw, RecordedPath, decoded


def parse(data: bytes) -> tuple[dict[str, Any], list[Raw]]:
    """What a file says of all paths, and each path.

    Raises:
        ValueError: it is malformed.
    """
    said = parsed_json(decoded(data))
    if isinstance(said, list):
        return {}, [Raw("the path", {"waypoints": said})]
    if not isinstance(said, dict) or "paths" not in said:
        known = ", ".join(("paths", *OF_FILES))
        raise ValueError(f"it is a list of waypoints, or an object with {known}")
    paths = said.pop("paths")
    if not isinstance(paths, list):
        raise ValueError(f"paths is a list, not {brief(paths)}")
    return said, [_raw(number, path) for number, path in enumerate(paths)]


def serialised(paths: PathFile) -> bytes:
    """A file with these paths."""
    of_file = {"environment": paths.environment or None, "seed": paths.seed}
    lines = ",\n".join(f"  {json.dumps(_said(path))}" for path in paths.paths)
    head = "".join(f'"{k}": {json.dumps(v)}, ' for k, v in of_file.items() if v is not None)
    return f'{{{head}"paths": [\n{lines}\n]}}\n'.encode()


def _said(path: RecordedPath) -> dict[str, Any]:
    said = {
        "problem": path.problem,
        "solve_s": path.solve_s,
        "status": path.status.value if path.status is not Status.EXACT_SOLUTION else None,
        "failure": path.failure or None,
        "waypoints": None if path.waypoints is None else path.waypoints.tolist(),
    }
    if path.waypoints is None:
        said["status"] = path.status.value
    return {name: value for name, value in said.items() if value is not None}


def _raw(number: int, path: Any) -> Raw:
    place = f"paths[{number}]"
    if not isinstance(path, dict):
        raise ValueError(f"{place} is an object, not {brief(path)}")
    return Raw(place, path)
