"""Training a network on an objective, interruptible at any step."""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from pickle import UnpicklingError
from time import monotonic
from typing import Any, ClassVar, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from envs import Environment, InputError
from envs.errors import input_error_of, reason
from envs.files.paths import atomic_write
from envs.seeding import derived_seed, stream

_CHECKPOINT_EVERY_S = 20.0
_LOSSES_KEPT = 50

_NOT_OURS = (
    *(OSError, EOFError, UnpicklingError, RuntimeError),
    *(LookupError, ValueError, TypeError, AttributeError),  # PyTorch reads it, but it is another's
)
"""What is raised of files that are no checkpoint."""

Batch = tuple[Tensor, ...]


class Objective(Protocol):
    """Data and loss."""

    def prepare(
        self, env: Environment, seed: int, kept: Path, report: Callable[[float], None]
    ) -> float:
        """Makes what is made once, and gives the seconds that it took, in earlier calls too.
        `kept` is a file to go on from, `report` is told the share that is done."""

    def draw(self, rng: np.random.Generator) -> Batch:
        """The data of a step, float32."""

    def loss(self, net: Any, batch: Batch, share: float) -> Tensor:
        """The loss of a batch at a share of the training, 0..1."""


@dataclass(frozen=True)
class Rollback:
    """After an epoch whose loss is `factor` times that before, one of the last `kept` states is
    taken up again."""

    epoch_steps: int = 100
    factor: float = 1.2
    kept: int = 5


@dataclass(frozen=True)
class Recipe:
    """How a network is optimised. The learning rate falls along a cosine to `last_rate_share`."""

    steps: int = 5000
    learning_rate: float = 2e-3
    warm_up_steps: int = 200
    last_rate_share: float = 0.02
    weight_decay: float = 0.0
    betas: tuple[float, float] = (0.9, 0.99)
    gradient_limit: float = 1.0
    averaging: float = 0.999
    rollback: Rollback | None = None

    def rate(self, step: int, share: float) -> float:
        """The learning rate of a step at a share of the training: linear warm-up, cosine decay."""
        cosine = 0.5 * (1 + math.cos(math.pi * share))
        decay = self.last_rate_share + (1 - self.last_rate_share) * cosine
        return self.learning_rate * min(1.0, (step + 1) / self.warm_up_steps) * decay


@dataclass
class Epochs:
    """What a `Rollback` goes by.

    Attributes:
        before: mean loss of the last epoch that was not rolled back.
        losses: of this epoch's steps.
        kept: states of network and optimiser after the last epochs.
    """

    before: float = math.inf
    losses: list[float] = field(default_factory=list)
    kept: list[tuple[dict[str, Any], dict[str, Any]]] = field(default_factory=list)

    def after_step(self, state: TrainingState, rollback: Rollback, loss: float, seed: int) -> None:
        """Is told the loss of each step; carries a rollback out."""
        self.losses.append(loss)
        if len(self.losses) < rollback.epoch_steps:
            return
        mean = sum(self.losses) / len(self.losses)
        self.losses.clear()
        if self.kept and mean > rollback.factor * self.before:
            choice = int(stream("rollback", seed, state.step).integers(len(self.kept)))
            net, optimiser = deepcopy(self.kept[choice])
            state.net.load_state_dict(net)
            state.optimiser.load_state_dict(optimiser)
            return
        self.before = mean
        now = state.net.state_dict(), state.optimiser.state_dict()
        self.kept = [*self.kept[1 - rollback.kept :], deepcopy(now)]


class Length(Protocol):
    """How long a training is."""

    def share(self, step: int, elapsed_s: float) -> float:
        """How much of it is done after some steps and seconds; it ends at 1."""


@dataclass(frozen=True)
class Steps:
    """So many steps: the same result each time."""

    steps: int

    def share(self, step: int, elapsed_s: float) -> float:
        return step / self.steps


@dataclass(frozen=True)
class Minutes:
    """So many minutes of training, whatever they allow."""

    minutes: float

    def share(self, step: int, elapsed_s: float) -> float:
        return min(1.0, elapsed_s / (60 * self.minutes))


@dataclass
class TrainingState:
    """Where a training stands.

    Attributes:
        average: of the weights over later steps, which is the result.
        data_s, train_s: seconds spent making data, and otherwise.
        losses: [share, mean loss since the last entry].
        epochs: what a recipe's `Rollback` goes by.
    """

    net: nn.Module
    average: nn.Module
    optimiser: torch.optim.Optimizer
    step: int = 0
    share: float = 0.0
    data_s: float = 0.0
    train_s: float = 0.0
    losses: list[list[float]] = field(default_factory=list)
    recent: list[float] = field(default_factory=list)
    latest_loss: float | None = None
    validation: list[list[float]] = field(default_factory=list)
    epochs: Epochs = field(default_factory=Epochs)

    _PLAIN: ClassVar = (
        *("step", "share", "data_s", "train_s"),
        *("losses", "recent", "latest_loss", "validation"),
    )
    _MODULES: ClassVar = ("net", "average", "optimiser")

    @staticmethod
    def begin(net: nn.Module, recipe: Recipe) -> TrainingState:
        """Before the first step."""
        optimiser = torch.optim.AdamW(
            net.parameters(), betas=recipe.betas, weight_decay=recipe.weight_decay
        )
        return TrainingState(net, deepcopy(net), optimiser)

    def averaged(self) -> nn.Module:
        """The averaged network. What is no weight, such as the w-space encoder's lambda, is not
        averaged but as it is now."""
        with torch.no_grad():
            for average, now in zip(self.average.buffers(), self.net.buffers(), strict=True):
                average.copy_(now)
        return self.average

    def save(self, file: Path) -> None:
        """Writes a checkpoint, whole or not at all.

        Raises:
            InputError: there is no room for it.
        """
        state: dict[str, Any] = {name: getattr(self, name) for name in self._PLAIN}
        state |= {name: getattr(self, name).state_dict() for name in self._MODULES}
        state["epochs"] = dict(vars(self.epochs))
        # PyTorch's own error for a full disk is a RuntimeError.
        with input_error_of(f"cannot write {file}", RuntimeError), atomic_write(file) as part:
            torch.save(state, part)

    def _check(self) -> None:
        """Raises ValueError if it is no state that a training can be in."""
        if type(self.step) is not int or self.step < 0 or not 0 <= self.share <= 1:
            raise ValueError(f"step {self.step} at a share of {self.share}")
        if not all(0 <= seconds < math.inf for seconds in (self.data_s, self.train_s)):
            raise ValueError(f"{self.data_s} s and {self.train_s} s were spent")
        for net in (self.net, self.average):
            if not all(tensor.isfinite().all() for tensor in net.state_dict().values()):
                raise ValueError("NaN or infinite weights")

    def load(self, file: Path) -> None:
        """Goes on from a checkpoint.

        Raises:
            InputError: it is damaged or of another program.
        """
        try:
            state = torch.load(file, weights_only=True)
            for name in self._MODULES:
                getattr(self, name).load_state_dict(state[name])
            for name in self._PLAIN:
                setattr(self, name, state[name])
            self.epochs = Epochs(**state["epochs"])
            self._check()
        except _NOT_OURS as error:
            raise InputError(f"cannot go on from {file}, delete it: {reason(error)}") from error


def train(
    state: TrainingState,
    objective: Objective,
    recipe: Recipe,
    length: Length,
    seed: int,
    checkpoint: Callable[[TrainingState], None] = lambda state: None,
    report: Callable[[TrainingState], None] = lambda state: None,
) -> nn.Module:
    """Trains until `length` is over, and gives the averaged weights.

    Every step has random streams of its own, for the data and for PyTorch, so that a training that
    was interrupted goes on as if it had not been.

    Args:
        objective: prepared.
        checkpoint: is called now and then.
        report: is called after every step.
    """
    saved = monotonic()
    while state.share < 1.0:
        begin = monotonic()
        device = next(state.net.parameters()).device
        batch = objective.draw(stream("training", seed, state.step))
        batch = tuple(part.to(device) for part in batch)
        drawn = monotonic()
        with torch.random.fork_rng():
            torch.manual_seed(derived_seed("training", seed, state.step))
            loss = _step(state, objective, batch, recipe)
        state.recent.append(loss)
        state.latest_loss = loss
        state.step += 1
        if recipe.rollback is not None:
            state.epochs.after_step(state, recipe.rollback, loss, seed)
        state.data_s += drawn - begin
        state.train_s += monotonic() - drawn
        before, state.share = state.share, length.share(state.step, state.train_s)
        if int(before * _LOSSES_KEPT) != int(state.share * _LOSSES_KEPT):
            state.losses.append([state.share, sum(state.recent) / len(state.recent)])
            state.recent.clear()
        report(state)
        if monotonic() - saved > _CHECKPOINT_EVERY_S:
            checkpoint(state)
            saved = monotonic()
    return state.averaged()


def _step(state: TrainingState, objective: Objective, batch: Batch, recipe: Recipe) -> float:
    """One step of the optimiser and of the average; the loss before it."""
    for group in state.optimiser.param_groups:
        group["lr"] = recipe.rate(state.step, state.share)
    state.optimiser.zero_grad()
    loss = objective.loss(state.net, batch, state.share)
    loss.backward()  # type: ignore[no-untyped-call]
    nn.utils.clip_grad_norm_(state.net.parameters(), recipe.gradient_limit)
    state.optimiser.step()
    keep = min(recipe.averaging, (state.step + 1) / (state.step + 10))
    with torch.no_grad():
        for mean, now in zip(state.average.parameters(), state.net.parameters(), strict=True):
            mean.lerp_(now, 1 - keep)
    return loss.item()


def ramp(share: float, begin: float, end: float) -> float:
    """0 until `begin`, linear to 1 at `end`."""
    if share < begin:
        return 0.0
    return 1.0 if share >= end else (share - begin) / (end - begin)


def as_float32(*arrays: Any) -> Batch:
    """Arrays as tensors of single precision."""
    return tuple(torch.from_numpy(np.ascontiguousarray(a, dtype=np.float32)) for a in arrays)
