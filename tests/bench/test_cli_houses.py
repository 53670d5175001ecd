"""Generated houses through the command line: their own name everywhere, and cut open."""

from __future__ import annotations

from pathlib import Path

import pytest
from conftest import Cli, records_of
from matplotlib.image import imread

from envs.errors import tell_once

pytestmark = pytest.mark.slow(minutes=1)


@pytest.mark.usefixtures("in_process_workers")
def test_a_house_is_called_generated_and_drawn_cut_open(bench: Cli, tmp_path: Path) -> None:
    run = tmp_path / "run"
    tell_once.cache_clear()  # it is said once in a process, perhaps for an earlier test
    code, out, err = bench(
        *("run", "--env", "gibson:scene=1", "--planners", "rrtconnect,mpnet", "--problems", 2),
        *("--stop", "first", "--out", run),
    )
    assert code == 0, err
    assert "gibson-generated:scene=1" in out
    assert err.count("gibson-generated, scene 1: interior") == 1
    records = records_of(run)
    assert set(records["env"]) == {"gibson-generated:scene=1"}
    outcomes = records.groupby("planner")["outcome"].agg(set).to_dict()
    assert outcomes == {"rrtconnect": {"VALID"}, "mpnet": {"UNSUPPORTED"}}
    picture = tmp_path / "house.png"
    shown = bench("show", "--env", "gibson:scene=1", "--paths", run, "--out", picture)
    assert shown[0] == 0, shown[2]
    # Cut open: rooms are seen, so there are many greys; a closed box has few.
    assert len({tuple(pixel) for pixel in imread(picture)[::4, ::4].reshape(-1, 4)}) > 500
