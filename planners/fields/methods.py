"""The named methods of time fields: which network, trained on what, for how long."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import torch
from torch import Tensor

from envs import Environment, InputError
from planners.fast_marching import default_resolution
from planners.fields.indoor_features import CLEARANCES, RoomInputs
from planners.fields.labels import LabelPlan
from planners.fields.layers import FieldShape
from planners.fields.metric_field import MetricField
from planners.fields.networks import TimeField, occupancy
from planners.fields.objectives import (
    LargestSubsolution,
    LargestSubsolutionAround,
    LargestSubsolutionInRooms,
    Regression,
    SpeedRegression,
    WithWorkspace,
)
from planners.fields.paper import PaperField, PublishedPhysics
from planners.fields.physics import GroupPlan, NearSurfaces
from planners.fields.robot_features import ArmInputs
from planners.fields.temporal_difference import TemporalDifference
from planners.learning.normalizer import Normalizer, obstacle_point_cloud
from planners.learning.trainer import Method
from planners.learning.training_loop import Recipe, Rollback

_BANDWIDTH = 0.07
"""Standard deviation of Fourier frequencies, in periods per d_max of the speed model, which is
the length over which speeds change."""

_BANDWIDTH_IN_ROOMS = 0.14

_METRIC_BANDWIDTH = 0.14
"""The same of NTRL's network."""

_MODES = 16
"""Of free space, in rooms."""

_ARM_RATIO = 15.0
"""Of arrival times by distances that arms' fields can express; detours take less than walls."""


def bandwidth(env: Environment) -> float:
    """See `FieldShape`."""
    periods = _BANDWIDTH_IN_ROOMS if env.is_interior else _BANDWIDTH
    return periods * Normalizer.of(env).extent / env.speed_model.d_max


def small(**shape: Any) -> Callable[[Environment], TimeField]:
    """Makes networks of `FieldShape`, with what differs from its defaults."""

    def network(env: Environment) -> TimeField:
        ratio = env.speed_model.ratio
        made = FieldShape(
            env.dimension,
            speed_ratio=ratio,
            bandwidth=bandwidth(env),
            circles=Normalizer.of(env).circles,
            **shape,
        )
        return TimeField(made, occupancy_of(env) if made.workspace else None)

    return network


def for_rooms(env: Environment) -> TimeField:
    """The network for rooms, see `planners.fields.laplacian_eigenmaps`.

    Its stretch is relative to distance plus effective resistance, which is T within a factor of
    two in most places, and several times T where the way is narrow, as on stairs.
    """
    made = FieldShape(
        env.dimension,
        speed_ratio=32.0,
        below=2.0,
        opening=0.0,
        bandwidth=bandwidth(env),
        computed=CLEARANCES + _MODES,
        modes=_MODES,
    )
    return TimeField(made, inputs=RoomInputs(env, _MODES))


def survey(net: TimeField | MetricField, seed: int) -> None:
    """Computes the modes of free space."""
    assert isinstance(net.inputs, RoomInputs)
    net.inputs.modes.solve(seed)


def for_arms(env: Environment) -> TimeField:
    """The network for arms, see `planners.fields.robot_features`."""
    inputs = ArmInputs(env)
    made = FieldShape(
        env.dimension,
        frequencies=0,
        speed_ratio=_ARM_RATIO,
        computed=inputs.size,
        circles=Normalizer.of(env).circles,
    )
    return TimeField(made, inputs=inputs)


def published(env: Environment) -> PaperField:
    """The paper's network."""
    return PaperField(env.dimension, occupancy_of(env))


def metric(env: Environment) -> MetricField:
    """The network of NTRL. It has to be steeper beside surfaces than one that is told the distance,
    and so its frequencies are higher."""
    return MetricField(_metric_shape(env))


def metric_for_rooms(env: Environment) -> MetricField:
    """The same, told in rooms what `for_rooms` is told."""
    inputs = RoomInputs(env, _MODES)
    return MetricField(replace(_metric_shape(env), computed=inputs.size), inputs)


def metric_for_arms(env: Environment) -> MetricField:
    """The same, told of arms what `for_arms` is told."""
    inputs = ArmInputs(env)
    return MetricField(replace(_metric_shape(env), frequencies=0, computed=inputs.size), inputs)


def _metric_shape(env: Environment) -> FieldShape:
    periods = _METRIC_BANDWIDTH * Normalizer.of(env).extent / env.speed_model.d_max
    return FieldShape(env.dimension, bandwidth=periods, circles=Normalizer.of(env).circles)


def occupancy_of(env: Environment) -> Tensor:
    """The voxel grid of an environment's obstacles, for a w-space encoder."""
    return occupancy(torch.from_numpy(obstacle_point_cloud(env)).float())


UNIFORM_PAIRS = GroupPlan(groups=384, starts=1, goals=1, local_share=0.0, near=NearSurfaces(0.0))
"""Pairs of points anywhere."""

_METRIC_STEPS = Recipe(steps=3000, learning_rate=4e-3)

METHODS: dict[str, Method] = {
    "ntfields": Method(small(), LargestSubsolution),
    "ief3d": Method(small(), Regression, Recipe(steps=3000), expected_minutes=6.0),
    "eikonet": Method(
        small(operator="concatenation", bounded=False),
        lambda: SpeedRegression(UNIFORM_PAIRS),
        Recipe(steps=2500),
        expected_minutes=2.0,
    ),
    "ntrl": Method(metric, TemporalDifference, _METRIC_STEPS, expected_minutes=5.0),
    "ntfields-nosym": Method(small(operator="concatenation"), LargestSubsolution),
    "ntfields-nowenc": Method(small(), LargestSubsolution),
    "ntfields-wenc": Method(
        small(workspace=True), lambda: WithWorkspace(LargestSubsolution()), expected_minutes=8.0
    ),
    "ntfields-wenc-early": Method(
        small(workspace=True),
        lambda: WithWorkspace(LargestSubsolution(), lambda_from=0.0, lambda_to=0.0),
        expected_minutes=8.0,
    ),
    "ntfields-paper": Method(
        published,
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
    ),
}

_STEPS_IN_ROOMS = Recipe(steps=8000)

IN_ROOMS: dict[str, Method] = {
    "ntfields": Method(
        for_rooms,
        LargestSubsolutionInRooms,
        _STEPS_IN_ROOMS,
        expected_minutes=15.0,
        survey=survey,
    ),
    "ntfields-nowenc": Method(
        small(), LargestSubsolutionInRooms, _STEPS_IN_ROOMS, expected_minutes=10.0
    ),
    "ntfields-wenc": Method(
        small(workspace=True),
        lambda: WithWorkspace(LargestSubsolutionInRooms()),
        _STEPS_IN_ROOMS,
        expected_minutes=20.0,
    ),
    "ntfields-wenc-early": Method(
        small(workspace=True),
        lambda: WithWorkspace(LargestSubsolutionInRooms(), lambda_from=0.0, lambda_to=0.0),
        _STEPS_IN_ROOMS,
        expected_minutes=20.0,
    ),
    "ief3d": Method(
        for_rooms,
        lambda: Regression(LabelPlan(sources=120, resolution=150)),
        Recipe(steps=4000),
        expected_minutes=12.0,
        survey=survey,
    ),
    "ntrl": Method(
        metric_for_rooms,
        TemporalDifference,
        _METRIC_STEPS,
        expected_minutes=10.0,
        survey=survey,
    ),
}
"""What is done otherwise in rooms, with a point robot."""

FOR_ARMS: dict[str, Method] = {
    "ntfields": Method(for_arms, LargestSubsolution, Recipe(steps=5000), expected_minutes=5.0),
    "ief3d": Method(
        for_arms,
        lambda: Regression(LabelPlan(resolution=None)),
        Recipe(steps=3000),
        expected_minutes=6.0,
    ),
    "ntrl": Method(metric_for_arms, TemporalDifference, _METRIC_STEPS, expected_minutes=10.0),
}
"""What is done otherwise for arms, of which an environment has `link_geometry`."""

_IN_MORE_DIMENSIONS: dict[str, Method] = {
    "ief3d": Method(
        small(),
        lambda: Regression(LabelPlan(resolution=None)),
        Recipe(steps=3000),
        expected_minutes=6.0,
    ),
}
"""What is done otherwise where a grid as fine as in three dimensions would be too large."""

_AROUND: dict[Any, Any] = {LargestSubsolution: LargestSubsolutionAround}
"""What methods are trained on instead where coordinates wrap."""

_FOR_POINTS = ("ntfields-wenc", "ntfields-wenc-early", "ntfields-paper")
"""Methods whose learned w-space encoder looks about one point."""


def unsupported(name: str, env: Environment) -> str | None:
    """Why a method is not for an environment, or None if it is."""
    if name in _FOR_POINTS and not env.is_point_robot:
        return "its learned w-space encoder looks about a robot that is a point, not an arm or body"
    if name in _FOR_POINTS and env.dimension != 3:
        return "its learned w-space encoder looks about a point in space, not in the plane"
    if name == "ief3d" and default_resolution(env.dimension) is None:
        return f"no labels by fast marching fit in {env.dimension} dimensions"
    return None


def method(name: str, env: Environment) -> Method:
    """The method of a name, as it is in an environment.

    Raises:
        InputError: there is none.
    """
    if name not in METHODS:
        raise InputError(f"no time field is called {name!r}; choose from {', '.join(METHODS)}")
    found = METHODS[name]
    for fits, special in (
        (env.dimension > 3, _IN_MORE_DIMENSIONS),
        (env.link_geometry is not None, FOR_ARMS),
        (env.is_interior and env.is_point_robot, IN_ROOMS),
    ):
        if fits:
            found = special.get(name, found)
    if env.space.wraps.any():
        found = replace(found, objective=_AROUND.get(found.objective, found.objective))
    return found
