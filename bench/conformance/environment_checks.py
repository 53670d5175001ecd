"""What an environment must keep to, judged by what it answers."""

from __future__ import annotations

from bench.conformance import environment_rules as rules
from bench.conformance.check import Check, CheckResult, Outcome
from bench.conformance.environment_evidence import EnvironmentEvidence
from envs import Environment
from envs.errors import reason
from envs.registry import Entry


def environment_findings(entry: Entry[Environment], seed: int = 0) -> list[CheckResult]:
    """What comes of every check.

    Args:
        entry: the environment, which is made here.
        seed: of configurations and problems, from 0 to 2^32 - 1.

    Raises:
        InputError: the environment cannot be made.
    """
    evidence = EnvironmentEvidence(entry, entry.make(), seed)
    return [environment_finding(check, evidence) for check in ENVIRONMENT_CHECKS]


def environment_finding(
    check: Check[EnvironmentEvidence], evidence: EnvironmentEvidence
) -> CheckResult:
    """What comes of one. An exception speaks against the environment, whose code is asked."""
    try:
        return check.result(evidence)
    except (Exception, SystemExit) as error:  # noqa: BLE001  it may fail in any way
        return CheckResult(check, Outcome.FAILED, reason(error))


ENVIRONMENT_CHECKS = (
    Check(
        "bounds",
        "has finite bounds, those of its space, and its samples are within them",
        "planners sample between the bounds, and the judge refuses paths that leave them",
        rules.bounds,
    ),
    Check(
        "definition",
        "has a definition in JSON, the same whenever it is made; equal definitions mean equal "
        "environments",
        "results and weights are kept by its fingerprint: those of one environment would be taken "
        "for another's, or never be found again",
        rules.definition,
    ),
    Check(
        "batches",
        "gives the clearances of many configurations as it does one at a time, and leaves these "
        "as they are",
        "planners ask in batches and one by one, and would plan in two different worlds",
        rules.batches,
    ),
    Check(
        "clearance",
        "has clearances that agree with its collision model on contact and, in free space, on "
        "distance",
        "planners plan by `clearance`, the judge by the collision model: where it is too large, "
        "paths are refused; where it is too small, free space is missed; speeds and what is "
        "learned from it are wrong in both cases",
        rules.clearance,
    ),
    Check(
        "motion",
        "has clearances that change no faster than the robot's bounds on motion say",
        "certified checks skip as far as these bounds allow: obstacles would be skipped, too",
        rules.motion,
    ),
    Check(
        "proofs",
        "proves no motion free on which its collision model finds contact",
        "planners and judge take motions by these proofs, not state by state",
        rules.proofs,
    ),
    Check(
        "problems",
        "makes the same problems of the same seed, others of another, with ends that are free",
        "results are compared problem by problem; one whose ends are not valid counts for nobody",
        rules.problems,
    ),
    Check(
        "pickle",
        "can be pickled, and the copy has the same fingerprint and problems",
        "labels for training are made in several processes, which are sent the environment",
        rules.pickled,
    ),
    Check(
        "speed",
        "has positive speeds, those of its speed model at its clearances",
        "time fields are trained on `speed`, and metrics apply the model to clearances",
        rules.speed,
    ),
)
"""In the order in which they are printed."""
