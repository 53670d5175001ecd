"""Training one model for all scenes of a family, through the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest
from conftest import Cli

import envs
from envs.scenes import cluttered
from planners.learning import trainer, training_loop, weight_files
from planners.learning.training_loop import Recipe
from planners.mpnet import planner as mpnet
from planners.mpnet.imitation import DemonstrationPlan, Imitation

pytestmark = pytest.mark.training

TRAIN = ("train", "--env", "c3d:scene=55,boxes=3", "--planner", "mpnet")


@pytest.fixture(autouse=True)
def brief(in_this_process: None, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A few demonstrations and steps, and a cache of their own; the cache's folder."""
    plan = DemonstrationPlan("rrtconnect", seconds=0.05, problems=3)
    objective = Imitation(plan, scenes=2, samples=8, points=32)
    method = replace(mpnet.METHOD, objective=lambda: objective, recipe=Recipe(steps=4))
    monkeypatch.setattr(mpnet, "METHOD", method)
    monkeypatch.setattr(cluttered, "FAMILY", (0, 20_000))
    monkeypatch.setattr(trainer, "_VALIDATION_PROBLEMS", 2)
    monkeypatch.setattr(training_loop, "_CHECKPOINT_EVERY_S", 0.0)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "plannerbench"


@pytest.mark.usefixtures("in_process_workers")
def test_weights_of_a_family_serve_all_its_scenes(bench: Cli, brief: Path, tmp_path: Path) -> None:
    code, out, err = bench(*TRAIN)
    assert code == 0, err
    file = Path(out.strip())
    assert file.name == f"mpnet-{envs.make('c3d:boxes=3').family_fingerprint}.safetensors"
    manifest = json.loads(file.with_suffix(".json").read_text())
    assert manifest["settings"]["objective"]["plan"]["planner"] == "rrtconnect"
    assert manifest["settings"]["network"]["class"] == "Mpnet"
    assert manifest["data_s"] > 0
    assert manifest["validation"][-1][2] == 2
    assert not list((brief / "training").iterdir())
    run = ("run", "--problems", 2, "--no-train", "--stop", "first", "--time-limit", 1)
    chosen = ("--env", "c3d:boxes=3,c3d:scene=7,boxes=3", "--planners", "mpnet,mpnet-hybrid")
    assert bench(*run, *chosen, "--out", tmp_path / "run")[0] == 0
    summary = pd.read_csv(tmp_path / "run" / "summary.csv")
    assert len(summary) == 4
    assert not summary["status_counts"].str.contains("SKIPPED|ERROR").any()
    hybrid = summary[summary["planner"] == "mpnet-hybrid"]
    assert (hybrid["solved"] == 2).all()
    assert hybrid["fallbacks"].notna().all()
    assert summary[summary["planner"] == "mpnet"]["fallbacks"].isna().all()
    assert (summary["train_s"] == manifest["data_s"] + manifest["train_s"]).all()


def test_weights_of_another_family_are_refused(bench: Cli, tmp_path: Path) -> None:
    code, out, _ = bench(*TRAIN)
    assert code == 0
    chosen = ("--env", "c3d:boxes=4", "--planners", f"mpnet:weights={out.strip()}")
    code, _, err = bench("run", *chosen, "--out", tmp_path / "run")
    assert code == 2
    assert "these weights are for environment" in err


def test_demonstrations_are_kept_when_a_training_is_interrupted(
    bench: Cli, brief: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(self: object, rng: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr(Imitation, "draw", interrupted)
        assert bench(*TRAIN)[0] == 130
    [kept] = [f for f in (brief / "training").iterdir() if f.name.endswith(".data.npz")]
    before = kept.stat().st_mtime_ns
    with monkeypatch.context() as patched:
        patched.setattr(Imitation, "draw", interrupted)
        assert bench(*TRAIN)[0] == 130
    assert kept.stat().st_mtime_ns == before, "nothing is demonstrated twice"
    assert bench(*TRAIN)[0] == 0
    assert weight_files.find("mpnet", envs.make("c3d:boxes=3").family_fingerprint)
