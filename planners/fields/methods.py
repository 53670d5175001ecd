"""The named methods: which network, trained on what, for how long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

import torch
from torch import Tensor, nn

from envs import Environment, InputError
from envs.collision.surface import surface_points
from planners.fields.networks import FieldShape, TimeField
from planners.fields.objectives import (
    LargestSubsolution,
    Objective,
    Regression,
    SpeedRegression,
    WithWorkspace,
)
from planners.fields.paper import PaperField, PublishedPhysics
from planners.fields.sampling import GroupPlan, NearSurfaces, Scale
from planners.fields.training import Recipe, Rollback
from planners.fields.workspace import SURFACE_POINTS, occupancy


@dataclass(frozen=True)
class Method:
    """A neural time field.

    Attributes:
        objective: makes what it is trained on.
        recipe: how.
        expected_minutes: about how long that takes on two cores.
        network: makes a network for an environment, random by PyTorch's global generator.
    """

    objective: Callable[[], Objective]
    recipe: Recipe = field(default_factory=Recipe)
    expected_minutes: float = 5.0
    network: Callable[[Environment], nn.Module] = field(default_factory=lambda: small())

    def settings(self) -> dict[str, Any]:
        """JSON data that says how it is trained."""
        return {"objective": described(self.objective()), "recipe": asdict(self.recipe)}


def small(**shape: Any) -> Callable[[Environment], TimeField]:
    """Makes networks of `FieldShape`, with what differs from its defaults."""

    def network(env: Environment) -> TimeField:
        model = env.speed_model
        ratio = model.d_max / model.d_min
        made = FieldShape(env.dimension, speed_ratio=ratio, **shape)
        return TimeField(made, occupancy_of(env) if made.workspace else None)

    return network


def published(env: Environment) -> PaperField:
    """The paper's network."""
    return PaperField(env.dimension, occupancy_of(env))


def occupancy_of(env: Environment) -> Tensor:
    """The voxel grid of an environment's obstacles, for a w-space encoder."""
    points = surface_points(env.obstacles, SURFACE_POINTS, seed=0)
    return occupancy(torch.from_numpy(Scale.of(env).shrink(points)).float())


def described(objective: Any) -> dict[str, Any]:
    """An objective's class and parameters as JSON data."""
    values = {
        name: described(value) if hasattr(value, "__dataclass_fields__") else value
        for name, value in vars(objective).items()
        if not name.startswith("_")
    }
    return {"class": type(objective).__name__, **values}


UNIFORM_PAIRS = GroupPlan(groups=384, starts=1, goals=1, local_share=0.0, near=NearSurfaces(0.0))
"""Independent pairs anywhere, as many points in a step as the default's groups have."""

METHODS: dict[str, Method] = {
    "ntfields": Method(LargestSubsolution),
    "ief3d": Method(Regression, Recipe(steps=3000), expected_minutes=6.0),
    "eikonet": Method(
        lambda: SpeedRegression(UNIFORM_PAIRS),
        expected_minutes=3.0,
        network=small(operator="concatenation", bounded=False),
    ),
    "ntfields-nosym": Method(LargestSubsolution, network=small(operator="concatenation")),
    "ntfields-wenc": Method(
        lambda: WithWorkspace(LargestSubsolution()),
        expected_minutes=8.0,
        network=small(workspace=True),
    ),
    "ntfields-wenc-early": Method(
        lambda: WithWorkspace(LargestSubsolution(), lambda_from=0.0, lambda_to=0.0),
        expected_minutes=8.0,
        network=small(workspace=True),
    ),
    "ntfields-paper": Method(
        PublishedPhysics,
        Recipe(  # 2000 epochs of a million pairs
            steps=200_000,
            learning_rate=5e-4,
            warm_up_steps=20,
            last_rate_share=1.0,
            weight_decay=0.1,
            betas=(0.9, 0.999),
            averaging=0.0,
            rollback=Rollback(),
        ),
        expected_minutes=15_000.0,
        network=published,
    ),
}


def method(name: str) -> Method:
    """The method of a name.

    Raises:
        InputError: there is none.
    """
    if name not in METHODS:
        raise InputError(f"no time field is called {name!r}; choose from {', '.join(METHODS)}")
    return METHODS[name]
