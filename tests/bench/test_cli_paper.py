"""`bench paper`: a small paper of each kind of experiment, carried out by the command."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest
from conftest import Cli, records_of
from matplotlib.image import imread

from bench.paper import runner
from bench.report import field

pytestmark = pytest.mark.slow

FILES = {
    "table.toml": """
kind = "comparison"
order = 1
title = "A table"
where = "Table 9"
generated = "a table in short"
env = ["arm4"]
planners = ["rrtconnect", "rrtstar"]
problems = 3
quick = 2
stop = "first"
[explained]
rrtconnect = "It is here to be explained."
""",
    "table.csv": "env,planner,problems,success_rate,time_s_mean\nall,rrtconnect,10,0.0,2.0\n",
    "paths.toml": """
kind = "paths"
order = 2
title = "Paths"
where = "Figure 9"
of = "table"
env = "arm4"
planners = ["rrtconnect"]
problem = 1
""",
    "fields.toml": """
kind = "fields"
order = 3
title = "Fields"
where = "Figure 10"
env = ["c3d", "c3d:scene=1"]
planners = ["fmm", "ntfields"]
""",
    "offline.toml": """
kind = "offline"
order = 4
title = "Training"
where = "Table 10"
rows = [["c3d", "ntfields"], ["arm4:scene=77", "ntfields"]]
""",
    "offline.csv": "env,planner,data_s,train_s\nc3d,ntfields,3.74,25920\n",
    "grids.toml": """
kind = "dimensions"
order = 5
title = "Grids"
where = "Table 11"
env = ["arm4"]
resolutions = [6, 12]
quick_nodes = 5000
""",
    "grids.csv": "env,resolution,solve_s,ief3d_data_s\narm4,6,0.5,1\narm4,12,,\n",
}


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    folder = tmp_path / "experiments"
    folder.mkdir()
    for name, text in FILES.items():
        (folder / name).write_text(text)
    monkeypatch.setattr(runner, "data_folder", lambda: folder)
    monkeypatch.setattr(field, "PER_AXIS", 30)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("MPLCONFIGDIR", str(tmp_path / "mpl"))
    return folder


@pytest.mark.usefixtures("in_process_workers")
def test_it_carries_everything_out_beside_the_papers(bench: Cli, tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, text, err = bench("paper", "--quick", "--out", out)
    assert code == 0, err
    assert text.strip() == (out / "paper.md").read_text().strip()
    for heading in ("A table (Table 9)", "Paths (Figure 9)", "Fields (Figure 10)", "Grids"):
        assert f"## {heading}" in text
    assert "Quick look: 2 problems instead of 3." in text
    assert "Generated stand-in, not the paper's own: a table in short." in text
    assert "It is here to be explained." in text
    table = pd.read_csv(out / "table.csv").set_index("planner")
    assert table.loc["rrtconnect", "problems"] == 2
    assert table.loc["rrtconnect", "verdict"] == "better"
    assert table.loc["rrtstar", "verdict"] == "not comparable"
    for name in ("paths", "fields"):
        assert len(set(imread(out / f"{name}.png")[:, :, :3].ravel().tolist())) > 50
        assert f"]({name}.png)" in text
    assert pd.read_csv(out / "fields.csv")["env"].tolist() == ["c3d"] * 2 + ["c3d:scene=1"] * 2
    offline = pd.read_csv(out / "offline.csv")
    assert offline["train_s"].notna().tolist() == [True, False]
    assert "no weights here" in text
    grids = pd.read_csv(out / "grids.csv")
    assert grids["outcome"].tolist() == ["solved", "left out by --quick"]


@pytest.mark.usefixtures("in_process_workers")
def test_it_goes_on_where_it_stopped(bench: Cli, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert bench("paper", "--quick", "--only", "table,grids", "--out", out)[0] == 0
    first, measured = records_of(out / "table"), (out / "grids-measured.csv").read_text()
    (out / "grids-measured.csv").write_text(measured.replace("arm4,4,6,1296", "arm4,4,6,4321"))
    assert bench("paper", "--only", "grids,table", "--out", out)[0] == 0
    again = records_of(out / "table")
    assert len(first) == 4
    assert len(again) == 6
    both = first.merge(again, on=["planner", "problem"])
    assert (both["run_id_x"] == both["run_id_y"]).all(), "what was measured is not measured again"
    grids = pd.read_csv(out / "grids.csv")
    assert grids["nodes"].tolist() == [4321, 12**4]
    assert grids["outcome"].tolist() == ["solved", "solved"], "what was left out is not any more"
    assert "Quick" not in (out / "table.md").read_text()


def test_what_cannot_be_done_is_said_and_the_rest_is_done(
    bench: Cli, tmp_path: Path, small: Path
) -> None:
    (small / "table.toml").write_text(FILES["table.toml"].replace('"arm4"', '"arm9"'))
    out = tmp_path / "out"
    code, text, err = bench("paper", "--only", "table,paths,offline", "--quick", "--out", out)
    assert code == 2
    assert err.strip().splitlines()[-1].endswith("table, paths")
    assert "Could not be carried out: unknown environment 'arm9'" in text
    assert "`bench paper --only table` makes it" in text
    assert (out / "offline.csv").exists()


def test_unknown_experiments_suggest_the_nearest(bench: Cli, tmp_path: Path) -> None:
    code, _, err = bench("paper", "--only", "tabel", "--out", tmp_path / "out")
    assert code == 2
    assert "did you mean 'table'" in err
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("")
    code, _, err = bench("paper", "--only", "offline", "--out", tmp_path / "file")
    assert code == 2
    assert "cannot write to" in err
