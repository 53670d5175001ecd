"""Messages between the harness and a worker: JSON and at most one array, never pickles.

Whatever a planner returns reaches the harness as plain numbers and text.
"""

from __future__ import annotations

import json
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from envs.problem import Array

Message = dict[str, Any]


def send(connection: Connection, message: Message, array: Array | None = None) -> None:
    """Sends a message, and float64 numbers of any shape with it."""
    shape = None if array is None else list(array.shape)
    text = json.dumps({"message": message, "shape": shape}, default=_plain)
    connection.send_bytes(text.encode())
    if array is not None:
        connection.send_bytes(np.ascontiguousarray(array, dtype="<f8").tobytes())


def receive(connection: Connection) -> tuple[Message, Array | None]:
    """The next message.

    Raises:
        EOFError: the other side is gone.
    """
    envelope = json.loads(connection.recv_bytes())
    if envelope["shape"] is None:
        return envelope["message"], None
    numbers = np.frombuffer(connection.recv_bytes(), dtype="<f8")
    return envelope["message"], numbers.reshape(envelope["shape"]).astype(np.float64)


def _plain(value: Any) -> Any:
    """NumPy's scalars and arrays as numbers and lists, anything else as text."""
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else str(value)
