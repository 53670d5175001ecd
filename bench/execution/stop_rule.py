"""When planners that could go on improving their path stop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import planners
from bench.execution import planner_queries as queries
from bench.execution.planner_queries import World
from envs import InputError
from envs.registry import Entry
from planners import Planner

PAPER = "paper"
"""The stop rule of the paper's tables."""


@dataclass(frozen=True)
class StopRule:
    """When a planner that could go on improving stops.

    `kind` is "first" (at the first solution), "limit" (at the time limit) or "match": at a length
    of at most (1 + tolerance) times what `reference` reached on the same problem.
    """

    kind: str
    reference: Entry[Planner] | None = None
    tolerance: float = 0.05

    @staticmethod
    def parse(text: str) -> StopRule:
        """ "first", "limit" or "match:PLANNER[:TOLERANCE]".

        Raises:
            InputError: it is none of them.
        """
        kind, _, rest = text.partition(":")
        if kind in ("first", "limit") and not rest:
            return StopRule(kind)
        if kind != "match" or not rest:
            raise InputError(
                f"--stop {text}: choose paper, first, limit or match:PLANNER[:TOLERANCE]"
            )
        name, _, last = rest.rpartition(":")
        try:
            tolerance = float(last) if name else 0.05
        except ValueError:
            name, tolerance = "", 0.05
        if not 0 <= tolerance < math.inf:
            raise InputError(f"--stop {text}: the tolerance must be at least 0 and finite")
        return StopRule(kind, planners.REGISTRY.entry(name or rest), tolerance)

    @property
    def text(self) -> str:
        """Its canonical form."""
        if self.reference is None:
            return self.kind
        return f"{self.kind}:{self.reference.id}:{self.tolerance}"

    def stop_cost(self, reference_length: float | None) -> float:
        """The length to stop at, given what the reference reached (None: it failed)."""
        if self.kind == "first":
            return math.inf
        if self.kind == "limit" or reference_length is None:
            return 0.0
        return (1 + self.tolerance) * reference_length


def paper_rule(worlds: Sequence[World]) -> tuple[str, list[str]]:
    """The paper's rule, as far as one of the planners that serve as its reference is there, and
    what is to be said about it: weights may be half an hour's work, which a default should not
    cost."""
    missing: dict[str, str] = {}
    for planner in _references():
        why = _why_no_reference(planner, worlds)
        if why is None:
            first = next(iter(missing), None)
            return f"match:{planner.id}", [] if first is None else [
                f"--stop paper: {planner.id} sets the length to match, as {first} does not: "
                f"{missing[first]}"
            ]
        missing[planner.id] = why
    reasons = "; ".join(f"{id}: {why}" for id, why in missing.items())
    return "first", [
        "--stop paper: planners stop at their first solution, as no length is there to match "
        f"({reasons})"
    ]


def _references() -> list[Entry[Planner]]:
    """The planners of ours that may set the length to match, the best first."""
    ours = [spec for spec in planners.REGISTRY.known() if spec.reference > 0 and not spec.origin]
    best_first = sorted(ours, key=lambda spec: -spec.reference)
    return [planners.REGISTRY.entry(spec.id) for spec in best_first]


def _why_no_reference(planner: Entry[Planner], worlds: Sequence[World]) -> str | None:
    reason = _unsupported_in_any(planner, worlds)
    if reason is None and any(queries.lacks_weights(planner, world) for world in worlds):
        return "it has no weights here"
    return reason


def _unsupported_in_any(planner: Entry[Planner], worlds: Sequence[World]) -> str | None:
    return next(filter(None, (queries.unsupported(planner, world) for world in worlds)), None)
