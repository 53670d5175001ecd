"""`bench run`, interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest
from conftest import Cli, records_of

from bench.analysis.run_results import RunResults


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_keeps_what_was_done_and_goes_on(
    number: int, tmp_path: Path, bench: Cli
) -> None:
    run = [
        *("run", "--env", "c3d", "--planners", "rrtstar", "--problems", "8", "--stop", "limit"),
        *("--time-limit", "0.7", "--out", str(tmp_path)),
    ]
    # As from a terminal: where the tests run in the background, SIGINT may be ignored.
    as_from_terminal = signal.signal(signal.SIGINT, signal.SIG_DFL)
    process = subprocess.Popen(
        [sys.executable, "-m", "bench", *run], stderr=subprocess.PIPE, stdout=subprocess.PIPE
    )
    signal.signal(signal.SIGINT, as_from_terminal)
    deadline = time.monotonic() + 60
    while _rows(tmp_path) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    assert b"kept" in err
    assert b"Traceback" not in err
    kept = records_of(tmp_path)
    assert 2 <= len(kept) < 8
    assert (tmp_path / "summary.csv").exists()
    assert bench(*run)[0] == 0
    whole = records_of(tmp_path)
    assert len(whole) == 8
    pd.testing.assert_frame_equal(whole.head(len(kept)), kept)


def test_interrupted_before_anything_was_measured(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bench.execution.runner.run", interrupted)
    code, out, err = bench("run", "--env", "c3d", "--planners", "rrtconnect", "--out", tmp_path)
    assert (code, out) == (130, "")
    assert "kept" in err
    assert pd.read_csv(tmp_path / "summary.csv").empty
    assert "(none)" in (tmp_path / "summary.md").read_text()


def _rows(folder: Path) -> int:
    if not (folder / "run.sqlite").exists():
        return 0
    try:
        return len(RunResults.read(folder).records)
    except ValueError:
        return 0
