"""What a planner must keep to, judged by what was seen of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from bench.conformance import rules
from bench.conformance.rules import LATE_S, LATE_SHARE, NotSeen
from bench.conformance.trials import Evidence


class Outcome(str, Enum):
    """What came of a check."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True)
class Check:
    """One thing to keep to.

    Attributes:
        promise: what a planner that keeps to it does, in a line.
        why: why it matters.
        rule: what of the evidence speaks against it, a line each.
    """

    name: str
    promise: str
    why: str
    rule: Callable[[Evidence], list[str] | NotSeen]


@dataclass(frozen=True)
class CheckResult:
    """What came of a check, and what speaks against it, or why it does not apply."""

    check: Check
    outcome: Outcome
    what: str = ""

    @property
    def text(self) -> str:
        """A line, and for a failure another that says why it matters."""
        said = self.what if self.outcome is not Outcome.PASSED else self.check.promise
        line = f"{self.outcome.value:<16}{self.check.name:<12}{said}"
        if self.outcome is Outcome.FAILED:
            line += f"\n{'':<28}why it matters: {self.check.why}"
        return line


def findings(evidence: Evidence) -> list[CheckResult]:
    """What comes of every check."""
    return [_finding(check, check.rule(evidence)) for check in CHECKS]


def _finding(check: Check, seen: list[str] | NotSeen) -> CheckResult:
    if isinstance(seen, NotSeen):
        return CheckResult(check, Outcome.NOT_APPLICABLE, seen.reason)
    if not seen:
        return CheckResult(check, Outcome.PASSED)
    # One mistake is mostly made in every trial, and said once.
    return CheckResult(check, Outcome.FAILED, "; ".join(dict.fromkeys(seen)))


CHECKS = (
    Check(
        "support",
        "says whether it can plan in an environment: None, or a reason why not",
        "runs over many environments leave planners out by that reason; an exception is an ERROR "
        "in every row",
        rules.support,
    ),
    Check(
        "setup",
        "sets up without a fault",
        "if `setup` fails, that is the outcome of every problem",
        rules.setup,
    ),
    Check(
        "result",
        "returns a PlannerResult with a Status, a path of numbers (k, d), and JSON data",
        "an exception is an ERROR in the table, and a path that is none is MALFORMED",
        rules.result,
    ),
    Check(
        "endpoints",
        "its paths begin at the start and end at the goal",
        "a path between other places solves another problem: the judge says WRONG_ENDPOINT",
        rules.endpoints,
    ),
    Check(
        "valid",
        "its paths are VALID by the judge's certified check",
        "a claim counts only if the judge proves it; waypoints free of collision are not enough",
        rules.valid,
    ),
    Check(
        "budget",
        f"returns within its time, or at most {LATE_S} s or {LATE_SHARE:.0%} later",
        "a path that comes late does not count, and a planner that goes on is killed",
        rules.budget,
    ),
    Check(
        "rest",
        "has nothing of its own running when it has returned",
        "what a thread or process does after that is planning off the clock; the table says "
        "LEFT_RUNNING",
        rules.rest,
    ),
    Check(
        "unsolvable",
        "returns in time from problems without a solution, and claims none",
        "a search without an end is KILLED, and a claim without a path behind it misleads",
        rules.unsolvable,
    ),
    Check(
        "inputs",
        "leaves problem and environment as they are",
        "the problems after it would be solved in another world than the judge's",
        rules.inputs,
    ),
    Check(
        "repeatable",
        "finds the same paths with the same seed in a new process, in another order",
        "results that nobody can repeat cannot be checked; use `problem.seed` for all that is "
        "random, and say `not_repeatable` with a reason where that does not suffice",
        rules.repeatable,
    ),
    Check(
        "threads",
        "keeps to one thread",
        "planners are compared on one core each: a second one buys time that the table does not "
        "show",
        rules.threads,
    ),
)
"""In the order in which they are printed."""
