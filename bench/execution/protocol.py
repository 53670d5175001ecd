"""Messages between the harness and a worker: JSON and at most one array, never pickles.

Whatever a planner returns reaches the harness as plain numbers and text. A message is two lengths,
a text and the array's numbers. Neither its size nor the time it takes to come is the sender's to
choose, so that no worker can hold the harness up or fill its memory.
"""

from __future__ import annotations

import json
import socket
import struct
from time import monotonic
from typing import Any

import numpy as np

from envs.problem import Array

Message = dict[str, Any]

MOST_TEXT, MOST_NUMBERS = 2**24, 2**27
"""Bytes of a message's text and of its numbers; those of a path with 5.6 million waypoints in three
dimensions."""

READY, GO, ENDED = "ready", "go", "ended"
"""Words about what is timed: of a worker that waits to begin, of the harness, of the worker."""

SCENE, PATH = "scene", "path"
"""What a worker that is set up is asked: to get ready for a problem's scene, or for a path."""

_LENGTHS = struct.Struct("<QQ")
_SHARE = 2**20  # bytes that are read at once


def send(connection: socket.socket, message: Message, array: Array | None = None) -> None:
    """Sends a message, and float64 numbers of any shape with it.

    Raises:
        ValueError: it is more than a message may be.
        OSError: the other side is gone.
    """
    shape = None if array is None else list(array.shape)
    text = json.dumps({"message": message, "shape": shape}, default=plain).encode()
    numbers = b"" if array is None else np.ascontiguousarray(array, dtype="<f8").tobytes()
    _check_size(len(text), len(numbers))
    connection.sendall(_LENGTHS.pack(len(text), len(numbers)) + text)
    if numbers:  # else the other side has it all, and may be gone
        connection.sendall(numbers)


def receive(connection: socket.socket, until: float = np.inf) -> tuple[Message, Array | None]:
    """The next message.

    Args:
        until: when the whole of it must have come, on `time.monotonic`.

    Raises:
        EOFError: the other side is gone.
        TimeoutError: it has not come in time.
        ValueError, KeyError, TypeError, RecursionError: what came is no message.
    """
    text_length, length = _LENGTHS.unpack(_read(connection, _LENGTHS.size, until))
    _check_size(text_length, length)
    envelope = json.loads(_read(connection, text_length, until))
    numbers = np.frombuffer(_read(connection, length, until), dtype="<f8").astype(np.float64)
    message = envelope["message"]
    if not isinstance(message, dict):
        raise TypeError(f"a message is a dict, not a {type(message).__name__}")
    if envelope["shape"] is None:
        return message, None
    return message, numbers.reshape(envelope["shape"])


def _check_size(text: int, numbers: int) -> None:
    if text > MOST_TEXT or numbers > MOST_NUMBERS:
        raise ValueError(f"a message of {text} bytes of text and {numbers} of numbers")


def _read(connection: socket.socket, length: int, until: float) -> bytearray:
    """So many bytes."""
    read = bytearray(length)
    view, begun = memoryview(read), 0
    while begun < length:
        connection.settimeout(None if until == np.inf else max(0.001, until - monotonic()))
        came = connection.recv_into(view[begun : begun + _SHARE])
        if not came:
            raise EOFError
        begun += came
        if monotonic() > until:
            raise TimeoutError("a message that does not end")
    return read


def plain(value: Any) -> Any:
    """NumPy's scalars and arrays as numbers and lists, anything else as text."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)
