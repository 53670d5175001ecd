"""An attempt that ends the harness is tried once more, and then passed over."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from conftest import Cli, records_of

from bench.execution.attempt_journal import Underway
from bench.judging.judge import Judge, Judgement
from envs import InputError, Problem
from envs.problem import Array

ATTEMPT = ("planner", "fingerprint", 3)


def end_within(folder: Path, error: BaseException) -> None:
    with pytest.raises(type(error)), Underway(folder).judging(*ATTEMPT):
        raise error


def test_an_attempt_is_passed_over_after_it_has_ended_two_runs(tmp_path: Path) -> None:
    for expected in (False, True):
        end_within(tmp_path, RuntimeError("a judge's"))
        assert Underway(tmp_path).has_ended_runs(*ATTEMPT) == expected
    assert not Underway(tmp_path).has_ended_runs("planner", "fingerprint", 4)
    with Underway(tmp_path).judging(*ATTEMPT):  # its row is stored
        pass
    assert not Underway(tmp_path).has_ended_runs(*ATTEMPT)
    assert not list(tmp_path.iterdir())


def test_a_process_that_is_gone_counts_like_an_exception(tmp_path: Path) -> None:
    for _ in range(2):
        pid = os.fork()
        if not pid:
            with Underway(tmp_path).judging(*ATTEMPT):
                os._exit(9)
        os.waitpid(pid, 0)
    assert Underway(tmp_path).has_ended_runs(*ATTEMPT)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), InputError("the disk is full")])
def test_interruptions_and_full_disks_do_not_count(error: BaseException, tmp_path: Path) -> None:
    for _ in range(3):
        end_within(tmp_path, error)
    assert not Underway(tmp_path).has_ended_runs(*ATTEMPT)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.usefixtures("in_process_workers")
def test_a_run_goes_on_behind_it(
    bench: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = Judge.__call__

    def judged(judge: Judge, problem: Problem, path: Array | None) -> Judgement:
        if problem.index == 1:
            raise RuntimeError("what the judge did not expect")
        return true(judge, problem, path)

    monkeypatch.setattr(Judge, "__call__", judged)
    run = [
        *("run", "--env", "c3d", "--planners", "rrtconnect", "--problems", 3, "--stop", "first"),
        *("--out", tmp_path),
    ]
    for _ in range(2):
        with pytest.raises(RuntimeError):
            bench(*run)
    code, _, err = bench(*run)
    assert code == 0, err
    records = records_of(tmp_path)
    assert records["outcome"].tolist() == ["VALID", "CRASH", "VALID"]
    assert "passed over" in records["error"][1]
    assert not list(tmp_path.glob(".underway*"))
