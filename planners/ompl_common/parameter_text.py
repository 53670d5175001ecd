"""Reading the parameters of OMPL's planners from text.

OMPL itself reads text loosely: any word is true to it, "5abc" is 5, and a count of -1 is four
billion.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from envs.errors import InputError, suggestion

_FLAGS = {"true": "1", "1": "1", "false": "0", "0": "0"}


def flag(text: str) -> str | None:
    """1 for true or 1, 0 for false or 0; None for others."""
    return _FLAGS.get(text.lower())


def count(text: str) -> str | None:
    """A whole number of at least 0; None for others."""
    return text if re.fullmatch("[0-9]{1,9}", text) else None


def number(text: str) -> str | None:
    """A finite number of at least 0; None for others."""
    try:
        return text if 0 <= float(text) < math.inf else None
    except ValueError:
        return None


def unknown(algorithm: str, name: str, known: Sequence[str]) -> InputError:
    """Of a name that is none of those known."""
    near = suggestion(name, known)
    hint = f"; {near}" if near.startswith("did") else ""
    return InputError(f"{algorithm} has no parameter {name!r}{hint} ({', '.join(known)})")


def refused(algorithm: str, name: str, text: str) -> InputError:
    """Of a value that is not of its kind."""
    return InputError(f"{algorithm} refuses {name}={text}")
