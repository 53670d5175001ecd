"""A training that is interrupted at any step ends as one that is not, whatever is trained."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from envs import Environment
from planners.fields.labels import Labels
from planners.fields.methods import METHODS
from planners.fields.objectives import Regression, WithWorkspace
from planners.fields.paper import PublishedPhysics
from planners.learning.learned_planner import Training
from planners.learning.trainer import Method, learn
from planners.learning.training_loop import Objective, Recipe, Rollback, Steps, TrainingState, train
from planners.mpnet.imitation import Imitation, _Paths
from planners.mpnet.planner import METHOD

STEPS = 5
ROLLED_BACK = Rollback(epoch_steps=2, factor=0.0, kept=2)  # after every epoch but the first
TRAINED = {**METHODS, "mpnet": METHOD}


def prepared(method: Method, env: Environment, file: Path) -> Objective:
    """What a method is trained on, only less of it."""
    objective: Any = method.objective()
    inner = objective.objective if isinstance(objective, WithWorkspace) else objective
    rng = np.random.default_rng(0)
    if isinstance(inner, PublishedPhysics):
        inner.pairs, inner.batch = 200, 20
    elif isinstance(inner, Regression):
        shapes = (4, 3), (4, 16, 3), (4, 16)
        inner._labels = Labels(*(rng.random(s, dtype=np.float32) - 0.5 for s in shapes))
        return objective
    elif isinstance(inner, Imitation):
        inner.scenes, inner.samples, inner.points = 2, 4, 16
        inner._turns, inner._clouds = [(np.eye(3), np.eye(3))], [rng.random((50, 3))]
        inner._paths = [_Paths(rng.random((4, 3)), np.full(4, 3))]
        return objective
    else:
        inner.plan = replace(inner.plan, groups=2)
    objective.prepare(env, 0, file, lambda share: None)
    return objective


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Steps this small are slower on several."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.training
@pytest.mark.parametrize("name", TRAINED)
def test_every_method_goes_on_as_if_it_had_not_been_interrupted(
    name: str, c3d: Environment, tmp_path: Path
) -> None:
    method = TRAINED[name]
    recipe = replace(method.recipe, rollback=ROLLED_BACK if method.recipe.rollback else None)
    objective = prepared(method, c3d, tmp_path / "data.npz")

    def begun() -> TrainingState:
        torch.manual_seed(0)
        return TrainingState.begin(method.network(c3d), recipe)

    def kept(state: TrainingState) -> None:
        state.save(tmp_path / str(state.step))

    whole = begun()
    train(whole, objective, recipe, Steps(STEPS), seed=3, report=kept)
    for step in range(1, STEPS):
        state = begun()
        state.load(tmp_path / str(step))
        train(state, objective, recipe, Steps(STEPS), seed=3)
        for ours, theirs in ((state.net, whole.net), (state.average, whole.average)):
            for a, b in zip(ours.state_dict().values(), theirs.state_dict().values(), strict=True):
                assert torch.equal(a, b), f"interrupted at step {step}"
        assert (state.recent, state.losses) == (whole.recent, whole.losses)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ntfields-wenc", "ntfields-paper"])
def test_what_is_validated_has_the_lambda_of_its_time(
    name: str, c3d: Environment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = Recipe(steps=8, averaging=0.5)
    method = replace(
        METHODS[name],
        recipe=recipe,
        objective=lambda: prepared(METHODS[name], c3d, tmp_path / "data.npz"),
    )
    monkeypatch.setattr("planners.learning.trainer._VALIDATION_PROBLEMS", 1)
    seen = []

    def solved(net: Any, problems: object) -> int:
        seen.append(net.workspace_weight.item())
        return 0

    learn(method, c3d, Training(0, None, "cpu", tmp_path / "checkpoint"), solved)
    assert seen == pytest.approx([0.0, 0.5, 1.0, 1.0])  # as it was in the step before
