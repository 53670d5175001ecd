"""Whether a run is worse than a baseline kept in version control: a gate for changes.

A run is summed up by the same `Baseline` that is kept as CSV, so that a check sets two of them side
by side.
"""

from bench.gate.baseline import MEASURES, Baseline, Row
from bench.gate.baseline_file import read, write
from bench.gate.check import Check, Finding, Verdict, check
from bench.gate.ratios import p_of_worse_ratio
from bench.gate.success import SuccessTest, success_test
from bench.gate.text import changes, text, write_text
from bench.gate.wanted import Wanted

__all__ = [
    "MEASURES",
    "Baseline",
    "Check",
    "Finding",
    "Row",
    "SuccessTest",
    "Verdict",
    "Wanted",
    "changes",
    "check",
    "p_of_worse_ratio",
    "read",
    "success_test",
    "text",
    "write",
    "write_text",
]
