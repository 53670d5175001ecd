"""Operators that combine the features of two configurations."""

from __future__ import annotations

import pytest
import torch

from planners.fields.layers import OPERATORS, Operator, elu, sine, squareplus


@pytest.fixture(params=sorted(OPERATORS))
def operator(request: pytest.FixtureRequest) -> Operator:
    return OPERATORS[request.param]()


def features() -> tuple[torch.Tensor, torch.Tensor]:
    torch.manual_seed(0)
    both = torch.randn(2, 30, 8, dtype=torch.float64)
    return both[0].requires_grad_(), both[1].requires_grad_()


def test_the_way_back_is_that_of_automatic_differentiation(operator: Operator) -> None:
    a, b = features()
    combined, bend = operator.combine(a, b)
    assert combined.shape == (30, operator.widening * 8)
    weight = torch.randn_like(combined)
    wanted = torch.autograd.grad((combined * weight).sum(), (a, b))
    for ours, theirs in zip(operator.back(weight, bend), wanted, strict=True):
        assert torch.allclose(ours, theirs, atol=1e-12)


@pytest.mark.parametrize("name", ["smooth", "maxmin"])
def test_symmetric_ones_do_not_know_which_end_is_which(name: str) -> None:
    a, b = features()
    operator = OPERATORS[name]()
    assert torch.equal(operator.combine(a, b)[0], operator.combine(b, a)[0])


def test_max_and_min_are_a_linear_map_of_the_smooth_one_without_smoothing() -> None:
    """max = (a + b + |a - b|) / 2, min = (a + b - |a - b|) / 2."""
    a, b = features()
    most, least = OPERATORS["maxmin"]().combine(a, b)[0].chunk(2, dim=-1)
    operator = OPERATORS["smooth"]()
    size = operator.combine(a.repeat(1, 2), b.repeat(1, 2))[0][:, :8]
    assert torch.allclose(most - least, size, atol=0.0101)
    assert torch.allclose(most + least, a + b)


@pytest.mark.parametrize("activation", [sine, squareplus, elu])
def test_activations_know_their_slopes(activation) -> None:  # type: ignore[no-untyped-def]
    x = torch.linspace(-3, 3, 61, dtype=torch.float64).requires_grad_()
    y, slope = activation(x)
    [wanted] = torch.autograd.grad(y.sum(), x)
    assert torch.allclose(slope, wanted, atol=1e-12)
