"""YAML that others have written: parsed, and what it holds checked as it is taken."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from envs.collision.shapes import LARGEST
from envs.errors import InputError, brief
from envs.problem import Array

_ODD_SCALARS = (
    *(ValueError, TypeError, AttributeError, LookupError),
    *(ArithmeticError, RecursionError),
)
"""What PyYAML raises besides its own, on scalars that are not what their tags say and on depth."""

_MERGE = "tag:yaml.org,2002:merge"

_NO_TURN = 1e-6
"""Of a quaternion's length: one that is shorter says nothing."""


class _Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
    """libyaml's, where PyYAML has it, which takes a tenth of the time. Takes 1e-3 for a number,
    which in YAML 1.1 needs a point, and refuses what says less, or more, than it seems to: a key
    given twice, of which YAML's own loader drops the first in silence, and merged mappings (<<), a
    few lines of which can stand for more entries than memory holds."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        where = f"in the mapping at line {node.start_mark.line + 1}"
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise InputError(f"{key.value!r} is given twice {where}")
            if key.tag == _MERGE:
                raise InputError(f"'<<' {where} is not supported; write the keys out")
            seen.add(key.value)
        return super().construct_mapping(node, deep)


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\d+|\d*\.\d+|\d+\.)[eE][-+]?\d+$"),
    [*"-+.0123456789"],
)


def parsed_yaml(text: bytes) -> Any:
    """What YAML stands for, of one document. The line that ends one, which ROS prints after each
    message, may be there.

    Raises:
        InputError: it is none, or gives a key twice, or merges mappings.
    """
    try:
        return yaml.load(text.rstrip().removesuffix(b"\n---"), _Loader)
    except InputError:
        raise
    except (yaml.YAMLError, *_ODD_SCALARS) as error:
        raise InputError(f"not YAML, mend it: {' '.join(str(error).split())}") from error


def mapping_of(value: Any, what: str) -> Mapping[Any, Any]:
    """A value that must be a mapping; `what` it is, for messages."""
    if not isinstance(value, Mapping):
        raise InputError(f"{what} must be a mapping, not {brief(value)}")
    return value


def list_of(value: Any, what: str) -> Sequence[Any]:
    """A value that must be a list."""
    if not isinstance(value, list):
        raise InputError(f"{what} must be a list, not {brief(value)}")
    return value


def name_of(value: Any) -> str:
    """Text, of what stands where a name should and may be anything that YAML has."""
    return value if isinstance(value, str) else brief(value)


def number_of(value: Any, what: str) -> float:
    """A value that must be a finite number of at most `LARGEST`."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST:
        raise InputError(f"{what} must be a number of at most {LARGEST:g}, not {brief(value)}")
    return float(value)


def numbers_of(values: Any, count: int, what: str) -> Array:
    """A value that must be a list of so many numbers, (count,)."""
    numbers = [number_of(value, what) for value in list_of(values, what)]
    if len(numbers) != count:
        raise InputError(f"{what} must be {count} numbers, not {len(numbers)}")
    return np.array(numbers)


def rotation_of(quaternion: Array, what: str) -> Array:
    """The rotation (3, 3) of a quaternion x, y, z, w (4,) of any length but 0."""
    if not np.linalg.norm(quaternion) > _NO_TURN:
        raise InputError(f"{what} is a quaternion, and not 0")
    turn: Array = Rotation.from_quat(quaternion).as_matrix()
    return turn
