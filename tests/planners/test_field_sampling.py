"""Training points."""

from __future__ import annotations

import numpy as np
import pytest

from envs import Environment
from planners.fields.physics import GroupPlan, GroupSampler, NearSurfaces, PointSampler, Space
from planners.learning.normalizer import Normalizer


def test_scale_is_the_unit_cube_and_back(c3d: Environment) -> None:
    scale = Normalizer.of(c3d)
    q = np.random.default_rng(0).uniform(c3d.lower, c3d.upper, (100, 3))
    assert np.abs(scale.normalize(q)).max() <= 0.5
    assert scale.denormalize(scale.normalize(q)) == pytest.approx(q)


def test_points_are_inside_and_know_their_speed(c3d: Environment) -> None:
    plan = GroupPlan(groups=40, starts=12, goals=12)
    points, log_speed = GroupSampler(Space.of(c3d), plan).draw(np.random.default_rng(1))
    assert points.shape == (40, 24, 3)
    assert log_speed.shape == (40, 24)
    assert np.abs(points).max() <= 0.5
    wanted = np.log(c3d.speed(20 * points.reshape(-1, 3)))
    assert log_speed.ravel() == pytest.approx(wanted)


def test_groups_are_local_or_spread_and_partly_near_surfaces(c3d: Environment) -> None:
    def near_share(share: float) -> float:
        plan = GroupPlan(groups=400, starts=12, goals=12, near=NearSurfaces(share), candidates=8)
        points, _ = GroupSampler(Space.of(c3d), plan).draw(np.random.default_rng(2))
        clearance = c3d.clearance(20 * points[200:].reshape(-1, 3)) / 20
        return float(plan.near.holds(clearance).mean())

    plain, more = near_share(0.0), near_share(0.5)
    assert more == pytest.approx(0.5 + 0.5 * plain, abs=0.05)
    points, _ = GroupSampler(Space.of(c3d), GroupPlan(400, 12, 12)).draw(np.random.default_rng(3))
    reach = np.linalg.norm(points - points.mean(axis=1, keepdims=True), axis=-1).max(axis=1)
    assert np.median(reach[:200]) < 0.2 < reach[200:].min()


def test_points_of_labels_are_inside_and_partly_near_surfaces(c3d: Environment) -> None:
    points = PointSampler(Space.of(c3d)).draw(np.random.default_rng(5), 4000)
    assert points.shape == (4000, 3)
    assert np.abs(points).max() <= 0.5
    clearance = c3d.clearance(20 * points) / 20
    spread = np.random.default_rng(6).uniform(-10, 10, (4000, 3))
    plain = c3d.clearance(spread) / 20
    near, by_chance = (((c > -0.01) & (c < 0.09)).mean() for c in (clearance, plain))
    assert near == pytest.approx(0.3 + 0.7 * by_chance, abs=0.03)


def test_starts_and_goals_are_drawn_alike(c3d: Environment) -> None:
    plan = GroupPlan(groups=20_000, near=NearSurfaces(0.6))
    _, log_speed = GroupSampler(Space.of(c3d), plan).draw(np.random.default_rng(4))
    starts, goals = log_speed[:, : plan.starts], log_speed[:, plan.starts :]
    assert starts.mean() == pytest.approx(goals.mean(), abs=0.02)
