"""What every planner must keep to, tried on anyone's: `bench test-planner`.

`evidence.py` has a planner solve a few problems in processes of their own, with `probe.py` about
it, which notes what the harness cannot see from outside. `looks.py` says what of that speaks
against the planner, `checks.py` what was promised and why it matters.
"""

from bench.conformance.checks import CHECKS, Check, Finding, Outcome, findings
from bench.conformance.evidence import Evidence, gathered
from bench.conformance.naming import named

__all__ = ["CHECKS", "Check", "Evidence", "Finding", "Outcome", "findings", "gathered", "named"]
