"""The paper's speed model, for arrays and for compiled code."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.speed_model import SpeedModel, speed_at


def test_speed_model_of_the_paper() -> None:
    speed = SpeedModel(d_min=0.2, d_max=2.0)
    at = np.array([-1, 0, 0.2, 1, 2, 5])
    assert speed(at) == pytest.approx([0.1, 0.1, 0.1, 0.5, 1, 1])


def test_speeds_go_on_falling_to_that_at_contact() -> None:
    speed = SpeedModel(d_min=0.2, d_max=2.0, contact=0.001)
    at = np.array([-1, 0, 0.1, 0.2, 1, 2, 5])
    assert speed(at) == pytest.approx([0.001, 0.001, 0.01, 0.1, 0.5, 1, 1])
    assert speed.ratio == pytest.approx(1000)
    assert SpeedModel(d_min=0.2, d_max=2.0).ratio == pytest.approx(10)


@settings(deadline=None)  # compiled on the first call
@given(
    st.floats(0.01, 0.99),
    st.floats(0.1, 20),
    st.sampled_from([0.0, 1e-3, 5e-3]),
    st.floats(-3, 3),
)
def test_compiled_code_has_the_same_speeds(
    least: float, d_max: float, contact: float, clearance: float
) -> None:
    model = SpeedModel(d_min=least * d_max, d_max=d_max, contact=contact)
    found = speed_at(model.normalized, clearance)
    assert found == pytest.approx(float(model(np.array(clearance * d_max))), rel=1e-9)


def test_what_compiled_code_is_given() -> None:
    assert SpeedModel(d_min=0.5, d_max=2.0).normalized == (0.25, 0.25)
    assert SpeedModel(d_min=0.5, d_max=2.0, contact=0.02).normalized == (0.25, 0.02)
