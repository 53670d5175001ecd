"""What a planner must keep to, judged by what was seen of it."""

from __future__ import annotations

from bench.conformance import rules
from bench.conformance.check import Check, CheckResult
from bench.conformance.rules import LATE_S, LATE_SHARE
from bench.conformance.trials import Evidence


def findings(evidence: Evidence) -> list[CheckResult]:
    """What comes of every check."""
    return [check.result(evidence) for check in CHECKS]


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
