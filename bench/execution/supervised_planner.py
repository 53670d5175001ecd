"""A planner in an environment for the length of a run: its process, restarted when it dies."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bench.execution import machine
from bench.execution import planner_queries as queries
from bench.execution.config import ProblemSet, RunConfig, on_device
from bench.execution.measurement import stored_metrics
from bench.execution.planner_queries import World
from bench.execution.session import Costs, Session
from bench.execution.worker_process import Attempt, SetUp, WorkerProcess, hard_limit_s
from bench.judging.judge import Judgement
from bench.storage.record import (
    LEFT_OUT,
    Fault,
    Record,
    Verdict,
    claimed_solve_s,
    encode_path,
    outcome,
)
from envs import InputError, Problem
from envs.registry import Entry
from envs.seeding import derived_seed
from planners import Planner

_OTHER_WEIGHTS = (
    "the weights were replaced while the run went on; run again to measure the new ones"
)

SETUP_LIMIT_S = 3600.0
"""A planner whose `setup` takes longer is killed."""

WARM_UP_GRACE_S = 30.0
"""By which a planner may overrun its time limit on the warm-up problem, on which it may compile: if
it were killed then, it would compile on the clock of an attempt, and be killed again."""

_MOST_WARM_UPS = 3


class SupervisedPlanner:
    """Attempts problems in a worker process.

    The process starts with the first problem, sets the planner up and solves a throw-away
    problem off the clock. If it dies, the problem at hand is lost and the next gets a new one,
    which is set up again.

    Args:
        session: where seconds of setting up are added.
        unready: why it cannot be set up, if it cannot.

    Attributes:
        weights: the digest of those that it plans with. Files that others have taken the place of
            when it is set up again are not used.
    """

    def __init__(
        self,
        problem_set: ProblemSet,
        planner: Entry[Planner],
        config: RunConfig,
        session: Session,
        unready: SetUp | None = None,
    ) -> None:
        self.id = planner.id
        self.weights = problem_set.weights(planner)
        self.stopped = False
        self._problem_set = problem_set
        self._planner = planner
        self._config = config
        self._session = session
        self._worker: WorkerProcess | None = None
        self._planned_elsewhere = queries.planned_elsewhere(planner)
        self._set_up = unready
        self._given_up = unready is not None
        self._has_been_ready = False
        self._survives_warm_up = True

    def attempt(self, problem: Problem, stop_cost: float) -> Attempt:
        """One attempt at a problem, whatever becomes of it."""
        set_up = self._ready()
        if set_up.fault or self._worker is None:
            return Attempt(set_up.fault, None, error=_said(set_up))
        scene = self._scene(self._worker, problem)
        if scene is not None and scene.fault:
            why = f"set_scene: {scene.error}"
            return Attempt(scene.fault, None, error=why, scene_s=scene.setup_s)
        attempt = self._worker.solve(problem, self._config.time_limit_s, stop_cost)
        if self._planned_elsewhere:
            attempt = _as_claimed(attempt)
        return attempt if scene is None else replace(attempt, scene_s=scene.setup_s)

    def _scene(self, worker: WorkerProcess, problem: Problem) -> SetUp | None:
        """How getting ready for a problem's scene went; None where all have the same."""
        if not self._problem_set.env.scenes_differ:
            return None
        scene = worker.set_scene(problem, SETUP_LIMIT_S)
        self._session.add(Costs(setup_s=scene.setup_s))
        return scene

    def confine(self, cpus: Sequence[int]) -> None:
        """Lets its process run on some processors only; see `machine.confine_process`."""
        if self._worker is not None and self._worker.alive:
            machine.confine_process(self._worker.pid, cpus)

    def stop(self) -> None:
        """Ends the process, also while it is working."""
        self.stopped = True
        if self._worker is not None:
            self._worker.close()

    def record(
        self, problem: Problem, attempt: Attempt, judged: Judgement | None, **known: Any
    ) -> Record:
        """The row for an attempt; `known` are the columns that only the run knows: `run_id`,
        `repeat` and `measured_at`."""
        set_up = self._set_up or SetUp("", "", 0.0)
        verdict = judged.verdict.value if judged else ""
        came = outcome(attempt.status, verdict, self._took_s(attempt), self._config.time_limit_s)
        checks = attempt.stats.get("collision_checks")
        reason = judged.reason if judged else ""
        return Record(
            env=self._problem_set.entry.id,
            env_fingerprint=self._problem_set.env.fingerprint,
            planner=self.id,
            planner_version=self._planner.spec.version,
            weights=self.weights,
            problem=problem.index,
            problems_seed=self._config.seed,
            settings=self._config.settings_digest,
            seed=problem.seed,
            status=attempt.status,
            verdict=verdict,
            outcome=came,
            solved=int(came == Verdict.VALID.value),
            setup_s=set_up.setup_s,
            train_s=set_up.train_s,
            scene_s=attempt.scene_s,
            solve_s=attempt.solve_s,
            cpu_s=attempt.cpu_s,
            load=attempt.load,
            metrics=stored_metrics(judged),
            path=encode_path(attempt.path),
            collision_checks=checks if isinstance(checks, int) else None,
            peak_memory_mb=attempt.peak_memory_mb,
            attempt_memory_mb=attempt.attempt_memory_mb,
            warm=int(self._survives_warm_up),
            processor=machine.processor(),
            error=attempt.error or reason,
            stats=json.dumps(attempt.stats),
            **known,
        )

    def _took_s(self, attempt: Attempt) -> float | None:
        """What the time limit is held against: of what was planned elsewhere the time that it
        claims; without a claim there is nothing that would be too late."""
        if not self._planned_elsewhere:
            return attempt.solve_s
        return claimed_solve_s(json.dumps(attempt.stats)) or 0.0

    def _ready(self) -> SetUp:
        """Sees to it that a process waits for a problem, unless setting up failed at first.

        Where it went well before, its failing costs no more than the problem at hand. A first
        process that dies may have been killed from outside, so that another is tried.
        """
        if self._set_up is None or not (self._given_up or self._alive()):
            self._set_up = self._started()
            if self._set_up.fault == Fault.CRASH.value and not self._has_been_ready:
                self._set_up = self._started()
            self._given_up = bool(self._set_up.fault) and not self._has_been_ready
        return self._set_up

    def _started(self) -> SetUp:
        """How setting up went in a new process."""
        self._worker = WorkerProcess(
            World(self._problem_set.entry, self._problem_set.env),
            on_device(self._planner, self._config.device),
            self._config.memory_limit_mb,
        )
        seed = derived_seed("planner setup", self._config.seed)
        set_up = self._worker.set_up(seed, SETUP_LIMIT_S)
        self._session.add(Costs(setup_s=set_up.setup_s))
        if not set_up.fault and self._weights_now() != self.weights:
            set_up = replace(set_up, fault=Fault.ERROR.value, error=_OTHER_WEIGHTS)
        if set_up.fault:
            self._worker.close()
            return set_up
        self._has_been_ready = True
        if self._survives_warm_up:
            self._warm_up(self._worker)
            self._survives_warm_up = self._alive()
        return set_up if self._alive() else self._started()

    def _warm_up(self, worker: WorkerProcess) -> None:
        """Solves the throw-away problem; again if it took so long that an attempt would have been
        killed, as the planner may have found its time over before it had compiled everything."""
        limit_s = self._config.time_limit_s
        scene = self._scene(worker, self._problem_set.warm_up)
        if scene is not None and scene.fault:
            return  # which the attempts will tell
        for _ in range(_MOST_WARM_UPS):
            made = worker.solve(self._problem_set.warm_up, limit_s, math.inf, WARM_UP_GRACE_S)
            if not self._alive() or (made.solve_s or 0.0) <= hard_limit_s(limit_s):
                return

    def _weights_now(self) -> str | None:
        """The digest of what a process that was just set up has read; None if it is gone."""
        try:
            return self._problem_set.weights(self._planner)
        except InputError:
            return None

    def _alive(self) -> bool:
        return self._worker is not None and self._worker.alive


def _said(set_up: SetUp) -> str:
    """What an attempt is told of how setting up went: a fault there, or why nobody was asked."""
    return set_up.error if set_up.fault in LEFT_OUT else f"setup: {set_up.error}"


def _as_claimed(attempt: Attempt) -> Attempt:
    """An attempt of which only the path was made elsewhere, without what handing it over cost here,
    and without a history of costs, whose times nobody measured here."""
    stats = {name: value for name, value in attempt.stats.items() if name != "cost_history"}
    return replace(
        attempt,
        stats=stats,
        solve_s=None,
        cpu_s=None,
        load=None,
        peak_memory_mb=None,
        attempt_memory_mb=None,
    )
