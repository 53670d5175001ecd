"""Planners against each other on the problems that they share: who, how it came out."""

from bench.analysis.comparison.pairing import Pair, Pairing, Side, chosen_planners, pair_runs
from bench.analysis.comparison.table import (
    COLUMNS,
    CONFIDENCE,
    ComparisonVerdict,
    chosen_metrics,
    compare,
)

__all__ = [
    "COLUMNS",
    "CONFIDENCE",
    "Pair",
    "Pairing",
    "Side",
    "ComparisonVerdict",
    "chosen_metrics",
    "chosen_planners",
    "compare",
    "pair_runs",
]
