"""Bidirectional execution on fields that are known."""

from __future__ import annotations

import pytest
import torch
from torch import Tensor, nn

from planners.fields.layers import FieldShape
from planners.fields.networks import TimeField
from planners.fields.path_extraction import Descent, descend

LOWER, UPPER = torch.full((3,), -0.5), torch.full((3,), 0.5)


class Constant(nn.Module):
    """The field of a constant speed: T = |qs - qg| / speed."""

    def __init__(self, speed: float) -> None:
        super().__init__()
        self._stretch = -torch.tensor(speed).log()

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        return self._stretch.expand(len(start)), torch.zeros_like(start), torch.zeros_like(goal)


class Outward(Constant):
    """Pushes both ends out of the bounds on their way."""

    def forward(self, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        stretch, at_start, at_goal = super().forward(start, goal)
        push = torch.tensor([0.0, 0.0, -3.0])
        return stretch, at_start + push, at_goal + push


def pairs(n: int) -> tuple[Tensor, Tensor]:
    torch.manual_seed(0)
    ends = torch.rand(2, n, 3) - 0.5
    return ends[0], ends[1]


@pytest.mark.parametrize("speed", [1.0, 0.5, 0.1])
def test_constant_speed_gives_straight_paths_with_steps_of_that_length(speed: float) -> None:
    starts, goals = pairs(20)
    descent = Descent(step=0.03)
    paths = descend(Constant(speed), starts, goals, LOWER, UPPER, descent)
    for path, start, goal in zip(paths, starts, goals, strict=True):
        assert path is not None
        assert torch.equal(path[0], start)
        assert torch.equal(path[-1], goal)
        steps = path.diff(dim=0).norm(dim=-1)
        assert steps.sum().item() == pytest.approx((start - goal).norm().item(), rel=1e-4)
        middle = len(steps) // 2
        others = torch.cat([steps[:middle], steps[middle + 1 :]])
        assert torch.allclose(others, torch.full_like(others, 0.03 * speed), rtol=1e-3)
        assert steps[middle] <= descent.meeting


def test_ends_that_are_close_are_joined_at_once() -> None:
    starts, _ = pairs(3)
    goals = starts + 0.01
    for path in descend(Constant(1.0), starts, goals, LOWER, UPPER, Descent()):
        assert path is not None
        assert len(path) == 2


@pytest.mark.parametrize("moves", [(True, False), (False, True)])
def test_one_end_alone_goes_all_the_way(moves: tuple[bool, bool]) -> None:
    starts, goals = pairs(10)
    descent = Descent(step=0.02, moves=moves)
    for path, start, goal in zip(
        descend(Constant(1.0), starts, goals, LOWER, UPPER, descent), starts, goals, strict=True
    ):
        assert path is not None
        assert torch.equal(path[0], start)
        assert torch.equal(path[-1], goal)
        still = path[len(path) // 2 :] if moves[0] else path[: len(path) // 2]
        assert torch.equal(still, still[:1].expand_as(still))


def test_ends_that_never_meet_give_none() -> None:
    starts, goals = (
        torch.tensor([[-0.4, 0, 0], [0, 0, 0]]),
        torch.tensor([[0.4, 0, 0], [0, 0, 0.05]]),
    )
    slow = Descent(step=0.001, most_steps=10)
    far, near = descend(Constant(1.0), starts, goals, LOWER, UPPER, slow)
    assert far is None
    assert near is not None


def test_paths_stay_within_the_bounds() -> None:
    starts, goals = pairs(50)
    for path in descend(Outward(1.0), starts, goals, LOWER, UPPER, Descent()):
        if path is not None:
            assert (path >= LOWER).all()
            assert (path <= UPPER).all()


def test_swapping_start_and_goal_reverses_the_path() -> None:
    torch.manual_seed(3)
    net = TimeField(FieldShape(3, frequencies=8, width=32))
    starts, goals = pairs(10)
    there = descend(net, starts, goals, LOWER, UPPER, Descent())
    back = descend(net, goals, starts, LOWER, UPPER, Descent())
    for a, b in zip(there, back, strict=True):
        assert (a is None) == (b is None)
        if a is not None and b is not None:
            assert torch.allclose(a, b.flip(0), atol=1e-5)
