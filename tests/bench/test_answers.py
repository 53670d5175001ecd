"""What is made of results in a worker, and of its answers in the harness."""

from __future__ import annotations

import json
import math
import sqlite3
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bench.execution import protocol
from bench.execution.answers import Attempt, Clock, attempt_of, set_up_of
from bench.execution.worker import in_memory
from bench.storage.record import cost_history, readable_history
from envs import Path
from planners import PlannerResult, Status

ANSWER = {
    "status": "EXACT_SOLUTION",
    "stats": "{}",
    "error": "",
    "solve_s": 1.0,
    "cpu_s": 1.0,
    "peak_memory_mb": 100.0,
    "attempt_memory_mb": 1.0,
}
CLOCK = Clock.around(1.01, 2, 1.5)
ENDS = [[0.0, 0.0], [1.0, 1.0]]


class FakeTensor:
    """On a device, and part of a gradient's graph."""

    def __init__(self, numbers: Any, where: str = "device") -> None:
        self.numbers, self.where = numbers, where

    def __array__(self, *_: Any, **__: Any) -> np.ndarray:
        if self.where != "host":
            raise TypeError("can't convert a device's tensor to numpy; use cpu() first")
        return np.array(self.numbers)

    def detach(self) -> FakeTensor:
        return FakeTensor(self.numbers, "detached")

    def cpu(self) -> FakeTensor:
        assert self.where == "detached"
        return FakeTensor(self.numbers, "host")


def claimed(path: Any, stats: Any = None) -> Any:
    return in_memory(PlannerResult(Status.EXACT_SOLUTION, path, stats or {}))


@pytest.mark.parametrize(
    "path",
    [
        ENDS,
        np.array(ENDS),
        np.array(ENDS, dtype=np.float32),
        Path(np.array(ENDS)),
        iter(ENDS),
        (q for q in ENDS),
        map(np.array, ENDS),
        FakeTensor(ENDS),
        [FakeTensor(q) for q in ENDS],
        tuple(FakeTensor(q) for q in ENDS),
    ],
)
def test_all_kinds_of_paths_are_numbers_in_memory(path: Any) -> None:
    claim = claimed(path)
    assert claim.path.dtype == np.float64
    assert claim.path.tolist() == ENDS
    assert not claim.notes


def test_a_claim_does_not_change_with_what_was_returned() -> None:
    path, stats = np.array(ENDS), {"list": [1]}
    claim = claimed(path, stats)
    path[:] = 7
    stats["list"].append(2)
    assert claim.path.tolist() == ENDS
    assert json.loads(claim.stats) == {"list": [1]}


@pytest.mark.parametrize(
    ("in_use", "waited"), [(True, ["synchronize"]), (False, [])], ids=["in use", "not in use"]
)
def test_devices_are_waited_for(
    in_use: bool, waited: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[str] = []
    cuda = SimpleNamespace(
        is_initialized=lambda: in_use, synchronize=lambda: calls.append("synchronize")
    )
    monkeypatch.setitem(sys.modules, "torch", SimpleNamespace(cuda=cuda))
    claimed(ENDS)
    assert calls == waited


@pytest.mark.parametrize("path", ["a path", [[1.0], [2.0, 3.0]], object(), [[1j, 2.0]]])
def test_what_is_no_path_says_why(path: Any) -> None:
    claim = claimed(path)
    assert claim.path is None
    assert "no array of numbers" in claim.notes[0]


def test_a_path_that_is_too_large_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(protocol, "MOST_NUMBERS", 2**20)
    claim = claimed(np.zeros((2**16, 3)))
    assert claim.path is None
    assert "(65536, 3)" in claim.notes[0]


@pytest.mark.parametrize(
    "spoilt",
    [
        {"status": "SOLVED"},
        {"status": None},
        {"status": "UNSUPPORTED"},
        {"status": "SKIPPED"},
        {"status": "CRASH"},
        {"status": ["EXACT_SOLUTION"]},
        {"stats": "[]"},
        {"stats": "{"},
        {"stats": {}},
    ],
)
def test_an_answer_that_makes_no_sense_is_none(spoilt: dict[str, Any]) -> None:
    with pytest.raises((ValueError, TypeError, KeyError)):
        attempt_of({**ANSWER, **spoilt}, None, CLOCK)
    for missing in ANSWER:
        with pytest.raises(KeyError):
            attempt_of({k: v for k, v in ANSWER.items() if k != missing}, None, CLOCK)


@pytest.mark.parametrize("status", ["SKIPPED", "KILLED", "VALID", ["ERROR"], 3])
def test_so_is_one_of_setting_up(status: Any) -> None:
    with pytest.raises((ValueError, TypeError)):
        set_up_of({"status": status, "error": "", "setup_s": 1.0}, None, CLOCK)


@pytest.mark.parametrize(
    "said", [-5, -5.0, 0.0, 0.8, 1.02, 1e9, math.inf, math.nan, "1", None, True]
)
def test_times_are_within_the_harnesss_clock(said: Any) -> None:
    attempt = attempt_of({**ANSWER, "solve_s": said}, None, CLOCK)
    assert attempt.solve_s is not None
    assert 0.9 < attempt.solve_s <= 1.01
    assert "it said that it took" in attempt.error
    set_up = set_up_of({"status": None, "error": "", "setup_s": said, "train_s": said}, None, CLOCK)
    assert 0.9 < set_up.setup_s <= 1.01
    assert 0 <= set_up.train_s < math.inf


def test_an_honest_time_is_kept_and_the_rest_of_the_machine_is_its_load() -> None:
    attempt = attempt_of(ANSWER, None, CLOCK)
    assert attempt == Attempt(
        "EXACT_SOLUTION",
        1.0,
        peak_memory_mb=100.0,
        cpu_s=1.0,
        load=pytest.approx(0.5 / 1.01),
        attempt_memory_mb=1.0,
    )
    assert attempt_of(ANSWER, None, Clock.around(1.01, 2, None)).load is None


@pytest.mark.parametrize("name", ["cpu_s", "peak_memory_mb", "attempt_memory_mb"])
@pytest.mark.parametrize("said", [-1.0, math.nan, math.inf, "much", None, [1]])
def test_costs_that_are_none_are_not_known(name: str, said: Any) -> None:
    assert getattr(attempt_of({**ANSWER, name: said}, None, CLOCK), name) is None


def test_more_processor_time_than_there_was_is_not_known() -> None:
    assert attempt_of({**ANSWER, "cpu_s": 3.0}, None, CLOCK).cpu_s is None


@pytest.mark.parametrize("text", ["\ud800", "/nowhere/\udcff", "a\0b", "x" * 10**6, "ok", 5])
def test_texts_can_be_stored_and_printed(text: Any) -> None:
    said = {**ANSWER, "status": "ERROR", "error": text}
    set_up = set_up_of({"status": "ERROR", "error": text, "setup_s": 1.0}, None, CLOCK)
    with sqlite3.connect(":memory:") as store:
        for error in (attempt_of(said, None, CLOCK).error, set_up.error):
            assert store.execute("SELECT ?", (error,)).fetchone() == (error,)
            assert len(error) < 30_000
            assert "\0" not in error


GOOD_HISTORIES = [[], [[0.1, 3.0]], [[0, 3], [0.5, 2.5]], [[0.1, math.inf]]]
BAD_HISTORIES = [
    *("none", 3, {"a": 1}, [1.0, 2.0], [[0.1]], [[0.1, 2.0], [0.2]], [["a", "b"]], [[0.1, None]]),
    *([[-1.0, 2.0]], [[math.nan, 2.0]], [[math.inf, 2.0]], [[0.1, math.nan]], [[True, False]]),
    *([[0.1, 2.0, 3.0]], [[[0.1, 2.0]]], [[0, 2**70]], [[]]),
]


@pytest.mark.parametrize("history", GOOD_HISTORIES)
def test_histories_are_kept(history: Any) -> None:
    said = {**ANSWER, "stats": json.dumps({"cost_history": history})}
    attempt = attempt_of(said, None, CLOCK)
    assert attempt.stats == {"cost_history": history}
    assert not attempt.error


@pytest.mark.parametrize("history", BAD_HISTORIES, ids=repr)
def test_what_is_no_history_is_left_out_and_reports_read_old_ones(history: Any) -> None:
    stats = json.dumps({"cost_history": history, "kept": 1})
    attempt = attempt_of({**ANSWER, "stats": stats}, None, CLOCK)
    assert attempt.stats == {"kept": 1}
    assert "cost_history" in attempt.error
    assert readable_history(history) is None
    assert cost_history(stats).shape[1] == 2


@pytest.mark.parametrize("count", [2**63, 2**64 - 1, 2**70, -1, 1.5, "3", [3], True, 10**400])
def test_counts_that_cannot_be_stored_are_left_out(count: Any) -> None:
    stats = json.dumps({"collision_checks": count, "fallbacks": count})
    attempt = attempt_of({**ANSWER, "stats": stats}, None, CLOCK)
    assert attempt.stats == {}
    assert attempt.error.count("left out") == 2


def test_the_largest_count_is_kept() -> None:
    said = {**ANSWER, "stats": json.dumps({"collision_checks": 2**63 - 1})}
    assert attempt_of(said, None, CLOCK).stats == {"collision_checks": 2**63 - 1}
