"""What of the evidence speaks against a planner, a function for each check."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.conformance.check import NotSeen
from bench.conformance.trials import Evidence, Trial
from bench.storage.record import Fault, Verdict

LATE_SHARE, LATE_S = 0.05, 0.1
"""How far a planner may overrun its time limit: by the larger of this share of it and this many
seconds. A path that comes after the limit is `LATE` in any case."""

_MORE_THREADS = 2  # the harness's watchdog, and one that only waits
_CORES, _LONG_ENOUGH_S = 1.5, 0.2  # of processor time a second; where the clocks can tell
_CUT_SHARE = 0.8  # of the time limit, after which the clock may have had a say in a path


_NOT_SET_UP = NotSeen("it was not set up")


def support(evidence: Evidence) -> list[str] | NotSeen:
    if evidence.unsupported:
        return []
    answered = [trial.seen["support"] for trial in evidence.trials if trial.seen]
    if not answered:
        return NotSeen("it did not return from any problem")
    return [said for said in answered if said]


def setup(evidence: Evidence) -> list[str] | NotSeen:
    tried = {"": evidence.set_up, "among closed walls, ": evidence.walled_in}
    if evidence.unsupported:
        return NotSeen(f"it does not plan here: {evidence.unsupported}")
    return [
        f"{where}{set_up.fault}: {_last_line(set_up.error)}"
        for where, set_up in tried.items()
        if set_up is not None and set_up.fault not in ("", Fault.UNSUPPORTED.value)
    ]


def result(evidence: Evidence) -> list[str] | NotSeen:
    if not evidence.solvable:
        return _NOT_SET_UP
    found = []
    for trial in evidence.trials:
        if trial.fault and trial in evidence.solvable and not _blamed_elsewhere(trial):
            found.append(f"{trial.what}: {trial.fault.value}: {_last_line(trial.attempt.error)}")
        found += trial.seen.get("result", [])
    return found


def _blamed_elsewhere(trial: Trial) -> bool:
    return trial.fault in (Fault.KILLED, Fault.LEFT_RUNNING) or _wrote_to_inputs(trial)


def _wrote_to_inputs(trial: Trial) -> bool:
    """NumPy's words for writing to an array that is read-only."""
    return trial.fault is Fault.ERROR and "read-only" in trial.attempt.error


def endpoints(evidence: Evidence) -> list[str] | NotSeen:
    return _verdicts(evidence, Verdict.WRONG_ENDPOINT)


def valid(evidence: Evidence) -> list[str] | NotSeen:
    return _verdicts(evidence, Verdict.COLLISION, Verdict.OUT_OF_BOUNDS)


def _verdicts(evidence: Evidence, *bad: Verdict) -> list[str] | NotSeen:
    """The claims on solvable problems of which the judge says one of `bad`."""
    claims = [t for t in evidence.solvable + evidence.again if t.claimed and t.judged]
    if not claims:
        return NotSeen("it claimed no path")
    return [
        f"{trial.what}: {trial.judged.verdict.value}: {trial.judged.reason}"
        for trial in claims
        if trial.judged and trial.judged.verdict in bad
    ]


def budget(evidence: Evidence) -> list[str] | NotSeen:
    if not evidence.solvable:
        return _NOT_SET_UP
    return list(_overruns(evidence.solvable + evidence.again))


def _overruns(trials: tuple[Trial, ...]) -> Iterator[str]:
    for trial in trials:
        over = trial.solve_s - trial.limit_s
        if trial.fault is Fault.KILLED:
            where = _last_line(trial.attempt.error)
            yield f"{trial.what}: it ignored its {trial.limit_s:g} s and was killed ({where})"
        elif over > max(LATE_S, LATE_SHARE * trial.limit_s):
            yield f"{trial.what}: it returned {over:.2f} s after its {trial.limit_s:g} s"


def rest(evidence: Evidence) -> list[str] | NotSeen:
    if not evidence.trials:
        return _NOT_SET_UP
    return [
        f"{trial.what}: {_last_line(trial.attempt.error)}"
        for trial in evidence.trials
        if trial.fault is Fault.LEFT_RUNNING
    ]


def unsolvable(evidence: Evidence) -> list[str] | NotSeen:
    if not evidence.unsolvable:
        return NotSeen("there was none to try, or it does not return from solvable ones")
    # One that is always late is told so once, by `budget`.
    found = [] if budget(evidence) else list(_overruns(evidence.unsolvable))
    for trial in evidence.unsolvable:
        if trial.claimed:
            found.append(f"{trial.what}: it claims a solution, and there is none")
        elif trial.fault and not _blamed_elsewhere(trial):
            found.append(f"{trial.what}: {trial.fault.value}: {_last_line(trial.attempt.error)}")
    return found


def inputs(evidence: Evidence) -> list[str] | NotSeen:
    if not evidence.solvable:
        return _NOT_SET_UP
    wrote = [
        f"{trial.what}: it writes to an array of its inputs: {_last_line(trial.attempt.error)}"
        for trial in evidence.trials
        if _wrote_to_inputs(trial)
    ]
    returned = [trial for trial in evidence.trials if trial.seen]
    if not wrote and not returned:
        return NotSeen("it did not return from any problem")
    return wrote + [f"it changed {what}" for trial in returned for what in trial.seen["changed"]]


def repeatable(evidence: Evidence) -> list[str] | NotSeen:
    if evidence.not_repeatable:
        return NotSeen(f"it declares: {evidence.not_repeatable}")
    again = {trial.problem.index: trial for trial in evidence.again if not _cut(trial)}
    pairs = [
        (trial, again[trial.problem.index])
        for trial in evidence.solvable[: len(evidence.again)]
        if trial.problem.index in again and not _cut(trial)
    ]
    if not pairs:
        return NotSeen("it ended no problem twice before its time was over")
    return [difference for a, b in pairs if (difference := _difference(a, b))]


def _cut(trial: Trial) -> bool:
    """Whether the clock may have decided what came of it."""
    return trial.fault is not None or trial.solve_s > _CUT_SHARE * trial.limit_s


def _difference(a: Trial, b: Trial) -> str:
    new = f"{a.what} with the same seed in a new process, others before it:"
    if a.attempt.status != b.attempt.status:
        return f"{new} {a.attempt.status}, then {b.attempt.status}"
    paths = a.attempt.path, b.attempt.path
    if all(path is None for path in paths) or np.array_equal(*paths, equal_nan=True):  # type: ignore[arg-type]
        return ""
    return f"{new} another path"


def threads(evidence: Evidence) -> list[str] | NotSeen:
    returned = [trial for trial in evidence.trials if trial.seen]
    if not returned:
        return NotSeen("it did not return from any problem")
    found = []
    for trial in returned:
        pinned, spent = trial.seen["threads"], trial.solve_s
        if pinned["more"] > _MORE_THREADS and trial.fault is not Fault.LEFT_RUNNING:
            found.append(f"it has {pinned['more']} more threads than before it was made")
        if pinned["variables"]:
            found.append(f"it changes {', '.join(pinned['variables'])}")
        if pinned["torch"] > 1:
            found.append(f"it lets PyTorch use {pinned['torch']} threads")
        if spent >= _LONG_ENOUGH_S and trial.seen["cpu_s"] > _CORES * spent:
            found.append(f"{trial.what}: it kept {trial.seen['cpu_s'] / spent:.1f} cores busy")
    return found


def _last_line(error: str) -> str:
    lines = error.strip().splitlines()
    return lines[-1] if lines else ""
