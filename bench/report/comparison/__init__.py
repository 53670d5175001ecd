"""Planners against each other on the problems that they share: who, how it came out, as text."""

from bench.report.comparison.chosen import chosen_planners
from bench.report.comparison.pairing import Pair, Pairing, Side, pair_runs
from bench.report.comparison.table import COLUMNS, CONFIDENCE, MEASURES, Verdict, compare
from bench.report.comparison.text import text, write_csv

__all__ = [
    "COLUMNS",
    "CONFIDENCE",
    "MEASURES",
    "Pair",
    "Pairing",
    "Side",
    "Verdict",
    "chosen_planners",
    "compare",
    "pair_runs",
    "text",
    "write_csv",
]
