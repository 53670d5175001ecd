"""The real rooms of the folder of meshes, through the command line, at what is asked of them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import briefly_trained
import pytest
from conftest import has_data, records_of

from bench.process import ONE_THREAD

ROOMS = ("office_small", "office_large", "meeting_room")
RUNS = {
    "ntfields": [briefly_trained.__file__],
    "fmm,rrtconnect": ["-m", "bench"],
}
"""Planners, and the command line that runs them; what takes longest comes first."""

Solved = dict[str, int]
"""How many of 100 problems each planner solves."""


def mesh(room: str) -> str:
    return f"rooms/{room}_zup.ply"


@pytest.fixture(scope="module")
def runs(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[tuple[str, str], Future[Solved]]]:
    """What comes of each run that some test asks for. Two are under way at a time, each on a
    thread, which takes half the time of one after the other on two."""
    asked = {
        (item.callspec.params["room"], item.callspec.params["planners"])
        for item in request.session.items
        if isinstance(item, pytest.Function) and item.fspath == request.node.fspath
    }
    with ThreadPoolExecutor(2) as pool:
        yield {
            (room, planners): pool.submit(
                solved, room, planners, tmp_path_factory.mktemp(room) / "run"
            )
            for planners in RUNS
            for room in ROOMS
            if (room, planners) in asked and has_data(mesh(room))
        }
        pool.shutdown(cancel_futures=True)


def solved(room: str, planners: str, out: Path) -> Solved:
    path = Path(os.environ["BENCH_DATA"]) / mesh(room)
    env = f"mesh:file={path},kind=interior,robot_radius=0.15"
    chosen = ("--env", env, "--planners", planners, "--problems", "100", "--seed", "2026")
    done = subprocess.run(
        [sys.executable, *RUNS[planners], "run", *chosen, "--stop", "first", "--out", str(out)],
        env={**os.environ, **ONE_THREAD, "XDG_CACHE_HOME": str(out.parent / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    records = records_of(out)
    return (records["outcome"] == "VALID").groupby(records["planner"]).sum().to_dict()


@pytest.fixture
def counts(runs: dict[tuple[str, str], Future[Solved]], room: str, planners: str) -> Solved:
    if not has_data(mesh(room)):
        pytest.skip("BENCH_DATA has no rooms")
    return runs[room, planners].result()


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("planners", ["fmm,rrtconnect"])
def test_classical_planners_solve_99_of_100(counts: Solved) -> None:
    assert counts["fmm"] >= 99
    assert counts["rrtconnect"] >= 99


@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.parametrize("planners", ["ntfields"])
def test_ntfields_solves_95_of_100_after_an_eighth_of_its_training(counts: Solved) -> None:
    assert counts["ntfields"] >= 95
