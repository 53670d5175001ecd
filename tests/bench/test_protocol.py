"""Messages between harness and worker."""

from __future__ import annotations

import json
import socket
import struct
from time import monotonic

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from bench.execution import protocol

json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=8,
)


@given(
    st.dictionaries(st.text(), json_values),
    st.none() | arrays(float, array_shapes(min_dims=0, max_dims=3, min_side=0)),
)
def test_what_is_sent_arrives(message: dict[str, object], array: np.ndarray | None) -> None:
    here, there = socket.socketpair()
    with here, there:
        protocol.send(here, message, array)
        got, numbers = protocol.receive(there)
    assert got == message
    if array is None:
        assert numbers is None
    else:
        assert numbers is not None
        assert numbers.dtype == np.float64
        assert np.array_equal(numbers, array, equal_nan=True)


def test_numpys_numbers_become_plain() -> None:
    here, there = socket.socketpair()
    with here, there:
        message = {"n": np.int64(3), "x": np.float32(0.5), "a": np.arange(2), "o": socket.socket}
        protocol.send(here, message)
        got, _ = protocol.receive(there)
    assert got["n"] == 3
    assert got["x"] == 0.5
    assert got["a"] == [0, 1]
    assert "socket" in got["o"]


def _framed(text: bytes, numbers: bytes = b"") -> bytes:
    return struct.pack("<QQ", len(text), len(numbers)) + text + numbers


NONSENSE = {
    "another protocol": b"\0\0\0\5hello" + b"x" * 20,
    "more text than may be": struct.pack("<QQ", 2**40, 0),
    "more numbers than may be": struct.pack("<QQ", 2, 2**40) + b"{}",
    "no JSON": _framed(b"\xff{"),
    "not a dict": _framed(b"[]"),
    "nothing in it": _framed(b"{}"),
    "a message that is none": _framed(b'{"message": 3, "shape": null}'),
    "another shape": _framed(b'{"message": {}, "shape": [2, 3]}', b"\0" * 8),
    "half a number": _framed(b'{"message": {}, "shape": [1]}', b"\0" * 7),
    "brackets without end": _framed(b"[" * 2**20),
    "digits without end": _framed(b"9" * 100_000),
}


@pytest.mark.parametrize("sent", NONSENSE.values(), ids=NONSENSE)
def test_what_is_no_message_is_refused(sent: bytes) -> None:
    here, there = socket.socketpair()
    with here, there:
        here.setblocking(False)
        here.sendall(sent[: 2**16]) if len(sent) < 2**16 else _send_apart(here, there, sent)
        with pytest.raises((ValueError, KeyError, TypeError, RecursionError)):
            protocol.receive(there, monotonic() + 5)


def _send_apart(here: socket.socket, there: socket.socket, sent: bytes) -> None:
    for end in (here, there):
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 2**22)
    here.sendall(sent)


@pytest.mark.parametrize("part", [1, 16, 30, -1])
def test_half_a_message_holds_nobody_up(part: int) -> None:
    here, there = socket.socketpair()
    text = json.dumps({"message": {"n": 1}, "shape": [2]}).encode()
    with here, there:
        here.sendall(_framed(text, b"\0" * 16)[:part])
        begin = monotonic()
        with pytest.raises(TimeoutError):
            protocol.receive(there, begin + 0.2)
        assert monotonic() - begin < 2
        here.close()
        with pytest.raises(EOFError):
            protocol.receive(there, monotonic() + 5)


def test_what_is_too_large_is_not_sent() -> None:
    here, there = socket.socketpair()
    with here, there, pytest.raises(ValueError, match="bytes"):
        protocol.send(here, {"text": "x" * protocol.MOST_TEXT})


class GoneOnceTold:
    """A connection whose other side closes as soon as it has a whole message."""

    def __init__(self) -> None:
        self.sent = b""

    def sendall(self, data: bytes) -> None:
        if len(self.sent) >= 16 and len(self.sent) == 16 + sum(
            struct.unpack("<QQ", self.sent[:16])
        ):
            raise BrokenPipeError
        self.sent += data


@pytest.mark.parametrize("array", [None, np.zeros((0, 3)), np.ones((4, 3))])
def test_the_other_side_may_end_once_it_has_the_message(array: np.ndarray | None) -> None:
    """As a worker does that has nothing more to do."""
    connection = GoneOnceTold()
    protocol.send(connection, {"mark": protocol.GO}, array)  # type: ignore[arg-type]
    assert connection.sent.endswith(b"}" if array is None or not array.size else array.tobytes())
