"""What every planner and every environment must keep to, tried on anyone's: `bench test-planner`
and `bench test-env`.

`trials.py` has a planner solve a few problems in processes of their own, within that of
`instrumented_planner.py`, which notes what the harness cannot see from outside. `rules.py` says
what of that speaks against the planner, `checks.py` what was promised and why it matters.

`environment_evidence.py` asks an environment and its collision model at random configurations;
`environment_rules.py` and `environment_checks.py` judge. `check.py` is what both have in common.
"""

from bench.conformance.check import Check, CheckResult, NotSeen, Outcome
from bench.conformance.checks import CHECKS, findings
from bench.conformance.environment_checks import (
    ENVIRONMENT_CHECKS,
    environment_finding,
    environment_findings,
)
from bench.conformance.environment_evidence import EnvironmentEvidence
from bench.conformance.trials import Evidence, gathered, resolve_planner

__all__ = [
    "CHECKS",
    "ENVIRONMENT_CHECKS",
    "Check",
    "EnvironmentEvidence",
    "Evidence",
    "CheckResult",
    "NotSeen",
    "Outcome",
    "environment_finding",
    "environment_findings",
    "findings",
    "gathered",
    "resolve_planner",
]
