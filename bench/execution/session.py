"""One call of `runner.run`: its costs; its progress, a bar on a terminal, a line now and then
elsewhere; and where its planners plan at the same time without disturbing each other.
"""

from __future__ import annotations

import logging
import sys
import threading
import uuid
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from queue import SimpleQueue
from time import monotonic
from typing import Any, NoReturn

from tqdm.auto import tqdm

import planners.learning.learned_planner
from bench.execution import machine
from bench.execution.config import ProblemSet, RunConfig
from bench.judging.judge import Judge
from bench.judging.simplification import Simplifier
from bench.storage.record import Record, Verdict
from envs.errors import printable

BLOCK = 10
"""Problems after which the order of the planners is drawn anew."""


@dataclass(frozen=True)
class Costs:
    """Sums over what was measured: attempts, and seconds of setting up, solving and judging."""

    attempts: int = 0
    setup_s: float = 0.0
    solve_s: float = 0.0
    judge_s: float = 0.0


class Session:
    """The costs of measuring; several threads may add to them at once.

    Attributes:
        run_id: of the records that were made.
        wall_s: seconds that it all took.
    """

    def __init__(self) -> None:
        self.run_id = uuid.uuid4().hex[:12]
        self.wall_s = 0.0
        self._started = now()
        self._costs = Costs()
        self._lock = threading.Lock()

    @property
    def costs(self) -> Costs:
        """So far."""
        return self._costs

    def add(self, more: Costs) -> None:
        """Adds what something cost."""
        with self._lock:
            sums = {
                name: value + getattr(more, name) for name, value in asdict(self._costs).items()
            }
            self._costs = Costs(**sums)

    def described(self, config: RunConfig) -> dict[str, Any]:
        """JSON data for store and manifest, the share of overhead included."""
        costs = {"run_id": self.run_id, "started": self._started, **asdict(self.costs)}
        costs["wall_s"] = self.wall_s
        rounded = {k: round(v, 3) if isinstance(v, float) else v for k, v in costs.items()}
        planning = self.costs.setup_s + self.costs.solve_s
        overhead = 1 - planning / (self.wall_s * config.jobs)
        return {
            **rounded,
            "overhead_share": round(overhead, 4),
            "jobs": config.jobs,
            "order": {"seed": config.seed, "shuffled_every": BLOCK},
            "settings": config.settings,
            **machine.describe(),
        }


def now() -> str:
    """The time in UTC, to the second, as records and sessions have it."""
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


logger = logging.getLogger(__name__)
_INTERVAL_S = 10.0


def _shows_bars() -> bool:
    """Whether there is a terminal or a notebook to show a bar in."""
    return sys.stderr.isatty() or "ipykernel" in sys.modules


class Progress:
    """Counts attempts and verified successes a planner; several threads may add some at once.

    Args:
        total: the number of attempts to come.
    """

    def __init__(self, total: int) -> None:
        self._total = total
        self._done: Counter[str] = Counter()
        self._solved: Counter[str] = Counter()
        self._next = monotonic() + _INTERVAL_S
        on_terminal = _shows_bars()
        self._bar = tqdm(total=total, unit="problem", disable=not on_terminal, dynamic_ncols=True)
        self._lines = not on_terminal
        self._lock = threading.Lock()

    def add(self, record: Record) -> None:
        """Counts one attempt."""
        with self._lock:
            self._count(record)

    def _count(self, record: Record) -> None:
        name = printable(f"{record.env} {record.planner}")
        self._done[name] += 1
        self._solved[name] += record.outcome == Verdict.VALID.value
        told = f"{name}: {self._done[name]} done, {self._solved[name]} solved"
        self._bar.set_description_str(told, refresh=False)
        self._bar.update()
        if self._lines and monotonic() >= self._next:
            self._next = monotonic() + _INTERVAL_S
            logger.info("%d of %d attempts; %s", self._done.total(), self._total, told)

    def close(self) -> None:
        """Ends the bar."""
        self._bar.close()


class TrainingProgress:
    """Shows how a training goes.

    Args:
        name: of what is trained.
    """

    def __init__(self, name: str) -> None:
        self._name = printable(name)
        self._stage = ""
        self._bar: tqdm[NoReturn] | None = None
        self._on_terminal = _shows_bars()
        self._next = monotonic() + _INTERVAL_S
        self._solved = ""

    def show(self, progress: planners.learning.learned_planner.Progress) -> None:
        """Is told how far the training has come."""
        if progress.validation is not None:
            self._solved = "solves {} of {}".format(*progress.validation)
        loss = "" if progress.loss is None else f"loss {progress.loss:.3f}"
        told = ", ".join(filter(None, (loss, self._solved)))
        if progress.stage != self._stage:
            self._begin(progress.stage)
        assert self._bar is not None
        self._bar.n = round(100 * progress.share)
        self._bar.set_postfix_str(told, refresh=False)
        self._bar.update(0)
        late = monotonic() >= self._next or progress.validation is not None
        if not self._on_terminal and late:
            self._next = monotonic() + _INTERVAL_S
            percent = 100 * progress.share
            logger.info("%s %s: %.0f %%, %s", self._name, progress.stage, percent, told)

    def _begin(self, stage: str) -> None:
        self._stage = stage
        if self._bar is not None:
            self._bar.close()
        self._bar = tqdm(
            total=100,
            desc=f"{self._name} {stage}",
            disable=not self._on_terminal,
            dynamic_ncols=True,
            bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining} {postfix}",
        )

    def __enter__(self) -> TrainingProgress:
        return self

    def __exit__(self, *error: object) -> None:
        if self._bar is not None:
            self._bar.close()


@dataclass(frozen=True)
class Slot:
    """One of several planners' place at a time: processors that no other uses, and a judge, which
    works on them while the planner waits. So judges wait neither for each other nor for planners,
    and none of them takes time from a planner whose clock runs.

    Attributes:
        cpus: logical processors; empty for any.
        simplifier: where paths are to be simplified.
    """

    cpus: tuple[int, ...]
    judge: Judge
    simplifier: Simplifier | None


class Slots:
    """The slots of a problem set.

    Args:
        config: how many planners plan at a time, among whom the machine is divided; and whether
            paths are simplified.
        used: as many of their slots as will ever be taken at once.
    """

    def __init__(self, problem_set: ProblemSet, config: RunConfig, used: int) -> None:
        self._free: SimpleQueue[Slot] = SimpleQueue()
        worlds = [problem_set.env, *(problem_set.entry.make() for _ in range(used - 1))]
        # Not all of `jobs`: making a world may take seconds.
        for cpus, world in zip(machine.shares(config.jobs), worlds, strict=False):
            self._free.put(Slot(cpus, Judge(world), config.simplifier()))

    @contextmanager
    def taken(self) -> Iterator[Slot]:
        """One that is free, for the calling thread, which is confined to it together with whatever
        it starts."""
        slot = self._free.get()
        try:
            machine.confine_thread(slot.cpus)
            yield slot
        finally:
            self._free.put(slot)
