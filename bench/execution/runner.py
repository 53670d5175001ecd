"""Carries out a run: who plans when, in which process, and what becomes of the result."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from functools import cached_property
from itertools import product
from time import monotonic

from bench.execution import measurement, weights_manager
from bench.execution.attempt_journal import Underway
from bench.execution.config import ProblemSet, RunConfig, on_device, repeated
from bench.execution.planner_queries import minutes_of_training
from bench.execution.session import BLOCK, Costs, Progress, Session, Slot, Slots, now
from bench.execution.supervised_planner import SupervisedPlanner
from bench.execution.worker_process import Attempt
from bench.storage.record import Fault, Record
from bench.storage.store import Store
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
    config: RunConfig,
    store: Store,
    *,
    force: bool = False,
    started_s: float = 0.0,
) -> None:
    """Measures whatever of the run the store does not hold yet.

    Args:
        force: measure again what the store holds.
        started_s: seconds that starting up took before this call, for the share of overhead.

    Raises:
        KeyboardInterrupt: interrupted; whatever was finished is in the store.
    """
    begin = monotonic() - started_s
    session = Session()
    stages = [
        _Stage(config, problem_set, store, session, force) for problem_set in config.problem_sets
    ]
    if not force:
        for stage in stages:
            stage.add_missing_metrics()
    if not any(stage.open for stage in stages):
        return
    _announce_training(stages)
    for stage in stages:
        stage.prepare()
    for stage in stages:  # not before all are: one training may give several planners weights
        stage.enter()
    if any(stage.minutes_of_training for stage in stages):
        store.put_selection(config.selection())  # again: the weights are known now
    progress = Progress(sum(len(stage.open) for stage in stages))
    try:
        for stage in stages:
            stage.run(progress)
    finally:
        progress.close()
        session.wall_s = monotonic() - begin
        if session.costs.attempts:
            store.put_session(session.run_id, session.described(config))


def _announce_training(stages: Sequence[_Stage]) -> None:
    minutes = sum(stage.minutes_of_training for stage in stages)
    if minutes:
        logger.info(
            "learned planners are trained first, about %.0f minutes; --no-train leaves them out",
            max(1.0, minutes),
        )


class _Stage:
    """One environment of a run: what is still to be measured there, and its measuring."""

    def __init__(
        self,
        config: RunConfig,
        problem_set: ProblemSet,
        store: Store,
        session: Session,
        force: bool,
    ) -> None:
        self._config = config
        self._problem_set = problem_set
        self._store = store
        self._session = session
        self._underway = Underway(store.folder)
        self._force = force
        self._reference_lengths: dict[tuple[int, int], float] = {}
        facts = problem_set.facts
        self._invalid = {} if config.keep_invalid else facts.invalid
        self._problems = problem_set.problems if config.keep_invalid else facts.problems
        self._look()

    def _look(self) -> None:
        """Sees what the store holds of what was asked for, by the weights that there are now."""
        self._weights = {p.id: self._problem_set.weights(p) for p in self._config.planners}
        fingerprint = self._problem_set.env.fingerprint
        held = self._store.records(
            [fingerprint],
            self._config.seed,
            self._config.settings_digest,
            self._config.planner_versions,
            {fingerprint: self._weights},
        )
        self._held = held
        tried = held[held["status"] != Fault.SKIPPED.value]
        places = zip(tried["planner"], tried["problem"], tried["repeat"], strict=True)
        done = set() if self._force else set(places)
        self.open = {
            (planner.id, problem.index, repeat)
            for planner in self._config.planners
            for problem in self._problems
            for repeat in range(self._config.repeats)
            if (planner.id, problem.index, repeat) not in done
        }
        reference = self._config.stop.reference
        if reference:
            of_reference = held[(held["planner"] == reference.id) & (held["solved"] == 1)]
            solved = zip(of_reference["problem"], of_reference["repeat"], strict=True)
            self._reference_lengths = dict(zip(solved, of_reference["length"], strict=True))

    def add_missing_metrics(self) -> None:
        """To what the store holds already."""
        problems = {problem.index: problem for problem in self._problem_set.problems}
        measurement.add_missing_metrics(self._store, self._held, self._problem_set.env, problems)

    @cached_property
    def minutes_of_training(self) -> float:
        """About how long `prepare` takes, by what has weights when it is first asked."""
        if not self._config.train:
            return 0.0
        return sum(minutes_of_training(p, self._problem_set.shown) for p in self._open_planners())

    def prepare(self) -> None:
        """Trains what has to be trained."""
        begin, trains = monotonic(), self.minutes_of_training > 0
        self._unready = {
            planner.id: weights_manager.unready(
                on_device(planner, self._config.device),
                self._problem_set.shown,
                may_train=self._config.train,
            )
            for planner in self._open_planners()
        }
        if trains:
            self._session.add(Costs(setup_s=monotonic() - begin))

    def enter(self) -> None:
        """Has everybody ready to begin."""
        if any(self._problem_set.weights(p) != self._weights[p.id] for p in self._config.planners):
            self._look()
        self._supervised_planners = {
            planner.id: SupervisedPlanner(
                self._problem_set,
                planner,
                self._config,
                self._session,
                self._unready.get(planner.id),
            )
            for planner in self._open_planners()
        }

    def _open_planners(self) -> list[Entry[Planner]]:
        ids = {id for id, _, _ in self.open}
        return [planner for planner in self._config.planners if planner.id in ids]

    def run(self, progress: Progress) -> None:
        """Attempts all open problems."""
        supervised_planners = self._supervised_planners
        at_once = min(self._config.jobs, len(supervised_planners))
        if not at_once:
            return
        self._slots = Slots(self._problem_set, self._config, at_once)
        pool = ThreadPoolExecutor(at_once)
        try:
            for number, begin in enumerate(range(0, len(self._problems), BLOCK)):
                block = self._problems[begin : begin + BLOCK]
                for together in self._order(number, supervised_planners):
                    tasks = [pool.submit(self._attempt_block, c, block, progress) for c in together]
                    _finish(tasks)
        finally:
            for supervised in supervised_planners.values():
                supervised.stop()
            pool.shutdown(cancel_futures=True)
            for supervised in supervised_planners.values():
                supervised.stop()  # again: one may have started a process meanwhile

    def _order(
        self, block: int, supervised_planners: dict[str, SupervisedPlanner]
    ) -> Iterator[list[SupervisedPlanner]]:
        """Who plans at the same time, in turn: the reference alone, then the others shuffled."""
        reference = self._config.stop.reference
        first = reference.id if reference else None
        if first in supervised_planners:
            yield [supervised_planners[first]]
        others = [c for id, c in supervised_planners.items() if id != first]
        stream("order", self._config.seed, block).shuffle(others)
        yield others

    def _attempt_block(
        self, supervised: SupervisedPlanner, block: Sequence[Problem], progress: Progress
    ) -> None:
        with self._slots.taken() as slot:
            supervised.confine(slot.cpus)
            for repeat, problem in product(range(self._config.repeats), block):
                if (supervised.id, problem.index, repeat) not in self.open or supervised.stopped:
                    continue
                key = self._key(supervised, problem, repeat)
                asked = repeated(problem, repeat)
                invalid = self._invalid.get(problem.index)
                if invalid is not None:
                    attempt = Attempt(Fault.INVALID_PROBLEM.value, None, error=invalid)
                elif self._underway.has_ended_runs(*key):
                    attempt = Attempt(Fault.CRASH.value, None, error=_ENDS_RUNS)
                else:
                    attempt = supervised.attempt(asked, self._stop_cost(problem, repeat))
                if supervised.stopped:
                    return  # the run is being interrupted: what came back is not a result
                with self._underway.judging(*key):
                    record = self._judged(slot, supervised, asked, repeat, attempt)
                    self._store.put(record)
                progress.add(record)

    def _stop_cost(self, problem: Problem, repeat: int) -> float:
        reached = self._reference_lengths.get((problem.index, repeat))
        return self._config.stop.stop_cost(reached)

    def _key(
        self, supervised: SupervisedPlanner, problem: Problem, repeat: int
    ) -> tuple[object, ...]:
        """What makes an attempt the same in another run into the same folder."""
        config, fingerprint = self._config, self._problem_set.env.fingerprint
        who = supervised.id, config.planner_versions[supervised.id], supervised.weights
        again = (repeat,) if repeat else ()  # the first as before there were repeats
        return *who, fingerprint, problem.index, config.seed, config.settings_digest, *again

    def _judged(
        self,
        slot: Slot,
        supervised: SupervisedPlanner,
        problem: Problem,
        repeat: int,
        attempt: Attempt,
    ) -> Record:
        begin = monotonic()
        judged = measurement.judged(slot.judge, problem, attempt, slot.simplifier)
        spent = monotonic() - begin
        self._session.add(Costs(attempts=1, solve_s=attempt.solve_s or 0.0, judge_s=spent))
        run_id = self._session.run_id
        record = supervised.record(
            problem, attempt, judged, run_id=run_id, repeat=repeat, measured_at=now()
        )
        reference = self._config.stop.reference
        if reference and supervised.id == reference.id:
            # Measured anew, it may fail where it once solved.
            self._reference_lengths.pop((problem.index, repeat), None)
            if judged is not None and judged.length and record.solved:
                self._reference_lengths[problem.index, repeat] = judged.length
        return record


def _finish(tasks: list[Future[None]]) -> None:
    """Waits for all tasks; the first failure or interruption ends the wait."""
    done, _ = wait(tasks, return_when=FIRST_EXCEPTION)
    for task in done:
        task.result()
