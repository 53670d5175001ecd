"""Maps as ROS has them: a YAML file that names an image, which `map_server` and `nav2_map_server`
read and `map_saver` writes.

    image: map.pgm
    resolution: 0.05
    origin: [-10.0, -10.0, 0.0]
    negate: 0
    occupied_thresh: 0.65
    free_thresh: 0.196
    mode: trinary
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from envs.errors import InputError, brief, reason, suggestion
from envs.files.map_formats import image
from envs.files.map_formats.cells import Cells, Thresholds, upright
from envs.files.paths import exists, safe_join
from envs.problem import Array

MODES = ("trinary", "scale", "raw")

_NEEDED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")

_MOST_BYTES = 2**16

_FARTHEST = 1e6
"""Of an origin, in metres."""


def read(file: Path, unknown: str) -> Cells:
    """Reads a YAML file and the image that it names, in its folder or the one above.

    The x and y of the origin are those of the lower left corner. Its yaw is left out, and said:
    positions are along the sides of the image. Cells that are neither surely occupied nor surely
    free count as `unknown` says, also in the modes `scale` and `raw`, which tell more of them.

    Raises:
        InputError: a value is missing or out of range, or the image cannot be used.
    """
    values = _values(file)
    resolution = _number(values, "resolution", file)
    if not 0 < resolution <= _FARTHEST:
        raise InputError(f"{file}: resolution must be above 0, in metres, not {resolution:g}")
    x, y, yaw = _origin(values["origin"], file)
    picture = safe_join(file.parent, _text(values, "image", file))
    if not exists(picture.is_file):
        raise InputError(f"{file}: its image {picture} does not exist")
    try:
        thresholds = Thresholds(
            _number(values, "occupied_thresh", file), _number(values, "free_thresh", file)
        )
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    chances = _chances(picture, values, file)
    occupied, share = thresholds.occupancy(chances, unknown)
    turned = f"its yaw of {yaw:g} is left out: positions are along the sides of the image"
    return Cells(
        upright(occupied),
        resolution,
        np.array([x, y]),
        unknown=share,
        notes=(turned,) if yaw else (),
    )


def _values(file: Path) -> Mapping[str, Any]:
    if file.stat().st_size > _MOST_BYTES:
        raise InputError(f"{file} has more than {_MOST_BYTES} bytes, which no map's YAML needs")
    try:
        values = yaml.safe_load(file.read_bytes())
    except (yaml.YAMLError, ValueError, RecursionError, AttributeError) as error:
        raise InputError(f"cannot read {file}: {reason(error)}") from error
    if not isinstance(values, Mapping):
        raise InputError(f"{file}: not a map of ROS, which says {', '.join(_NEEDED)}")
    for key in _NEEDED:
        if key not in values:
            others = [str(name) for name in values if name not in _NEEDED]
            near = f"; it has {', '.join(map(repr, others[:5]))}" if others else ""
            raise InputError(f"{file}: a map of ROS needs {key!r}{near}")
    return values


def _chances(picture: Path, values: Mapping[str, Any], file: Path) -> Array:
    """The probabilities that pixels are occupied."""
    mode = values.get("mode", MODES[0])
    if mode not in MODES:
        raise InputError(f"{file}: no mode is called {brief(mode)}; {suggestion(mode, MODES)}")
    negate = values["negate"]
    if not (isinstance(negate, int) and negate in (0, 1)):
        raise InputError(f"{file}: negate must be 0 or 1, not {brief(negate)}")
    if mode != "raw":
        return image.darkness(picture, bool(negate))
    percent = np.rint(255 * image.darkness(picture, not negate))
    return np.where(percent <= 100, percent / 100, np.nan)


def _origin(value: object, file: Path) -> tuple[float, float, float]:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 3:
        raise InputError(f"{file}: origin must be [x, y, yaw], not {brief(value)}")
    x, y, yaw = (_finite(number, "origin", file) for number in value)
    if max(abs(x), abs(y)) > _FARTHEST:
        raise InputError(f"{file}: origin must be within {_FARTHEST:g} metres of 0")
    return x, y, yaw


def _number(values: Mapping[str, Any], key: str, file: Path) -> float:
    return _finite(values[key], key, file)


def _finite(value: object, key: str, file: Path) -> float:
    number = math.nan
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        with suppress(ValueError, OverflowError):
            number = float(value)  # of 5e-2, too, which PyYAML takes for text
    if not math.isfinite(number):
        raise InputError(f"{file}: {key} must be a finite number, not {brief(value)}")
    return number


def _text(values: Mapping[str, Any], key: str, file: Path) -> str:
    value = values[key]
    if not isinstance(value, str) or not value or "\0" in value:
        raise InputError(f"{file}: {key} must be the name of a file, not {brief(value)}")
    return value
