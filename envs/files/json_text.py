"""JSON that others have written."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from envs.errors import brief


def parsed_json(text: str) -> Any:
    """What JSON stands for.

    Raises:
        ValueError: it is none, or gives a key twice.
    """
    try:
        return json.loads(text, object_pairs_hook=_once)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno}: it is no JSON: {error.msg}") from None


def _once(pairs: Sequence[tuple[str, Any]]) -> dict[str, Any]:
    """An object's content; of keys given twice Python's own reader drops the first in silence."""
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{brief(twice)} is given twice in an object")
    return found
