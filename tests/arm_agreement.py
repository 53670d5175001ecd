"""How the checks of arms agree with an independent exact one."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from exact_arms import ExactArm

from envs.collision.continuous import DEFAULT_TOLERANCE
from envs.problem import Array
from envs.robots import arm_clearance
from envs.scenes.arm_world import ArmWorld

_SAMPLES = 50
"""Of a motion that is accepted; then of what is about the nearest of them."""

_ROUNDING = 1e-6
"""Metres: nearer to contact, which of two exact checks is right cannot be told."""


@dataclass
class Agreement:
    """Counts.

    Attributes:
        configurations, valid: asked, and how many touch nothing.
        wrongly_valid, wrongly_invalid: against the exact check.
        motions, accepted: asked, and how many are proved free.
        wrongly_accepted: motions with a configuration in contact.
        wrongly_refused: motions of which no sample comes within the tolerance.
    """

    configurations: int = 0
    valid: int = 0
    wrongly_valid: int = 0
    wrongly_invalid: int = 0
    motions: int = 0
    accepted: int = 0
    wrongly_accepted: int = 0
    wrongly_refused: int = 0

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            *(getattr(self, f.name) + getattr(other, f.name) for f in fields(Agreement))
        )

    @property
    def wrong(self) -> int:
        return (
            self.wrongly_valid + self.wrongly_invalid + self.wrongly_accepted + self.wrongly_refused
        )


def agreement(
    env: ArmWorld, exact: ExactArm, configurations: int, motions: int, seed: int
) -> Agreement:
    """Asks both about random configurations and motions of up to 1.5 rad."""
    rng = np.random.default_rng(seed)
    found = Agreement(configurations=configurations, motions=motions)
    model = env.collision_model()
    for q in rng.uniform(env.lower, env.upper, (configurations, env.dimension)):
        valid, free = model.is_valid(q), not exact.touches(q)
        found.valid += valid
        if valid != free and abs(exact.distance(q)) > _ROUNDING:
            found.wrongly_valid += valid
            found.wrongly_invalid += free
    for a in rng.uniform(env.lower, env.upper, (motions, env.dimension)):
        way = rng.normal(size=env.dimension)
        b = a + rng.uniform(0.05, 1.5) * way / np.linalg.norm(way)
        b = np.clip(b, env.lower, env.upper)
        by_model = model.segment_is_free(a, b)
        by_spheres = arm_clearance.paths_are_free(
            env.robot.arrays, env.scene, [np.array([a, b])], DEFAULT_TOLERANCE
        )[0] and (env.allowed is None or bool(env.allowed(a[None])[0]))
        found.accepted += by_model
        if by_model or by_spheres:
            found.wrongly_accepted += _touches(exact, a, b)
        if not by_model:
            found.wrongly_refused += _nearest(exact, a, b) > DEFAULT_TOLERANCE + _ROUNDING
    return found


def _touches(exact: ExactArm, a: Array, b: Array) -> bool:
    """Whether anything touches at one of the samples. What begins within something touches its
    surface before it leaves."""
    ts = np.linspace(0, 1, _SAMPLES)
    return exact.touches(a) or any(exact.meets(a + t * (b - a)) for t in ts)


def _nearest(exact: ExactArm, a: Array, b: Array) -> float:
    """The least distance found along a motion: that of samples, and ever closer about the least."""
    if _touches(exact, a, b):
        return 0.0
    low, high, least = 0.0, 1.0, np.inf
    for samples in (33, 9, 9, 9, 9):
        ts = np.linspace(low, high, samples)
        distances = [exact.distance(a + t * (b - a)) for t in ts]
        at = int(np.argmin(distances))
        least = min(least, distances[at])
        low, high = ts[max(at - 1, 0)], ts[min(at + 1, samples - 1)]
    return float(least)
