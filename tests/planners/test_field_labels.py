"""Labels by fast marching: where times are known, and when the making is interrupted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from envs import Environment
from envs.scenes.cluttered import Cluttered3D
from planners.fast_marching import SpeedGrid
from planners.fields import labels
from planners.fields.labels import LabelPlan, make_labels

pytestmark = pytest.mark.usefixtures("in_this_process")

PLAN = LabelPlan(sources=4, goals=300, resolution=30)


class Uniform(Cluttered3D):
    """A world with the same clearance everywhere: speed 0.5."""

    def clearance(self, q: np.ndarray) -> np.ndarray:
        return np.full(len(q), 1.0)


def test_at_constant_speed_the_stretch_is_its_slowness(tmp_path: Path) -> None:
    plan = LabelPlan(sources=2, goals=300, resolution=60)
    made, seconds = make_labels(Uniform(), plan, seed=1, kept=tmp_path / "kept.npz")
    assert made.sources.shape == (2, 3)
    assert made.goals.shape == (2, 300, 3)
    assert made.stretch.shape == (2, 300)
    assert made.stretch.dtype == np.float32
    error = np.abs(made.stretch - np.log(2.0))
    assert np.median(error) < 0.02
    assert error.max() < 0.06
    assert seconds > 0


def test_labels_are_times_of_fast_marching(c3d: Environment, tmp_path: Path) -> None:
    made, _ = make_labels(c3d, PLAN, seed=2, kept=tmp_path / "kept.npz")
    distance = np.linalg.norm(made.goals - made.sources[:, None], axis=-1)
    assert (distance * 20 >= PLAN.nearest * 20 / 29 - 1e-5).all()
    grid = SpeedGrid(c3d, PLAN.resolution, order=2)
    source = made.sources[0].astype(float) * 20
    wanted = grid.times_at(grid.arrival_times(source), source, made.goals[0].astype(float) * 20)
    assert 20 * distance[0] * np.exp(made.stretch[0]) == pytest.approx(wanted, rel=1e-3)


def test_an_interrupted_making_goes_on(
    c3d: Environment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(labels, "_BLOCK", 1)
    whole, _ = make_labels(c3d, PLAN, seed=3, kept=tmp_path / "whole.npz")
    kept = tmp_path / "kept.npz"
    shares: list[float] = []

    def stop(share: float) -> None:
        shares.append(share)
        if share >= 0.25:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_labels(c3d, PLAN, seed=3, kept=kept, report=stop)
    [interrupted] = shares
    before = np.load(kept)["seconds"]
    resumed, seconds = make_labels(c3d, PLAN, seed=3, kept=kept, report=shares.append)
    assert shares[1] > interrupted
    assert shares[-1] == 1
    assert seconds > before
    for a, b in zip(vars(whole).values(), vars(resumed).values(), strict=True):
        assert (a == b).all()
