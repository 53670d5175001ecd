"""The w-space encoder against a dense convolution and automatic differentiation."""

from __future__ import annotations

import pytest
import torch
from torch.nn import functional

from envs import Environment
from planners.fields.layers import FieldShape
from planners.fields.methods import occupancy_of
from planners.fields.networks import VOXELS, TimeField, WSpaceEncoder, occupancy

AXES = torch.eye(3, dtype=torch.float64)


@pytest.fixture(scope="module")
def encoder(c3d: Environment) -> WSpaceEncoder:
    torch.manual_seed(0)
    return WSpaceEncoder(16, occupancy_of(c3d)).double()


def points(n: int = 400) -> torch.Tensor:
    torch.manual_seed(1)
    return torch.rand(n, 3, dtype=torch.float64) - 0.5


def test_occupancy_marks_the_voxels_of_points() -> None:
    grid = occupancy(torch.tensor([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5], [0.001, -0.001, 0.0]]))
    assert grid.sum() == 3
    assert grid[0, 0, 0]
    assert grid[-1, -1, -1]
    assert grid[VOXELS // 2, VOXELS // 2 - 1, VOXELS // 2]


def test_surfaces_fill_some_of_the_grid(c3d: Environment) -> None:
    share = occupancy_of(c3d).float().mean().item()
    assert 0.002 < share < 0.02


@pytest.mark.slow
def test_features_are_those_of_a_dense_convolution(encoder: WSpaceEncoder) -> None:
    x = points()
    dense = encoder.grid.double()[None, None]
    maps = functional.relu(encoder.convolution(dense))
    both = torch.cat([dense[:, :, 1:-1, 1:-1, 1:-1], maps], dim=1)
    at = (x + 0.5) * VOXELS - 0.5 + 2
    at = (2 * at / (both.shape[2] - 1) - 1).flip(-1)
    wanted = functional.grid_sample(both, at[None, None, None], align_corners=True)
    found, _ = encoder._interpolate(x)
    assert torch.allclose(found, wanted[0, :, 0, 0].T, atol=1e-12)


def test_derivatives_are_those_of_automatic_differentiation(encoder: WSpaceEncoder) -> None:
    x = points().requires_grad_()
    features, jacobian = encoder(x, AXES)
    weight = torch.randn(16, dtype=torch.float64)
    [wanted] = torch.autograd.grad((features @ weight).sum(), x)
    assert torch.allclose((jacobian @ weight).T, wanted, atol=1e-10)
    assert wanted.norm() > 0


def test_far_from_anything_features_do_not_change() -> None:
    encoder = WSpaceEncoder(8, torch.zeros((VOXELS,) * 3, dtype=torch.bool)).double()
    features, jacobian = encoder(points(10), AXES)
    assert torch.equal(features, features[:1].expand_as(features))
    assert (jacobian == 0).all()


def test_positions_beyond_the_cube_are_empty_space(encoder: WSpaceEncoder) -> None:
    outside = torch.tensor([[0.8, 0.0, 0.0], [-0.9, -0.9, 0.9]], dtype=torch.float64)
    features, jacobian = encoder(outside, AXES)
    assert torch.equal(features[0], features[1])
    assert (jacobian == 0).all()


def test_a_field_with_it_has_the_right_slopes_and_ignores_it_at_weight_0(
    c3d: Environment,
) -> None:
    torch.manual_seed(2)
    shape = FieldShape(3, frequencies=8, width=16, workspace=True)
    net = TimeField(shape, occupancy_of(c3d)).double()
    start, goal = points(60)[:30].requires_grad_(), points(60)[30:].requires_grad_()
    stretch, by_start, by_goal = net(start, goal)
    wanted = torch.autograd.grad(stretch.sum(), (start, goal))
    assert torch.allclose(by_start, wanted[0], atol=1e-9)
    assert torch.allclose(by_goal, wanted[1], atol=1e-9)
    net.workspace_weight.fill_(0.0)
    without, _, _ = net(start, goal)
    assert not torch.allclose(without, stretch)
    assert net.workspace is not None
    for parameter in net.workspace.parameters():
        parameter.data.fill_(7.0)
    assert torch.equal(net(start, goal)[0], without)
