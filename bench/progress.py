"""Progress of a run: a bar on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import logging
import sys
from collections import Counter
from time import monotonic

from tqdm import tqdm

from bench.record import Record, Verdict

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
        name = f"{record.env} {record.planner}"
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
