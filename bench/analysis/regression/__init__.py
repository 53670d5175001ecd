"""Whether a run is worse than a baseline kept in version control: a gate for changes.

A run is summed up by the same `Baseline` that is kept as CSV, so that a check sets two of them side
by side.
"""

from bench.analysis.regression.baseline import (
    Baseline,
    CheckOptions,
    Row,
    always_kept,
    gated_metrics,
)
from bench.analysis.regression.baseline_file import read, write
from bench.analysis.regression.check import Check, RegressionFinding, RegressionVerdict, check
from bench.analysis.regression.significance import SuccessTest, p_of_worse_ratio, success_test

__all__ = [
    "Baseline",
    "Check",
    "CheckOptions",
    "RegressionFinding",
    "Row",
    "SuccessTest",
    "RegressionVerdict",
    "always_kept",
    "check",
    "gated_metrics",
    "p_of_worse_ratio",
    "read",
    "success_test",
    "write",
]
