"""The arrays of numbers in a glTF file."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from envs.scenes.mesh_formats.soup import MOST_FACES, UnreadableError

_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DATA = "data:"


class Accessors:
    """Reads accessors as the specification of glTF 2.0 has them (section 3.6), with strides,
    normalised integers and sparse values.

    Args:
        content: the file's description.
        binary: the numbers that come with it.
    """

    def __init__(self, content: dict[str, Any], binary: bytes) -> None:
        self._content, self._binary = content, binary

    def read(self, number: int) -> NDArray[Any]:
        """An accessor's values (n, columns); normalised integers as what they stand for.

        Raises:
            UnreadableError: it leaves its buffer, or has no values.
        """
        accessor = self._content["accessors"][number]
        dtype = np.dtype(_TYPES[accessor["componentType"]])
        columns, count = _COLUMNS[accessor["type"]], accessor["count"]
        if "bufferView" in accessor:
            values = self._values(accessor, dtype, count, columns)
        elif "sparse" in accessor:
            if not 0 <= count <= 3 * MOST_FACES:
                raise UnreadableError(f"it has an array of {count} values")
            values = np.zeros((count, columns), dtype=dtype)
        else:
            raise UnreadableError(
                "it has an array without values, which only extensions could give it"
            )
        if "sparse" in accessor:
            values = self._replaced(values, accessor["sparse"])
        return _as_meant(values) if accessor.get("normalized") else values

    def _replaced(self, values: NDArray[Any], sparse: dict[str, Any]) -> NDArray[Any]:
        count, where, what = sparse["count"], sparse["indices"], sparse["values"]
        at = self._values(where, np.dtype(_TYPES[where["componentType"]]), count, 1)[:, 0]
        if len(at) and at.max() >= len(values):
            raise UnreadableError("it has sparse values beyond their array")
        values = values.copy()
        values[at] = self._values(what, values.dtype, count, values.shape[1])
        return np.asarray(values)

    def _values(
        self, place: dict[str, Any], dtype: np.dtype[Any], count: int, columns: int
    ) -> NDArray[Any]:
        view = self._content["bufferViews"][place["bufferView"]]
        buffer = self._buffer(view["buffer"])
        start = view.get("byteOffset", 0) + place.get("byteOffset", 0)
        size = columns * dtype.itemsize
        stride = view.get("byteStride", size)
        end = view.get("byteOffset", 0) + view["byteLength"]
        last = start + (count - 1) * stride + size if count else start
        if min(start, count, view.get("byteOffset", 0)) < 0 or stride < size:
            raise UnreadableError("it has an array of negative size or stride")
        if last > min(end, len(buffer)):
            raise UnreadableError("it has an array that leaves its buffer")
        values: NDArray[Any] = np.ndarray(
            (count, columns), dtype, buffer, start, (stride, dtype.itemsize)
        )
        return np.array(values)

    def _buffer(self, number: int) -> bytes:
        uri = self._content["buffers"][number].get("uri")
        if uri is None and number > 0:
            raise UnreadableError("it has a buffer without content, which only extensions fill")
        if uri is None:
            return self._binary
        if not uri.startswith(_DATA):
            raise UnreadableError(f"it wants another file, {uri!r}; put what is needed into it")
        return base64.b64decode(uri.partition(",")[2])


def _as_meant(values: NDArray[Any]) -> NDArray[Any]:
    """Fractions for normalised integers, by the specification's equations."""
    if values.dtype.kind == "f":
        return values
    fractions: NDArray[Any] = values / float(np.iinfo(values.dtype).max)
    return np.asarray(np.maximum(fractions, -1.0))
