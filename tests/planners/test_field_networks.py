"""Networks of time fields: symmetry, bounds, and derivatives against automatic differentiation."""

from __future__ import annotations

import math

import pytest
import torch
from torch import Tensor

from planners.fields.layers import FieldShape
from planners.fields.networks import TimeField
from planners.learning.circles import Circles

SHAPES = {
    "2-D": FieldShape(2, frequencies=8, width=32),
    "3-D": FieldShape(3, frequencies=8, width=32),
    "6-D": FieldShape(6, frequencies=8, width=32),
    "wrapping": FieldShape(3, frequencies=8, width=32, circles=Circles((0, 2), 0.7)),
}


@pytest.fixture(params=SHAPES)
def net(request: pytest.FixtureRequest) -> TimeField:
    torch.manual_seed(1)
    made = TimeField(SHAPES[request.param]).double()
    for parameter in made.parameters():  # away from the near-linear start
        parameter.data *= 1.5
    return made


def ends(net: TimeField, n: int = 40) -> tuple[Tensor, Tensor]:
    torch.manual_seed(2)
    q = torch.rand(2, n, net.shape.dimension, dtype=torch.float64) - 0.5
    return q[0].requires_grad_(), q[1].requires_grad_()


def test_swapping_the_ends_gives_exactly_the_same(net: TimeField) -> None:
    start, goal = ends(net)
    there, by_start, by_goal = net(start, goal)
    back, by_start_back, by_goal_back = net(goal, start)
    assert torch.equal(there, back)
    assert torch.equal(by_start, by_goal_back)
    assert torch.equal(by_goal, by_start_back)


def test_the_stretch_is_bounded(net: TimeField) -> None:
    start, goal = ends(net, 1000)
    stretch, _, _ = net(1000 * start, -1000 * goal)
    assert (stretch > -0.0801).all()
    assert (stretch < 1.1 * math.log(10)).all()


def test_slopes_are_those_of_automatic_differentiation(net: TimeField) -> None:
    start, goal = ends(net)
    stretch, by_start, by_goal = net(start, goal)
    wanted = torch.autograd.grad(stretch.sum(), (start, goal))
    assert torch.allclose(by_start, wanted[0], atol=1e-9)
    assert torch.allclose(by_goal, wanted[1], atol=1e-9)


def test_one_backward_pass_trains_through_the_slopes(net: TimeField) -> None:
    """Gradients by the parameters of a loss on the slopes equal those of a double backward."""
    start, goal = ends(net)
    stretch, by_start, _ = net(start, goal)
    ours = torch.autograd.grad((by_start**2).sum(), list(net.parameters()), allow_unused=True)
    stretch, _, _ = net(start, goal)
    [slope] = torch.autograd.grad(stretch.sum(), start, create_graph=True)
    wanted = torch.autograd.grad((slope**2).sum(), list(net.parameters()), allow_unused=True)
    for a, b in zip(ours, wanted, strict=True):
        if b is not None:
            assert a is not None
            assert torch.allclose(a, b, rtol=1e-5, atol=1e-7)


def test_single_precision_is_close_enough(net: TimeField) -> None:
    start, goal = ends(net)
    exact = net(start, goal)
    single = net.float()(start.float(), goal.float())
    for a, b in zip(exact, single, strict=True):
        assert torch.allclose(a.float(), b, rtol=1e-3, atol=1e-4)


def test_groups_are_all_their_pairs(net: TimeField) -> None:
    d = net.shape.dimension
    torch.manual_seed(3)
    starts, goals = torch.rand(4, 5, d).double(), torch.rand(4, 3, d).double()
    whole = net.all_pairs(starts, goals)
    one_by_one = net(
        starts[:, :, None].expand(4, 5, 3, d).reshape(-1, d),
        goals[:, None].expand(4, 5, 3, d).reshape(-1, d),
    )
    for a, b in zip(whole, one_by_one, strict=True):
        assert torch.allclose(a.reshape(b.shape), b, atol=1e-12)
