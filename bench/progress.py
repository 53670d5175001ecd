"""Progress of runs and trainings: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import logging
import sys
from collections import Counter
from time import monotonic
from typing import NoReturn

from tqdm import tqdm

import planners.learned
from bench.record import Record, Verdict
from envs.errors import printable

logger = logging.getLogger(__name__)
_INTERVAL_S = 10.0


class Progress:
    """Counts attempts and verified successes a planner.

    Args:
        total: the number of attempts to come.
    """

    def __init__(self, total: int) -> None:
        self._total = total
        self._done: Counter[str] = Counter()
        self._solved: Counter[str] = Counter()
        self._next = monotonic() + _INTERVAL_S
        on_terminal = sys.stderr.isatty()
        self._bar = tqdm(total=total, unit="problem", disable=not on_terminal, dynamic_ncols=True)
        self._lines = not on_terminal

    def add(self, record: Record) -> None:
        """Counts one attempt."""
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
        self._on_terminal = sys.stderr.isatty()
        self._next = monotonic() + _INTERVAL_S
        self._solved = ""

    def show(self, progress: planners.learned.Progress) -> None:
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
