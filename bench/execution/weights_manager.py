"""Training learned planners: by command, or on the spot before a run."""

from __future__ import annotations

import hashlib
import logging
import math
import shlex
import traceback
from pathlib import Path
from time import monotonic

from bench.execution import machine
from bench.execution import planner_queries as queries
from bench.execution.planner_queries import World
from bench.execution.problem_choice import check_range
from bench.execution.session import TrainingProgress
from bench.execution.worker_process import SetUp
from bench.storage.record import Fault
from envs import Environment, InputError
from envs.errors import input_error_of
from envs.files.paths import cache_folder
from envs.registry import Entry
from envs.seeding import TEST_SEEDS
from planners import Planner
from planners.learning import weight_files
from planners.learning.learned_planner import LearnedPlanner, Training, checked_device
from planners.learning.weight_files import Manifest

logger = logging.getLogger(__name__)


def train(
    env: Entry[Environment],
    planner: Entry[Planner],
    *,
    seed: int = 0,
    minutes: float | None = None,
    device: str = "cpu",
    out: Path | None = None,
) -> Path:
    """Trains a planner for an environment, or goes on where an interrupted training stopped.

    Args:
        minutes: instead of the planner's own number of steps.
        out: file or folder of the weights; by default the user's cache. Wherever it is, runs of
            this user find it.

    Returns:
        The file of the weights.

    Raises:
        InputError: the planner needs no training or cannot plan there, or an argument is out of
            range.
    """
    world = env.make()
    made = _learned(planner)
    checked_device(device)
    _check_supported(made, planner.id, world)
    check_range("--seed", seed, 0, TEST_SEEDS - 1)
    if minutes is not None:
        check_range("--minutes", minutes, 0.01, 100_000)
    file = _destination(made, world, out)
    checkpoint = _checkpoint(made.name, world, f"{planner.spec.version} {seed} {minutes} {device}")
    expected = minutes or made.expected_minutes(world)
    logger.info("training %s for %s, about %.0f minutes", planner.id, env.id, math.ceil(expected))
    if checkpoint.is_file():
        logger.info("going on from where an earlier training stopped")
    with TrainingProgress(made.name) as progress:
        how = Training(seed, minutes, device, checkpoint, progress.show)
        trained = made.train(world, how)
    manifest = Manifest(
        planner=made.name,
        env=env.id,
        env_fingerprint=made.domain(world),
        settings=trained.settings,
        seed=seed,
        data_s=round(trained.data_s, 2),
        train_s=round(trained.train_s, 2),
        losses=trained.losses,
        validation=trained.validation,
        command=_command(env.id, made.name, seed, minutes, device),
        machine=machine.describe(),
    )
    weight_files.write(file, trained.tensors, manifest)
    how.forget()
    if file != weight_files.cached_file(made.name, made.domain(world)):
        _let_runs_find(file, made.name, made.domain(world))
    return file


def _let_runs_find(file: Path, name: str, domain: str) -> None:
    try:
        weight_files.link(file, name, domain)
    except OSError as error:
        logger.warning("runs will not find these weights by themselves: %s", error)


def unready(planner: Entry[Planner], world: World, *, may_train: bool) -> SetUp | None:
    """Sees to it that a planner has weights where it needs some; else the reason why not."""
    if not queries.lacks_weights(planner, world):
        return None
    if not may_train:
        how = _how_to_train(planner.spec.id, world)
        reason = f"no weights for {world.entry.id}, and --no-train was given; `{how}` makes some"
        return SetUp(Fault.SKIPPED.value, reason, 0.0)
    begin = monotonic()
    try:
        queries.train(planner, world)
    except queries.PlannerError as error:
        return _failed(planner, error.traceback, begin)
    except InputError:
        raise
    except Exception:  # noqa: BLE001  ours may fail too
        return _failed(planner, traceback.format_exc(limit=-4).strip(), begin)
    return None


def _failed(planner: Entry[Planner], error: str, begin: float) -> SetUp:
    logger.warning("training %s failed: %s", planner.id, error.splitlines()[-1])
    return SetUp(Fault.ERROR.value, f"training: {error}", monotonic() - begin)


def refuse_untrained(planner: Entry[Planner], world: World) -> None:
    """Raises InputError if a planner would have to be trained first, and says how."""
    if queries.lacks_weights(planner, world):
        how = _how_to_train(planner.id, world)
        raise InputError(f"{planner.id} has no weights for {world.entry.id}; `{how}` makes some")


def _how_to_train(planner: str, world: World) -> str:
    return shlex.join(["bench", "train", "--env", world.entry.id, "--planner", planner])


def ready(env: Entry[Environment], planner: Entry[Planner], may_train: bool) -> Planner:
    """A planner set up in this process, trained before if it has to be.

    Raises:
        InputError: it cannot plan there, or has no weights and may not be trained.
    """
    made, world = planner.make(), env.make()
    _check_supported(made, planner.id, world)
    refused = unready(planner, World(env, world), may_train=may_train)
    if refused is not None:
        raise InputError(f"{planner.id}: {refused.error}")
    made.setup(world, seed=0)
    return made


def _learned(planner: Entry[Planner]) -> LearnedPlanner:
    made = planner.make()
    if not isinstance(made, LearnedPlanner):
        raise InputError(f"{planner.id} needs no training")
    return made


def _check_supported(planner: Planner, id: str, env: Environment) -> None:
    reason = planner.unsupported(env)
    if reason is not None:
        raise InputError(f"{id} cannot plan there: {reason}")


def _destination(planner: LearnedPlanner, env: Environment, out: Path | None) -> Path:
    whose = planner.name, planner.domain(env)
    if out is None:
        return weight_files.cached_file(*whose)
    file = out / weight_files.file_name(*whose) if out.is_dir() else out
    if not file.parent.is_dir():
        raise InputError(f"--out {out}: there is no folder {file.parent}")
    if file.exists() and not weight_files.is_described(file):
        raise InputError(f"--out {out}: there is such a file, and it does not hold weights")
    return file


def _checkpoint(name: str, env: Environment, how: str) -> Path:
    """A file that no training in another way shares."""
    folder = cache_folder() / "training"
    digest = hashlib.sha256(how.encode()).hexdigest()[:12]
    with input_error_of(f"cannot keep checkpoints in {folder}"):
        folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{name}-{env.fingerprint}-{digest}.checkpoint"


def _command(env: str, planner: str, seed: int, minutes: float | None, device: str) -> str:
    words = ["bench", "train", "--env", env, "--planner", planner, "--seed", str(seed)]
    if minutes is not None:
        words += ["--minutes", f"{minutes:g}"]
    if device != "cpu":
        words += ["--device", device]
    return shlex.join(words)
