"""The contract of planners that have to be trained for an environment first."""

from __future__ import annotations

import re
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from envs import Environment, InputError
from envs.errors import reason
from planners.base import Planner
from planners.learning import weight_files
from planners.learning.weight_files import Tensors


@dataclass(frozen=True)
class Progress:
    """How far a training has come.

    Attributes:
        stage: "data" or "training".
        share: of the stage that is done, 0..1.
        loss: of the latest step.
        validation: problems solved and tried, when they have just been tried.
    """

    stage: str
    share: float
    loss: float | None = None
    validation: tuple[int, int] | None = None


@dataclass(frozen=True)
class Training:
    """How to train.

    Attributes:
        seed: of everything random.
        minutes: how long, or None for as many steps as the planner's recipe has.
        device: of PyTorch.
        checkpoint: a file to go on from if it exists, written now and then.
        report: is told how far it has come.
    """

    seed: int
    minutes: float | None
    device: str
    checkpoint: Path
    report: Callable[[Progress], None] = lambda progress: None

    @property
    def data(self) -> Path:
        """A file beside the checkpoint, for data that is made once."""
        return self.checkpoint.with_suffix(".data.npz")

    def forget(self) -> None:
        """Removes both files: what came of the training has been kept."""
        for file in (self.checkpoint, self.data):
            file.unlink(missing_ok=True)


@dataclass(frozen=True)
class Trained:
    """What came of it; see `weight_files.Manifest` for the fields."""

    tensors: Tensors
    settings: Mapping[str, Any]
    data_s: float
    train_s: float
    losses: list[list[float]] = field(default_factory=list)
    validation: list[list[float]] = field(default_factory=list)


def unsupported_scenes(env: Environment) -> str | None:
    """Why a planner with weights for one scene cannot plan where each problem has its own, or None
    where all have one."""
    if not env.scenes_differ:
        return None
    return "it has weights for one scene, and here each problem has its own; choose one, scene=1"


class LearnedPlanner(Planner):
    """The contract of a planner that is trained first. Besides `solve`, a subclass implements
    `train`, `expected_minutes`, `fitted` and `load`.

    The harness trains it where it has no weights: by `bench train`, or before a run. `train` gives
    arrays, which are kept as safetensors with a manifest (seed, settings, losses, machine,
    command); `setup` finds them for the environment's `domain` and has `load` make the planner
    ready.

    Training may use only what the method allows, and no test problem: seeds for training are those
    of `envs.seeding.training_seed`.

    Args:
        name: str, under which its weights are kept.
        weights: str, a file of weights; by default the shipped ones, else those in the user's
            cache.
        device: str, of PyTorch: "cpu", "cuda" or "cuda:INDEX".

    Raises:
        InputError: there is no such device.

    Example:
        >>> class Constant(LearnedPlanner):
        ...     def __init__(self, weights: str = ""):
        ...         super().__init__("constant", weights)
        ...
        ...     def train(self, env, how):
        ...         how.report(Progress("training", 1.0))
        ...         return Trained({"number": np.array([0.5])}, {}, data_s=0.0, train_s=0.1)
        ...
        ...     def expected_minutes(self, env):
        ...         return 0.1
        ...
        ...     def fitted(self, env, tensors):
        ...         return float(tensors["number"][0])
        ...
        ...     def load(self, env, tensors):
        ...         self.number = self.fitted(env, tensors)
        ...
        ...     def solve(self, problem, budget):
        ...         return PlannerResult(Status.TIMEOUT)
        >>> import envs, numpy as np
        >>> from planners import PlannerResult, Status
        >>> env, planner = envs.make("c3d"), Constant()
        >>> planner.load(env, {"number": np.array([0.5])})
        >>> planner.number
        0.5
    """

    def __init__(self, name: str, weights: str = "", device: str = "cpu") -> None:
        self.name = name
        self.device = checked_device(device)
        self._weights = weights

    def unsupported(self, env: Environment) -> str | None:
        """By default a reason where problems have scenes of their own, and where the configuration
        space is not R^n: a network that takes the numbers of a configuration as they are knows
        nothing of angles that wrap and rotations."""
        if env.space.is_flat:
            return unsupported_scenes(env)
        return f"its network is for R^n, without angles that wrap or rotations as in {env.space}"

    def weights_file(self, env: Environment) -> Path | None:
        """The weights that `setup` will use, or None if it must be trained first."""
        if self._weights:
            return Path(self._weights)
        return weight_files.find(self.name, self.domain(env))

    def weights_digest(self, env: Environment) -> str:
        file = self.weights_file(env)
        return "" if file is None else weight_files.digest(file)

    def domain(self, env: Environment) -> str:
        """A fingerprint of what its weights are for: by default this one environment."""
        return env.fingerprint

    @abstractmethod
    def train(self, env: Environment, how: Training) -> Trained:
        """Trains from scratch, or goes on from the checkpoint.

        Args:
            env: `envs.Environment`, not to be changed.
            how: `Training`: seed, time, device, where the checkpoint is, whom to tell.

        Returns:
            `Trained`: named arrays, and what they cost.

        Raises:
            Exception: any; it is recorded as the fault of every problem of the run.
        """

    @abstractmethod
    def expected_minutes(self, env: Environment) -> float:
        """About how many minutes (float) `train` takes in `env` on two cores, by its own recipe;
        it is shown before training begins."""

    @abstractmethod
    def fitted(self, env: Environment, tensors: Tensors) -> Any:
        """A network with these weights, without making the planner ready: what is checked before
        a run, and so takes milliseconds.

        Args:
            env: `envs.Environment` that they are for.
            tensors: arrays by name, as `train` gave them.

        Returns:
            Whatever `load` can use.

        Raises:
            ValueError, KeyError, TypeError, RuntimeError: they do not fit.
        """

    @abstractmethod
    def load(self, env: Environment, tensors: Tensors) -> None:
        """Makes itself ready to solve with these weights.

        Raises:
            ValueError, KeyError, TypeError, RuntimeError: they do not fit.
        """

    def setup(self, env: Environment, *, seed: int) -> None:
        """Loads the weights.

        Raises:
            InputError: there are none, or not for this environment.
        """
        file = self.weights_file(env)
        if file is None:
            raise InputError(f"{self.name} has no weights for this environment; see bench train")
        tensors, manifest = weight_files.read(file, self.name, self.domain(env))
        with _fitting(file, self.name):
            self.load(env, tensors)
        self.train_s = manifest.data_s + manifest.train_s


def check_weights(planner: Planner, env: Environment) -> None:
    """Raises InputError if a planner would find weights that it cannot use."""
    if not isinstance(planner, LearnedPlanner) or planner.unsupported(env) is not None:
        return
    file = planner.weights_file(env)
    if file is not None:
        tensors, _ = weight_files.read(file, planner.name, planner.domain(env))
        with _fitting(file, planner.name):
            planner.fitted(env, tensors)


@contextmanager
def _fitting(file: Path, name: str) -> Iterator[None]:
    """Says of weights that do not fit which they are, and why not."""
    try:
        yield
    except (ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError(f"{file} does not hold weights of {name}: {reason(error)}") from error


def checked_device(name: str) -> str:
    """The name of a device of PyTorch that is there: "cpu", "cuda" or "cuda:INDEX".

    Raises:
        InputError: it is not.
    """
    if name == "cpu":
        return name
    chosen = re.fullmatch("cuda(?::([0-9]{1,3}))?", name)
    if chosen is None:
        raise InputError(f"no device is called {name!r}; choose cpu or cuda")
    import torch  # takes seconds, which other planners need not pay

    if not torch.cuda.is_available():
        raise InputError("no CUDA device is available here; choose cpu")
    count = torch.cuda.device_count()
    if int(chosen[1] or 0) >= count:
        raise InputError(f"{name} is not among the {count} CUDA devices here; they count from 0")
    return name
