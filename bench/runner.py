"""Runs a suite: who plans when, in which process, and what becomes of the result."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property
from time import monotonic
from typing import Any

from bench import machine, training
from bench.contestant import Contestant
from bench.judge import Judge
from bench.process import Attempt
from bench.progress import Progress
from bench.record import Fault, Record, encode_path, outcome
from bench.store import Store
from bench.suite import Arena, Suite
from envs import Problem
from envs.registry import Entry
from envs.seeding import stream
from planners import Planner

logger = logging.getLogger(__name__)

BLOCK = 10
"""Problems after which the order of the planners is drawn anew."""


@dataclass
class Session:
    """The costs of measuring, summed over what one call of `run` measured."""

    run_id: str = field(default_factory=lambda: uuid.uuid4().hex[:12])
    started: str = field(default_factory=lambda: _now())
    attempts: int = 0
    setup_s: float = 0.0
    solve_s: float = 0.0
    judge_s: float = 0.0
    wall_s: float = 0.0

    def described(self, suite: Suite) -> dict[str, Any]:
        """JSON data for store and manifest, the share of overhead included."""
        costs = {k: round(v, 3) if isinstance(v, float) else v for k, v in vars(self).items()}
        overhead = 1 - (self.setup_s + self.solve_s) / (self.wall_s * suite.jobs)
        return {
            **costs,
            "overhead_share": round(overhead, 4),
            "jobs": suite.jobs,
            "order": {"seed": suite.seed, "shuffled_every": BLOCK},
            "settings": suite.settings,
            **machine.describe(),
        }


def run(
    suite: Suite,
    store: Store,
    *,
    force: bool = False,
    started_s: float = 0.0,
) -> None:
    """Measures whatever of the suite the store does not hold yet.

    Args:
        force: measure again what the store holds.
        started_s: seconds that starting up took before this call, for the share of overhead.

    Raises:
        KeyboardInterrupt: interrupted; whatever was finished is in the store.
    """
    begin = monotonic() - started_s
    session = Session()
    stages = [_Stage(suite, arena, store, session, force) for arena in suite.arenas]
    total = sum(len(stage.open) for stage in stages)
    if total == 0:
        return
    _announce_training(stages)
    for stage in stages:
        stage.prepare()
    progress = Progress(total)
    try:
        for stage in stages:
            stage.run(progress)
    finally:
        progress.close()
        session.wall_s = monotonic() - begin
        if session.attempts:
            store.put_session(session.run_id, session.described(suite))


def _announce_training(stages: Sequence[_Stage]) -> None:
    minutes = sum(stage.minutes_of_training for stage in stages)
    if minutes:
        logger.info(
            "learned planners are trained first, about %.0f minutes; --no-train leaves them out",
            max(1.0, minutes),
        )


class _Stage:
    """One arena of a run: what is still to be measured there, and its measuring."""

    def __init__(
        self, suite: Suite, arena: Arena, store: Store, session: Session, force: bool
    ) -> None:
        self._suite = suite
        self._arena = arena
        self._store = store
        self._session = session
        self._fingerprint = arena.env.fingerprint
        self._judge = Judge(arena.env)
        self._lock = threading.Lock()  # one result at a time is judged and stored
        held = store.records(
            [self._fingerprint], suite.seed, suite.settings_digest, suite.planner_versions
        )
        reference = suite.stop.reference
        tried = held[held["status"] != Fault.SKIPPED.value]
        done = set() if force else set(zip(tried["planner"], tried["problem"], strict=True))
        self.open = {
            (planner.id, index)
            for planner in suite.planners
            for index in range(suite.problems)
            if (planner.id, index) not in done
        }
        by_reference = (
            held[(held["planner"] == reference.id) & (held["solved"] == 1)]
            if reference
            else held[:0]
        )
        self._reference_lengths: dict[int, float] = dict(
            zip(by_reference["problem"], by_reference["length"], strict=True)
        )

    @cached_property
    def minutes_of_training(self) -> float:
        """About how long `prepare` takes, by what has weights when it is first asked."""
        if not self._suite.train:
            return 0.0
        return sum(training.expected_minutes(self._arena.entry, p) for p in self._contesting())

    def prepare(self) -> None:
        """Trains what has to be trained."""
        begin, trains = monotonic(), self.minutes_of_training > 0
        self._contestants = {
            planner.id: Contestant(
                self._arena,
                planner,
                self._suite,
                self._session,
                training.unready(self._arena.entry, planner, may_train=self._suite.train),
            )
            for planner in self._contesting()
        }
        if trains:
            self._session.setup_s += monotonic() - begin

    def _contesting(self) -> list[Entry[Planner]]:
        ids = {id for id, _ in self.open}
        return [planner for planner in self._suite.planners if planner.id in ids]

    def run(self, progress: Progress) -> None:
        """Attempts all open problems."""
        contestants = self._contestants
        pool = ThreadPoolExecutor(self._suite.jobs)
        try:
            for number, begin in enumerate(range(0, self._suite.problems, BLOCK)):
                block = self._arena.problems[begin : begin + BLOCK]
                for together in self._order(number, contestants):
                    tasks = [pool.submit(self._attempt_block, c, block, progress) for c in together]
                    _finish(tasks)
        finally:
            for contestant in contestants.values():
                contestant.stop()
            pool.shutdown(cancel_futures=True)
            for contestant in contestants.values():
                contestant.stop()  # again: one may have started a process meanwhile

    def _order(self, block: int, contestants: dict[str, Contestant]) -> Iterator[list[Contestant]]:
        """Who plans at the same time, in turn: the reference alone, then the others shuffled."""
        reference = self._suite.stop.reference
        first = reference.id if reference else None
        if first in contestants:
            yield [contestants[first]]
        others = [c for id, c in contestants.items() if id != first]
        stream("order", self._suite.seed, block).shuffle(others)
        yield others

    def _attempt_block(
        self, contestant: Contestant, block: Sequence[Problem], progress: Progress
    ) -> None:
        for problem in block:
            if (contestant.id, problem.index) not in self.open or contestant.stopped:
                continue
            stop_cost = self._suite.stop.stop_cost(self._reference_lengths.get(problem.index))
            attempt = contestant.attempt(problem, stop_cost)
            if contestant.stopped:
                return  # the run is being interrupted: what came back is not a result
            with self._lock:
                record = self._judged(contestant, problem, attempt)
                self._store.put(record)
                progress.add(record)

    def _judged(self, contestant: Contestant, problem: Problem, attempt: Attempt) -> Record:
        begin = monotonic()
        judged = self._judge(problem, attempt.path) if attempt.claims else None
        self._session.judge_s += monotonic() - begin
        self._session.attempts += 1
        self._session.solve_s += attempt.solve_s or 0.0
        verdict = judged.verdict.value if judged else ""
        what = outcome(attempt.status, verdict, attempt.solve_s, self._suite.time_limit_s)
        record = contestant.record(
            problem,
            attempt,
            judged,
            run_id=self._session.run_id,
            outcome=what,
            measured_at=_now(),
            path=encode_path(attempt.path),
        )
        reference = self._suite.stop.reference
        if reference and contestant.id == reference.id:
            # Measured anew, it may fail where it once solved.
            self._reference_lengths.pop(problem.index, None)
            if record.solved and record.length:
                self._reference_lengths[problem.index] = record.length
        return record


def _finish(tasks: list[Future[None]]) -> None:
    """Waits for all tasks; the first failure or interruption ends the wait."""
    done, _ = wait(tasks, return_when=FIRST_EXCEPTION)
    for task in done:
        task.result()


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")
