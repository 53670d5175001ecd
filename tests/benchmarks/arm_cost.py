"""Prints what arms cost: python tests/benchmarks/arm_cost.py [environment]

Kinematics and clearances of a million configurations and more, and exact answers to one at a time,
by default of the six-joint arm at its first table. Compilation is not counted.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from time import perf_counter

import numpy as np

import envs
from envs.problem import Array
from envs.robots import arm_clearance
from envs.scenes.arm_world import ArmWorld

MILLION = 1_000_000
BATCH = 100_000


def main(text: str) -> None:
    env = envs.make(text)
    assert isinstance(env, ArmWorld)
    print(f"{text}: {env.dimension} joints, {len(env.robot.parts)} solids", end=", ")
    print(f"{len(env.robot.arrays.balls)} spheres, {len(env.obstacles)} obstacles")
    in_bulk(env, "forward kinematics", env.robot.tree.forward, MILLION)
    in_bulk(env, "clearances of pairs by spheres", env.approximate_clearance, 2 * MILLION)
    model = env.collision_model()
    q = configurations(env, 5000)
    one_by_one("is_valid", model.is_valid, q)
    one_by_one("clearance", model.clearance, q)
    steps = np.random.default_rng(1).normal(0, 0.3, q.shape)
    motions = np.stack([q, q + steps], axis=1)[:2000]
    view, scene = env.robot.arrays, env.scenes

    def exactly(motion: Array) -> None:
        model.segment_is_free(*motion)

    def by_spheres(motion: Array) -> None:
        arm_clearance.segment_is_free(view, scene, motion[0], motion[1], 1e-3)

    one_by_one("segment_is_free", exactly, motions)
    one_by_one("segment_is_free, by spheres", by_spheres, motions)


def configurations(env: ArmWorld, n: int) -> Array:
    return np.random.default_rng(0).uniform(env.lower, env.upper, (n, env.dimension))


def in_bulk(env: ArmWorld, name: str, function: Callable[[Array], object], n: int) -> None:
    """In batches, as poses of a million take a gigabyte."""
    q = configurations(env, BATCH)
    function(q[:5000])
    begin = perf_counter()
    for _ in range(n // BATCH):
        function(q)
    print(f"{name:>32}: {perf_counter() - begin:7.2f} s for {n / MILLION:g} million")


def one_by_one(name: str, function: Callable[[Array], object], inputs: Array) -> None:
    function(inputs[0])
    times = []
    for one in inputs:
        begin = perf_counter()
        function(one)
        times.append(1e6 * (perf_counter() - begin))
    mean, median = np.mean(times), np.median(times)
    print(f"{name:>32}: mean {mean:7.1f}   median {median:7.1f} microseconds")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "arm6")
