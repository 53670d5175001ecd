"""Runs a suite: who plans when, in which process, and what becomes of the result."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from functools import cached_property
from time import monotonic

from bench import training
from bench.contestant import Contestant
from bench.judge import Judge
from bench.planner_queries import minutes_of_training
from bench.process import Attempt
from bench.progress import Progress
from bench.record import Fault, Record, encode_path, outcome
from bench.session import BLOCK, Costs, Session, now
from bench.slots import Slots
from bench.store import Store
from bench.suite import Arena, Suite, on_device
from bench.underway import Underway
from envs import Problem
from envs.registry import Entry
from envs.seeding import stream
from planners import Planner

logger = logging.getLogger(__name__)

_ENDS_RUNS = (
    "passed over: twice the harness came to its end while it judged or stored what this planner "
    "returned here; --force tries again"
)


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
    if not any(stage.open for stage in stages):
        return
    _announce_training(stages)
    for stage in stages:
        stage.prepare()
    for stage in stages:  # not before all are: one training may give several planners weights
        stage.enter()
    if any(stage.minutes_of_training for stage in stages):
        store.put_selection(suite.selection())  # again: the weights are known now
    progress = Progress(sum(len(stage.open) for stage in stages))
    try:
        for stage in stages:
            stage.run(progress)
    finally:
        progress.close()
        session.wall_s = monotonic() - begin
        if session.costs.attempts:
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
        self._underway = Underway(store.folder)
        self._force = force
        self._reference_lengths: dict[int, float] = {}
        self._look()

    def _look(self) -> None:
        """Sees what the store holds of what was asked for, by the weights that there are now."""
        self._weights = {p.id: self._arena.weights(p) for p in self._suite.planners}
        fingerprint = self._arena.env.fingerprint
        held = self._store.records(
            [fingerprint],
            self._suite.seed,
            self._suite.settings_digest,
            self._suite.planner_versions,
            {fingerprint: self._weights},
        )
        tried = held[held["status"] != Fault.SKIPPED.value]
        done = set() if self._force else set(zip(tried["planner"], tried["problem"], strict=True))
        self.open = {
            (planner.id, index)
            for planner in self._suite.planners
            for index in range(self._suite.problems)
            if (planner.id, index) not in done
        }
        reference = self._suite.stop.reference
        if reference:
            of_reference = held[(held["planner"] == reference.id) & (held["solved"] == 1)]
            lengths = zip(of_reference["problem"], of_reference["length"], strict=True)
            self._reference_lengths = dict(lengths)

    @cached_property
    def minutes_of_training(self) -> float:
        """About how long `prepare` takes, by what has weights when it is first asked."""
        if not self._suite.train:
            return 0.0
        return sum(minutes_of_training(p, self._arena.shown) for p in self._contesting())

    def prepare(self) -> None:
        """Trains what has to be trained."""
        begin, trains = monotonic(), self.minutes_of_training > 0
        self._unready = {
            planner.id: training.unready(
                on_device(planner, self._suite.device),
                self._arena.shown,
                may_train=self._suite.train,
            )
            for planner in self._contesting()
        }
        if trains:
            self._session.add(Costs(setup_s=monotonic() - begin))

    def enter(self) -> None:
        """Has everybody ready to begin."""
        if any(self._arena.weights(p) != self._weights[p.id] for p in self._suite.planners):
            self._look()
        self._contestants = {
            planner.id: Contestant(
                self._arena, planner, self._suite, self._session, self._unready.get(planner.id)
            )
            for planner in self._contesting()
        }

    def _contesting(self) -> list[Entry[Planner]]:
        ids = {id for id, _ in self.open}
        return [planner for planner in self._suite.planners if planner.id in ids]

    def run(self, progress: Progress) -> None:
        """Attempts all open problems."""
        contestants = self._contestants
        at_once = min(self._suite.jobs, len(contestants))
        if not at_once:
            return
        self._slots = Slots(self._arena, self._suite.jobs, at_once)
        pool = ThreadPoolExecutor(at_once)
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
        with self._slots.taken() as slot:
            contestant.confine(slot.cpus)
            for problem in block:
                if (contestant.id, problem.index) not in self.open or contestant.stopped:
                    continue
                if self._underway.has_ended_runs(*self._key(contestant, problem)):
                    attempt = Attempt(Fault.CRASH.value, None, error=_ENDS_RUNS)
                else:
                    attempt = self._attempt(contestant, problem)
                if contestant.stopped:
                    return  # the run is being interrupted: what came back is not a result
                with self._underway.judging(*self._key(contestant, problem)):
                    record = self._judged(slot.judge, contestant, problem, attempt)
                    self._store.put(record)
                progress.add(record)

    def _attempt(self, contestant: Contestant, problem: Problem) -> Attempt:
        stop_cost = self._suite.stop.stop_cost(self._reference_lengths.get(problem.index))
        return contestant.attempt(problem, stop_cost)

    def _key(self, contestant: Contestant, problem: Problem) -> tuple[object, ...]:
        """What makes an attempt the same in another run into the same folder."""
        suite, fingerprint = self._suite, self._arena.env.fingerprint
        who = contestant.id, suite.planner_versions[contestant.id], contestant.weights
        return *who, fingerprint, problem.index, suite.seed, suite.settings_digest

    def _judged(
        self, judge: Judge, contestant: Contestant, problem: Problem, attempt: Attempt
    ) -> Record:
        begin = monotonic()
        judged = judge(problem, attempt.path) if attempt.claims else None
        spent = monotonic() - begin
        self._session.add(Costs(attempts=1, solve_s=attempt.solve_s or 0.0, judge_s=spent))
        verdict = judged.verdict.value if judged else ""
        what = outcome(attempt.status, verdict, attempt.solve_s, self._suite.time_limit_s)
        record = contestant.record(
            problem,
            attempt,
            judged,
            run_id=self._session.run_id,
            outcome=what,
            measured_at=now(),
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
