"""Arrays and texts small enough to travel inside a page; `assets/unpack.js` undoes it."""

from __future__ import annotations

import base64
import gzip
from typing import Any

import numpy as np

from envs.problem import Array

_TYPES = (("Int16Array", "<i2", 2**15 - 1), ("Int32Array", "<i4", 2**31 - 1))
"""JavaScript's names of the types, ours, and the largest numbers they hold; the smallest first."""


def packed(values: Array, step: float) -> dict[str, Any]:
    """Numbers of any shape, flattened and rounded to multiples of `step`, as JSON data.

    Raises:
        ValueError: a number is not finite, or too many steps away from 0 for 32 bits.
    """
    whole = np.rint(np.asarray(values, dtype=np.float64) / step)
    for name, kind, largest in _TYPES:
        # Not a number fits nowhere.
        if whole.size == 0 or np.abs(whole).max() <= largest:
            data = base64.b64encode(whole.astype(kind).tobytes()).decode("ascii")
            return {"type": name, "step": step, "data": data}
    raise ValueError(f"some numbers are not finite, or too large for steps of {step:g}")


def compressed(text: str) -> str:
    """A text as the base64 of its gzip, the same whenever it is made."""
    return base64.b64encode(gzip.compress(text.encode("utf-8"), 9, mtime=0)).decode("ascii")
