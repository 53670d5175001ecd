"""Training, on problems with known answers."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from envs import InputError
from planners.fields.layers import FieldShape
from planners.fields.networks import TimeField
from planners.fields.objectives import LargestSubsolution
from planners.fields.physics import GroupPlan, GroupSampler, NearSurfaces, Space
from planners.learning import training_loop
from planners.learning.training_loop import (
    Batch,
    Minutes,
    Recipe,
    Rollback,
    Steps,
    TrainingState,
    ramp,
    train,
)


def test_schedules() -> None:
    recipe = Recipe(steps=1000)
    assert recipe.rate(0, 0.0) == pytest.approx(recipe.learning_rate / 200)
    assert recipe.rate(1000, 1.0) == pytest.approx(0.02 * recipe.learning_rate)
    objective = LargestSubsolution()
    assert objective.weights(0.0) == (0.3, 0.1)
    assert objective.weights(0.55) == pytest.approx((0.185, 0.1**0.5))
    assert objective.weights(1.0) == pytest.approx((0.07, 1.0))
    assert [ramp(share, 0.25, 0.5) for share in (0.0, 0.3, 0.5, 1.0)] == pytest.approx(
        [0, 0.2, 1, 1]
    )
    assert [ramp(share, 0.0, 0.0) for share in (0.0, 1.0)] == [1, 1]
    assert Steps(10).share(5, 1e9) == 0.5
    assert Minutes(0.5).share(10**9, 15.0) == 0.5
    assert Minutes(0.5).share(0, 60.0) == 1


class Ramp(LargestSubsolution):
    """S = 0.55 + 0.9 x on [-0.5, 0.5]."""

    def __init__(self, **plan: float) -> None:
        super().__init__(GroupPlan(near=NearSurfaces(0.0), **plan))  # type: ignore[arg-type]
        space = Space(np.full(1, -0.5), np.full(1, 0.5), lambda x: x[:, 0], self.speed)
        self._sampler = GroupSampler(space, self.plan)

    @staticmethod
    def speed(x: np.ndarray) -> np.ndarray:
        return 0.55 + 0.9 * x


def begun(width: int, recipe: Recipe) -> TrainingState:
    torch.manual_seed(0)
    return TrainingState.begin(TimeField(FieldShape(1, frequencies=8, width=width)), recipe)


@pytest.mark.training
def test_a_ramp_of_speed_is_learned() -> None:
    """T(a, b) = |log(S(b) / S(a))| / 0.9, to 2 %."""
    recipe = Recipe(steps=800)
    state = begun(32, recipe)
    field = train(state, Ramp(), recipe, Steps(800), seed=0)
    assert state.step == 800
    assert len(state.losses) == 50
    assert state.losses[-1][0] == 1
    ends = torch.linspace(-0.48, 0.48, 60)
    a, b = (x.reshape(-1, 1) for x in torch.meshgrid(ends, ends, indexing="ij"))
    apart = (a - b).abs().squeeze() > 0.05
    a, b = a[apart], b[apart]
    with torch.no_grad():
        stretch, _, _ = field(a, b)
    found = ((a - b).norm(dim=-1) * stretch.exp()).numpy()
    wanted = np.abs(np.log(Ramp.speed(b.numpy()) / Ramp.speed(a.numpy()))).squeeze() / 0.9
    error = np.abs(found / wanted - 1)
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.9) < 0.04


def test_an_interrupted_training_goes_on_as_if_it_had_not_been(tmp_path: Path) -> None:
    class Noisy(Ramp):
        """Uses PyTorch's random numbers, as dropout does."""

        def loss(self, net: TimeField, batch: Batch, share: float) -> torch.Tensor:
            return super().loss(net, batch, share) * (1 + torch.rand(()))

    recipe = Recipe(steps=12)
    file = tmp_path / "checkpoint"
    whole = train(begun(16, recipe), Noisy(groups=4), recipe, Steps(12), seed=7)

    def stop(state: TrainingState) -> None:
        if state.step == 5:
            state.save(file)
        if state.step == 7:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(begun(16, recipe), Noisy(groups=4), recipe, Steps(12), seed=7, report=stop)
    state = begun(16, recipe)
    state.load(file)
    assert state.step == 5
    resumed = train(state, Noisy(groups=4), recipe, Steps(12), seed=7)
    for a, b in zip(whole.parameters(), resumed.parameters(), strict=True):
        assert torch.equal(a, b)
    other = train(begun(16, recipe), Noisy(groups=4), recipe, Steps(12), seed=8)
    assert any(
        not torch.equal(a, b) for a, b in zip(whole.parameters(), other.parameters(), strict=True)
    )


WRONG = [
    *({"share": math.nan}, {"share": 2.0}, {"step": -1}, {"step": 1.5}, {"step": "3"}),
    *({"data_s": math.inf}, {"train_s": -1.0}, {"epochs": {"other": 1}}, {"epochs": None}),
]


@pytest.mark.parametrize("other", WRONG, ids=str)
def test_a_checkpoint_of_no_training_is_refused(tmp_path: Path, other: dict[str, Any]) -> None:
    file = tmp_path / "checkpoint"
    recipe = Recipe(steps=3)
    begun(8, recipe).save(file)
    begun(8, recipe).load(file)
    torch.save({**torch.load(file, weights_only=True), **other}, file)
    with pytest.raises(InputError, match=r"cannot go on from .*, delete it: "):
        begun(8, recipe).load(file)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_a_checkpoint_that_is_cut_off_is_refused(tmp_path: Path, share: float) -> None:
    file = tmp_path / "checkpoint"
    recipe = Recipe(steps=3)
    begun(8, recipe).save(file)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    with pytest.raises(InputError, match=r"cannot go on from .*, delete it: "):
        begun(8, recipe).load(file)


def test_a_checkpoint_with_weights_that_are_no_numbers_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "checkpoint"
    recipe = Recipe(steps=3)
    state = begun(8, recipe)
    next(state.net.parameters()).data[0] = math.nan
    state.save(file)
    with pytest.raises(InputError, match="NaN or infinite"):
        begun(8, recipe).load(file)


def test_checkpoints_come_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(training_loop, "_CHECKPOINT_EVERY_S", 0.0)
    recipe = Recipe(steps=3)
    steps: list[int] = []
    train(
        begun(8, recipe),
        Ramp(groups=2),
        recipe,
        Steps(3),
        seed=0,
        checkpoint=lambda state: steps.append(state.step),
    )
    assert steps == [1, 2, 3]


def test_an_epoch_that_gets_much_worse_is_rolled_back() -> None:
    class Worsening(Ramp):
        epoch = 0.0

        def loss(self, net: TimeField, batch: Batch, share: float) -> torch.Tensor:
            self.epoch += 1
            real = super().loss(net, batch, share)
            return real - real.detach() + (2.0 if self.epoch > 4 else 1.0)

    recipe = Recipe(steps=6, rollback=Rollback(epoch_steps=2), warm_up_steps=1)
    state = begun(8, recipe)
    seen: list[list[torch.Tensor]] = []

    def watch(state: TrainingState) -> None:
        seen.append([p.detach().clone() for p in state.net.parameters()])

    train(state, Worsening(groups=2), recipe, Steps(6), seed=0, report=watch)
    last = seen[-1]
    again = [all(torch.equal(a, b) for a, b in zip(last, s, strict=True)) for s in seen[:-1]]
    assert again in ([False, True, False, False, False], [False, False, False, True, False])
