"""Learned fields in rooms, from training to the table, through the command line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from conftest import Cli, records_of

import envs
from planners.fields.labels import LabelPlan
from planners.fields.methods import IN_ROOMS, survey
from planners.fields.objectives import Regression
from planners.learning import trainer, weight_files
from planners.learning.training_loop import Recipe, TrainingState

pytestmark = pytest.mark.training(minutes=3)


@pytest.fixture
def two_rooms(tmp_path: Path) -> str:
    """An environment: 6 m by 5 m, with a wall that leaves 1.2 m open."""
    room = trimesh.creation.box((6.0, 5.0, 2.5))
    room.invert()
    wall = trimesh.creation.box((0.2, 3.8, 2.5))
    wall.apply_translation((0.3, -0.6, 0.0))
    file = tmp_path / "rooms.ply"
    trimesh.util.concatenate([room, wall]).export(file)
    return f"mesh:file={file},kind=interior,robot_radius=0.1"


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Trainings of a few steps on few labels, and a cache of their own."""
    for name, method in IN_ROOMS.items():
        monkeypatch.setitem(IN_ROOMS, name, replace(method, recipe=Recipe(steps=60)))
    few = replace(IN_ROOMS["ief3d"], objective=lambda: Regression(LabelPlan(4, 500, 40)))
    monkeypatch.setitem(IN_ROOMS, "ief3d", few)
    monkeypatch.setattr(trainer, "_VALIDATION_PROBLEMS", 2)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


@pytest.mark.usefixtures("in_this_process", "in_process_workers")
def test_fields_are_trained_and_plan_round_a_wall(
    bench: Cli, two_rooms: str, tmp_path: Path
) -> None:
    chosen = ("--env", two_rooms, "--planners", "ntfields,ief3d", "--problems", 6)
    code, out, err = bench("run", *chosen, "--stop", "first", "--out", tmp_path / "run")
    assert code == 0, err
    records = records_of(tmp_path / "run")
    assert set(records["outcome"]) <= {"VALID", "NOT_SOLVED"}, "what is claimed is valid"
    solved = records[records["outcome"] == "VALID"].groupby("planner").size()
    assert solved["ntfields"] >= 4, "even hardly trained: the inputs know the wall"
    assert "training ntfields" in err
    assert out.count("ntfields") >= 1


def test_an_interrupted_training_keeps_its_modes(two_rooms: str, tmp_path: Path) -> None:
    env = envs.make(two_rooms)
    method = IN_ROOMS["ntfields"]
    net = method.network(env)
    survey(net, 5)
    TrainingState.begin(net, method.recipe).save(tmp_path / "checkpoint")
    fresh = TrainingState.begin(method.network(env), method.recipe)
    fresh.load(tmp_path / "checkpoint")
    x = np.random.default_rng(0).uniform(-0.3, 0.3, (20, 3))
    for module in (fresh.net, fresh.average):
        assert (module.inputs.at(x) == net.inputs.at(x)).all()


def test_weights_for_rooms_are_small_enough_to_ship(two_rooms: str) -> None:
    env = envs.make(two_rooms)
    net = IN_ROOMS["ntfields"].network(env)
    survey(net, 0)
    size = sum(tensor.numel() * tensor.element_size() for tensor in net.state_dict().values())
    assert size < 2 * 10**6
    assert all(file.stat().st_size < 2 * 10**6 for file in weight_files.SHIPPED.iterdir())
