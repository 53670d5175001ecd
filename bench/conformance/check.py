"""What a check is, and what comes of one; of planners as of environments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Outcome(str, Enum):
    """What came of a check."""

    PASSED = "passed"
    FAILED = "failed"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True)
class NotSeen:
    """Why there is nothing to judge."""

    reason: str


@dataclass(frozen=True)
class Check(Generic[T]):
    """One thing to keep to.

    Attributes:
        promise: what a planner or an environment that keeps to it does, in a line.
        why: why it matters.
        rule: what of the evidence speaks against it, a line each.
    """

    name: str
    promise: str
    why: str
    rule: Callable[[T], list[str] | NotSeen]

    def result(self, evidence: T) -> CheckResult:
        """What comes of it."""
        seen = self.rule(evidence)
        if isinstance(seen, NotSeen):
            return CheckResult(self, Outcome.NOT_APPLICABLE, seen.reason)
        if not seen:
            return CheckResult(self, Outcome.PASSED)
        # One mistake is mostly made in every trial, and said once.
        return CheckResult(self, Outcome.FAILED, "; ".join(dict.fromkeys(seen)))


@dataclass(frozen=True)
class CheckResult:
    """What came of a check, and what speaks against it, or why it does not apply."""

    check: Check[Any]
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
