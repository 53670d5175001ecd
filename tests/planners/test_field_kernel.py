"""The compiled routine against the network and the batched execution."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from planners.fields.layers import FieldShape
from planners.fields.metric_field import MetricField
from planners.fields.networks import TimeField
from planners.fields.path_extraction import Descent, descend
from planners.fields.path_extraction import _step as step
from planners.fields.single_query import CompiledField
from planners.learning.circles import NO_CIRCLES

DESCENTS = [Descent(), Descent(step=0.01), Descent(moves=(True, False)), Descent(most_steps=3)]


Net = TimeField | MetricField


@pytest.fixture(scope="module", params=[2, 3, 6], ids=lambda d: f"{d}-D")
def dimension(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module", params=[TimeField, MetricField])
def net(request: pytest.FixtureRequest, dimension: int) -> Net:
    torch.manual_seed(4)
    made: Net = request.param(FieldShape(dimension, frequencies=8, width=32)).eval()
    return made


def ends(net: Net, n: int) -> np.ndarray:
    rng = np.random.default_rng(5)
    return rng.uniform(-0.5, 0.5, (2, n, net.shape.dimension)).astype(np.float32)


def test_stretch_and_gradients_are_the_networks(net: Net) -> None:
    starts, goals = ends(net, 30)
    with torch.no_grad():
        stretch, *slopes = (x.numpy() for x in net(*map(torch.from_numpy, (starts, goals))))
    compiled = CompiledField(net)
    for i in range(30):
        found, gradients = compiled.pair(starts[i], goals[i])
        assert found == pytest.approx(stretch[i], abs=1e-5)
        assert gradients == pytest.approx(np.stack([s[i] for s in slopes]), abs=1e-4)


def test_first_steps_are_those_of_the_batch(net: Net) -> None:
    starts, goals = ends(net, 20)
    bounds = torch.full((net.shape.dimension,), 0.5)
    compiled = CompiledField(net)
    a, b = torch.from_numpy(starts), torch.from_numpy(goals)
    few = Descent(step=0.002, most_steps=3, meeting=0.0)
    found = [
        compiled.after(np.stack([p, q]), -bounds.numpy(), bounds.numpy(), few)
        for p, q in zip(a.numpy(), b.numpy(), strict=True)
    ]
    for _ in range(3):
        a, b = (x.clamp(-bounds, bounds) for x in step(net, a, b, few.step, NO_CIRCLES))
    assert np.array(found) == pytest.approx(torch.stack([a, b], dim=1).numpy(), abs=1e-4)


@pytest.mark.parametrize("descent", DESCENTS)
def test_paths_are_those_of_the_batch(dimension: int, descent: Descent) -> None:
    """Of a smooth field: an untrained metric has kinks all over, where rounding decides."""
    torch.manual_seed(4)
    net, d = TimeField(FieldShape(dimension, frequencies=8, width=32)).eval(), dimension
    starts, goals = ends(net, 20)
    lower, upper = np.full(d, -0.5, np.float32), np.full(d, 0.5, np.float32)
    together = descend(net, *map(torch.from_numpy, (starts, goals, lower, upper)), descent)
    compiled = CompiledField(net)
    for start, goal, wanted in zip(starts, goals, together, strict=True):
        found = compiled.descend(start, goal, lower, upper, descent)
        assert (found is None) == (wanted is None)
        if found is not None and wanted is not None:
            assert found == pytest.approx(wanted.numpy(), abs=1e-4)


def test_it_says_what_it_does_not_fit() -> None:
    assert CompiledField.fits(TimeField(FieldShape(3)))
    assert CompiledField.fits(MetricField(FieldShape(3)))
    assert not CompiledField.fits(TimeField(FieldShape(3, operator="concatenation")))
    assert not CompiledField.fits(TimeField(FieldShape(3, bounded=False)))
    assert not CompiledField.fits(torch.nn.Linear(3, 3))
