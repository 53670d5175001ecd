"""The store and the words of a record."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from bench.storage.record import (
    COLUMNS,
    KEY,
    MOST_WAYPOINTS,
    Record,
    decode_path,
    encode_path,
    outcome,
)
from bench.storage.store import FORCED_EVERY_S, Store, StoredRecords
from envs import InputError

PATH = np.array([[0.0, 1], [2, 3], [4, 5]])

RECORD = Record(
    run_id="r",
    env="c3d",
    env_fingerprint="f",
    planner="p",
    planner_version=1,
    weights="",
    problem=0,
    repeat=0,
    problems_seed=7,
    settings="s",
    seed=123,
    status="EXACT_SOLUTION",
    verdict="VALID",
    outcome="VALID",
    solved=1,
    setup_s=0.1,
    train_s=0.0,
    scene_s=None,
    solve_s=0.2,
    cpu_s=0.19,
    load=0.5,
    metrics='{"length": 3.0, "safety_margin": 0.5, "waypoints": 3, "mine": null}',
    collision_checks=9,
    peak_memory_mb=100.0,
    attempt_memory_mb=3.0,
    warm=1,
    processor="P",
    measured_at="now",
    error="",
    stats="{}",
    path=encode_path(PATH),
)


def test_what_is_put_is_found(tmp_path: Path) -> None:
    with Store(tmp_path) as store:
        store.put(RECORD)
    with StoredRecords(tmp_path) as store:
        [row] = store.records(["f"], 7, "s").to_dict("records")
    assert {name: row[name] for name in COLUMNS} == vars(RECORD)
    assert (row["length"], row["safety_margin"], row["waypoints"]) == (3, 0.5, 3)
    assert np.isnan(row["mine"])
    assert (decode_path(row["path"]) == PATH).all()


@pytest.mark.parametrize("column", KEY)
def test_the_key_tells_attempts_apart(tmp_path: Path, column: str) -> None:
    other = replace(RECORD, **{column: 99 if isinstance(getattr(RECORD, column), int) else "q"})
    with Store(tmp_path) as store:
        store.put(RECORD)
        store.put(replace(RECORD, metrics='{"length": 9.0}'))
        store.put(other)
        rows = [
            len(store.records([r.env_fingerprint], r.problems_seed, r.settings))
            for r in {(RECORD.env_fingerprint, RECORD.settings): RECORD, 1: other}.values()
        ]
        assert store.records(["f"], 7, "s")["length"].tolist()[0] == 9.0, "put again: replaced"
    assert rows in ([1, 1], [2, 2])


def test_threads_may_put_at_once(tmp_path: Path) -> None:
    with Store(tmp_path) as store:

        def put(begin: int) -> None:
            for problem in range(begin, begin + 50):
                store.put(replace(RECORD, problem=problem))

        threads = [threading.Thread(target=put, args=(50 * i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert store.records(["f"], 7, "s")["problem"].tolist() == list(range(200))


PUT_AND_DIE = """
import os, signal, sys
from pathlib import Path
from records import record_of, row
from bench.storage.store import Store
store = Store(Path(sys.argv[1]))
for problem in range(30):
    store.put(record_of(row("p", problem, "TIMEOUT")))
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_was_put_outlives_a_process_that_is_killed_at_once(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PUT_AND_DIE, str(tmp_path)],
        check=False,
        cwd=Path(__file__).parents[1],
    )
    assert done.returncode == -signal.SIGKILL
    with StoredRecords(tmp_path) as store:
        assert store.records(["f"], 0, "s")["problem"].tolist() == list(range(30))


def test_rows_are_forced_to_the_disk_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One by one they would be at the disk's pace, some tens a second."""
    done: list[str] = []

    def forced() -> int:
        count = sum("synchronous = FULL" in statement for statement in done)
        done.clear()
        return count

    with Store(tmp_path) as store:
        store._connection.set_trace_callback(done.append)
        begin = time.monotonic()
        for problem in range(100):
            store.put(replace(RECORD, problem=problem))
        assert 1 <= forced() <= 1 + (time.monotonic() - begin) / FORCED_EVERY_S
        store.put_session("r", {})
        store.put_selection({})
        assert forced() == 2, "what rows belong to is there before them"
        monkeypatch.setattr("bench.storage.store.FORCED_EVERY_S", 0.0)
        store.put(RECORD)
        assert forced() == 1, "of slow planners every row is"


def test_a_store_without_a_run_says_so(tmp_path: Path) -> None:
    with Store(tmp_path) as store, pytest.raises(InputError, match="no run yet"):
        store.selection()


@given(arrays(float, array_shapes(min_dims=2, max_dims=2, min_side=0, max_side=8)))
def test_paths_survive_encoding(path: np.ndarray) -> None:
    data = encode_path(path)
    assert data is not None
    assert np.array_equal(decode_path(data), path, equal_nan=True)


def test_what_is_no_path_is_not_encoded() -> None:
    assert encode_path(None) is None
    assert encode_path(np.zeros(3)) is None
    assert encode_path(np.zeros((MOST_WAYPOINTS + 1, 0))) is None


@given(st.floats(0, 10), st.floats(0.1, 10))
def test_success_needs_claim_verdict_and_time(solve_s: float, limit: float) -> None:
    in_time = solve_s <= limit
    assert outcome("EXACT_SOLUTION", "VALID", solve_s, limit) == ("VALID" if in_time else "LATE")
    assert outcome("EXACT_SOLUTION", "COLLISION", solve_s, limit) == "COLLISION"
    assert outcome("APPROXIMATE_SOLUTION", "VALID", solve_s, limit) == "APPROXIMATE_SOLUTION"
    assert outcome("KILLED", "", solve_s, limit) == "KILLED"
    assert outcome("EXACT_SOLUTION", "", solve_s, limit) == "MALFORMED"
