"""What every planner must keep to, tried on anyone's: `bench test-planner`.

`trials.py` has a planner solve a few problems in processes of their own, within that of
`instrumented_planner.py`, which notes what the harness cannot see from outside. `rules.py` says
what of that speaks against the planner, `checks.py` what was promised and why it matters.
"""

from bench.conformance.checks import CHECKS, Check, CheckResult, Outcome, findings
from bench.conformance.trials import Evidence, gathered, resolve_planner

__all__ = [
    "CHECKS",
    "Check",
    "Evidence",
    "CheckResult",
    "Outcome",
    "findings",
    "gathered",
    "resolve_planner",
]
