"""What to run: environments, planners, problems and the rules of the clock."""

from __future__ import annotations

import hashlib
import json
import logging
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import envs
import planners
from bench.execution import planner_queries as queries
from bench.execution.planner_queries import World
from bench.execution.problem_choice import ProblemChoice, check_range
from bench.execution.stop_rule import PAPER, StopRule, paper_rule
from bench.judging.metrics import REGISTERED
from bench.judging.problem_facts import UNKNOWN, ProblemFacts, problem_facts, share_blocked
from bench.judging.simplification import Simplifier
from bench.storage.problem_file import GivenProblems
from envs import Environment, InputError, Problem, processors
from envs.registry import Entry
from envs.seeding import derived_seed
from planners import Planner
from planners.learning.learned_planner import checked_device

logger = logging.getLogger(__name__)

CPU = "cpu"
"""The device that runs use unless another is asked for."""

RULES = 2
"""Rises whenever the protocol or the judge changes what is measured."""


@dataclass(frozen=True)
class RunConfig:
    """A run as it was asked for.

    Attributes:
        choice: which problems.
        repeats: how often each planner attempts each problem, with another seed each time.
        train: whether learned planners without weights are trained first.
        device: of PyTorch, for planners that take one and were not given another.
        keep_invalid: whether problems that are invalid as posed are attempted all the same.
        simplify_s: how long each valid path is simplified, at most, beside what the planner did; 0
            for not at all.
    """

    problem_sets: tuple[ProblemSet, ...]
    planners: tuple[Entry[Planner], ...]
    choice: ProblemChoice
    time_limit_s: float
    stop: StopRule
    jobs: int
    memory_limit_mb: int
    train: bool = True
    device: str = CPU
    repeats: int = 1
    keep_invalid: bool = False
    simplify_s: float = 0.0

    @property
    def seed(self) -> int:
        """Of problems, planners and order."""
        return self.choice.seed

    def simplifier(self) -> Simplifier | None:
        """A new one, if paths are to be simplified."""
        return Simplifier(self.simplify_s) if self.simplify_s else None

    @property
    def settings(self) -> dict[str, Any]:
        """Everything besides planner, environment and problem that a measurement depends on."""
        # Only said of what is unusual: what was measured before there was a choice still counts.
        elsewhere = {} if self.device == CPU else {"device": self.device}
        kept = {"invalid_problems": "kept"} if self.keep_invalid else {}
        simplified = {"simplify_s": self.simplify_s} if self.simplify_s else {}
        return {
            "rules": RULES,
            "time_limit_s": self.time_limit_s,
            "stop": self.stop.text,
            "jobs": self.jobs,
            "memory_limit_mb": self.memory_limit_mb,
            **elsewhere,
            **kept,
            **simplified,
            **self.choice.settings,
        }

    @property
    def settings_digest(self) -> str:
        """A short name for `settings`, equal exactly if they are."""
        text = json.dumps(self.settings, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    @property
    def planner_versions(self) -> dict[str, int]:
        """By the planners' ids. What another version did does not count as measured."""
        return {entry.id: entry.spec.version for entry in self.planners}

    def selection(self) -> dict[str, Any]:
        """JSON data that says which records of a store this run is about."""
        return {
            "envs": [
                {
                    "id": problem_set.entry.id,
                    "fingerprint": problem_set.env.fingerprint,
                    "units": dict(problem_set.env.units),
                    "space": str(problem_set.env.space),
                    "problems": problem_set.end,
                    "count": len(problem_set.problems),  # fewer, where numbers are left out
                    **self._told(problem_set),
                    "weights": {entry.id: problem_set.weights(entry) for entry in self.planners},
                }
                for problem_set in self.problem_sets
            ],
            "planners": [entry.id for entry in self.planners],
            "planner_versions": self.planner_versions,
            "improves": {entry.id: queries.improves(entry) for entry in self.planners},
            "planned_elsewhere": [e.id for e in self.planners if queries.planned_elsewhere(e)],
            "problems": max(problem_set.end for problem_set in self.problem_sets),
            **self.choice.data,
            "repeats": self.repeats,
            "seed": self.seed,
            "settings": self.settings,
            "settings_digest": self.settings_digest,
            "metrics": [metric.definition for metric in REGISTERED if metric.origin],
        }

    def _told(self, problem_set: ProblemSet) -> dict[str, Any]:
        """What is worth knowing of the problems: facts that tables show, of each problem whether
        its straight line is blocked, and which ends are invalid."""
        facts = problem_set.facts
        blocked = {"share_of_straight_lines_blocked": share_blocked(facts.straight_lines)}
        letters = dict(
            zip((p.index for p in problem_set.problems), facts.straight_lines, strict=True)
        )
        count = 0 if self.choice.given else len(problem_set.problems)
        drawn = problem_set.env.problem_statistics(count, self.seed) if count else {}
        return {
            "census": blocked | drawn,
            # Lists of problems may leave numbers out.
            "straight_lines": "".join(letters.get(n, UNKNOWN) for n in range(problem_set.end)),
            "invalid_ends": [end.data() for end in facts.invalid_ends],
        }


@dataclass(frozen=True)
class ProblemSet:
    """An environment of a run, made, with its problems.

    Attributes:
        env: the harness's own, which makes the problems and judges; no planner gets to see it.
        shown: another one, for what planners are asked.
        warm_up: a problem of the same kind that is no test problem.
    """

    entry: Entry[Environment]
    env: Environment
    shown: World
    problems: tuple[Problem, ...]
    warm_up: Problem

    @staticmethod
    def make(
        entry: Entry[Environment], choice: ProblemChoice, shown: World | None = None
    ) -> ProblemSet:
        """With the problems that are chosen.

        Raises:
            InputError: the environment cannot be made or has too few problems.
        """
        env = entry.make()
        asked = tuple(choice.of(env))  # first, as its errors say how many
        warm_up = choice.warm_up(env)
        return ProblemSet(entry, env, shown or World(entry, entry.make()), asked, warm_up)

    @property
    def end(self) -> int:
        """The number after the last problem's."""
        return max(problem.index for problem in self.problems) + 1

    @cached_property
    def facts(self) -> ProblemFacts:
        """What is known of the problems before they are attempted."""
        return problem_facts(self.env, self.problems)

    def weights(self, planner: Entry[Planner]) -> str:
        """The digest of the weights with which a planner plans here now, empty if it has none. What
        was measured with others is not what is asked for.

        Raises:
            InputError: they cannot be read.
        """
        return queries.weights_digest(planner, self.shown)


def repeated(problem: Problem, repeat: int) -> Problem:
    """A problem as planners get it the time with this number, from 0: with a seed of its own."""
    if repeat == 0:
        return problem
    return replace(problem, seed=derived_seed("repeat", problem.seed, repeat))


def make_run_config(
    *,
    env: str,
    planner: str,
    problems: int | None,
    seed: int,
    time_limit_s: float,
    stop: str,
    jobs: int,
    memory_limit_mb: int,
    train: bool = True,
    device: str = CPU,
    repeats: int = 1,
    keep_invalid: bool = False,
    simplify_s: float = 0.0,
    problem_file: Path | None = None,
) -> RunConfig:
    """Checks what was asked for.

    Problems of a file must be valid unless invalid ones are kept. Planners chosen by a group
    ("all") are left out where they support none of the environments. The reference of a match rule
    is added if it is missing and any of the planners may improve on its first solution in any of
    the environments. Learned planners run on `device`.

    Raises:
        InputError: something is unknown or out of range.
    """
    choice = ProblemChoice.checked(problems, seed, problem_file)
    check_range("--repeats", repeats, 1, 10_000)
    check_range("--time-limit", time_limit_s, 0.001, 86_400)
    check_range("--simplify", simplify_s, 0, 3600)
    _check_jobs(jobs)
    checked_device(device)
    check_range("--memory-limit", memory_limit_mb, 256, 2**24)
    worlds = _distinct([World(entry, entry.make()) for entry in envs.REGISTRY.entries(env)])
    chosen = planners.REGISTRY.entries(planner, wanted=lambda entry: _supports(entry, worlds))
    text, told = paper_rule(worlds) if stop == PAPER else (stop, [])
    rule = StopRule.parse(text)
    added = []
    if rule.reference is not None and any(_improves(entry, worlds) for entry in chosen):
        added = [rule.reference] if rule.reference.id not in {e.id for e in chosen} else []
        told += [f"{entry.id} runs too, as the reference of --stop {stop}" for entry in added]
    elif rule.kind == "match":
        told = []  # nobody is held to a length
    chosen = [*added, *chosen]
    for entry in chosen:  # bad arguments and weights are refused before anything runs
        for world in worlds:
            queries.refuse_bad_weights(entry, world)
    problem_sets = tuple(ProblemSet.make(world.entry, choice, world) for world in worlds)
    if choice.given is not None and not keep_invalid:
        for problem_set in problem_sets:
            _refuse_invalid(choice.given, problem_set)
    for line in told:  # not before: what is refused is refused in one line
        logger.info(line)
    return RunConfig(
        problem_sets,
        tuple(chosen),
        choice,
        time_limit_s,
        rule,
        jobs,
        memory_limit_mb,
        train,
        device,
        repeats,
        keep_invalid,
        simplify_s,
    )


def _refuse_invalid(given: GivenProblems, problem_set: ProblemSet) -> None:
    """A file is its user's to mend, unlike the sets of others."""
    invalid = problem_set.facts.invalid.items()
    faults = [f"{given.posed[index].row}: {reason}" for index, reason in invalid]
    mend = "; --keep-invalid attempts them all the same" if faults else ""
    given.refuse([*faults[:-1], *(f"{fault}{mend}" for fault in faults[-1:])])


def on_device(entry: Entry[Planner], device: str) -> Entry[Planner]:
    """How a planner is made that runs on a device: one that takes an argument of that name and was
    given none. Which planner it is, and what it is called, does not change by that."""
    if device == CPU or not queries.takes_device(entry):
        return entry
    return Entry(entry.spec, {"device": device, **entry.arguments})


def _distinct(worlds: list[World]) -> list[World]:
    """Each environment once, by its first name: one mesh may have been given by two paths."""
    first: dict[str, World] = {}
    for world in worlds:
        known = first.setdefault(world.env.fingerprint, world)
        if known is not world:
            logger.info("%s is the same environment as %s", world.entry.id, known.entry.id)
    return list(first.values())


def _supports(entry: Entry[Planner], worlds: list[World]) -> bool:
    return any(queries.unsupported(entry, world) is None for world in worlds)


def _improves(entry: Entry[Planner], worlds: list[World]) -> bool:
    """Whether a planner may go on after its first solution anywhere."""
    return queries.improves(entry) and _supports(entry, worlds)


def _check_jobs(jobs: int) -> None:
    cores = processors.physical_cores()
    if not 1 <= jobs <= cores:
        raise InputError(
            f"--jobs must be between 1 and {cores}, the physical cores here, not {jobs}: "
            "planners that share a core would measure each other"
        )
