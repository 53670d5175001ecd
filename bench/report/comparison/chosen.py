"""Which planners somebody wants compared, by the names that the runs know."""

from __future__ import annotations

import planners
from bench.report.recorded import RecordedRun
from envs import InputError
from envs.arguments import split_entries
from envs.errors import suggestion

ALL = "all"


def chosen_planners(text: str, a: RecordedRun, b: RecordedRun) -> tuple[str, str] | None:
    """The planners of `a` and of `b` that "P,Q" names, or "P" in both; None for "all", if
    there are two runs: each planner then meets itself.

    Raises:
        InputError: a run has no such planner, there are more than two names, or those of one run
            are not two planners.
    """
    names = split_entries(text)
    if names == [ALL] and a is not b:
        return None
    pair = names * 2 if len(names) == 1 and names != [ALL] else names
    if len(pair) != 2:
        raise _misnamed(text, a, b)
    who = _id_in(a, pair[0]), _id_in(b, pair[1])
    if a is b and who[0] == who[1]:
        raise _misnamed(text, a, b)
    return who


def _misnamed(text: str, a: RecordedRun, b: RecordedRun) -> InputError:
    wanted = "two planners of that run" if a is b else "one planner, or one of each run"
    return InputError(f"--planners {text}: name {wanted}, from {', '.join(_planners(a))}")


def _planners(run: RecordedRun) -> list[str]:
    return list(dict.fromkeys(planner for _, planner in run.order))


def _id_in(run: RecordedRun, name: str) -> str:
    known = _planners(run)
    id = planners.REGISTRY.id_among(name, known)
    if id in known:
        return id
    folders = ", ".join(str(folder) for folder in run.folders)
    raise InputError(f"--planners: {folders} has no {name!r}; {suggestion(name, known)}")
