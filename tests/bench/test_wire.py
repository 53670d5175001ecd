"""Messages between harness and worker."""

from __future__ import annotations

from multiprocessing import Pipe

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from bench import wire

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
    here, there = Pipe()
    with here, there:
        wire.send(here, message, array)
        got, numbers = wire.receive(there)
    assert got == message
    if array is None:
        assert numbers is None
    else:
        assert numbers is not None
        assert numbers.dtype == np.float64
        assert np.array_equal(numbers, array, equal_nan=True)


def test_numpys_numbers_become_plain() -> None:
    here, there = Pipe()
    with here, there:
        wire.send(here, {"n": np.int64(3), "x": np.float32(0.5), "a": np.arange(2), "o": Pipe})
        got, _ = wire.receive(there)
    assert got["n"] == 3
    assert got["x"] == 0.5
    assert got["a"] == [0, 1]
    assert "Pipe" in got["o"]
