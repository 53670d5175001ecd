"""Files of ours that others may have written: baselines, manifests of weights, experiments."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from fuzzing import fuzzed
from mutations import contents

from bench.analysis.regression import Baseline, read, write
from bench.paper import runner
from bench.paper.experiment import Experiment
from planners.learning import weight_files
from planners.learning.weight_files import Manifest

T = TypeVar("T")

BASELINES = (
    "version,env,planner,fingerprint,seed,settings,problems,solved\n"
    '1,c3d,"rrtstar:range=2,goal_bias=0.1",7e7d5e2e,0,jobs=1 rules=1,20,19\n'
    "1,arm4,fmm,e30800c7,7,jobs=1 stop=first,3,0\n",
    "version,env,planner,fingerprint,seed,settings,problems,solved,length,margin,time\n"
    "1,c3d,fmm,7e7d5e2e,0,jobs=1,3,2,14.5 - 1e-3,0.2 - 3,0.1 - 0.25\n"
    '1,"c3d:boxes=5,scene=3",fmm,7e7d5e2f,0,jobs=1,2,1,8 -,- -,0.001 -\n',
)

MANIFEST = Manifest(
    planner="ntfields",
    env="c3d:scene=3",
    env_fingerprint="7e7d5e2ec55fe2d0",
    settings={"steps": 12000, "learning_rate": 1e-3, "betas": [0.9, 0.99], "device": "cpu"},
    seed=0,
    data_s=4.25,
    train_s=601.5,
    losses=[[0.0, 0.5], [0.5, 0.125], [1.0, 0.0625]],
    validation=[[1.0, 199, 200]],
    command="bench train --env c3d:scene=3 --planner ntfields --seed 0",
    machine={"machine": {"processor": "EPYC", "physical_cores": 2}, "versions": {"torch": "2.8"}},
)

EXPERIMENTS = tuple(
    file.read_text(encoding="utf-8") for file in sorted(runner.data_folder().glob("*.toml"))
)


def reader(file: Path, read_it: Callable[[Path], T]) -> Callable[[bytes], T]:
    """Reads what it is given from a file, which is left as it is, as is what is beside it."""
    beside = set(file.parent.iterdir())

    def parse(content: bytes) -> T:
        file.write_bytes(content)
        try:
            return read_it(file)
        finally:
            assert file.read_bytes() == content
            assert set(file.parent.iterdir()) == beside | {file}

    return parse


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An empty one."""
    (tmp_path / "in").mkdir()
    return tmp_path / "in"


def test_baselines(folder: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.csv"

    def check(baseline: Baseline) -> None:
        write(baseline, again)
        same = read(again)
        assert same.measures == baseline.measures
        assert same.rows.keys() == baseline.rows.keys()
        for key, row in baseline.rows.items():
            assert 0 <= row.solved <= row.problems
            assert {**vars(same.rows[key]), "values": 0} == {**vars(row), "values": 0}
            for name, values in row.values.items():
                assert not np.isinf(values).any()
                assert same.rows[key].values[name] == pytest.approx(values, 1e-5, nan_ok=True)

    fuzzed("baselines", contents(BASELINES), reader(folder / "b.csv", read), check)


def test_manifests(folder: Path) -> None:
    """Beside weights that the good one describes."""
    weights = folder / "w.safetensors"
    weight_files.write(weights, {"bias": np.ones(2, dtype=np.float32)}, MANIFEST)
    written = weight_files.manifest_file(weights).read_text()
    samples = written, json.dumps(json.loads(written))

    def read_it(_: Path) -> Manifest:
        return weight_files.read(weights, MANIFEST.planner, MANIFEST.env_fingerprint)[1]

    def check(manifest: Manifest) -> None:
        assert Manifest(**json.loads(json.dumps(asdict(manifest)))) == manifest
        assert 0 <= manifest.data_s + manifest.train_s < math.inf

    parse = reader(weight_files.manifest_file(weights), read_it)
    fuzzed("manifests", contents(samples), parse, check)


def test_experiments(folder: Path) -> None:
    def check(found: list[Experiment]) -> None:
        [experiment] = found
        assert experiment.name == "one"
        assert experiment.heading
        assert math.isfinite(getattr(experiment, "time_limit_s", 0.0))

    parse = reader(folder / "one.toml", lambda file: runner.experiments(file.parent))
    fuzzed("experiments", contents(EXPERIMENTS), parse, check)
