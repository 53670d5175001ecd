"""How planners are measured: `run`, `load`, `judge` and `judge_file`, and what is behind them."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bench.api import Run, judge, load, run
    from bench.judged_file import JudgedFile, judge_file
    from bench.judging.metric import Metric, SolvedAttempt

__version__ = "0.1.0"

_MODULES = {
    **dict.fromkeys(("Run", "judge", "load", "run"), "bench.api"),
    **dict.fromkeys(("JudgedFile", "judge_file"), "bench.judged_file"),
    **dict.fromkeys(("Metric", "SolvedAttempt"), "bench.judging.metric"),
}

__all__ = [
    "JudgedFile",
    "Metric",
    "Run",
    "SolvedAttempt",
    "judge",
    "judge_file",
    "load",
    "run",
]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # Only now: the command line imports this package too, and must come at once.
    globals()[name] = getattr(import_module(_MODULES[name]), name)
    return globals()[name]
