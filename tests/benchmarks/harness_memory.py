"""Prints what the harness's own process holds over a run with a planner that crashes on every
third problem, hangs on every fifth and leaks 100 MB a problem, beside two that do not:

    PYTHONPATH=tests python tests/benchmarks/harness_memory.py [PROBLEMS]

2000 problems, the default, take about half an hour.
"""

from __future__ import annotations

import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from pathlib import Path

import psutil

NASTY = Path(__file__).parents[1] / "planners_that_fail.py"
PLANNERS = ("rrtconnect", "rrtconnect:range=2", "nasty")
BOOT = (  # two planners at a time, also where there is one core: times do not matter here
    "import sys; from bench import cli; from envs import processors;"
    "processors.physical_cores = lambda: 2; sys.exit(cli.main())"
)


def main(problems: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        store = Path(folder) / "run.sqlite"
        run = (
            *("run", "--env", "c3d", "--planners", ",".join(PLANNERS), "--problems", str(problems)),
            *("--jobs", "2", "--planner-file", str(NASTY), "--memory-limit", "280"),
            *("--stop", "first", "--time-limit", "0.1", "--out", folder),
        )
        with subprocess.Popen(
            [sys.executable, "-c", BOOT, *run], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as process:
            watch(process, store, problems * len(PLANNERS))
        query = "SELECT planner, outcome, count(*) FROM records GROUP BY planner, outcome"
        for planner, outcome, count in answers(store, query):
            print(f"{planner:<20} {outcome:<14} {count:5}")


def watch(process: subprocess.Popen[bytes], store: Path, total: int) -> None:
    """Prints a line whenever another tenth of the attempts is stored, and one in the beginning."""
    harness = psutil.Process(process.pid)
    tenths = [0.1, *range(1, 11)]
    while tenths and process.poll() is None:
        [(rows,)] = answers(store, "SELECT count(*) FROM records") or [(0,)]
        if rows >= tenths[0] / 10 * total:
            held = harness.memory_info().rss / 2**20
            print(f"{rows:5} attempts {held:7.1f} MB {harness.num_fds():3} files", flush=True)
            tenths = [tenth for tenth in tenths if tenth / 10 * total > rows]
        time.sleep(0.2)


def answers(store: Path, query: str) -> list[tuple[object, ...]]:
    """Of a store; none where it is not made yet."""
    try:
        with closing(sqlite3.connect(f"file:{store}?mode=ro", uri=True)) as connection:
            return connection.execute(query).fetchall()
    except sqlite3.OperationalError:
        return []


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000)
