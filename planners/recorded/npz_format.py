"""Paths as NumPy's arrays in a file, by their names.

`waypoints` (n, d) are those of all paths below each other, and `lengths` (m,) how many each path
has, 0 without a path; without `lengths` they are one path. `problem` (m,), -1 where it is not said,
`solve_s` (m,), NaN where nothing is claimed, `status` (m,) and `failure` (m,), "" where nothing is
said, `environment` () and `seed` () may be left out.
"""

from __future__ import annotations

import io
import math
import zipfile
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.errors import reason, suggestion
from planners.recorded.path_file import MOST_BYTES, OF_FILES, OF_PATHS, PathFile, Raw

_KNOWN = ("waypoints", "lengths", *OF_PATHS, *OF_FILES)
_KINDS = {
    "waypoints": "iuf",
    "lengths": "iu",
    "problem": "iu",
    "solve_s": "iuf",
    "status": "U",
    "failure": "U",
    "environment": "U",
    "seed": "iu",
}
_AXES = {"waypoints": 2, "environment": 0, "seed": 0}
"""Of arrays that have not one."""

_BROKEN = (ValueError, OSError, EOFError, KeyError, NotImplementedError, RuntimeError, SyntaxError)
_NO_PROBLEM = -1


def parse(data: bytes) -> tuple[dict[str, Any], list[Raw]]:
    """What a file says of all paths, and each path.

    Raises:
        ValueError: it is malformed.
    """
    arrays = _arrays(data)
    if "waypoints" not in arrays:
        raise ValueError("it has no array waypoints")
    alone = "lengths" not in arrays
    lengths = arrays.pop("lengths", np.array([len(arrays["waypoints"])]))
    of_file = {name: arrays.pop(name).item() for name in OF_FILES if name in arrays}
    waypoints = arrays.pop("waypoints")
    if (lengths < 0).any() or int(sum(map(int, lengths))) != len(waypoints):
        raise ValueError(f"lengths do not add up to the {len(waypoints)} rows of waypoints")
    for name, array in arrays.items():
        if len(array) != len(lengths):
            raise ValueError(f"{name} has {len(array)} entries for {len(lengths)} paths")
    ends = np.cumsum(lengths)
    found = []
    for number, (end, length) in enumerate(zip(ends, lengths, strict=True)):
        said = {name: _unsaid(name, array[number].item()) for name, array in arrays.items()}
        if length or alone:
            said["waypoints"] = waypoints[end - length : end]
        found.append(Raw(f"path {number}", said))
    return of_file, found


def serialised(paths: PathFile) -> bytes:
    """A file with these paths."""
    given = [path.waypoints for path in paths.paths if path.waypoints is not None]
    arrays: dict[str, Any] = {
        "waypoints": np.concatenate(given) if given else np.zeros((0, 1)),
        "lengths": [0 if p.waypoints is None else len(p.waypoints) for p in paths.paths],
        "problem": [_NO_PROBLEM if p.problem is None else p.problem for p in paths.paths],
        "solve_s": [np.nan if p.solve_s is None else p.solve_s for p in paths.paths],
        "status": [path.status.value for path in paths.paths],
        "failure": [path.failure for path in paths.paths],
    }
    if paths.environment:
        arrays["environment"] = paths.environment
    if paths.seed is not None:
        arrays["seed"] = paths.seed
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def _arrays(data: bytes) -> dict[str, NDArray[Any]]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            size = sum(entry.file_size for entry in archive.infolist())
        if size > MOST_BYTES:
            raise ValueError(f"it unpacks to {size} bytes; {MOST_BYTES} are the most")
        with np.load(io.BytesIO(data), allow_pickle=False) as loaded:
            arrays = {name: np.asarray(loaded[name]) for name in loaded.files}
    except (*_BROKEN, zipfile.BadZipFile, zlib.error, MemoryError) as error:
        raise ValueError(f"it is no file of NumPy's arrays: {reason(error)}") from None
    for name, array in arrays.items():
        if name not in _KNOWN:
            raise ValueError(f"unknown array {name!r}; {suggestion(name, _KNOWN)}")
        axes = _AXES.get(name, 1)
        if array.dtype.kind not in _KINDS[name] or array.ndim != axes:
            raise ValueError(f"{name} has shape {array.shape} and type {array.dtype}")
    return arrays


def _unsaid(name: str, value: Any) -> Any:
    """None for what stands where nothing is said."""
    if name == "problem" and value == _NO_PROBLEM:
        return None
    if name == "solve_s" and math.isnan(value):
        return None
    return None if value == "" else value
