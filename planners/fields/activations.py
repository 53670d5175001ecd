"""Activations with their derivatives."""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor
from torch.nn import functional

Activation = Callable[[Tensor], tuple[Tensor, Tensor]]


def sine(x: Tensor) -> tuple[Tensor, Tensor]:
    """sin x."""
    return x.sin(), x.cos()


def squareplus(x: Tensor) -> tuple[Tensor, Tensor]:
    """(x + sqrt(x^2 + 1)) / 2, a smooth ReLU."""
    root = torch.sqrt(x**2 + 1)
    return (x + root) / 2, (1 + x / root) / 2


def elu(x: Tensor) -> tuple[Tensor, Tensor]:
    """x above 0, exp(x) - 1 below."""
    y = functional.elu(x)
    return y, torch.where(x > 0, torch.ones_like(x), y + 1)
