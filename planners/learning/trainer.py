"""A method's whole training in an environment: network, data, steps, validation, checkpoints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from time import monotonic
from typing import Any

import torch
from torch import nn

from envs import Environment, Problem, processors
from envs.seeding import derived_seed, training_seed
from planners.learning.learned_planner import Progress, Trained, Training, checked_device
from planners.learning.training_loop import (
    Length,
    Minutes,
    Objective,
    Recipe,
    Steps,
    TrainingState,
    train,
)
from planners.learning.weight_files import Tensors

Solved = Callable[[nn.Module, Sequence[Problem]], int]
"""How many of some problems a network solves."""

_VALIDATION_PROBLEMS = 200
_VALIDATED_AT = (0.25, 0.5, 0.75, 1.0)


@dataclass(frozen=True)
class Method:
    """What is trained, on what, for how long.

    Attributes:
        network: makes a network for an environment, random by PyTorch's global generator.
        survey: computes what in a new network is computed rather than learned, for a seed.
        objective: makes what it is trained on.
        recipe: how.
        expected_minutes: about how long that takes on two cores.
    """

    network: Callable[[Environment], nn.Module]
    objective: Callable[[], Objective]
    recipe: Recipe = field(default_factory=Recipe)
    expected_minutes: float = 5.0
    survey: Callable[[Any, int], None] = lambda network, seed: None

    def settings(self) -> dict[str, Any]:
        """JSON data that says how it is trained."""
        return {"objective": described(self.objective()), "recipe": asdict(self.recipe)}


def described(objective: Any) -> dict[str, Any]:
    """An objective's class and parameters as JSON data."""
    values = {
        name: described(value) if hasattr(value, "__dataclass_fields__") else value
        for name, value in vars(objective).items()
        if not name.startswith("_")
    }
    return {"class": type(objective).__name__, **values}


def learn(method: Method, env: Environment, how: Training, solved: Solved) -> Trained:
    """Trains a network of a method from scratch, or from the checkpoint."""
    state = _begun(method, env, how)
    objective = method.objective()
    prepared_s = objective.prepare(
        env, how.seed, how.data, lambda share: how.report(Progress("data", share))
    )
    with _quick_arithmetic(), _usable_threads():
        train(
            state,
            objective,
            method.recipe,
            _length(method, how),
            how.seed,
            checkpoint=lambda state: state.save(how.checkpoint),
            report=_Watch(env, how, solved),
        )
    spent = {
        "network": _network(state.net),
        "steps": state.step,
        "minutes": how.minutes,
        "device": how.device,
        "threads": min(torch.get_num_threads(), processors.physical_cores()),
    }
    return Trained(
        {name: tensor.cpu().numpy() for name, tensor in state.averaged().state_dict().items()},
        method.settings() | spent,
        data_s=prepared_s + state.data_s,
        train_s=state.train_s,
        losses=state.losses,
        validation=state.validation,
    )


def filled(net: nn.Module, tensors: Tensors) -> nn.Module:
    """A network itself, with weights in place of its own.

    Raises:
        TypeError: some are of another type of numbers.
        ValueError, RuntimeError: some are missing, unknown, or of another shape.
    """
    given = {name: torch.from_numpy(array) for name, array in tensors.items()}
    for name, own in net.state_dict().items():
        if name in given and given[name].dtype != own.dtype:
            raise TypeError(f"{name} is of {given[name].dtype}, not of {own.dtype}")
    net.load_state_dict(given)
    return net


def _begun(method: Method, env: Environment, how: Training) -> TrainingState:
    with torch.random.fork_rng():
        torch.manual_seed(derived_seed("weights", how.seed))
        net = method.network(env).to(checked_device(how.device))
    if how.checkpoint.is_file():
        state = TrainingState.begin(net, method.recipe)
        state.load(how.checkpoint)
        return state
    begin = monotonic()
    method.survey(net, how.seed)
    state = TrainingState.begin(net, method.recipe)
    state.data_s = monotonic() - begin
    return state


def _network(net: nn.Module) -> dict[str, Any]:
    shape = getattr(net, "shape", None)
    return {
        "class": type(net).__name__,
        "parameters": sum(weights.numel() for weights in net.parameters()),
        **({} if shape is None else {"shape": asdict(shape)}),
    }


def _length(method: Method, how: Training) -> Length:
    return Steps(method.recipe.steps) if how.minutes is None else Minutes(how.minutes)


class _Watch:
    """Tells how a training goes, and now and then lets it plan on problems of its own."""

    def __init__(self, env: Environment, how: Training, solved: Solved) -> None:
        self._report = how.report
        self._solved = solved
        seed = training_seed("validation", how.seed)
        self._problems = env.sample_problems(_VALIDATION_PROBLEMS, seed)

    def __call__(self, state: TrainingState) -> None:
        validation = None
        if sum(at <= state.share for at in _VALIDATED_AT) > len(state.validation):
            average = state.averaged()
            validation = self._solved(average, self._problems), len(self._problems)
            state.validation.append([state.share, *validation])
            average.train()
        self._report(Progress("training", state.share, state.latest_loss, validation))


@contextmanager
def _quick_arithmetic() -> Iterator[None]:
    """Takes numbers near 0 as 0, which are slow otherwise."""
    flushes = torch.set_flush_denormal(True)
    try:
        yield
    finally:
        if flushes:
            torch.set_flush_denormal(False)


@contextmanager
def _usable_threads() -> Iterator[None]:
    """PyTorch's threads are no more than there are cores to use: more would wait for each other."""
    threads = torch.get_num_threads()
    torch.set_num_threads(min(threads, processors.physical_cores()))
    try:
        yield
    finally:
        torch.set_num_threads(threads)
