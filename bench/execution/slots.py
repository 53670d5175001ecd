"""Where planners plan at the same time without disturbing each other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import SimpleQueue

from bench.execution import machine
from bench.execution.config import ProblemSet
from bench.judging.judge import Judge


@dataclass(frozen=True)
class Slot:
    """One of several planners' place at a time: processors that no other uses, and a judge, which
    works on them while the planner waits. So judges wait neither for each other nor for planners,
    and none of them takes time from a planner whose clock runs.

    Attributes:
        cpus: logical processors; empty for any.
    """

    cpus: tuple[int, ...]
    judge: Judge


class Slots:
    """The slots of a problem set.

    Args:
        jobs: planners at a time, among whom the machine is divided.
        used: as many of their slots as will ever be taken at once.
    """

    def __init__(self, problem_set: ProblemSet, jobs: int, used: int) -> None:
        self._free: SimpleQueue[Slot] = SimpleQueue()
        worlds = [problem_set.env, *(problem_set.entry.make() for _ in range(used - 1))]
        # Not all of `jobs`: making a world may take seconds.
        for cpus, world in zip(machine.shares(jobs), worlds, strict=False):
            self._free.put(Slot(cpus, Judge(world)))

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
